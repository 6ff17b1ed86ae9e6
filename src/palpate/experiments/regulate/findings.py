"""Findings of a force regulation: statements and remedies; imports nothing heavy."""

import math
from typing import TYPE_CHECKING

from palpate.experiments.kit.metric import Finding

if TYPE_CHECKING:
    from palpate.experiments.regulate.result import RegulationResult

MIN_GAIN_MARGIN = 2.0
"""Gain margin below which a loop is closer to oscillation than usual (6 dB)."""

MAX_SENSOR_ERROR_DEVIATIONS = 5.0
"""Standard errors by which felt and true force may differ before the sensor counts as drifted."""

MAX_SENSOR_ERROR_SHARE = 0.01
"""Difference of felt and true force, relative to the set force, before the sensor counts as drifted."""


def _over_limit(result: "RegulationResult") -> bool:
    return result.peak > result.planned.limits.force


def _over_limit_sentence(result: "RegulationResult") -> str:
    force, limit = "true" if result.truth.known else "felt", result.planned.limits.force
    return f"The {force} force went up to {result.peak:.3g} N, beyond the limit of {limit:g} N."


def _drifted(result: "RegulationResult") -> bool:
    allowed = max(
        MAX_SENSOR_ERROR_DEVIATIONS * result.sensor_error_sd,
        MAX_SENSOR_ERROR_SHARE * result.planned.config.force,
    )
    return result.truth.known and abs(result.sensor_error) > allowed


def _small_margin(result: "RegulationResult") -> bool:
    margin = result.planned.parameters.gain.gain_margin
    return math.isfinite(margin) and margin < MIN_GAIN_MARGIN


FINDINGS = (
    Finding(
        _over_limit,
        _over_limit_sentence,
        "The force exceeded its limit: land more slowly (--landing-speed), or press less.",
    ),
    Finding(
        lambda result: result.every > 1,
        lambda result: f"Metrics cover every {result.every}th period, without responses: no log has all periods.",
    ),
    Finding(
        lambda result: result.guard_trips,
        lambda result: (
            f"Force control oscillated and continued with {0.5**result.guard_trips:g} of its gain: stiffness or "
            "delay differ from the assumed values; --identify measures them."
        ),
        lambda result: (
            ""
            if result.planned.config.identify
            else "Force control oscillated: repeat with --identify, which measures stiffness and delay."
        ),
    ),
    Finding(
        _small_margin,
        remedy=lambda result: (
            f"The gain margin of {result.planned.parameters.gain.gain_margin:.2g} is small: a stiffer "
            "--assumed-stiffness lowers the gain."
        ),
    ),
    Finding(
        _drifted,
        lambda result: (
            f"At the end the sensor showed {result.sensor_error:+.3f} N that was not there: the felt force was "
            "held, not the true force."
        ),
    ),
)
