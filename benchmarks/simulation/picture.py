"""The picture: cost of a control period against error, one panel per question."""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from drawing import FONT_SIZE, INK, QUIET, new_figure, style_axes
from simulation.choices import Group
from simulation.measured import Findings, HoldFinding, TouchFinding
from simulation.sensed import FACTS, STIFFNESS_ROWS, Row
from simulation.timing import ratio

DOTS_PER_INCH = 130
SMALL = FONT_SIZE - 2.0


@dataclass(frozen=True, slots=True)
class Mark:
    """How a family of choices is drawn: colours of Okabe and Ito."""

    colour: str
    shape: str
    size: float = 6.0

    @property
    def look(self) -> dict[str, Any]:
        """What matplotlib calls it."""
        return {"marker": self.shape, "markersize": self.size, "color": self.colour, "linestyle": "none"}


MARKS = {
    "preset": Mark("#d55e00", "*", 13.0),
    "Euler": Mark("#0072b2", "o"),
    "implicitfast": Mark("#56b4e9", "s", 5.5),
    "implicit": Mark("#009e73", "D", 5.0),
    "RK4": Mark("#111111", "X", 6.5),
    "impedance": Mark("#cc79a7", "^"),
    "impratio": Mark("#e69f00", "v"),
    "friction plant": Mark("#999999", "P", 7.0),
}


STEPPED = ("Euler", "implicitfast", "implicit", "RK4")

BESIDE: dict[str, tuple[float, float, str]] = {
    "Euler": (0.0, -9.0, "center"),
    "RK4": (0.0, 9.0, "center"),
    "impedance": (-5.0, 0.0, "right"),
    "impratio": (6.0, 0.0, "left"),
}
"""Where a choice's label stands [points]; time steps of the two implicit integrators are Euler's."""

FRAME = 1.45
"""Of the preset's error: what is beyond is told in words."""


def draw(found: Findings, rows: Sequence[Row]) -> Figure:
    """Return the figure."""
    figure = new_figure(7.6)
    panels = figure.subplots(2, 3).ravel()
    force: Callable[[TouchFinding], float] = lambda each: 1e3 * each.explored.force_rms  # noqa: E731
    point: Callable[[TouchFinding], float] = lambda each: 1e6 * each.explored.point_rms  # noqa: E731
    _touch(panels[0], found.stage, force, "force error [mN RMS]", "stage: force held")
    _touch(panels[1], found.stage, point, "points to surface [um RMS]", "stage: surface found")
    _touch(panels[2], found.arm, force, "force error [mN RMS]", "UR5e: force held")
    _grasp(panels[3], found.grasp)
    _stiffness(panels[4], rows)
    _sensors(panels[5], rows)
    entries = [Line2D([], [], **mark.look, label=name) for name, mark in MARKS.items()]
    figure.legend(
        handles=entries,
        loc="outside lower center",
        ncols=len(entries),
        fontsize=FONT_SIZE - 1.0,
        frameon=False,
        labelcolor=INK,
        columnspacing=1.2,
        handletextpad=0.3,
    )
    figure.suptitle(
        "Simulation: processor time of a control period (1 kHz, with sensing) against error; hollow: does not "
        "reach as far as the preset",
        fontsize=FONT_SIZE + 0.5,
        color=INK,
    )
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write the figure as PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DOTS_PER_INCH)


def _family(name: str, group: Group) -> str | None:
    if group is Group.STEP:
        return name.split(",")[0] if "control" not in name else None
    known = {
        Group.PRESET: "preset",
        Group.IMPEDANCE: "impedance",
        Group.IMPRATIO: "impratio",
        Group.FRICTION: "friction plant",
    }
    return known.get(group)


def _short(name: str, group: Group) -> str:
    if group is Group.STEP:
        return name.split(", ")[1]
    return name.split()[-1] if group in (Group.IMPEDANCE, Group.IMPRATIO) else ""


@dataclass(frozen=True, slots=True)
class Placed:
    """A choice in a panel.

    Attributes:
        family: Its mark.
        label: Beside it.
        cost: [us].
        error: In the panel's unit.
        reaches: Whether it reaches as far as the preset.
    """

    family: str
    label: str
    cost: float
    error: float
    reaches: bool


def _scatter(panel: Axes, placed: Sequence[Placed]) -> None:
    lines: dict[str, list[tuple[float, float]]] = {}
    for each in placed:
        mark = MARKS[each.family]
        face = mark.colour if each.reaches else "white"
        front = 6 if each.family == "preset" else 3
        panel.plot(each.cost, each.error, **mark.look, markerfacecolor=face, markeredgewidth=0.9, zorder=front)
        if each.label and each.family in BESIDE:
            x, y, aligned = BESIDE[each.family]
            panel.annotate(
                each.label,
                (each.cost, each.error),
                xytext=(x, y),
                textcoords="offset points",
                ha=aligned,
                va="center",
                fontsize=SMALL - 0.5,
                color=mark.colour,
            )
        family = "Euler" if each.family == "preset" else each.family
        if family in STEPPED:
            lines.setdefault(family, []).append((each.cost, each.error))
    for family, ends in lines.items():
        x_ends, y_ends = zip(*sorted(ends), strict=True)
        panel.plot(x_ends, y_ends, color=MARKS[family].colour, linewidth=0.8, alpha=0.5, zorder=2)


