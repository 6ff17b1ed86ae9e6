"""Key metrics of a grasp."""

import math
from collections.abc import Callable
from statistics import fmean

from palpate.controllers.grip.grasp import GraspStage
from palpate.experiments.grasp.belief import NUDGING_GRIP
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.creep import CREEPS, TURNS
from palpate.experiments.grasp.price import growth_in_hold
from palpate.experiments.grasp.result import SLIPPED, SPUN, GraspResult
from palpate.experiments.grasp.strength import LARGEST_GRIP, OVERSHOOT
from palpate.experiments.grasp.unit_text import MILLI, in_percent
from palpate.reporting.data import Quantity
from palpate.robots.known_truth import NOT_KNOWN

OF_FRICTION, OF_SPIN_LENGTH = 0.02, 2.5e-4
"""By which share mu, and by how much e [m], is off that a nudge finds: by more in none of 40, half of them with
MuJoCo's friction and half with the friction plant (mu 0.35 to 0.65, e 2 to 6 mm, p = 2)."""

MICRO = 1e6
"""Micrometres per metre."""

DIGITS = 6
"""Decimals of millimetres and degrees: beyond is rounding error."""

_COMMANDED = (
    f"{LARGEST_GRIP:g} N is asked for at most, and servos overshoot a jump by up to {in_percent(OVERSHOOT)}"
)


def quantities(grasp: GraspResult) -> tuple[Quantity, ...]:
    """Return the key metrics; a dash for what was never measured. Of a real robot, those that do without truth."""
    return _known_metrics(grasp) if grasp.truth_known else _felt_metrics(grasp)


def _felt_metrics(grasp: GraspResult) -> tuple[Quantity, ...]:
    return (
        Quantity("dropped", "yes" if grasp.dropped else "no", "", "as fingers feel it"),
        Quantity(
            "largest grip",
            grasp.largest_grip,
            "N",
            f"as it was felt, mean of the fingers, while held; {_COMMANDED}",
            3,
        ),
        *_growth(grasp),
        *_alarm_metrics(grasp),
        *_nudged(grasp),
    )


def _known_metrics(grasp: GraspResult) -> tuple[Quantity, ...]:
    metrics = [
        Quantity("dropped", _dropped(grasp), "", ""),
        Quantity("slip", _slip(grasp), "mm", f"largest while pulled; counts above {MILLI * SLIPPED:g} mm", 2),
        Quantity("spin", _spin(grasp), "degrees", f"likewise; above {math.degrees(SPUN):g} degrees", 2),
        Quantity(
            "rate of slip",
            MICRO * grasp.slip_rate,
            "um/s",
            f"while pulled; counts above {MICRO * CREEPS:g} um/s",
            2,
        ),
        Quantity(
            "rate of spin",
            math.degrees(grasp.spin_rate),
            "degrees/s",
            f"likewise; above {math.degrees(TURNS):g} degrees/s",
            3,
        ),
        Quantity(
            "slip in the whole time in the air", _slip_aloft(grasp), "mm", "from the lift on, until it lands", 2
        ),
        Quantity("spin in the whole time in the air", _spin_aloft(grasp), "degrees", "likewise", 2),
        Quantity("grip over the least", grasp.grip_ratio, "", "mean over mean, while pulled", 3),
        Quantity(
            "tightest", grasp.tightest, "", "smallest of that at any instant in the air; below 1 it slips", 3
        ),
        Quantity(
            "largest grip", grasp.largest_grip, "N", f"true, mean of the fingers, while pulled; {_COMMANDED}", 3
        ),
        *_growth(grasp),
        *_alarm_metrics(grasp),
        *_nudged(grasp),
    ]
    metrics += [
        Quantity(
            f"alarm after slip, finger {onset.finger + 1}",
            MILLI * onset.latency,
            "ms",
            _latency_note(onset.latency),
            3,
        )
        for onset in grasp.onsets
    ]
    return tuple(metrics)


def _growth(grasp: GraspResult) -> list[Quantity]:
    """How the grip grew while nothing pulled, and what that was for."""
    if grasp.planned.config.load != "none":
        return []
    note = f"last half second over the first; for zeros that wander up to {growth_in_hold(grasp.planned):.3g}"
    return [Quantity("grip growth in the hold", grasp.growth, "", note, 3)]


def _alarm_metrics(grasp: GraspResult) -> tuple[Quantity, ...]:
    pulled = len(grasp.pulled_alarms)
    return (
        Quantity("alarms while pulled", float(pulled), "", _alarm_criterion(grasp.planned.config)),
        Quantity(
            "other alarms",
            float(len(grasp.alarms) - pulled),
            "",
            _at(grasp.alarms_at(), "from the first touch to letting go"),
        ),
        Quantity(
            "times the grip was raised", float(grasp.regrips), "", _at(grasp.raised_at(), _why_raised(grasp))
        ),
    )


