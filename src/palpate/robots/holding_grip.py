"""The least grip with which fingertips hold an object while another finger presses on it."""

from collections.abc import Sequence

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp import GraspContacts, GraspForceOptimizer, SolveStatus
from palpate.sim.fidelity import GRAVITY
from palpate.spatial import Vector

MARGIN = 1.25
"""Of the grip over the least one: friction is known to some 10 %, and forces overshoot."""


def least_grip(
    points: Sequence[Vector],
    friction: float,
    spin_length: float,
    weight: Vector,
    pushes: Sequence[tuple[Vector, Vector]],
) -> float:
    """Return the largest normal force [N] that any fingertip needs for the worst of some pushes.

    Args:
        points: Where fingertips touch the object, its frame [m]; they press towards their middle.
        friction: Coulomb coefficient.
        spin_length: Largest spin torque over friction and normal force [m].
        weight: Of the object, its frame [N].
        pushes: Forces [N], and where they act [m].

    Raises:
        InvalidValueError: No grip holds one of them.
    """
    contacts = np.array(points)
    frames = [_frame(normal) for normal in contacts.mean(axis=0) - contacts]
    optimizer = GraspForceOptimizer(GraspContacts(contacts, np.array(frames), friction, spin_length))
    worst = 0.0
    for force, at in pushes:
        load = np.array([*np.add(weight, force), *np.cross(at, force)])
        found = optimizer.solve(load)
        if found.status is not SolveStatus.SOLVED:
            raise InvalidValueError(
                f"no grip of these fingers holds a push of {np.round(force, 2).tolist()} N at "
                f"{np.round(at, 4).tolist()} m (object's frame): press less, nearer to the line of the "
                "fingers, or hold with more of them"
            )
        worst = max(worst, float(found.forces[:, 0].max()))
    return worst


def pushes_at(at: Vector, force: float, friction: float) -> list[tuple[Vector, Vector]]:
    """Return what a fingertip may exert that presses down at a point [m] with a force [N] and rubs any way."""
    rubbing = friction * force
    aside = ((0.0, 0.0), (rubbing, 0.0), (-rubbing, 0.0), (0.0, rubbing), (0.0, -rubbing))
    return [((x, y, -force), at) for x, y in aside]


def weight_of(mass: float) -> Vector:
    """Return the weight of an object that hangs below the palm, z of its frame down [N]."""
    return (0.0, 0.0, mass * GRAVITY)


def _frame(along: FloatArray) -> FloatArray:
    """Columns n, t1, t2."""
    n = along / np.linalg.norm(along)
    side = np.eye(3)[int(np.abs(n).argmin())]
    t = np.cross(n, side)
    t /= np.linalg.norm(t)
    return np.column_stack([n, t, np.cross(n, t)]).astype(np.float64)
