"""Which material was taken for which."""

import numpy as np
from matplotlib.figure import Figure

from palpate.friction.materials.trials import UNKNOWN, Confusion
from palpate.reporting.style import (
    FONT_SIZE,
    HEIGHT_COLOURS,
    INK,
    ON_DARK,
    QUIET,
    RIM,
    SMALL_SIZE,
    Picture,
    Width,
    label,
    new_figure,
)

LONGEST_NAME = 18
"""Letters of a name beside the matrix; the rest is left out."""

MOST_FIGURES = 20
"""Rows or columns above which the shares are no longer written into the cells."""

DARK = 0.4
"""Shares from this on are on a ground dark enough for white letters."""


def confusion_picture(confusion: Confusion) -> Picture:
    """Return the picture of a confusion matrix: rows are what was touched, columns what it was taken for."""
    return Picture(
        title="Materials recognised by touch",
        caption=(
            "Share of touched objects of each material (row) that were taken for another (column), in per cent; "
            "correct results lie on the diagonal; for objects of no material of the library, in the last column. "
            "Empty cells elsewhere are good."
        ),
        full=_draw(confusion, Width.FULL),
        narrow=_draw(confusion, Width.HALF),
    )


def _draw(confusion: Confusion, width: Width) -> Figure:
    rows, columns = confusion.counts.shape
    shares = confusion.shares
    figure = new_figure(width, 1.6 + 0.3 * rows if width is Width.FULL else 1.9 + 0.24 * rows)
    axes = figure.subplots()
    # white where the share is 0, so that wrong results stand out
    image = axes.pcolormesh(
        np.where(shares > 0.0, shares, np.nan), cmap=HEIGHT_COLOURS.reversed(), vmin=0.0, vmax=1.0
    )
    axes.invert_yaxis()
    axes.axvline(columns - 1, color=INK, linewidth=1.0)
    unknown = sum(truth not in confusion.predictions for truth in confusion.truths)
    if 0 < unknown < rows:
        axes.axhline(rows - unknown, color=INK, linewidth=1.0)
    size = SMALL_SIZE
    if max(rows, columns) <= MOST_FIGURES:
        for (i, j), share in np.ndenumerate(shares):
            if share > 0.0:
                colour = ON_DARK if share >= DARK else RIM
                axes.text(
                    j + 0.5, i + 0.5, _per_cent(share), ha="center", va="center", fontsize=size, color=colour
                )
    axes.set_xticks(np.arange(columns) + 0.5, [label(name, LONGEST_NAME) for name in confusion.predictions])
    axes.set_yticks(np.arange(rows) + 0.5, [label(name, LONGEST_NAME) for name in confusion.truths])
    axes.tick_params(labelsize=size, colors=INK, length=0)
    for each in axes.get_xticklabels():
        each.set(rotation=40, ha="right", rotation_mode="anchor")
    axes.get_xticklabels()[-1].set_fontstyle("italic" if confusion.predictions[-1] == UNKNOWN else "normal")
    axes.set_xlabel("taken for", fontsize=FONT_SIZE, color=INK)
    axes.set_ylabel("touched", fontsize=FONT_SIZE, color=INK)
    for spine in axes.spines.values():
        spine.set_color(QUIET)
    bar = figure.colorbar(image, ax=axes, shrink=0.8, pad=0.02)
    bar.set_ticks([0.0, 0.5, 1.0], labels=["0", "50", "100 %"])
    bar.ax.tick_params(labelsize=size, colors=INK, length=2)
    return figure


def _per_cent(share: float) -> str:
    """Whole per cent; what is hardly ever or nearly always is not rounded to never or always."""
    if share < 0.005:
        return "<1"
    return ">99" if 0.995 < share < 1.0 else f"{100.0 * share:.0f}"
