"""The picture: warm time against the worst error, one panel a number of contacts."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from drawing import FONT_SIZE, INK, QUIET, new_figure, style_axes
from grasp_forces.asked import GAP, Times

COLUMNS = 4
LEAST, WRONG = 1e-17, 1.0
TIMES = (1e-6, 3e-1)
DOTS_PER_INCH = 130


@dataclass(frozen=True, slots=True)
class Mark:
    """How a solver is drawn: families by shape (ours are stars), every solver a colour of its own."""

    colour: str
    shape: str
    size: float = 6.5

    @property
    def look(self) -> dict[str, Any]:
        """What matplotlib calls it."""
        return {"marker": self.shape, "markersize": self.size, "color": self.colour, "linestyle": "none"}


MARKS = {
    "dual Newton alone": Mark("#d55e00", "*", 12.0),
    "GraspForceOptimizer": Mark("#8c1c13", "*", 11.0),
    "clarabel direct": Mark("#0072b2", "o"),
    "ecos": Mark("#56b4e9", "o"),
    "scs": Mark("#3b4994", "o"),
    "cvxpy + clarabel": Mark("#1b9e77", "o"),
    "ipopt, bounds kept": Mark("#111111", "s"),
    "ipopt, default": Mark("#888888", "s"),
    "ipopt, squared cones": Mark("#bbbbbb", "s"),
    "fatrop": Mark("#7f5539", "s"),
    "sqpmethod + qrqp": Mark("#cc79a7", "^"),
    "sqpmethod + daqp": Mark("#9d4edd", "^"),
    "sqpmethod + osqp": Mark("#f72585", "^"),
    "sqpmethod + qpoases": Mark("#5a189a", "^"),
    "scipy SLSQP": Mark("#b5179e", "v"),
    "superscs": Mark("#009e73", "D", 5.5),
    "16 facets + daqp": Mark("#6a994e", "X"),
}


def draw(times: Times, heading: str) -> Figure:
    """Return the figure."""
    rows = -(-len(times) // COLUMNS)
    figure = new_figure(1.4 + 2.5 * rows)
    panels = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
    for panel, n in zip(panels, times, strict=False):
        _ground(panel, n)
        for name, timing in times[n].items():
            mark = MARKS[name]
            height = min(max(timing.error, 3.0 * LEAST), WRONG) if math.isfinite(timing.error) else 30.0
            full = {"markerfacecolor": "white"} if timing.unsolved else {"markeredgecolor": "white"}
            panel.plot(timing.median(warm=True), height, **(mark.look | full), markeredgewidth=0.7, zorder=3)
    for panel in panels[len(times) :]:
        panel.set_visible(False)
    for i, panel in enumerate(panels):
        panel.label_outer()
        if i + COLUMNS >= len(times):
            panel.tick_params(labelbottom=True)
        panel.set_xlabel("time per period, warm" if i + COLUMNS >= len(times) else "")
    named = [name for name in MARKS if any(name in each for each in times.values())]
    entries = [Line2D([], [], **MARKS[name].look, label=name) for name in named]
    hollow = {"marker": "o", "color": QUIET, "linestyle": "none", "markerfacecolor": "white"}
    entries.append(Line2D([], [], **hollow, label="hollow: not all solved, cold or warm"))
    figure.legend(
        handles=entries,
        loc="outside lower center",
        ncols=5,
        fontsize=FONT_SIZE - 1.0,
        frameon=False,
        labelcolor=INK,
        columnspacing=1.2,
        handletextpad=0.3,
    )
    figure.suptitle(heading, fontsize=FONT_SIZE + 1.0, color=INK)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write the figure as PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DOTS_PER_INCH)


def _ground(panel: Axes, n: int) -> None:
    style_axes(panel, x="time per period, warm", y="largest error, relative")
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xlim(*TIMES)
    panel.set_ylim(LEAST, 100.0)
    panel.set_yticks([1e-16, 1e-12, 1e-8, 1e-4, 1.0], ["1e-16", "1e-12", "1e-8", "1e-4", "1"])
    panel.set_xticks([1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1], ["1 us", "", "100 us", "", "10 ms", ""])
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_minor_locator(NullLocator())
    panel.axhline(GAP, color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
    panel.axvline(1e-3, color=QUIET, linewidth=0.8, linestyle=(0, (1, 2)))
    panel.set_title(f"n = {n}", fontsize=FONT_SIZE, color=INK, loc="left")
