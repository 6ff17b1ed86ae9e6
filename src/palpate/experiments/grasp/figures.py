"""A grasp over time: grip against the least, slip and spin with alarms."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from palpate.controllers.grip.grasp import GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.result import GraspResult
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Dash, Line, Points, Symbol
from palpate.reporting.run_figures import phase_spans, true_and_felt
from palpate.runtime.palette import (
    APPROACH,
    BOUND,
    INK_COLOUR,
    LIFT,
    OTHER,
    SCAN,
    SET,
    SETTLE,
    SPIN_COLOUR,
    TRAVEL,
    TRUTH,
    Colour,
)

GROUNDS: Mapping[str, Colour] = {
    GraspStage.CLOSE: APPROACH,
    GraspStage.NUDGE: SETTLE,
    GraspStage.LIFT: LIFT,
    GraspStage.HOLD: OTHER,
    GraspStage.SET_DOWN: TRAVEL,
    GraspStage.LET_GO: SCAN,
}
"""Behind plots over time."""

HIGHEST = 1.15
"""What is drawn goes up to this share of the largest; of grip while it was held: impacts are left out."""

NO_SLIP, NO_SPIN = 0.01, 0.1
"""The scales span at least this [mm], [degrees]: below is the elastic deflection of contacts."""

MILLI = 1e3


def over_time(grasp: GraspResult, note: str = "") -> Figure | None:
    """Return the figure of a grasp over time; None if it did not last.

    Args:
        grasp: What came of it.
        note: For the end of the title.
    """
    if len(grasp.truth) < 2:
        return None
    if not grasp.truth_known:
        return Figure(
            title=f"Grip{note}",
            caption="Normal force of each finger (mean), as set and as felt: the closer together the better. "
            f"Above: when slip was detected ({_alarms(grasp)}).",
            panels=(_grip(grasp),),
            wide=True,
        )
    return Figure(
        title=f"Grip, slip and spin{note}",
        caption=(
            "Normal force of each finger (mean), as it was set and as it was, and the least that the true load "
            "needs with the true friction, shared as best it can be; known while the object is held in the air. "
            "A grip slightly above the least is good. At the end the table pushes the object up between the "
            "fingers, and the grip that would hold against that jumps; the hand keeps its grip until it lets go. "
            "Below: how far the object moved over the fingertips, and turned about the contact normals, in the "
            "air, since the lift began: the larger of the fingers, by the simulation's truth. Next to nothing is "
            f"good. Triangles: when slip was detected ({_alarms(grasp)})."
        ),
        panels=(
            _grip(grasp),
            _motion(grasp, Axis("slip", "mm"), MILLI * grasp.truth.slid, NO_SLIP, TRUTH),
            _motion(grasp, Axis("spin", "degrees"), np.degrees(grasp.truth.turned), NO_SPIN, SPIN_COLOUR),
        ),
        wide=True,
    )


def _alarms(grasp: GraspResult) -> str:
    count = len(grasp.alarms_aloft)
    return f"{count} alarm{'' if count == 1 else 's'} in the air"


def _grip(grasp: GraspResult) -> Panel:
    truth, known = grasp.truth, grasp.truth_known
    wanted = Line(truth.time, truth.target, "set", SET, dash=Dash.DASHED)
    if not known:
        top = float(np.nanmax(np.maximum(grasp.felt, truth.target), initial=0.0))
        return _panel(grasp, Axis("grip", "N", 0.0, top), (*true_and_felt(truth.time, None, grasp.felt), wanted))
    pressed = Line(truth.time, grasp.felt, "true", TRUTH, width=4.0, opacity=0.55)
    least = Line(truth.time, grasp.least, "least", BOUND, width=1.8, dash=Dash.DASH_DOT)
    held = np.isfinite(grasp.least)
    top = float(np.maximum(grasp.felt, grasp.least)[held].max()) if held.any() else float(grasp.felt.max())
    return _panel(grasp, Axis("grip", "N", 0.0, top), (pressed, wanted, least), alarms=False)


def _motion(grasp: GraspResult, axis: Axis, values: FloatArray, least: float, colour: Colour) -> Panel:
    """The largest of the fingers since the lift; `least` is what the scale spans."""
    largest = np.where(grasp.aloft, values.max(axis=1), np.nan)
    top = max(least, float(values[grasp.aloft].max(initial=0.0)))
    return _panel(grasp, replace(axis, low=0.0, high=top), (Line(grasp.truth.time, largest, colour=colour),))


def _panel(grasp: GraspResult, axis: Axis, lines: tuple[Line, ...], *, alarms: bool = True) -> Panel:
    """Lines over time with the stages behind them, up to a bit more than the axis's end."""
    truth, top = grasp.truth, HIGHEST * (axis.high or 1.0)
    spans = phase_spans(truth, grounds=GROUNDS)
    if axis.quantity != "grip":  # one legend is enough
        spans = tuple(replace(span, name="") for span in spans)
    heard = np.array([alarm.time for alarm in grasp.alarms_aloft])
    signals = tuple(f"finger {each.finger + 1}: {each.signal.value}" for each in grasp.alarms_aloft)
    marks = Points(
        heard, np.full(len(heard), 0.96 * top), "alarm", INK_COLOUR, symbol=Symbol.TRIANGLE, texts=signals
    )
    return Panel(
        (*spans, *lines, *((marks,) if alarms and signals else ())),
        Axis("time", "s", float(truth.time[0]), float(truth.time[-1]), run_time=True),
        replace(axis, high=top),
        height=300 if axis.quantity == "grip" else 220,
    )
