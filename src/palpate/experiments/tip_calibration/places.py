"""From a touch that tells much to where the tip goes for it: pure geometry with the tip as it is known so far."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from palpate.controllers.touch_sequence import TouchStep
from palpate.errors import FloatArray
from palpate.experiments.tip_calibration.bench import PLATE_HALF, ROD_HALF, SPREAD
from palpate.sensing.tip_calibration import PlannedTouch, Target, TargetKind
from palpate.sensing.tip_calibration.targets import across
from palpate.sensing.tip_calibration.unknowns import TypedTip
from palpate.spatial import Matrix, Vector, as_vector

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Multiples of it, without their whole part, are spread most evenly (van der Corput and Weyl)."""

SPARE = 2e-3
"""How much farther the tip stays off what it passes than it is uncertain [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Approach:
    """How touches are approached.

    Attributes:
        tip: As it is known.
        targets: Where they are thought to be.
        uncertain: How far a surface may be from where it is thought to be [m].
        forces: Of each touch, one after the other [N].
    """

    tip: TypedTip
    targets: Sequence[Target]
    uncertain: float
    forces: tuple[float, ...]

    @property
    def clearance(self) -> float:
        """From the standoff to where the surface is thought to be [m]."""
        return self.uncertain + SPARE

    @property
    def search_distance(self) -> float:
        """From the standoff on [m]."""
        return self.clearance + self.uncertain

    def steps(self, touches: Sequence[PlannedTouch]) -> tuple[TouchStep, ...]:
        """Return where the tip goes for each touch; those of a plate or rod are spread over it."""
        numbers = [count() for _ in self.targets]
        return tuple(self._step(touch, next(numbers[touch.target])) for touch in touches)

    def _step(self, touch: PlannedTouch, number: int) -> TouchStep:
        target, inward = self.targets[touch.target], touch.direction  # out of the tip, into the target
        position = touch.position + _spread(target, number) - self.clearance * inward
        return TouchStep(
            as_vector(position), _matrix(touch.rotation), as_vector(inward), self.forces, self._height(target)
        )

    def _height(self, target: Target) -> float:
        """Of the tip frame's origin, z from which no part of the tip reaches the target, however it turns [m]."""
        rise = {
            TargetKind.PLANE: float(PLATE_HALF[0] * np.linalg.norm(target.unit[:2])),
            TargetKind.LINE: float(ROD_HALF * abs(target.unit[2])),
            TargetKind.POINT: 0.0,
        }
        return target.place[2] + target.radius + rise[target.kind] + self.reach + self.clearance

    @property
    def reach(self) -> float:
        """How far the tip reaches from the tip frame's origin [m]."""
        normals = np.concatenate([np.eye(3), -np.eye(3)])
        farthest = np.linalg.norm(tip_points(self.tip, normals) - self.tip.center, axis=1).max()
        return float(np.linalg.norm(self.tip.center) + farthest)


def tip_points(tip: TypedTip, normals: FloatArray) -> FloatArray:
    """Return where a tip's outward normals are these, both shape (n, 3), sensor frame [m]."""
    sizes = np.tile(tip.shape.sizes, (len(normals), 1))
    _, x = tip.shape.support(sizes, normals @ tip.rotation)
    return np.asarray(x @ tip.rotation.T + tip.center)


def _spread(target: Target, number: int) -> FloatArray:
    """Offset of a touch along what of a target is flat [m]."""
    reach, unit = SPREAD[target.kind], target.unit
    share = np.array([(number + 0.5) * GOLDEN, (number + 0.5) * GOLDEN**2]) % 1.0
    along, beside = 2.0 * reach * (share - 0.5)
    if target.kind is TargetKind.PLANE:
        return np.asarray(np.array([along, beside]) @ across(unit))
    return np.asarray(along * unit)


def _matrix(rotation: FloatArray) -> Matrix:
    a, b, c = (as_vector(row) for row in rotation)
    return (a, b, c)


def first_touches(tip: TypedTip, targets: Sequence[Target], force: float, turn: float) -> tuple[PlannedTouch, ...]:
    """Return the touches that come first: they find the targets, and the tip roughly.

    Args:
        tip: As typed.
        targets: Where they are thought to be.
        force: Largest of each touch [N].
        turn: How far the tip may be turned [rad]; 0 for a robot that cannot.
    """
    return tuple(
        _touching(tip, i, target, rotation, inward, force)
        for i, target in enumerate(targets)
        for rotation, inward in _first(target, turn)
    )


def _first(target: Target, turn: float) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Orientations, and the directions of touches, base frame."""
    above = -target.unit if target.kind is TargetKind.PLANE else _across_line(target, DOWN)
    for rotation in _rotations(FIRST_SHARE * turn)[: FIRST[target.kind]]:
        yield rotation, above
    if target.kind is not TargetKind.PLANE:
        sides = (_across_line(target, np.array(side)) for side in SIDES)
        for aside in sides:
            if aside.any():
                yield np.eye(3), (aside + above) / np.linalg.norm(aside + above)


def _touching(
    tip: TypedTip, i: int, target: Target, rotation: FloatArray, inward: FloatArray, force: float
) -> PlannedTouch:
    """The touch of a target along a direction."""
    normal = rotation.T @ inward
    (point,) = tip_points(tip, normal[None])
    position = np.array(target.place) - target.radius * inward - rotation @ point
    return PlannedTouch(i, rotation, normal, force, position)


DOWN = np.array([0.0, 0.0, -1.0])

FIRST_SHARE = 0.7
"""Of how far the tip may be turned, it is for the first touches."""

FIRST = {TargetKind.PLANE: 5, TargetKind.LINE: 3, TargetKind.POINT: 3}
"""First touches from above, with the tip turned in so many ways."""

SIDES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
"""Directions towards which the tip presses on rod and ball besides, half downwards."""


def _across_line(target: Target, direction: FloatArray) -> FloatArray:
    """The part of a direction at right angles to a line, of length 1; 0 near the line. Of a point, it as it is."""
    left = direction - (direction @ target.unit) * target.unit if target.kind is TargetKind.LINE else direction
    length = float(np.linalg.norm(left))
    return left / length if length > 0.5 * float(np.linalg.norm(direction)) else np.zeros(3)


def _rotations(turn: float) -> list[FloatArray]:
    """Upright, and turned about x and y to either side."""
    c, s = np.cos(turn), np.sin(turn)
    about_x = [np.array([[1.0, 0.0, 0.0], [0.0, c, -e * s], [0.0, e * s, c]]) for e in (1.0, -1.0)]
    about_y = [np.array([[c, 0.0, e * s], [0.0, 1.0, 0.0], [-e * s, 0.0, c]]) for e in (1.0, -1.0)]
    return [np.eye(3), about_x[0], about_y[0], about_x[1], about_y[1]]
