"""Whether a grasp could hold anything, and which forces only squeeze."""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.certificates.support_function import BearableWrenches
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome

__all__ = ["Closure", "ForceClosure", "force_closure", "internal_forces"]

RANK = 1e-9
"""Singular values below this share of the largest count as zero, lengths and spins scaled."""

INSIDE = 1e-6
"""Strictly inside a cone: by this share of mu f_n, and of what presses least."""


class Closure(Enum):
    """Whether every load can be held by pressing hard enough."""

    CLOSED = "closed"
    """It can: `forces` press inside all cones and balance by themselves."""
    OPEN = "open"
    """It cannot: `certificate` names a load that nothing holds."""
    UNDECIDED = "undecided"
    """On the border within rounding: closed, if at all, with a millionth of friction to spare."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceClosure:
    """Force closure with soft fingers.

    Attributes:
        closure: The verdict.
        rank: Of the grasp map: how many components of a load are met at all.
        forces: If closed: internal forces strictly inside all cones, the least f_n 1 N, shape (n, 4) [N, N, N, N
            m].
        certificate: If open: unit load (6,), scaled, of which no part can be held: y . G w >= 0 for all w in the
            cones, and y . G is not 0 for all, or the rank is below 6.
    """

    closure: Closure
    rank: int
    forces: FloatArray | None
    certificate: FloatArray | None


def force_closure(grasp: GraspContacts) -> ForceClosure:
    """Return whether a grasp is closed, bounds of normal forces and actuators left aside.

    It is if and only if G has rank 6 and some internal force lies strictly inside all cones: then any load is
    balanced by any forces at all, plus as much of that internal force as brings them inside. A contact whose cone
    is not needed only adds to it. Found as the least squeeze with every f_n at least 1 N.

    Args:
        grasp: Any; e is taken at 1 N where it grows with the load.
    """
    endless = _cones_only(grasp)
    scaled = ScaledGrasp.of(endless)
    left, values, _ = np.linalg.svd(_scaled_map(scaled, grasp))
    rank = int((values > RANK * values[0]).sum())
    if rank < 6:
        return ForceClosure(Closure.OPEN, rank, None, _about_origin(left[:, rank], scaled))
    forces = np.zeros((len(grasp), 4))
    cones = replace(endless, friction=(1.0 - INSIDE) * grasp.friction, force_min=np.ones(len(grasp)))
    solver = LeastEffort(ScaledGrasp.of(cones), 0.01)
    outcome, _ = solver.solve(np.zeros(6), forces)
    if outcome == Outcome.SOLVED:
        return ForceClosure(Closure.CLOSED, rank, forces, None)
    y = _about_origin(solver.y, scaled)
    # y . G w >= 0 over every cone: nothing pulls against it
    pull = BearableWrenches.of(endless).pull(y)
    if outcome == Outcome.INFEASIBLE and pull.max() <= INSIDE * np.abs(scaled.rows).max():
        return ForceClosure(Closure.OPEN, rank, None, y)
    return ForceClosure(Closure.UNDECIDED, rank, None, None)


def internal_forces(grasp: GraspContacts) -> FloatArray:
    """Return a basis of the forces that balance by themselves, G w = 0, shape (4 n, 4 n - rank).

    Orthonormal in (f_n, f_t1, f_t2, tau / L), L the grasp's size, and given as (f_n, f_t1, f_t2, tau_n): columns
    of N, N, N, N m.
    """
    scaled = ScaledGrasp.of(grasp)
    _, values, right = np.linalg.svd(_scaled_map(scaled, grasp))
    rank = int((values > RANK * values[0]).sum())
    basis = right[rank:].T.copy()
    basis[3::4] *= scaled.length
    return basis


def _cones_only(grasp: GraspContacts) -> GraspContacts:
    n = len(grasp)
    return GraspContacts(grasp.positions, grasp.frames, grasp.friction, grasp.spin_length, np.zeros(n))


def _scaled_map(scaled: ScaledGrasp, grasp: GraspContacts) -> FloatArray:
    """G about the middle of the contacts, moments and torques over the unit of length."""
    moved = replace(grasp, positions=(grasp.positions - scaled.center) / scaled.length)
    return moved.grasp_map


def _about_origin(y: FloatArray, scaled: ScaledGrasp) -> FloatArray:
    """Return scaled multipliers as a unit vector that goes with wrenches about the object's origin."""
    out = scaled.multiplier(y)
    return out / float(np.linalg.norm(out))
