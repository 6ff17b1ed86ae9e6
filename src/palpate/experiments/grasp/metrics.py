"""Metrics of a grasp, the most important first, and their limits; imports nothing heavy."""

import math
from collections.abc import Callable
from statistics import fmean
from typing import TYPE_CHECKING

from palpate.experiments.kit.metric import Metric

if TYPE_CHECKING:
    from palpate.controllers.grip.grasp import GraspStage
    from palpate.experiments.grasp.result import GraspResult

MAX_GRIP = 15.5
"""Largest commanded force of a finger [N]. At 12 mm before the sensor its moment is 0.19 N m, and 0.24 as a grip
that jumps there with 450 N/s overshoots, of the 0.25 that it measures; half of the largest pull and a weight, 8 mm
aside, are 0.036 about another axis."""

_MAX_OVERSHOOT = 0.3
"""Largest overshoot of a grip that jumps to its limit, relative: the servos' rotors swing on the contacts."""

SLIP_LIMIT = 2e-5
"""Slip above which an object counts as slipped [m]; below are elastic motion and creep."""

SPIN_LIMIT = math.radians(0.2)
"""Spin above which an object counts as spun [rad]; below are elastic motion and creep."""

CREEP_RATE_LIMIT = 5e-6
"""Rate of slip above which an object counts as slipped [m/s]: `SLIP_LIMIT` in four seconds. Elastic motion is
slower as a pull of 0.5 N grows within a second."""

SPIN_RATE_LIMIT = math.radians(0.05)
"""Rate of spin above which an object counts as spun [rad/s]: `SPIN_LIMIT` in four seconds."""

_NUDGE_FRICTION_ERROR, _NUDGE_SPIN_LENGTH_ERROR = 0.02, 2.5e-4
"""Largest errors of a nudge in 40 runs: of mu, relative, and of e [m]. Half of the runs had MuJoCo's friction,
half the friction plant (mu 0.35 to 0.65, e 2 to 6 mm, p = 2)."""


def _pulled(grasp: "GraspResult") -> bool:
    return grasp.truth_known and bool(grasp.counted.any())


def _aloft(grasp: "GraspResult") -> bool:
    return grasp.truth_known and bool(grasp.aloft.any())


def _grip_note(grasp: "GraspResult") -> str:
    kind = "true" if grasp.truth_known else "felt"
    return (
        f"{kind}, mean of the fingers, while pulled; at most {MAX_GRIP:g} N is commanded, and servos overshoot a "
        f"jump by up to {100.0 * _MAX_OVERSHOOT:.3g} %"
    )


def _alarm_note(grasp: "GraspResult") -> str:
    config = grasp.planned.config
    if config.ignores_spin:
        return "a grip that ignores spin does not detect slip"
    ripple = ", or a finger's load follows the ripple of its grip" if config.known == "untouched" else ""
    return f"what hangs falls, or rises with the grip{ripple}"


def _by_stage(counts: "dict[GraspStage, int]", note: str) -> str:
    """Return a note with the counts of the stages; while the object is set down, the table pushes at it."""
    names = {"set down": "set down, where the table pushes"}
    where = ", ".join(f"{count} at {names.get(stage, stage)}" for stage, count in counts.items())
    return f"{note}: {where}" if where else note


def _raised_note(grasp: "GraspResult") -> str:
    ignores = grasp.planned.config.ignores_spin
    note = "there are no alarms" if ignores else "for an alarm, and again while it goes on; in the whole run"
    return _by_stage(grasp.raised_at(), note)


def delay_note(delay: float) -> str:
    """Return the note on the time from slip to alarm [s]."""
    return "no alarm" if math.isnan(delay) else "before it slipped" if delay < 0.0 else "after the truth"


def _alarm_delay(grasp: "GraspResult") -> float:
    """Return the time from slip to alarm of the slowest finger [s]; NaN if a finger slipped without an alarm."""
    delays = [onset.latency for onset in grasp.onsets]
    return math.nan if any(map(math.isnan, delays)) else max(delays)


def _nudge_mean(name: str) -> "Callable[[GraspResult], float]":
    """Return the function to the mean finding of a nudge over the fingers; NaN if nothing slipped."""

    def mean(grasp: "GraspResult") -> float:
        known = [value for each in grasp.nudged if (value := getattr(each, name)) is not None]
        return fmean(known) if known else math.nan

    return mean


_nudge_friction, _nudge_spin_length = _nudge_mean("friction"), _nudge_mean("spin_length")


def _nudge_note(value: float, error: float, true: str) -> str:
    if math.isnan(value):
        return f"nothing slipped: the lower bound is planned with; {true}"
    return f"as nudges err: {value - error:.3g} to {value + error:.3g}; {true}"


def _nudge_friction_note(grasp: "GraspResult") -> str:
    mu = grasp.planned.true.friction
    true = f"true {mu:.3g}" if grasp.truth_known else "true mu not known on a robot"
    return _nudge_note(_nudge_friction(grasp), _NUDGE_FRICTION_ERROR * mu, true)


