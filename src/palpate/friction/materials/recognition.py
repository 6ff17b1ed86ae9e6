"""Which material of a library a touched surface is, or none of them.

The posterior is Bayes' (`palpate.friction.materials.touch_sums` has the likelihood); strangers have no place in
it, as nobody knows what else there is. Unknown is what no material fits, by tests that need no idea of it: of
where the touches lie together, of their scatter, and of what was borne without slip. The true material is refused
with at most the stated probability, each time one asks.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from scipy.special import logsumexp

from palpate.errors import FloatArray, InvalidValueError, not_negative
from palpate.friction.materials.library import MaterialLibrary
from palpate.friction.materials.touch_evidence import NeverSlipped, TouchEvidence
from palpate.friction.materials.touch_sums import Known, TouchSums

FALSE_REJECTION = 0.005
"""Probability of rejecting the true material: below the 1 % of wrong results allowed after 3 strokes."""

CALIBRATION = 0.003
"""Of the ratio of two loads on different axes, relative: as in `SensorErrors`."""

CONFIDENCE = 0.95
"""Posterior above which a material counts as recognised. At 2 % scatter that was right 97 to 100 % of the time."""

STRANGER_PRIOR = 0.1
"""Share of objects that are of no material of the library, for want of a better one."""


class RecognitionOutcome(Enum):
    """What the touches say."""

    RECOGNISED = "recognised"
    """One material, beyond doubt."""
    UNDECIDED = "undecided"
    """Several materials are still likely: touch again."""
    UNKNOWN = "unknown"
    """No material of the library fits."""


@dataclass(frozen=True, slots=True, eq=False)
class Recognition:
    """What touches say about which material it is; k materials.

    Attributes:
        library: Of materials.
        posterior: Probability of each, given that it is one of them, and not one that does not fit while another
            does; shape (k,).
        fit: Probability that touches of the material itself fit it no better, shape (k,).
        outcome: Decision that follows.
        stranger: Probability that it is none of them if one object in ten is; how sure, not what UNKNOWN goes by.
        known: Of the specimen, for each material and a stranger.
    """

    library: MaterialLibrary
    posterior: FloatArray
    fit: FloatArray
    outcome: RecognitionOutcome
    stranger: float
    known: Known = field(repr=False)

    @property
    def best(self) -> str:
        """Name of the likeliest material; of one that does not fit if the outcome is UNKNOWN."""
        return self.library.names[int(np.argmax(self.posterior))]


def recognise(
    library: MaterialLibrary,
    touches: Sequence[TouchEvidence | NeverSlipped],
    prior: Mapping[str, float] | None = None,
    *,
    false_rejection: float = FALSE_REJECTION,
    confidence: float = CONFIDENCE,
    calibration: float = CALIBRATION,
) -> Recognition:
    """Return what touches of one object say about its material.

    Args:
        library: Of materials.
        touches: In any order, all of the same object.
        prior: How likely each material was before, by name, in any unit; alike if not given. One that is left out
            is not considered.
        false_rejection: Probability of rejecting the true material, at every query.
        confidence: Posterior, strangers included, above which a material counts as recognised.
        calibration: Standard deviation of the sensor's error that all touches share, relative.

    Raises:
        InvalidValueError: A prior of materials that are not there, or a number out of range.
    """
    for name, value in (("false_rejection", false_rejection), ("confidence", confidence)):
        if not 0.0 < value < 1.0:
            raise InvalidValueError(f"{name} = {value!r}: must lie between 0 and 1")
    log_prior = _log_prior(library, prior)
    not_negative("calibration", calibration, "")
    sums = TouchSums.of(library, calibration, touches)
    known, fit = sums.known(), sums.fit()[:-1]
    log_posterior = log_prior + known.log_likelihood[:-1]
    fits = (fit >= false_rejection) & np.isfinite(log_posterior)
    if fits.any():
        log_posterior = np.where(fits, log_posterior, -np.inf)
    posterior = np.exp(log_posterior - logsumexp(log_posterior))
    stranger = _stranger(log_prior, known.log_likelihood)
    outcome = RecognitionOutcome.UNDECIDED
    if not fits.any():
        outcome = RecognitionOutcome.UNKNOWN
    elif (1.0 - stranger) * posterior.max() >= confidence:
        outcome = RecognitionOutcome.RECOGNISED
    return Recognition(library, posterior, fit, outcome, stranger, known)


def _stranger(log_prior: FloatArray, log_likelihood: FloatArray) -> float:
    """Posterior of a stranger."""
    of_library = float(logsumexp(log_prior + log_likelihood[:-1])) + math.log1p(-STRANGER_PRIOR)
    of_stranger = float(log_likelihood[-1]) + math.log(STRANGER_PRIOR)
    return math.exp(of_stranger - float(np.logaddexp(of_library, of_stranger)))


def _log_prior(library: MaterialLibrary, prior: Mapping[str, float] | None) -> FloatArray:
    names = library.names
    if prior is None:
        return np.full(len(names), -math.log(len(names)))
    for name, value in prior.items():
        if name not in names:
            raise InvalidValueError(f"prior of {name!r}: no such material; must be among {', '.join(names)}")
        not_negative(f"prior of {name!r}", value, "")
    weights = np.array([prior.get(name, 0.0) for name in names], dtype=np.float64)
    if not weights.sum() > 0.0:
        raise InvalidValueError("prior: at least one material must have a probability above 0")
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(weights / weights.max()) - np.log((weights / weights.max()).sum()))
