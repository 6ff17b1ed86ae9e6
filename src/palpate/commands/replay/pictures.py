"""Recorded and replayed over time, and how far they are apart."""

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.marks import Line, Mark, Points, unnamed
from palpate.reporting.phases import phase_spans
from palpate.reporting.picture import TIME, Axis, Panel, Picture
from palpate.runtime import Record
from palpate.runtime.palette import COMMAND, FELT

MILLI = 1e3

SMALLEST_DRAWN = 1e-15
"""[mm/s]. Smaller differences, the last bits of velocities far below 1 mm/s, are drawn as this one."""


def velocity_picture(recorded: Record, replayed: Record) -> Picture:
    """Return the picture of the commanded velocity, axis by axis."""
    rows: list[tuple[Mark, ...]] = [
        (*phase_spans(recorded), *_both(recorded, MILLI * before, MILLI * after))
        for before, after in zip(recorded.command.T[:3], replayed.command.T[:3], strict=True)
    ]
    return Picture(
        title="Commanded velocity",
        caption=(
            "What was commanded when the run was recorded, and what comes out of the same samples now, for each "
            "axis of the base frame; the lines lie on each other where they agree, as they should if nothing was "
            "changed. The ground shows what the recorded controller was doing."
        ),
        panels=(
            Panel(rows[0], TIME, Axis("x", "mm/s"), height=230),
            Panel(unnamed(rows[1]), TIME, Axis("y", "mm/s"), height=180),
            Panel(unnamed(rows[2]), TIME, Axis("z", "mm/s"), height=180),
        ),
        wide=True,
    )


def difference_picture(recorded: Record, replayed: Record) -> Picture | None:
    """Return the picture of how far the commands are apart, or None if they are not."""
    apart = MILLI * np.linalg.norm(replayed.command - recorded.command, axis=1)
    if not np.nansum(apart) > 0.0:
        return None
    shown = np.where(apart > 0.0, np.maximum(apart, SMALLEST_DRAWN), np.nan)
    known = np.isfinite(shown)
    alone = known & ~np.append(known[1:], False) & ~np.append(False, known[:-1])  # no line goes through it
    return Picture(
        title="How far the commands are apart",
        caption=(
            "Length of the difference between replayed and recorded velocity in every period, on a logarithmic "
            f"scale; periods without any are left open. The largest is {np.nanmax(apart):.3g} mm/s. "
            "Nothing at all is good where nothing was changed."
        ),
        panels=(
            Panel(
                (
                    *phase_spans(recorded),
                    Line(recorded.time, shown),
                    Points(recorded.time[alone], shown[alone], size=3.0),
                ),
                TIME,
                Axis("difference", "mm/s", logarithmic=True),
            ),
        ),
        wide=True,
    )


def felt_picture(recorded: Record, replayed: Record) -> Picture | None:
    """Return the picture of the felt normal force, or None if nothing was touched."""
    if not any(side.touching.any() for side in (recorded, replayed)):
        return None
    forces = (np.where(side.touching, side.normal_force, np.nan) for side in (recorded, replayed))
    return Picture(
        title="Felt normal force",
        caption=(
            "The normal force that touch found in the same samples, then and now. It differs only if what sensing "
            "goes by was changed: fingertip, sensor, or set force and stiffness (how far the tip yields)."
        ),
        panels=(
            Panel(
                (*phase_spans(recorded), *_both(recorded, *forces)),
                TIME,
                Axis("normal force", "N"),
            ),
        ),
        wide=True,
    )


def _both(of: Record, recorded: FloatArray, replayed: FloatArray) -> tuple[Line, Line]:
    """A wide pale line below a thin one: where they agree, both are seen."""
    return (
        Line(of.time, recorded, "recorded", COMMAND, width=4.5, opacity=0.5),
        Line(of.time, replayed, "replayed", FELT, width=1.3),
    )