def _touch(
    panel: Axes, found: Sequence[TouchFinding], error: Callable[[TouchFinding], float], y: str, title: str
) -> None:
    _ground(panel, "us per period", y, title)
    placed, beyond = [], []
    most = FRAME * error(found[0])
    for each in found:
        family = _family(each.choice.name, each.choice.group)
        if not family or each.cost is None or not each.explored.done:
            continue
        if error(each) > most:
            beyond.append(f"{each.choice.name}: {error(each):.0f}")
            continue
        label = _short(each.choice.name, each.choice.group)
        placed.append(Placed(family, label, _cost(each, found[0]), error(each), not each.short))
    _scatter(panel, placed)
    panel.set_yscale("linear")
    panel.margins(x=0.16)
    least, largest = min(each.error for each in placed), max(each.error for each in placed)
    panel.set_ylim(least - 0.12 * (largest - least), largest + 0.28 * (largest - least))
    if beyond:
        panel.text(
            0.98,
            0.98,
            "beyond the frame:\n" + "\n".join(beyond),
            transform=panel.transAxes,
            ha="right",
            va="top",
            fontsize=SMALL,
            color=MARKS["impedance"].colour,
        )


def _grasp(panel: Axes, found: Sequence[HoldFinding]) -> None:
    _ground(panel, "us per period", "creep [mm/s]", "hand: an object held")
    placed = []
    for each in found:
        family = _family(each.choice.name, each.choice.group)
        if family and each.cost is not None and math.isfinite(each.held.limit) and each.held.creep > 1e-12:
            label = _short(each.choice.name, each.choice.group)
            placed.append(Placed(family, label, _cost(each, found[0]), 1e3 * each.held.creep, not each.short))
    _scatter(panel, placed)
    panel.margins(x=0.16)
    panel.axhline(1e-3, color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
    panel.yaxis.set_major_locator(LogLocator(numticks=12))
    panel.yaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0e}"))
    panel.text(0.98, 1.5e-3, "asked: below", transform=panel.get_yaxis_transform(), ha="right", fontsize=SMALL)


def _stiffness(panel: Axes, rows: Sequence[Row]) -> None:
    _ground(panel, "contact stiffness [kN/m]", "sensed contact, off the surface [um]", "stiffness of the contact")
    by_name = {row.name: row.found for row in rows}
    x = [float(name.split()[0]) for name in STIFFNESS_ROWS]
    series = (
        ("first measured", [1e3 * FACTS[name].on_surface[0] for name in STIFFNESS_ROWS], "#999999", "s"),
        (
            "tip not shrunk",
            [1e6 * by_name[f"{name}, tip not shrunk"].on_surface[0] for name in STIFFNESS_ROWS],
            "#56b4e9",
            "o",
        ),
        (
            "MuJoCo's own contact finder",
            [1e6 * by_name[f"{name}, MuJoCo's own contact finder"].on_surface[0] for name in STIFFNESS_ROWS],
            "#e69f00",
            "v",
        ),
        ("as palpate senses", [1e6 * by_name[name].on_surface[0] for name in STIFFNESS_ROWS], "#d55e00", "*"),
    )
    for name, values, colour, shape in series:
        panel.plot(x, values, color=colour, marker=shape, markersize=6.0, linewidth=1.0, label=name)
    panel.set_xticks(x, [f"{value:g}" for value in x])
    panel.legend(fontsize=SMALL, frameon=False, labelcolor=INK)


def _sensors(panel: Axes, rows: Sequence[Row]) -> None:
    style_axes(panel, x="error of its point [um], median to 99 %", y="")
    panel.set_title("sensor, 20 kN/m", fontsize=FONT_SIZE, color=INK, loc="left")
    wanted = [
        row
        for row in rows
        if row.name.startswith(("noise", "nano17", "weight", "wrench")) or row.name == "20 kN/m"
    ]
    for i, row in enumerate(reversed(wanted)):
        low, high = (1e6 * value for value in row.found.to_contact)
        colour = "#d55e00" if row.name == "20 kN/m" else "#0072b2"
        panel.plot((low, high), (i, i), color=colour, linewidth=2.0, alpha=0.5)
        panel.plot(low, i, marker="o", color=colour, markersize=5.0)
    names = ["perfect sensor" if row.name == "20 kN/m" else row.name for row in reversed(wanted)]
    panel.set_yticks(range(len(names)), names, fontsize=SMALL)
    panel.set_xscale("log")
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _ground(panel: Axes, x: str, y: str, title: str) -> None:
    style_axes(panel, x=x, y=y)
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_title(title, fontsize=FONT_SIZE, color=INK, loc="left")
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(plain)


def _cost(each: TouchFinding | HoldFinding, preset: TouchFinding | HoldFinding) -> float:
    """The preset's time, as many times over as in the same rounds [us]."""
    assert each.cost is not None
    assert preset.cost is not None
    times = ratio(each.cost.sensing, preset.cost.sensing).median
    return 1e6 * times * statistics.median(preset.cost.sensing)