def _nudge_spin_length_note(grasp: "GraspResult") -> str:
    from palpate.experiments.grasp.friction_belief import NUDGE_GRIP

    e = 1e3 * grasp.planned.true.spin_length_at(NUDGE_GRIP)
    true = f"true {e:.3g} mm" if grasp.truth_known else "true e not known on a robot"
    found = 1e3 * _nudge_spin_length(grasp)
    return _nudge_note(found, 1e3 * _NUDGE_SPIN_LENGTH_ERROR, f"{true} at {NUDGE_GRIP:g} N")


METRICS = (
    Metric(
        "grip_ratio",
        "grip over the least",
        "",
        lambda grasp: grasp.grip_ratio,
        digits=3,
        note="mean over mean, while pulled",
        applies=lambda grasp: math.isfinite(grasp.grip_ratio),
        needs_truth=True,
    ),
    Metric(
        "slip_aloft_m",
        "slip in the air",
        "m",
        lambda grasp: grasp.slip_aloft,
        "mm",
        2,
        "from the lift on, until it lands",
        applies=_aloft,
        needs_truth=True,
    ),
    Metric(
        "dropped",
        "dropped",
        "",
        lambda grasp: grasp.dropped,
        note=lambda grasp: "" if grasp.truth_known else "as the fingers feel it",
    ),
    Metric(
        "gave_way",
        "slipped or spun",
        "",
        lambda grasp: bool(grasp.gave_way),
        note=lambda grasp: " and ".join(grasp.gave_way),
        applies=lambda grasp: grasp.truth_known,
        needs_truth=True,
    ),
    Metric(
        "slip_m",
        "slip while pulled",
        "m",
        lambda grasp: grasp.slip,
        "mm",
        2,
        f"counts above {1e3 * SLIP_LIMIT:g} mm",
        applies=_pulled,
        needs_truth=True,
    ),
    Metric(
        "spin_rad",
        "spin while pulled",
        "rad",
        lambda grasp: grasp.spin,
        "degrees",
        2,
        f"counts above {math.degrees(SPIN_LIMIT):g} degrees",
        applies=_pulled,
        needs_truth=True,
    ),
    Metric(
        "spin_aloft_rad",
        "spin in the air",
        "rad",
        lambda grasp: grasp.spin_aloft,
        "degrees",
        2,
        "from the lift on, until it lands",
        applies=_aloft,
        needs_truth=True,
    ),
    Metric(
        "slip_rate_m_per_s",
        "rate of slip while pulled",
        "m/s",
        lambda grasp: grasp.slip_rate,
        "µm/s",
        2,
        f"counts above {1e6 * CREEP_RATE_LIMIT:g} µm/s",
        applies=_pulled,
        needs_truth=True,
    ),
    Metric(
        "spin_rate_rad_per_s",
        "rate of spin while pulled",
        "rad/s",
        lambda grasp: grasp.spin_rate,
        "degrees/s",
        3,
        f"counts above {math.degrees(SPIN_RATE_LIMIT):g} degrees/s",
        applies=_pulled,
        needs_truth=True,
    ),
    Metric(
        "tightest",
        "smallest grip over the least",
        "",
        lambda grasp: grasp.tightest,
        digits=3,
        note="at any instant in the air; below 1 a contact slips",
        applies=lambda grasp: math.isfinite(grasp.tightest),
        needs_truth=True,
    ),
    Metric("grip_max_n", "largest grip", "N", lambda grasp: grasp.largest_grip, digits=3, note=_grip_note),
    Metric(
        "grip_growth",
        "grip growth in the hold",
        "",
        lambda grasp: grasp.growth,
        digits=3,
        note=lambda grasp: (
            f"last half second over the first; drift of the zeros explains up to {grasp.planned.hold_growth:.3g}"
        ),
        applies=lambda grasp: grasp.planned.config.load == "none",
    ),
    Metric("alarms_pulled", "alarms while pulled", "", lambda grasp: len(grasp.pulled_alarms), note=_alarm_note),
    Metric(
        "alarms_other",
        "other alarms",
        "",
        lambda grasp: len(grasp.alarms) - len(grasp.pulled_alarms),
        note=lambda grasp: _by_stage(grasp.alarms_at(), "from the first touch to letting go"),
    ),
    Metric("regrips", "times the grip was raised", "", lambda grasp: grasp.regrips, note=_raised_note),
    Metric(
        "nudge_friction",
        "mu, by the nudge",
        "",
        _nudge_friction,
        digits=3,
        note=_nudge_friction_note,
        applies=lambda grasp: grasp.nudged,
    ),
    Metric(
        "nudge_spin_length_m",
        "e, by the nudge",
        "m",
        _nudge_spin_length,
        "mm",
        3,
        _nudge_spin_length_note,
        applies=lambda grasp: grasp.nudged,
    ),
    Metric(
        "alarm_delay_s",
        "alarm after slip, slowest finger",
        "s",
        _alarm_delay,
        "ms",
        3,
        lambda grasp: delay_note(_alarm_delay(grasp)),
        applies=lambda grasp: grasp.truth_known and bool(grasp.onsets),
    ),
    Metric("simulated_s", "simulated time", "s", lambda grasp: grasp.run.duration, in_table=False),
)
