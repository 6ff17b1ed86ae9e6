"""Normal force and speed over time."""

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.data import TimeSeries
from palpate.reporting.figure import TIME, Axis, Figure, Panel
from palpate.reporting.lines import true_and_felt
from palpate.reporting.marks import Dash, Line, unnamed
from palpate.reporting.phases import phase_spans, scan_window, within
from palpate.runtime.palette import QUIET_COLOUR, SET

FORCE, SPEED = Axis("normal force", "N"), Axis("speed", "mm/s", low=0.0)

ROOM = 0.08
"""Above and below the forces, over what they span."""

MILLI = 1e3


def force_overview(series: TimeSeries) -> Figure | None:
    """Return the figure of normal force and speed over the whole run; None if nothing was felt."""
    felt = (series.measured_force, series.true_force)
    if not any(np.isfinite(force).any() for force in felt if force is not None):
        return None
    speed = Line(series.time, MILLI * series.speed, colour=QUIET_COLOUR)
    return Figure(
        title="Normal force over the run",
        caption=(
            "Normal force found by touch, in the simulation (where known) and asked for, above the speed "
            "of the fingertip; the ground shows what the controller was doing. The nearer the true force "
            "to the set one the better."
        ),
        panels=(
            Panel((*phase_spans(series), *_forces(series)), TIME, FORCE),
            Panel((*unnamed(phase_spans(series)), speed), TIME, SPEED, height=150),
        ),
        wide=True,
    )


def force_zoom(series: TimeSeries) -> Figure | None:
    """Return the figure of normal force while scanning, or None if nothing was scanned."""
    window = scan_window(series)
    if window is None or not len(within(series, series.measured_force)):
        return None
    shown = [within(series, series.measured_force), within(series, series.set_force)]
    if series.true_force is not None:
        shown.append(within(series, series.true_force))
    low, high = _with_room(np.concatenate(shown))
    return Figure(
        title="Normal force while scanning",
        caption="The same forces while scanning, on a scale that shows every deviation from the set value: "
        "the smaller the better.",
        panels=(
            Panel(
                (*phase_spans(series, *window), *_forces(series)),
                Axis("time", "s", *window, run_time=True),
                Axis("normal force", "N", low, high),
            ),
        ),
        wide=True,
    )


def _forces(series: TimeSeries) -> tuple[Line, ...]:
    wanted = Line(series.time, series.set_force, "set", SET, dash=Dash.DASHED)
    return (*true_and_felt(series.time, series.true_force, series.measured_force), wanted)


def _with_room(values: FloatArray) -> tuple[float, float]:
    room = ROOM * max(float(np.ptp(values)), 1e-3 * float(np.abs(values).max()), 1e-6)
    return float(values.min()) - room, float(values.max()) + room
