"""Long series drawn with few points and no peak lost."""

import numpy as np

from palpate.errors import FloatArray

DRAWN_BINS = 900
"""Bins of a drawn line: about one per pixel of a report's width, so the figure is the same as with every
point."""


def envelope(time: FloatArray, value: FloatArray, bins: int = DRAWN_BINS) -> tuple[FloatArray, FloatArray]:
    """Return a subset of a series that draws like the whole of it.

    Of each of `bins` bins of equally many samples the lowest and the highest value are kept, in the order
    they came, and a NaN where there is one, so that lines stay broken where there was no value. Series of up
    to 2 * `bins` samples come back as they are.

    Args:
        time: Shape (n,).
        value: Shape (n,), may hold NaN.
        bins: Number of bins, at least 1.

    Returns:
        Time and value, each of shape (m,) with m at most 3 * `bins`.
    """
    count = len(time)
    if count <= 2 * bins:
        return time, value
    edges = np.linspace(0, count, bins + 1).astype(np.intp)
    starts = edges[:-1]
    bin_of_sample = np.repeat(np.arange(bins), np.diff(edges))
    # Sorted by bin, then value: the first of each bin is its lowest, the last its highest; NaN sorts last.
    missing = np.isnan(value)
    order = np.lexsort((np.where(missing, np.inf, value), bin_of_sample))
    lowest = order[starts]
    present = np.add.reduceat((~missing).astype(np.intp), starts)
    highest = order[starts + np.maximum(present, 1) - 1]
    first_missing = order[np.minimum(starts + present, edges[1:] - 1)][present < np.diff(edges)]
    keep = np.unique(np.concatenate([lowest, highest, first_missing, np.array([0, count - 1])]))
    return time[keep], value[keep]


def thinned(x: FloatArray, y: FloatArray, most: int) -> tuple[FloatArray, FloatArray]:
    """Return at most about `most` points of a line, its peaks among them where x goes one way only.

    Args:
        x: Shape (n,), may hold NaN.
        y: Likewise.
        most: Points, at least 3.
    """
    if len(x) <= most:
        return x, y
    if (np.diff(x) >= 0.0).all():
        return envelope(x, y, most // 3)
    kept = np.linspace(0, len(x) - 1, most).round().astype(np.intp)
    return x[kept], y[kept]
