"""Metrics of a force regulation, the most important first; imports nothing heavy."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from palpate.experiments.kit.metric import Metric

if TYPE_CHECKING:
    from palpate.experiments.regulate.result import RegulationResult


def _judged(result: "RegulationResult") -> str:
    return "true" if result.truth.known else "felt"


def _rise_note(result: "RegulationResult") -> str:
    from palpate.experiments.regulate.response import RISE_FROM, RISE_TO

    return f"from {100.0 * RISE_FROM:g} to {100.0 * RISE_TO:g} % of the mean step, {_judged(result)} force"


def _overshoot_note(result: "RegulationResult") -> str:
    steps = result.judged_steps
    return "" if steps is None else f"beyond the step's height; worst step {100.0 * steps.largest_overshoot:.2g} %"


def _settling_note(result: "RegulationResult") -> str:
    from palpate.experiments.regulate.response import SETTLING_BAND

    return f"until it stays within {100.0 * SETTLING_BAND:g} % of the step's height"


def _bandwidth_note(result: "RegulationResult") -> str:
    return f"{_judged(result)} per set amplitude first below 0.707 (-3 dB)"


def _rms_note(result: "RegulationResult") -> str:
    moving = result.planned.config.profile in ("step", "sine")
    return "changes of the set force included" if moving else "first half second left out"


def _landing_note(result: "RegulationResult") -> str:
    return f"at {1e3 * result.planned.parameters.landing_speed:.3g} mm/s"


def _bounce_note(result: "RegulationResult") -> str:
    times = result.bounces
    return f"bounced {times} time{'s' if times > 1 else ''} on landing" if times else ""


def _sensor_error(result: "RegulationResult") -> float:
    error = result.sensor_error
    return 0.0 if abs(error) < 1e-9 else error  # a perfect sensor leaves rounding errors


def _known(value: "Callable[[RegulationResult], float]") -> "Callable[[RegulationResult], bool]":
    """Return whether a true value is known, or a robot hides it; False if a simulated tip never held a force."""
    return lambda result: not result.truth.known or not math.isnan(value(result))


def _of_steps(
    key: str,
    meaning: str,
    unit: str,
    value: Callable[[Any], float],
    shown_unit: str,
    digits: int,
    note: "Callable[[RegulationResult], str]",
) -> Metric:
    """Return a metric of the step response; only runs with steps have it."""
    return Metric(
        key,
        meaning,
        unit,
        lambda result: value(result.judged_steps),
        shown_unit,
        digits,
        note,
        applies=lambda result: result.judged_steps is not None,
    )


def _of_tones(
    key: str,
    meaning: str,
    unit: str,
    value: Callable[[Any], float | None],
    note: "str | Callable[[RegulationResult], str]" = "",
) -> Metric:
    """Return a metric of the frequency response; only runs with sines have it."""
    return Metric(
        key,
        meaning,
        unit,
        lambda result: value(result.judged_tones),
        digits=3,
        note=note,
        applies=lambda result: result.judged_tones is not None,
    )


METRICS = (
    _of_steps("rise_time_s", "rise time", "s", lambda steps: steps.rise_time, "ms", 3, _rise_note),
    _of_tones("bandwidth_hz", "bandwidth", "Hz", lambda tones: tones.bandwidth, _bandwidth_note),
    _of_tones(
        "bandwidth_least_hz",
        "bandwidth, at least",
        "Hz",
        lambda tones: float(tones.frequency[-1]) if tones.bandwidth is None else None,
        _bandwidth_note,
    ),
    _of_steps(
        "overshoot",
        "overshoot",
        "",
        lambda steps: steps.overshoot,
        "%",
        2,
        _overshoot_note,
    ),
    Metric(
        "force_rms_n",
        "true force, RMS error",
        "N",
        lambda result: result.true_rms,
        digits=3,
        note=_rms_note,
        needs_truth=True,
        applies=_known(lambda result: result.true_rms),
    ),
    Metric(
        "landing_max_n",
        "largest force of landing",
        "N",
        lambda result: result.landing_peak,
        digits=3,
        note=_landing_note,
        needs_truth=True,
        applies=_known(lambda result: result.landing_peak),
    ),
    Metric("sensed_rms_n", "felt force, RMS error", "N", lambda result: result.sensed_rms, digits=3),
    Metric(
        "force_max_n",
        "largest force of the run",
        "N",
        lambda result: result.peak,
        digits=3,
        note=lambda result: f"limit {result.planned.limits.force:g} N",
    ),
    Metric(
        "sensor_error_n",
        "felt less true force at the end",
        "N",
        _sensor_error,
        digits=3,
        note="error of the sensor",
        needs_truth=True,
        applies=_known(_sensor_error),
    ),
    _of_steps("settling_time_s", "settling time", "s", lambda steps: steps.settling_time, "ms", 3, _settling_note),
    _of_tones("largest_ratio", "largest amplitude ratio", "", lambda tones: tones.peak),
    Metric("contact", "contact", "", lambda result: result.loss.value, note=_bounce_note),
    Metric("bounces", "bounces on landing", "", lambda result: result.bounces, in_table=False),
    Metric(
        "gain_halved",
        "gain halved",
        "",
        lambda result: result.guard_trips,
        "times",
        note="because force control oscillated",
    ),
    Metric("simulated_s", "time of the run", "s", lambda result: result.run.duration),
)
