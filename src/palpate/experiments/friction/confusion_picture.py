"""Which material was taken for which."""

from collections.abc import Sequence

import numpy as np

from palpate.friction.materials.trials import Confusion
from palpate.reporting.marks import Cells, Colouring, ColourScale, shortened
from palpate.reporting.picture import Axis, Panel, Picture

LONGEST_NAME = 18
"""Letters of a name beside the matrix; the rest is left out."""

MOST_FIGURES = 20
"""Rows or columns above which the shares are no longer written into the cells."""

FRAME, ROW = 190, 26
"""Height of the picture without its rows, and of a row [px]."""


def confusion_picture(confusion: Confusion) -> Picture:
    """Return the picture of a confusion matrix: rows are what was touched, columns what it was taken for."""
    shares = confusion.shares
    # nothing where the share is 0, so that wrong results stand out
    seen = np.where(shares > 0.0, 100.0 * shares, np.nan).ravel()
    texts = tuple(map(_per_cent, shares.ravel().tolist())) if max(shares.shape) <= MOST_FIGURES else ()
    cells = Cells(
        Colouring("share", seen, "%", 0.0, 100.0, ColourScale.SHARE),
        _names(confusion.predictions),
        _names(confusion.truths),
        texts,
    )
    return Picture(
        title="Materials recognised by touch",
        caption=(
            "Share of touched objects of each material (row) that were taken for another (column), in per cent; "
            "correct results lie on the diagonal; for objects of no material of the library, in the last column. "
            "Empty cells elsewhere are good."
        ),
        panels=(Panel((cells,), Axis("taken for"), Axis("touched"), height=FRAME + ROW * len(shares)),),
        wide=True,
    )


def _names(typed: Sequence[str]) -> tuple[str, ...]:
    """Short names; those that become alike are numbered."""
    short = [shortened(name, LONGEST_NAME) for name in typed]
    return tuple(name if short.count(name) == 1 else f"{i + 1}: {name}" for i, name in enumerate(short))


def _per_cent(share: float) -> str:
    """Whole per cent; what is hardly ever or nearly always is not rounded to never or always."""
    if not share > 0.0:
        return ""
    if share < 0.005:
        return "<1"
    return ">99" if 0.995 < share < 1.0 else f"{100.0 * share:.0f}"
