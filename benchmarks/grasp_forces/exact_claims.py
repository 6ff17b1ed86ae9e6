"""Whether what is claimed of a load is true of the numbers given, at 50 digits."""

import math
from dataclasses import dataclass
from enum import Enum

import mpmath
import numpy as np
from mpmath import mpf

from palpate.errors import FloatArray
from palpate.grasp import GraspContacts, GraspForceOptimizer, GraspForces, SolveStatus
from support.grasp_families import least_value

DIGITS = 50
BALANCED, WITHIN = 1e-8, 1e-9
"""What forces may leave, over load or preload; by how much they may be beyond limits, over the largest of them."""

NEAREST, FARTHEST = 14, 3
"""Decades below the load at which the boundary is looked for."""


class Claim(Enum):
    """What can be wrong with a result, or cannot."""

    TRUE = "true"
    FALSE_SOLVED = "false SOLVED"
    FALSE_INFEASIBLE = "false INFEASIBLE"
    FALSE_CERTIFICATE = "false certificates"
    UNDECIDED = "undecided"
    INVALID = "INVALID"


@dataclass(frozen=True, slots=True)
class Verdict:
    """A claim, and what is said against it."""

    claim: Claim
    why: str = ""


TRUE = Verdict(Claim.TRUE)


def judged(grasp: GraspContacts, load: FloatArray, result: GraspForces, factor: float | None) -> Verdict:
    """Judge a result of min_effort.

    Args:
        grasp: Contacts.
        load: Shape (6,) [N, N m].
        result: For that load.
        factor: By which the load could be larger, to 1e-6; None if nobody knows.
    """
    match result.status:
        case SolveStatus.SOLVED:
            if not np.isfinite(result.forces).all() or math.isnan(result.objective):
                return Verdict(Claim.FALSE_SOLVED, "forces or objective are not numbers")
            off, beyond = shortfall(grasp, load, result.forces)
            if not (off <= BALANCED and beyond <= WITHIN):
                return Verdict(Claim.FALSE_SOLVED, f"equilibrium off by {off:.1e}, limits by {beyond:.1e}")
            return TRUE if factor is None or factor > 1.0 - 1e-6 else Verdict(Claim.FALSE_SOLVED, f"{factor=}")
        case SolveStatus.INFEASIBLE:
            if factor is not None and factor > 1.0 + 1e-6:
                return Verdict(Claim.FALSE_INFEASIBLE, f"{factor=}")
            if result.certificate is None or result.reach is None:
                return Verdict(Claim.FALSE_CERTIFICATE, "none")
            reach = mpf(min(result.reach, 1e300)) * mpf("0.999")
            proven = least_value(grasp, load, result.certificate, reach) > 0
            return TRUE if proven else Verdict(Claim.FALSE_CERTIFICATE, "proves nothing")
        case SolveStatus.INVALID:
            return Verdict(Claim.INVALID)
    return Verdict(Claim.UNDECIDED)


def shortfall(grasp: GraspContacts, load: FloatArray, forces: FloatArray) -> tuple[float, float]:
    """Return what forces leave of a load, over load or preload, and by how much they are beyond limits.

    Moments are about the middle of the contacts, over the distance of the farthest, or the largest e.
    """
    with mpmath.workdps(DIGITS):
        n = len(grasp)
        center = [mpmath.fsum(map(mpf, column)) / n for column in grasp.positions.T]
        arms = [[mpf(a) - b for a, b in zip(place, center, strict=True)] for place in grasp.positions]
        length = max(max(mpmath.norm(arm) for arm in arms), mpf(max(grasp.spin_length)))
        force, moment = [mpf(each) for each in load[:3]], [mpf(each) for each in load[3:]]
        moment = [a - b for a, b in zip(moment, _cross(center, force), strict=True)]
        size = max(*map(abs, force), *(abs(each) / length for each in moment), mpf(max(grasp.force_min)))
        size = size if size > 0 else mpf(1)
        beyond, largest = mpf(0), size
        for i, (f, a, b, spin) in enumerate([mpf(each) for each in row] for row in forces):
            normal, t1, t2 = ([mpf(each) for each in column] for column in grasp.frames[i].T)
            pushed = [f * p + a * q + b * r for p, q, r in zip(normal, t1, t2, strict=True)]
            force = [p + q for p, q in zip(force, pushed, strict=True)]
            turned = _cross(arms[i], pushed)
            moment = [p + q + spin * r for p, q, r in zip(moment, turned, normal, strict=True)]
            side = mpmath.norm([a, b, spin / mpf(grasp.spin_length[i])])
            over = [side - mpf(grasp.friction[i]) * f, mpf(grasp.force_min[i]) - f]
            if math.isfinite(grasp.force_max[i]):
                over.append(f - mpf(grasp.force_max[i]))
            beyond, largest = max(beyond, *over), max(largest, f)
        off = max(*map(abs, force), *(abs(each) / length for each in moment))
        return float(off / size), float(beyond / largest)


def _cross(a: list[mpf], b: list[mpf]) -> list[mpf]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def from_boundary(grasp: GraspContacts, load: FloatArray) -> float:
    """Return how far a load is at most from where it can just be held, over its size; infinite if nobody knows.

    A share less is held by forces, and a share more is not, by a certificate, both at 50 digits.
    """
    optimizer = GraspForceOptimizer(grasp)
    for decade in range(NEAREST, FARTHEST - 1, -1):
        for base in (1.0, 2.0, 5.0):
            share = base * 10.0**-decade
            pair = [(load * (1.0 + sign * share)) for sign in (-1.0, 1.0)]
            ends = [optimizer.solve(each, warm_start=False) for each in pair]
            if {each.status for each in ends} == {SolveStatus.SOLVED, SolveStatus.INFEASIBLE} and all(
                judged(grasp, each, end, None) == TRUE for each, end in zip(pair, ends, strict=True)
            ):
                return share
    return math.inf
