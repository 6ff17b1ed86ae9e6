"""The tables: what each choice costs and gives."""

import math
import statistics
from collections.abc import Sequence

from rich import box
from rich.table import Table

from simulation.asked import Answer, percent
from simulation.exploring import PERIOD
from simulation.measured import HoldFinding, TouchFinding
from simulation.sensed import FACTS, Row
from simulation.timing import Cost

WIDTH = 150
"""Characters that the tables take; cut off in a narrower terminal."""

EXPLANATION = (
    "us: processor time of one control period, median; physics includes servos, whole adds sensing and the "
    "controller (a grasp has none). Times vary between runs: trust the ratios to the preset, which were measured "
    "in turns. Real time: how many times faster than that. Force: the true normal force against the one set; "
    "points: found against the true surface; both root mean square over a scan at 2 N. Touching: least share of "
    "a scan's time. Reach: what cannot be built without another time step (100 kN/m on a stage of 5 kg; friction "
    "0.05 to 1 from 0.5 N on with 2 kg), or is not still with twice its contact step (a grasp of 0.1 kg): these "
    "do not compete with the preset."
)


def touch_table(title: str, found: Sequence[TouchFinding]) -> Table:
    """Return the table of tips on objects."""
    table = _table(title, "choice", "physics us", "whole us", "to preset", "real time", "force mN", "points um")
    for heading in ("touching", "reach"):
        table.add_column(heading, justify="right")
    for each in found:
        run = each.explored
        table.add_row(
            each.choice.name,
            *_costs(each.cost, found[0].cost, each.choice.touching.period),
            _number(1e3 * run.force_rms) if run.done else "lost" if math.isfinite(run.force_rms) else "none",
            _number(1e6 * run.point_rms) if run.done else "-",
            f"{100.0 * run.touching:.1f} %" if math.isfinite(run.touching) else "-",
            each.short or "ok",
        )
    return table


def hold_table(title: str, found: Sequence[HoldFinding]) -> Table:
    """Return the table of grasps."""
    table = _table(
        title,
        "choice",
        "physics us",
        "whole us",
        "to preset",
        "real time",
        "creep mm/s",
        "limit surface",
        "load off slip",
        "force by slip",
        "reach",
    )
    for each in found:
        held = each.held
        table.add_row(
            each.choice.name,
            *_costs(each.cost, found[0].cost, PERIOD),
            _scientific(1e3 * held.creep),
            percent(held.limit) if math.isfinite(held.limit) else "none",
            f"{held.turned:.1f} deg" if math.isfinite(held.turned) else "-",
            f"{100.0 * held.pressed:.1f} %" if math.isfinite(held.pressed) else "-",
            each.short or "ok",
        )
    return table


def sensed_table(rows: Sequence[Row]) -> Table:
    """Return the accuracy table, beside the first measurements."""
    table = _table(
        "Contact sensed: ellipsoid tip on a plane, 5.3 N, mu 0.5, 20 mm/s + 1 rad/s; 20 kN/m where not said",
        "case",
        "c to contact.pos mm",
        "before",
        "c on surface mm",
        "before",
        "spin torque mNm",
        "before",
    )
    for row in rows:
        found, known = row.found, FACTS.get(row.name)
        table.add_row(
            row.name,
            f"{1e3 * found.to_contact[0]:.4f}",
            f"{known.to_contact:.3f}" if known else "",
            _pair(found.on_surface),
            f"{known.on_surface[0]:.3f}/{known.on_surface[1]:.3f}" if known else "",
            _pair(found.spin_torque),
            f"{known.spin_torque[0]:.3f}/{known.spin_torque[1]:.3f}" if known else "",
        )
    table.caption = (
        f"Median, '/' 99th percentile; of a spin torque of {1e3 * rows[0].found.of_torque:.2f} mNm. 'Before': the "
        "project's first measurements, with a tip sensed as if it did not yield."
    )
    return table


def asked_table(answers: Sequence[Answer]) -> Table:
    """Return what was asked, and what is given."""
    table = Table(title="Asked of the presets, and got", box=box.SIMPLE, padding=(0, 1, 0, 0))
    for heading in ("what", "asked", "got", ""):
        table.add_column(heading)
    for each in answers:
        table.add_row(each.what, each.asked, each.got, "kept" if each.kept else "NOT KEPT")
    return table


def _table(title: str, first: str, *headings: str) -> Table:
    table = Table(title=title, box=box.SIMPLE, padding=(0, 1, 0, 0))
    table.add_column(first, no_wrap=True)
    for heading in headings:
        table.add_column(heading.replace(" ", "\n", 1), justify="right", no_wrap=True)
    return table


def _costs(cost: Cost | None, preset: Cost | None, period: float) -> tuple[str, str, str, str]:
    if cost is None or preset is None:
        return "-", "-", "-", "-"
    physics, whole = statistics.median(cost.physics), statistics.median(cost.whole)
    paired = statistics.median(a / b for a, b in zip(cost.whole, preset.whole, strict=True))
    return f"{1e6 * physics:.1f}", f"{1e6 * whole:.1f}", f"{paired:.2f}", f"{period / whole:.0f}"


def _number(value: float) -> str:
    return f"{value:.3g}"


def _scientific(value: float) -> str:
    return f"{value:.1e}" if math.isfinite(value) else "dropped"


def _pair(errors: tuple[float, float]) -> str:
    return f"{1e3 * errors[0]:.4f}/{1e3 * errors[1]:.4f}"
