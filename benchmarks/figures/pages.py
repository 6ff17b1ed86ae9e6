"""The tables of README and documents that are made of figures, and how they get there.

A page marks where one stands:

    <!-- figures: contact -->
    ...
    <!-- end of figures -->
"""

import re
from collections.abc import Callable
from pathlib import Path

from figures.figure import Figure, Measured

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", ROOT / "docs" / "numerics.md", ROOT / "docs" / "running.md")
BLOCK = re.compile(r"(<!-- figures: (\w+) -->\n).*?(<!-- end of figures -->)", re.DOTALL)

Show = Callable[[str], str]
"""From a figure's name to its value as the tables have it."""


def contact(show: Show) -> str:
    """Speed and error of contact sensing."""
    return f"""\
| contact sensing | |
|---|---|
| error of the centroid, every hard category (grazing, slender 1e-3..1e6, scale 1e-200..1e200, zero spin, ...) \
| at most {show("contact_error")} relative |
| 1e6 contacts on an ellipsoid, all fields, one thread | {show("batch_copy")} times a plain copy of as many bytes |
| one contact, result object included; by a `Solver`, in a loop \
| {show("contact_time")} us; {show("solver_time")} us |
| the same by one row of numpy; by scipy's `root` | {show("numpy_row")} times that; {show("scipy_root")} times |"""


def exploration(show: Show) -> str:
    """Errors of explorations."""

    def pair(name: str, robot: str, speed: int) -> str:
        return " / ".join(show(f"{name}_{robot}_{shape}_{speed}") for shape in ("sphere", "ellipsoid"))

    def rough(name: str, robot: str) -> str:
        return ", ".join(show(f"{name}_{robot}_{shape}_20") for shape in ("bumps", "torus"))

    rows = [
        "| exploration in simulation, 1 kHz, 2 N, friction 0.3, 20 kN/m: sphere / ellipsoid | 20 mm/s | 50 mm/s |",
        "|---|---|---|",
    ]
    for name, unit, what in (
        ("force", "N", "true normal force, RMS error"),
        ("points", "mm", "points to the true surface, RMS"),
    ):
        for robot, called in (("stage", "stage"), ("ur5e-sim", "UR5e")):
            each = " | ".join(f"{pair(name, robot, speed)} {unit}" for speed in (20, 50))
            rows.append(f"| {what}, {called} | {each} |")
            rows.append(f"| the same, bumps of +-3 mm, torus | {rough(name, robot)} {unit} | |")
    return "\n".join(rows)


def simulation(show: Show) -> str:
    """Speed of simulated runs."""
    return f"""\
| simulation, one core, whole control period of 1 ms with sensing | times real time |
|---|---|
| stage / UR5e, exploring (MuJoCo's steps alone: {show("factor_physics")} on the stage) \
| {show("factor_stage")} / {show("factor_ur5e")} |
| hand of two fingers that holds an object | {show("factor_hand")} |"""


def period(show: Show) -> str:
    """Cost of a control period."""
    return f"""\
| a period of the loop, paced at 1 kHz: read, sense, control, supervise, record | median | 99 % |
|---|---|---|
| all of it | {show("period_median")} us | {show("period_99")} us |
| of it sensing: calibration, payload, filter, health, contact | {show("period_sensing")} us | |"""


BLOCKS: dict[str, Callable[[Show], str]] = {
    "contact": contact,
    "exploration": exploration,
    "simulation": simulation,
    "period": period,
}


def made(page: str, measured: Measured) -> str:
    """Return a page with its tables made anew.

    Raises:
        KeyError: It marks a table that is not known.
    """
    figures = measured.figures
    caption = f"*{measured.date}, palpate {measured.version}, {measured.machine}; `make figures`.*"

    def block(found: re.Match[str]) -> str:
        table = BLOCKS[found[2]](lambda name: shown(figures[name]))
        return f"{found[1]}{table}\n\n{caption}\n{found[3]}"

    return BLOCK.sub(block, page)


def shown(figure: Figure) -> str:
    """Return a value as a table has it: two digits say what two shared cores can."""
    value = float(f"{float(figure.row[1]):.2g}")
    return f"{value:.0f}" if 10.0 <= value < 1e6 else f"{value:g}"


def write(measured: Measured) -> None:
    """Write the tables of every page anew."""
    for path in PAGES:
        path.write_text(made(path.read_text(encoding="utf-8"), measured), encoding="utf-8")
