"""One look for all pictures: sizes, colours, axes.

Colours come from `palpate.runtime.palette`, by what they stand for. Heights use viridis, signed errors red to
blue through white: both stay distinct with colour-blind eyes. Pictures are drawn for a light ground; in a report
their text and lines follow the reader's theme.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure, FigureBase
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patheffects import AbstractPathEffect, Normal, Stroke
from matplotlib.ticker import MaxNLocator

from palpate.runtime import palette
from palpate.runtime.data import Phase

INK, QUIET, GRID = palette.INK_COLOUR.light, palette.QUIET_COLOUR.light, palette.GRID_COLOUR.light
MEASURED, TRUE, WANTED = palette.FELT.light, palette.TRUTH.light, palette.SET.light
COMMANDED, LIMIT, SPIN = palette.COMMAND.light, palette.BOUND.light, palette.SPIN_COLOUR.light
PATH, CARD, RIM = palette.TRACK.light, palette.CARD.light, palette.RIM_COLOUR.light
MAP_GROUND, PANE, INSIDE = palette.MAP_COLOUR.light, palette.PANE_COLOUR.light, palette.INSIDE_COLOUR.light
CONE, CONE_EDGE = palette.CONE_COLOUR.light, palette.CONE_RIM.light
SIDE_BY_SIDE = tuple(each.light for each in palette.SIDE_BY_SIDE)
"""Of runs, fingers or options beside each other."""
LOAD_COLOURS = tuple(SIDE_BY_SIDE[i] for i in (0, 3, 4, 5))
"""Of loads beside each other, where what is true and what was found of them all have colours of their own."""

MARK_COLOURS = ("#fefefe", "#e69f00", "#cc79a7", "#56b4e8", "#f0e442")
"""Pale ones of the palette of Okabe and Ito, for marks inside a dark rim: they stand out on every colour of a map,
on either theme."""

ON_DARK = MARK_COLOURS[0]
"""Text on dark fields, whatever the theme; on pale ones it is `RIM`."""

DASHED = (0, (5, 3))
"""Of what was set or asked for, everywhere."""
DASH_DOT = (0, (6, 2, 1, 2))
"""Of limits."""

HEIGHT_COLOURS: Colormap = mpl.colormaps["viridis"]
TIME_COLOURS: Colormap = ListedColormap(mpl.colormaps["viridis"](np.linspace(0.3, 0.8, 256)))
"""Of lines and of points in space: without the darkest and the brightest, seen on either ground."""
ERROR_COLOURS: Colormap = mpl.colormaps["RdBu_r"]

PHASE_COLOURS: dict[str, str] = {
    Phase.APPROACH: palette.APPROACH.light,
    Phase.SETTLE: palette.SETTLE.light,
    Phase.SCAN: palette.SCAN.light,
    Phase.SEEK: palette.SEEK.light,
    Phase.LIFT: palette.LIFT.light,
    Phase.TRAVEL: palette.TRAVEL.light,
    Phase.HOLD: palette.HOLD.light,
    Phase.STOP: palette.STOP.light,
    Phase.DONE: palette.DONE.light,
    Phase.LOST: palette.LOST.light,
}
"""Pale grounds for the phases; names of other phases take `OTHER_PHASE`."""

OTHER_PHASE = palette.OTHER.light

STAGE_COLOURS = {
    "close": palette.APPROACH.light,
    "nudge": palette.SETTLE.light,
    "lift": palette.LIFT.light,
    "hold": palette.OTHER.light,
    "set down": palette.TRAVEL.light,
    "let go": palette.SCAN.light,
}
"""Of a grasp, likewise."""

FONT_SIZE = 9.0
SMALL_SIZE = FONT_SIZE - 0.5
"""Of numbers beside axes and in legends [points]; nothing is smaller, so that all can be read on a phone: there a
picture of `Width.HALF` is shown at four fifths of its size, where this is 9 pixels."""

MILLI = 1e3
MICRO = 1e6


class Width(Enum):
    """How wide a picture is drawn [inch]; at 96 dots per inch, as in browsers, text is life-size."""

    FULL = 10.2
    """Across the page of a screen."""
    HALF = 4.6
    """Half the page, or a phone."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture with what a reader needs beside it.

    Attributes:
        title: Short heading.
        caption: What one sees and what is good, in sentences.
        full: Drawn for half the page, or across it if `narrow` is given.
        narrow: The same for a phone, if `full` is drawn across the page.
        dense: Whether it has many thousand elements and is better kept as pixels than as lines.
    """

    title: str
    caption: str
    full: Figure
    narrow: Figure | None = None
    dense: bool = False


def label(typed: str, longest: int) -> str:
    """Return text that people typed as a picture can hold it: short, no formula, and no letter without a glyph."""
    font = get_font(findfont(FontProperties()))
    shown = typed if len(typed) <= longest else typed[: longest - 1] + "…"
    held = (
        each if each.isprintable() and font.get_char_index(ord(each)) else "\N{REPLACEMENT CHARACTER}"
        for each in shown
    )
    return "".join(held).replace("$", r"\$")


def new_figure(width: Width, height: float) -> Figure:
    """Return an empty figure, `height` in inches; its parts are laid out without overlap when it is drawn."""
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06)
    return Figure(figsize=(width.value, height), layout=layout, facecolor=CARD)


def rim(width: float) -> Sequence[AbstractPathEffect]:
    """Return what sets a line of `width` points off whatever it goes over."""
    return (Stroke(linewidth=width + 1.2, foreground=CARD), Normal())


def style_axes(axes: Axes, *, x: str, y: str, grid: bool = True) -> None:
    """Label `axes` with quantities and units, and give it the common look."""
    axes.set_xlabel(x, fontsize=FONT_SIZE, color=INK)
    axes.set_ylabel(y, fontsize=FONT_SIZE, color=INK)
    axes.tick_params(labelsize=SMALL_SIZE, colors=INK, length=3)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(QUIET)
    axes.set_axisbelow(True)
    if grid:
        axes.grid(visible=True, color=GRID, linewidth=0.6)


def colour_bar(
    figure: FigureBase, mapped: ScalarMappable, axes: Axes | Sequence[Axes], label: str, **layout: Any
) -> Colorbar:
    """Return a labelled colour bar below `axes`; `layout` as of `Figure.colorbar`."""
    placed: dict[str, Any] = {"location": "bottom", "aspect": 28, **layout}
    bar = figure.colorbar(mapped, ax=axes, **placed)
    bar.set_label(label, fontsize=FONT_SIZE, color=INK)
    bar.ax.tick_params(labelsize=SMALL_SIZE, colors=INK)
    return bar


def style_space(axes: Any, shares: Iterable[float] = ()) -> None:
    """Label the axes of a plot in space [mm], and give them the common look.

    Args:
        axes: Three-dimensional.
        shares: Length of each axis over the longest, for its ticks; matplotlib's ticks if left out.
    """
    three = (axes.xaxis, axes.yaxis, axes.zaxis)
    for axis, name in zip(three, "xyz", strict=True):
        axis.set_label_text(f"{name} [mm]", fontsize=FONT_SIZE, color=INK)
        axis.set_pane_color(PANE)
        axis.set_tick_params(labelsize=SMALL_SIZE, colors=QUIET)
    for axis, share in zip(three, shares, strict=False):
        axis.set_major_locator(MaxNLocator(nbins=math.ceil(5.0 * share), steps=[1, 2, 5, 10], min_n_ticks=1))
        axis.get_major_formatter().set_useOffset(False)


def legend_above(figure: FigureBase, axes: Iterable[Axes], columns: int) -> None:
    """Put one legend for all `axes` above them, each label once."""
    entries: dict[str, Artist] = {}
    for each in axes:
        for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        legend = figure.legend(
            list(entries.values()),
            list(entries),
            loc="outside upper center",
            ncols=min(columns, len(entries)),
            fontsize=SMALL_SIZE,
            frameon=False,
            labelcolor=INK,
            handlelength=1.6,
            columnspacing=1.4,
        )
        for patch in legend.get_patches():  # pale grounds are hardly seen without
            patch.set(edgecolor=QUIET, linewidth=0.6)
