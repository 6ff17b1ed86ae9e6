"""What a guard watches in what was sensed: each condition is a pure function of this and the last observation."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from sys import float_info
from typing import Protocol, runtime_checkable

import numpy as np

from palpate.runtime.data import Observation
from palpate.runtime.supervision import observed_row as row
from palpate.runtime.supervision.bounds import Bound, BoundChecks, Measure, rotation_error
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.runtime.supervision.observed_row import RowLayout, row_of
from palpate.spatial import Vector

Told = Callable[[Observation, Observation | None], Violation]
"""Words of a `Bound`."""


class Condition(Protocol):
    """Something that should hold."""

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """Return what is wrong, if anything; `before` is the last observation, None at first."""
        ...


@runtime_checkable
class Bounded(Condition, Protocol):
    """A condition that bounds numbers of `observed_row`: the supervisor watches all of these in one compiled pass.

    Its `broken` is `broken_by_bounds`, for whoever asks once.
    """

    def bounds(self, layout: RowLayout) -> tuple[Bound[Observation], ...] | None:
        """Return what it says of observations of a layout; None: only `broken` says it, in every period."""
        ...


def broken_by_bounds(condition: Bounded, now: Observation, before: Observation | None) -> Violation | None:
    """Return what is wrong by a condition's bounds, if anything."""
    given = row_of(now, before)
    bounds = BoundChecks([condition.bounds(given.layout) or ()])
    return bounds.broken(0, given.values, now, before, before is not None)


LARGEST_JOINT = 1e3
"""[rad or m], as of limits in robot files: 160 turns, or a number in another unit."""

ROTATION_TOLERANCE = 1e-5
"""Of products of a rotation's rows: ten times what single precision leaves."""


@dataclass(frozen=True, slots=True)
class PossibleState:
    """The state of the arm, its joints, its force and every wrench are finite numbers, and can be at all."""

    def bounds(self, layout: RowLayout) -> tuple[Bound[Observation], ...]:
        """See `Bounded`."""
        return tuple(self._each(layout))

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        return broken_by_bounds(self, now, before)

    def _each(self, layout: RowLayout) -> Iterator[Bound[Observation]]:
        yield from _finite(range(row.POSITION, row.TURN + 3), "arm state")
        yield Bound(row.ROTATION, _no_rotation, 0.0, ROTATION_TOLERANCE, measure=Measure.ROTATION_ERROR)
        for i in range(layout.joints):
            yield Bound(layout.joint(i), partial(_joint, "arm", i), -LARGEST_JOINT, LARGEST_JOINT)
        for i in range(layout.hand_joints):
            place = layout.joint(layout.joints + i)
            yield Bound(place, partial(_joint, "hand", i), -LARGEST_JOINT, LARGEST_JOINT)
        force = range(row.ARM_FORCE, row.ARM_FORCE + 3)
        yield from _finite(force, "force that the arm measures", row.HAS_ARM_FORCE)
        for i, place in enumerate(layout.each_finger(row.FORCE)):
            yield from _finite(range(place, place + 6), f"wrench of finger {i + 1}")


def _finite(places: range, what: str, where: int | None = None) -> Iterator[Bound[Observation]]:
    finding = Violation(what, "not finite", "finite numbers", Cause.DEVICE)
    for place in places:
        yield Bound(place, lambda now, before: finding, -float_info.max, float_info.max, where=where)


def _no_rotation(now: Observation, before: Observation | None) -> Violation:
    error = rotation_error(np.array(now.arm.rotation_base_tip).ravel())
    by, most = f"no rotation by {error:.3g}", f"{ROTATION_TOLERANCE:g}"
    return Violation("rotation of the tip", by, most, Cause.DEVICE)


def _joint(device: str, index: int, now: Observation, before: Observation | None) -> Violation:
    joints = now.arm.joint_position if device == "arm" or now.hand is None else now.hand.joint_position
    limit = f"-{LARGEST_JOINT:g} to {LARGEST_JOINT:g} rad or m"
    what = f"position of joint {index + 1} of the {device}"
    return Violation(what, f"{joints[index]:.6g}", limit, Cause.DEVICE)


@dataclass(frozen=True, slots=True)
class HealthySensors:
    """Every force/torque sensor can be believed: it is not frozen, stuck, drifting, or talking nonsense."""

    def bounds(self, layout: RowLayout) -> tuple[Bound[Observation], ...]:
        """See `Bounded`."""
        return _healthy(layout.each_finger(row.FAULTY), "a healthy sensor", Cause.DEVICE)

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        return broken_by_bounds(self, now, before)


@dataclass(frozen=True, slots=True)
class SensorsInRange:
    """No force/torque sensor is saturated or bears more than it is made for."""

    def bounds(self, layout: RowLayout) -> tuple[Bound[Observation], ...]:
        """See `Bounded`."""
        return _healthy(layout.each_finger(row.OVERLOADED), "a load within its range", Cause.FORCE)

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        return broken_by_bounds(self, now, before)


def _healthy(places: range, wanted: str, cause: Cause) -> tuple[Bound[Observation], ...]:
    def told(index: int, now: Observation, before: Observation | None) -> Violation:
        return Violation(f"force/torque sensor {index + 1}", str(now.fingers[index].health), wanted, cause)

    return tuple(Bound(place, partial(told, i), 0.0, 0.0) for i, place in enumerate(places))


@dataclass(frozen=True, slots=True)
class InsideWorkspace:
    """The tip stays in a box of the base frame [m]."""

    lower: Vector
    upper: Vector

    def bounds(self, layout: RowLayout) -> tuple[Bound[Observation], ...]:
        """See `Bounded`."""
        axes = enumerate(zip(self.lower, self.upper, strict=True))
        return tuple(Bound(row.POSITION + i, self._told, low, high) for i, (low, high) in axes)

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        return broken_by_bounds(self, now, before)

    def _told(self, now: Observation, before: Observation | None) -> Violation:
        x, y, z = now.arm.position_base_tip
        limit = f"between {self.lower} m and {self.upper} m"
        return Violation("tip position", f"({x:.4f}, {y:.4f}, {z:.4f}) m", limit, Cause.MOTION)


@dataclass(frozen=True, slots=True)
class InsideJointRange:
    """Every joint of the arm stays in its range [rad or m]."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def bounds(self, layout: RowLayout) -> tuple[Bound[Observation], ...]:
        """See `Bounded`."""
        count = len(self.lower)
        if layout.joints != count:
            return (Bound(row.JOINTS, self._miscounted, count, count),)
        ranges = enumerate(zip(self.lower, self.upper, strict=True))
        return tuple(Bound(layout.joint(i), partial(self._told, i), low, high) for i, (low, high) in ranges)

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        return broken_by_bounds(self, now, before)

    def _miscounted(self, now: Observation, before: Observation | None) -> Violation:
        joints, limit = len(now.arm.joint_position), f"the {len(self.lower)} that are limited"
        return Violation("number of the arm's joints", str(joints), limit, Cause.DEVICE)

    def _told(self, index: int, now: Observation, before: Observation | None) -> Violation:
        q, limit = now.arm.joint_position[index], f"{self.lower[index]:g} to {self.upper[index]:g}"
        return Violation(f"position of joint {index + 1}", f"{q:.4f}", limit, Cause.MOTION)
