"""The touch with the largest expected information about the material.

The information that a touch is expected to bring is the mutual information of the material, a stranger included,
and the logarithm y that will be measured, a mixture of normals (MacKay 1992):

    I = sum_k w_k E_k[ln N(y; m_k, V_k) - ln sum_j w_j N(y; m_j, V_j)],

by the trapezoidal rule. m_k and V_k are of this specimen as the touches so far have it, the
scatter of a touch and the sensor's errors included: so a light twist tells less than a firm one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.special import logsumexp

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.friction.materials.recognition import Recognition, RecognitionOutcome
from palpate.friction.materials.touch_evidence import STROKE_ROW, twist_row
from palpate.friction.materials.touch_sums import speed_shifts
from palpate.friction.rubbing.estimate import SensorErrors
from palpate.friction.rubbing.stroke_plan import PlannedSlip

MIN_BITS = 0.01
"""Of a touch that is worth making: at 20 materials alike it would take hundreds of them."""

STROKE_TIME, SAMPLES = 0.5, 250
"""[s] of a stroke there, or back, and its samples at 500 Hz."""

_NODES = np.linspace(-6.0, 6.0, 81)
"""Of every normal, in its standard deviations: so broad ones have nodes also where narrow ones lie."""


class Advice(Enum):
    """Whether to touch again."""

    TOUCH = "touch"
    """It tells something."""
    RECOGNISED = "recognised"
    """Enough: the material is known."""
    UNKNOWN = "unknown"
    """Enough: no material of the library fits, and touches cannot tell which of them it is."""
    NOTHING_TELLS = "nothing tells"
    """None of the touches that were considered tells the remaining materials apart."""


@dataclass(frozen=True, slots=True)
class TouchAdvice:
    """What to do next.

    Attributes:
        advice: Whether to touch again, or why not.
        slip: The most telling touch; None if `advice` is another than TOUCH.
        bits: Information expected of every candidate, in their order.
    """

    advice: Advice
    slip: PlannedSlip | None
    bits: tuple[float, ...]


def candidate_touches(
    forces: Sequence[float], speeds: Sequence[float], spins: Sequence[float]
) -> tuple[PlannedSlip, ...]:
    """Return a stroke of every speed [m/s] and a twist of every spin [rad/s] at every normal force [N]."""
    strokes = [PlannedSlip(force, speed, 0.0) for force in forces for speed in speeds]
    return *strokes, *(PlannedSlip(force, 0.0, spin) for force in forces for spin in spins)


def next_touch(found: Recognition, candidates: Sequence[PlannedSlip]) -> TouchAdvice:
    """Return the touch that tells most, or that there have been enough.

    Args:
        found: What the touches so far say; without any, what the prior does.
        candidates: Strokes and twists that finger and object bear, see `candidate_touches`.

    Raises:
        InvalidValueError: There is no candidate, or one that both slides and spins.
    """
    if not candidates:
        raise InvalidValueError("0 candidates: must be at least one stroke or twist")
    bits = tuple(expected_bits(found, slip) for slip in candidates)
    if found.outcome is not RecognitionOutcome.UNDECIDED:
        return TouchAdvice(Advice[found.outcome.name], None, bits)
    best = int(np.argmax(bits))
    if bits[best] < MIN_BITS:
        return TouchAdvice(Advice.NOTHING_TELLS, None, bits)
    return TouchAdvice(Advice.TOUCH, candidates[best], bits)


def expected_bits(found: Recognition, slip: PlannedSlip, errors: SensorErrors | None = None) -> float:
    """Return the information about the material that one touch is expected to bring [bit].

    Args:
        found: What is known so far.
        slip: A stroke or a twist.
        errors: Of the sensor; those of the Nano17 class if not given.

    Raises:
        InvalidValueError: It both slides and spins, or neither.
    """
    positive("normal_force", slip.normal_force, "N")
    if (slip.speed > 0.0) == (slip.spin > 0.0):
        raise InvalidValueError(
            f"speed = {slip.speed:g} m/s and spin = {slip.spin:g} rad/s: one must be above 0, the other 0"
        )
    known = found.known
    h = np.array(STROKE_ROW if slip.spin == 0.0 else twist_row(slip.normal_force))
    mean = known.mean @ h + speed_shifts(found.library, slip.speed, slip.spin, slip.normal_force)
    variance = np.einsum("a,kab,b->k", h, known.covariance, h) + known.scatter @ h**2
    variance += touch_error(slip, np.exp(mean), errors or SensorErrors()) ** 2
    weights = np.append((1.0 - found.stranger) * found.posterior, found.stranger)
    return _mutual_information(weights, mean, variance) / math.log(2.0)


def touch_error(slip: PlannedSlip, ratio: FloatArray, errors: SensorErrors) -> FloatArray:
    """Return the standard deviation of what the sensor says of a touch there and back, relative.

    Args:
        slip: A stroke or a twist.
        ratio: mu, or mu e [m], of any shape.
        errors: Of the sensor.
    """
    force, noise, drift = slip.normal_force, errors.force_noise, errors.force_drift
    if slip.spin > 0.0:
        noise, drift = errors.moment_noise, errors.moment_drift
    of_load = math.hypot(noise / math.sqrt(2 * SAMPLES), 0.5 * drift * STROKE_TIME) / (ratio * force)
    shared = math.hypot(errors.calibration, errors.force_zero / force)
    return np.asarray(np.hypot(of_load, shared))


def _mutual_information(weights: FloatArray, mean: FloatArray, variance: FloatArray) -> float:
    """Of which normal, and a sample of it [nat]; k normals."""
    likely = weights > 0.0
    w, m, sd = weights[likely], mean[likely], np.sqrt(variance[likely])
    y = np.unique(m + sd * _NODES[:, None])[:, None]
    own = -0.5 * ((y - m) / sd) ** 2 - np.log(math.sqrt(2.0 * math.pi) * sd)
    mixture = logsumexp(own + np.log(w), axis=1, keepdims=True)
    return max(0.0, float(np.trapezoid((w * np.exp(own) * (own - mixture)).sum(axis=1), y[:, 0])))