def compared(grasp: GraspResult) -> tuple[Quantity, ...]:
    """Return the metrics of the control that ignores spin, noted with those of this one; empty without it."""
    other = grasp.comparison
    if other is None:
        return ()
    return (
        Quantity("dropped, ignoring spin", _dropped(other), "", f"with spin {_dropped(grasp)}"),
        _beside("slip", _slip, grasp, other, "mm"),
        _beside("spin", _spin, grasp, other, "degrees"),
        _beside("slip in the air", _slip_aloft, grasp, other, "mm"),
        _beside("spin in the air", _spin_aloft, grasp, other, "degrees"),
        _beside("grip over the least", lambda each: each.grip_ratio, grasp, other, digits=3),
        _beside("tightest", lambda each: each.tightest, grasp, other, digits=3),
    )


def _beside(
    name: str,
    value: Callable[[GraspResult], float],
    own: GraspResult,
    other: GraspResult,
    unit: str = "",
    digits: int = 2,
) -> Quantity:
    with_spin = Quantity(name, value(own), unit, "", digits)
    note = f"with spin {with_spin.text} {unit}".rstrip()
    return Quantity(f"{name}, ignoring spin", value(other), unit, note, digits)


def _dropped(grasp: GraspResult) -> str:
    if grasp.dropped:
        return "yes"
    return f"no, but it {' and '.join(grasp.gave_way)}" if grasp.gave_way else "no"


def _slip(grasp: GraspResult) -> float:
    return round(MILLI * grasp.slip, DIGITS) if grasp.counted.any() else math.nan


def _spin(grasp: GraspResult) -> float:
    return round(math.degrees(grasp.spin), DIGITS) if grasp.counted.any() else math.nan


def _slip_aloft(grasp: GraspResult) -> float:
    return round(MILLI * grasp.slip_aloft, DIGITS) if grasp.aloft.any() else math.nan


def _spin_aloft(grasp: GraspResult) -> float:
    return round(math.degrees(grasp.spin_aloft), DIGITS) if grasp.aloft.any() else math.nan


def _at(counts: dict[GraspStage, int], note: str) -> str:
    """A note, and at what stages that was; while it is set down, the table pushes at what lands."""
    names = {GraspStage.SET_DOWN: "set down, where the table pushes"}
    where = ", ".join(f"{count} at {names.get(stage, stage.value)}" for stage, count in counts.items())
    return f"{note}: {where}" if where else note


def _nudged(grasp: GraspResult) -> list[Quantity]:
    """What a nudge found: the mean over the fingers, against the truth."""
    true, found = grasp.planned.true, grasp.nudged
    if not found:
        return []
    frictions = [each.friction for each in found if each.friction is not None]
    lengths = [MILLI * each.spin_length for each in found if each.spin_length is not None]
    e = MILLI * true.spin_length_at(NUDGING_GRIP)
    mu_off = OF_FRICTION * true.friction
    at = f"at {NUDGING_GRIP:g} N"
    mu_note, e_note = f"true {true.friction:.3g}", f"true {e:.3g} mm {at}"
    if not grasp.truth_known:
        mu_note, e_note = NOT_KNOWN, f"{at}; {NOT_KNOWN}"
    return [
        _found("mu, by the nudge", frictions, mu_off, "", mu_note),
        _found("e, by the nudge", lengths, MILLI * OF_SPIN_LENGTH, "mm", e_note),
    ]


def _found(name: str, values: list[float], off: float, unit: str, true: str) -> Quantity:
    if not values:
        return Quantity(name, math.nan, unit, f"nothing slipped: the lower bound is planned with; {true}")
    value = fmean(values)
    return Quantity(name, value, unit, f"as nudges err: {value - off:.3g} to {value + off:.3g}; {true}", 3)


def _alarm_criterion(config: GraspConfig) -> str:
    if config.ignores_spin:
        return "nobody listens to a grip that ignores spin"
    ripple = ", or a finger's load follows the ripple of its grip" if config.known == "untouched" else ""
    return f"what hangs falls, or rises with the grip{ripple}"


def _why_raised(grasp: GraspResult) -> str:
    if grasp.planned.config.ignores_spin:
        return "there are no alarms"
    return "for an alarm, and again while it goes on; in the whole run"


def _latency_note(latency: float) -> str:
    if math.isnan(latency):
        return "no alarm"
    return "before it slipped" if latency < 0.0 else "after the truth"
