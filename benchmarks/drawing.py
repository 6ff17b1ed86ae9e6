"""How pictures of benchmarks look."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.runtime.palette import GRID_COLOUR, INK_COLOUR, QUIET_COLOUR

WIDTH = 10.2
"""[inch]"""

FONT_SIZE, SMALL_SIZE = 9.0, 8.5

INK, QUIET = INK_COLOUR.light, QUIET_COLOUR.light


def new_figure(height: float) -> Figure:
    """Return an empty figure, `height` in inches; its parts are laid out without overlap when it is drawn."""
    return Figure(figsize=(WIDTH, height), layout="constrained")


def style_axes(axes: Axes, *, x: str, y: str) -> None:
    """Label `axes` with quantities and units, and give it the common look."""
    axes.set_xlabel(x, fontsize=FONT_SIZE, color=INK)
    axes.set_ylabel(y, fontsize=FONT_SIZE, color=INK)
    axes.tick_params(labelsize=SMALL_SIZE, colors=INK, length=3)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(QUIET)
    axes.set_axisbelow(True)
    axes.grid(visible=True, color=GRID_COLOUR.light, linewidth=0.6)
