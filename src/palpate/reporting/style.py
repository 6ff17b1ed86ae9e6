"""One look for all pictures: sizes, colours, axes.

Lines use the palette of Okabe and Ito ("Color Universal Design", 2008), which stays distinct with
colour-blind eyes and in grey. Heights use viridis, signed errors red to blue through white: both safe in the
same way. Pictures have a white ground, also on a dark page.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from palpate.runtime.data import Phase

INK = "#22272e"
QUIET = "#6b7280"
GRID = "#e3e6ea"
MEASURED = "#0072b2"
TRUE = "#d55e00"
WANTED = "#009e73"
PATH = "#111111"

HEIGHT_COLOURS: Colormap = mpl.colormaps["viridis"]
ERROR_COLOURS: Colormap = mpl.colormaps["RdBu_r"]

PHASE_COLOURS: dict[str, str] = {
    Phase.APPROACH: "#dbe9f6",
    Phase.SETTLE: "#fdebd0",
    Phase.SCAN: "#e2f2e5",
    Phase.SEEK: "#f9d9d6",
    Phase.LIFT: "#e9e2f3",
    Phase.TRAVEL: "#d8f0ef",
    Phase.HOLD: "#eeeeee",
    Phase.STOP: "#dcdcdc",
    Phase.DONE: "#d5d8dc",
    Phase.LOST: "#f1948a",
}
"""Pale grounds for the phases; names of other phases take `OTHER_PHASE`."""

OTHER_PHASE = "#f4f4f4"

FONT_SIZE = 9.0
MILLI = 1e3
MICRO = 1e6


class Width(Enum):
    """How wide a picture is drawn [inch]; at 96 dots per inch, as in browsers, text is life-size."""

    FULL = 10.2
    """Across the page of a screen."""
    HALF = 4.9
    """Half the page, or a phone."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture with what a reader needs beside it.

    Attributes:
        title: Short heading.
        caption: One sentence that says what to see.
        full: Drawn for half the page, or across it if `narrow` is given.
        narrow: The same for a phone, if `full` is drawn across the page.
        dense: Whether it has many thousand elements and is better kept as pixels than as lines.
    """

    title: str
    caption: str
    full: Figure
    narrow: Figure | None = None
    dense: bool = False


def new_figure(width: Width, height: float) -> Figure:
    """Return an empty figure, `height` in inches; its parts are laid out without overlap when it is drawn."""
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06)
    return Figure(figsize=(width.value, height), layout=layout, facecolor="white")


def dress(axes: Axes, *, x: str, y: str, grid: bool = True) -> None:
    """Label `axes` with quantities and units, and give it the common look."""
    axes.set_xlabel(x, fontsize=FONT_SIZE, color=INK)
    axes.set_ylabel(y, fontsize=FONT_SIZE, color=INK)
    axes.tick_params(labelsize=FONT_SIZE - 0.5, colors=INK, length=3)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(QUIET)
    axes.set_axisbelow(True)
    if grid:
        axes.grid(visible=True, color=GRID, linewidth=0.6)


def legend_above(figure: Figure, axes: Iterable[Axes], columns: int) -> None:
    """Put one legend for all `axes` above them, each label once."""
    entries: dict[str, Artist] = {}
    for each in axes:
        for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        figure.legend(
            list(entries.values()),
            list(entries),
            loc="outside upper center",
            ncols=min(columns, len(entries)),
            fontsize=FONT_SIZE - 0.5,
            frameon=False,
            labelcolor=INK,
            handlelength=1.6,
            columnspacing=1.4,
        )
