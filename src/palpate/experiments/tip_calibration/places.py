"""From planned touches to poses of the tip: pure geometry with the current estimate of the tip."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from palpate.controllers.touch_sequence import TouchStep
from palpate.errors import FloatArray
from palpate.experiments.tip_calibration.known import PLATE_HALF, ROD_HALF, SPREAD
from palpate.sensing.tip_calibration import PlannedTouch, TargetKind, TouchTarget
from palpate.sensing.tip_calibration.targets import across
from palpate.sensing.tip_calibration.unknowns import TypedTip
from palpate.spatial import Matrix, Vector, as_vector

_GOLDEN_RATIO = 0.5 * (5.0**0.5 - 1.0)
"""Golden ratio: fractional parts of its multiples are spread most evenly (van der Corput and Weyl)."""

_SPARE_DISTANCE = 1e-3
"""Distance of the tip from targets beyond their uncertainty [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Approach:
    """Approach of touches.

    Attributes:
        tip: Current estimate of the tip.
        targets: Targets at their expected places.
        uncertain: Largest distance of a surface from its expected place [m].
        forces: Forces of each touch, one after the other [N].
    """

    tip: TypedTip
    targets: Sequence[TouchTarget]
    uncertain: float
    forces: tuple[float, ...]

    @property
    def clearance(self) -> float:
        """Distance from the standoff to the expected surface [m]."""
        return self.uncertain + _SPARE_DISTANCE

    @property
    def search_distance(self) -> float:
        """Largest distance of the search from the standoff [m]."""
        return self.clearance + self.uncertain

    def steps(self, touches: Sequence[PlannedTouch]) -> tuple[TouchStep, ...]:
        """Return the poses of the tip for each touch; touches of a plate or rod are spread over it."""
        numbers = [count() for _ in self.targets]
        return tuple(self._step(touch, next(numbers[touch.target])) for touch in touches)

    def _step(self, touch: PlannedTouch, number: int) -> TouchStep:
        target, inward = self.targets[touch.target], touch.direction  # out of the tip, into the target
        position = touch.position + _spread(target, number) - self.clearance * inward
        return TouchStep(
            as_vector(position), _matrix(touch.rotation), as_vector(inward), self.forces, self._height(target)
        )

    def _height(self, target: TouchTarget) -> float:
        """Return the lowest z of the tip frame's origin at which no turned tip reaches the target [m]."""
        rise = {
            TargetKind.PLANE: float(PLATE_HALF[0] * np.linalg.norm(target.unit[:2])),
            TargetKind.LINE: float(ROD_HALF * abs(target.unit[2])),
            TargetKind.POINT: 0.0,
        }
        return target.place[2] + target.radius + rise[target.kind] + self.reach + self.clearance

    @property
    def reach(self) -> float:
        """Largest distance of the tip from the tip frame's origin [m]."""
        normals = np.concatenate([np.eye(3), -np.eye(3)])
        farthest = np.linalg.norm(tip_points(self.tip, normals) - self.tip.center, axis=1).max()
        return float(np.linalg.norm(self.tip.center) + farthest)


def tip_points(tip: TypedTip, normals: FloatArray) -> FloatArray:
    """Return the points of a tip with given outward normals, both shape (n, 3), sensor frame [m]."""
    sizes = np.tile(tip.shape.sizes, (len(normals), 1))
    _, x = tip.shape.support(sizes, normals @ tip.rotation)
    return np.asarray(x @ tip.rotation.T + tip.center)


def _spread(target: TouchTarget, number: int) -> FloatArray:
    """Return the offset of a touch along the flat directions of a target [m]."""
    reach, unit = SPREAD[target.kind], target.unit
    share = np.array([(number + 0.5) * _GOLDEN_RATIO, (number + 0.5) * _GOLDEN_RATIO**2]) % 1.0
    along, beside = 2.0 * reach * (share - 0.5)
    if target.kind is TargetKind.PLANE:
        return np.asarray(np.array([along, beside]) @ across(unit))
    return np.asarray(along * unit)


def _matrix(rotation: FloatArray) -> Matrix:
    a, b, c = (as_vector(row) for row in rotation)
    return (a, b, c)


def first_touches(
    tip: TypedTip, targets: Sequence[TouchTarget], force: float, turn: float
) -> tuple[PlannedTouch, ...]:
    """Return the first touches: they find the targets, and the tip roughly.

    Args:
        tip: Typed tip.
        targets: Targets at their expected places.
        force: Largest force of each touch [N].
        turn: Largest turn of the tip [rad]; 0 for a robot that cannot turn it.
    """
    return tuple(
        _touching(tip, i, target, rotation, inward, force)
        for i, target in enumerate(targets)
        for rotation, inward in _first(target, turn)
    )


def _first(target: TouchTarget, turn: float) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield orientations and directions of touches, base frame."""
    above = -target.unit if target.kind is TargetKind.PLANE else _across_line(target, _DOWN)
    for rotation in _rotations(_FIRST_TURN_SHARE * turn)[: _FIRST_COUNTS[target.kind]]:
        yield rotation, above
    if target.kind is not TargetKind.PLANE:
        sides = (_across_line(target, np.array(side)) for side in _SIDE_DIRECTIONS)
        for aside in sides:
            if aside.any():
                yield np.eye(3), (aside + above) / np.linalg.norm(aside + above)


def _touching(
    tip: TypedTip, i: int, target: TouchTarget, rotation: FloatArray, inward: FloatArray, force: float
) -> PlannedTouch:
    """Return the touch of a target along a direction."""
    normal = rotation.T @ inward
    (point,) = tip_points(tip, normal[None])
    position = np.array(target.place) - target.radius * inward - rotation @ point
    return PlannedTouch(i, rotation, normal, force, position)


_DOWN = np.array([0.0, 0.0, -1.0])

_FIRST_TURN_SHARE = 0.7
"""Turn of the first touches over the largest turn."""

_FIRST_COUNTS = {TargetKind.PLANE: 5, TargetKind.LINE: 3, TargetKind.POINT: 3}
"""Number of first touches from above, each with the tip turned differently."""

_SIDE_DIRECTIONS: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
"""Further directions, combined with downwards, in which the tip presses on rod and ball."""


def _across_line(target: TouchTarget, direction: FloatArray) -> FloatArray:
    """Return the unit part of a direction normal to a line, 0 near the line; for a point, the direction."""
    left = direction - (direction @ target.unit) * target.unit if target.kind is TargetKind.LINE else direction
    length = float(np.linalg.norm(left))
    return left / length if length > 0.5 * float(np.linalg.norm(direction)) else np.zeros(3)


def _rotations(turn: float) -> list[FloatArray]:
    """Return rotations: upright, and turned about x and y to either side."""
    c, s = np.cos(turn), np.sin(turn)
    about_x = [np.array([[1.0, 0.0, 0.0], [0.0, c, -e * s], [0.0, e * s, c]]) for e in (1.0, -1.0)]
    about_y = [np.array([[c, 0.0, e * s], [0.0, 1.0, 0.0], [-e * s, 0.0, c]]) for e in (1.0, -1.0)]
    return [np.eye(3), about_x[0], about_y[0], about_x[1], about_y[1]]
