"""What a recognised surface lets one expect of the grasp that follows."""

from dataclasses import dataclass

import numpy as np

from palpate.friction.limit_surface import LARGEST_LOAD_EXPONENT, LimitSurface
from palpate.friction.materials.recognition import Answer, Recognition


@dataclass(frozen=True, slots=True)
class GraspSeed:
    """A limit surface to plan with, and how far the contact of the next touch may be off it.

    Attributes:
        surface: With mu of fast slip, the least that the surface ever has unless it grows with the speed.
        friction_deviation: Standard deviation of ln mu: 0.02 for 2 %.
        spin_length_deviation: Of ln c.
        load_exponent_deviation: Of gamma.
        norm_exponent_deviation: Of p.
    """

    surface: LimitSurface
    friction_deviation: float
    spin_length_deviation: float
    load_exponent_deviation: float
    norm_exponent_deviation: float


def grasp_seed(found: Recognition) -> GraspSeed:
    """Return what library and touches together say of the next contact with the same object.

    For each material the library's figures as the touches have corrected them for this specimen; over the
    materials, the mean by their posterior. Deviations hold what is not known of the specimen, the scatter of one
    more touch, and how far the materials differ. If the answer is UNKNOWN it is the touches alone, with what
    surfaces in general are like where they say nothing.
    """
    known = found.known
    weights = np.append(found.posterior, 0.0)
    if found.answer is Answer.UNKNOWN:
        weights = np.append(np.zeros_like(found.posterior), 1.0)
    mean = weights @ known.mean
    variances = np.diagonal(known.covariance, axis1=1, axis2=2) + known.scatter + (known.mean - mean) ** 2
    friction, spin_length, gamma, p = mean.tolist()
    deviations = np.sqrt(weights @ variances).tolist()
    surface = LimitSurface(
        float(np.exp(friction)),
        float(np.exp(spin_length)),
        min(max(gamma, 0.0), LARGEST_LOAD_EXPONENT),
        min(max(p, 1.0), 2.0),
    )
    return GraspSeed(surface, *deviations)
