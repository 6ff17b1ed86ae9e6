"""The picture: time per contact against the worst error, one panel per category of hardness."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from contact.categories import FAILED, Category, Errors
from contact.methods import Method
from contact.speed import Speeds
from drawing import FONT_SIZE, INK, QUIET, new_figure, style_axes

COLUMNS = 3
LEAST = 3e-17  # below every error, a fifth of the rounding unit
WRONG = 1.0  # relative error: nothing of the centroid is right
TIMES = (3e-9, 1e-2)
DOTS_PER_INCH = 130
SMALL = FONT_SIZE - 2.0


@dataclass(frozen=True, slots=True)
class Mark:
    """How a method is drawn: colours of Okabe and Ito tell the families apart, shapes the members."""

    colour: str
    shape: str
    size: float = 6.0

    @property
    def look(self) -> dict[str, Any]:
        """What matplotlib calls it."""
        return {"marker": self.shape, "markersize": self.size, "color": self.colour, "linestyle": "none"}


MARKS = {
    "palpate": Mark("#d55e00", "*", 12.0),
    "palpate, implicit": Mark("#d55e00", "p", 7.0),
    "one formula, numpy": Mark("#0072b2", "o"),
    "one formula, float32": Mark("#0072b2", "v"),
    "paper, eq. 16-18": Mark("#111111", "s", 5.5),
    "wrench axis": Mark("#111111", "d"),
    "Newton, 1 step": Mark("#009e73", "<"),
    "Newton, 2 steps": Mark("#009e73", "^"),
    "Newton, 3 steps": Mark("#009e73", ">"),
    "scipy root": Mark("#cc79a7", "X"),
    "scipy least_squares": Mark("#cc79a7", "P"),
}


def draw(
    methods: tuple[Method, ...],
    found: dict[str, dict[str, Errors]],
    speeds: Speeds,
    categories: tuple[Category, ...],
    heading: str,
) -> Figure:
    """Return the figure; `found` is by method, then by category. Methods without a mark are left out."""
    drawn = [method for method in methods if method.name in MARKS]
    rows = -(-len(categories) // COLUMNS)
    figure = new_figure(1.35 + 2.55 * rows)
    panels = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
    for panel, category in zip(panels, categories, strict=False):
        _ground(panel, category, speeds.floor, len(drawn))
        for i, method in enumerate(drawn):
            _method(panel, method, found[method.name][category.name], speeds, _slot(i))
    for panel in panels[len(categories) :]:
        panel.set_visible(False)
    for i, panel in enumerate(panels):
        panel.label_outer()
        panel.set_xlabel(panel.get_xlabel() if i >= len(panels) - COLUMNS else "")
    _annotate(panels[0], found, speeds, categories[0])
    _legend(figure, drawn)
    figure.suptitle(heading, fontsize=FONT_SIZE + 1.0, color=INK)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write the figure as PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DOTS_PER_INCH)


def _slot(i: int) -> float:
    # methods that fail alike would hide each other on one line: each has a row of its own in the band
    return float(WRONG * 10.0 ** (0.9 + 0.42 * i))


def _ground(panel: Axes, category: Category, floor: float, methods: int) -> None:
    style_axes(panel, x="time per contact", y="largest error of the centroid, relative")
    panel.set_xscale("log")
    panel.set_yscale("log")
    top = _slot(methods + 1)
    panel.set_xlim(*TIMES)
    panel.set_ylim(LEAST, top)
    panel.set_yticks([1e-16, 1e-12, 1e-8, 1e-4, 1.0], ["1e-16", "1e-12", "1e-8", "1e-4", "1 or more"])
    panel.yaxis.set_minor_locator(NullLocator())
    panel.set_xticks([1e-8, 1e-6, 1e-4, 1e-2], ["10 ns", "1 us", "100 us", "10 ms"])
    panel.xaxis.set_minor_locator(NullLocator())
    panel.axhspan(WRONG * 10.0**0.5, top, color="#f1f2f4", zorder=0)
    panel.axhline(FAILED, color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
    panel.axvline(floor, color=QUIET, linewidth=0.8, linestyle=(0, (1, 2)))
    panel.set_title(f"{category.name}: {category.about}", fontsize=FONT_SIZE, color=INK, loc="left")


def _method(panel: Axes, method: Method, errors: Errors, speeds: Speeds, slot: float) -> None:
    mark = MARKS[method.name]
    height = slot if errors.no_number > 0.0 else min(max(errors.largest, 2.0 * LEAST), WRONG)
    single = speeds.single[method.name].median
    batch = speeds.batch.get(method.name)
    front = 5 if method.name == "palpate" else 3
    if batch:
        line = (batch.median, single)
        panel.plot(line, (height, height), color=mark.colour, linewidth=0.7, alpha=0.35, zorder=2)
        panel.plot(batch.median, height, **mark.look, markeredgecolor="white", markeredgewidth=0.4, zorder=front)
    panel.plot(single, height, **mark.look, markerfacecolor="white", markeredgewidth=0.9, zorder=front)


def _annotate(panel: Axes, found: dict[str, dict[str, Errors]], speeds: Speeds, category: Category) -> None:
    text: dict[str, Any] = {"fontsize": SMALL, "color": INK}
    panel.text(speeds.floor * 0.8, 2e-12, "copy of the answer", rotation=90, ha="right", va="center", **text)
    panel.text(TIMES[1] * 0.6, FAILED * 1.8, "above: failed", ha="right", va="bottom", **text)
    panel.text(
        speeds.floor * 1.3, panel.get_ylim()[1] * 0.6, "grey: some contacts give no number", va="top", **text
    )
    batch, single = speeds.batch.get("palpate"), speeds.single.get("palpate")
    height = found["palpate"][category.name].largest
    if batch and single and math.isfinite(height):
        panel.annotate(
            "palpate, batch and single",
            (batch.median, height),
            xytext=(batch.median * 1.6, 4e-14),
            arrowprops={"arrowstyle": "-", "color": QUIET, "linewidth": 0.7},
            **text,
        )


def _legend(figure: Figure, methods: list[Method]) -> None:
    entries = [Line2D([], [], **MARKS[method.name].look, label=method.name) for method in methods]
    solid: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 6.0, "color": QUIET}
    entries.append(Line2D([], [], **solid, label="filled: per contact in a batch"))
    entries.append(Line2D([], [], **solid, markerfacecolor="white", label="hollow: one call"))
    figure.legend(
        handles=entries,
        loc="outside lower center",
        ncols=5,
        fontsize=FONT_SIZE - 1.0,
        frameon=False,
        labelcolor=INK,
        columnspacing=1.4,
        handletextpad=0.4,
    )
