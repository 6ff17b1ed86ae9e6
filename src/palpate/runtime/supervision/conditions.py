"""What a guard watches in what was sensed: each condition is a pure function of this and the last observation."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from palpate.runtime.data import Observation
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.sensing.ft.health import HEALTHY, HealthCheck
from palpate.spatial import Vector


class Condition(Protocol):
    """Something that should hold."""

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """Return what is wrong, if anything; `before` is the last observation, None at first."""
        ...


@dataclass(frozen=True, slots=True)
class MonitoredQuantity:
    """A number with a name.

    Attributes:
        name: For people.
        unit: Of the number.
        of: Takes it from an observation; not finite counts as out of bounds.
        cause: What has to be seen to where it is out of bounds.
        remark: What an observation that is out of bounds shows besides; begins with a separator, or is empty.
    """

    name: str
    unit: str
    of: Callable[[Observation], float]
    cause: Cause = Cause.OTHER
    remark: Callable[[Observation], str] = lambda _: ""


@dataclass(frozen=True, slots=True)
class AtMost:
    """A measure stays at or below a limit."""

    measure: MonitoredQuantity
    limit: float

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        value = self.measure.of(now)
        if value <= self.limit:
            return None
        unit, remark = self.measure.unit, self.measure.remark(now)
        limit = f"{self.limit:g} {unit}{remark}"
        return Violation(self.measure.name, f"{value:.4g} {unit}", limit, self.measure.cause)


LARGEST_JOINT = 1e3
"""[rad or m], as of limits in robot files: 160 turns, or a number in another unit."""

ROTATION_TOLERANCE = 1e-5
"""Of products of a rotation's rows: ten times what single precision leaves."""


@dataclass(frozen=True, slots=True)
class PossibleState:
    """The state of the arm, its joints, its force and every wrench are finite numbers, and can be at all."""

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        arm = now.arm
        row0, row1, row2 = arm.rotation_base_tip
        # a sum is finite unless one of its terms is not, or they overflow, which is no better
        total = sum(arm.position_base_tip) + sum(arm.velocity_base_tip) + sum(row0) + sum(row1) + sum(row2)
        total += sum(arm.angular_velocity_base_tip)
        if not math.isfinite(total):
            return Violation("arm state", "not finite", "finite numbers", Cause.DEVICE)
        if before is None or arm.rotation_base_tip is not before.arm.rotation_base_tip:
            error = _rotation_error(row0, row1, row2)
            if error > ROTATION_TOLERANCE:
                by, most = f"no rotation by {error:.3g}", f"{ROTATION_TOLERANCE:g}"
                return Violation("rotation of the tip", by, most, Cause.DEVICE)
        finding = _joints("arm", arm.joint_position)
        if finding is None and now.hand is not None:
            finding = _joints("hand", now.hand.joint_position)
        if finding is not None:
            return finding
        if arm.tip_force_base is not None and not math.isfinite(sum(arm.tip_force_base)):
            return Violation("force that the arm measures", "not finite", "finite numbers", Cause.DEVICE)
        for i, finger in enumerate(now.fingers):
            if not math.isfinite(sum(finger.wrench)):
                return Violation(f"wrench of finger {i + 1}", "not finite", "finite numbers", Cause.DEVICE)
        return None


def _joints(device: str, position: tuple[float, ...]) -> Violation | None:
    for i, q in enumerate(position):
        if not -LARGEST_JOINT <= q <= LARGEST_JOINT:
            limit = f"-{LARGEST_JOINT:g} to {LARGEST_JOINT:g} rad or m"
            return Violation(f"position of joint {i + 1} of the {device}", f"{q:.6g}", limit, Cause.DEVICE)
    return None


def _rotation_error(a: Vector, b: Vector, c: Vector) -> float:
    """How far rows are from right-handed and orthonormal."""
    a0, a1, a2 = a
    b0, b1, b2 = b
    c0, c1, c2 = c
    return max(
        abs(a0 * a0 + a1 * a1 + a2 * a2 - 1.0),
        abs(b0 * b0 + b1 * b1 + b2 * b2 - 1.0),
        abs(a0 * b0 + a1 * b1 + a2 * b2),
        abs(a1 * b2 - a2 * b1 - c0),
        abs(a2 * b0 - a0 * b2 - c1),
        abs(a0 * b1 - a1 * b0 - c2),
    )


TOO_MUCH = (HealthCheck.SATURATED, HealthCheck.OVERLOAD_AXIS, HealthCheck.OVERLOAD_COMBINED)
"""What a force/torque sensor says of too large a load; it works all the same."""


@dataclass(frozen=True, slots=True)
class HealthySensors:
    """Every force/torque sensor can be believed: it is not frozen, stuck, drifting, or talking nonsense."""

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        for i, finger in enumerate(now.fingers):
            health = finger.health
            if health is not HEALTHY and not health.ok and health.measure not in TOO_MUCH:
                return Violation(f"force/torque sensor {i + 1}", str(health), "a healthy sensor", Cause.DEVICE)
        return None


@dataclass(frozen=True, slots=True)
class SensorsInRange:
    """No force/torque sensor is saturated or bears more than it is made for."""

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        for i, finger in enumerate(now.fingers):
            health = finger.health
            if health is not HEALTHY and health.measure in TOO_MUCH:
                return Violation(
                    f"force/torque sensor {i + 1}", str(health), "a load within its range", Cause.FORCE
                )
        return None


CLOCK_SLACK = 1e-9
"""[s]: rounding of time stamps."""

LONGEST_GAP = 0.1
"""[s] from period to period: by then the robot's own watchdog (20 to 100 ms) has stopped it, or it has gone on
with an old command for as long. Where older samples are believed, commands may be as old, too."""


@dataclass(frozen=True, slots=True)
class FreshSamples:
    """Time goes on, and no device's sample is older than `longest_age` [s], by the device's own time stamp.

    A device that is read faster than it samples repeats itself: that is in order until its sample grows too old.
    From period to period no more time passes than `LONGEST_GAP`, or `longest_age` where that is more.
    """

    longest_age: float

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        time, longest = now.time, self.longest_age + CLOCK_SLACK
        if not math.isfinite(time):
            return Violation("time of the sample", f"{time}", "a finite number", Cause.DEVICE)
        if before is not None and not time > before.time:
            return Violation(
                "time of the sample", f"{time:.6f} s", f"later than the last, {before.time:.6f} s", Cause.DEVICE
            )
        if not -CLOCK_SLACK <= time - now.arm.time <= longest:
            return self._aged("the arm", time - now.arm.time)
        for i, finger in enumerate(now.fingers):
            if not -CLOCK_SLACK <= time - finger.time <= longest:
                return self._aged(f"force/torque sensor {i + 1}", time - finger.time)
        if now.hand is not None and not -CLOCK_SLACK <= time - now.hand.time <= longest:
            return self._aged("the hand", time - now.hand.time)
        if before is None:
            return None
        gap = max(LONGEST_GAP, self.longest_age)
        if not time - before.time <= gap + CLOCK_SLACK:
            return Violation(
                "time since the last sample", f"{time - before.time:.4g} s", f"{gap:g} s", Cause.COMPUTER
            )
        joints, last_joints = len(now.arm.joint_position), len(before.arm.joint_position)
        if joints != last_joints:
            return Violation("number of the arm's joints", f"{joints}", f"as before, {last_joints}", Cause.DEVICE)
        if now.arm.time < before.arm.time:
            return _backwards("the arm", now.arm.time, before.arm.time)
        for i, last in enumerate(before.fingers):
            if now.fingers[i].time < last.time:
                return _backwards(f"force/torque sensor {i + 1}", now.fingers[i].time, last.time)
        if now.hand is None or before.hand is None:
            if now.hand is before.hand:
                return None
            return Violation(
                "sample of the hand", "missing" if now.hand is None else "new", "as in every period", Cause.DEVICE
            )
        if now.hand.time < before.hand.time:
            return _backwards("the hand", now.hand.time, before.hand.time)
        return None

    def _aged(self, device: str, age: float) -> Violation:
        limit = f"0 to {1e3 * self.longest_age:g} ms"
        return Violation(f"age of the sample of {device}", f"{1e3 * age:.4g} ms", limit, Cause.WIRE)


def _backwards(device: str, time: float, last: float) -> Violation:
    return Violation(
        f"time stamp of {device}", f"{time:.6f} s", f"not before its last, {last:.6f} s", Cause.DEVICE
    )


@dataclass(frozen=True, slots=True)
class InsideWorkspace:
    """The tip stays in a box of the base frame [m]."""

    lower: Vector
    upper: Vector

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        x, y, z = now.arm.position_base_tip
        lower, upper = self.lower, self.upper
        if lower[0] <= x <= upper[0] and lower[1] <= y <= upper[1] and lower[2] <= z <= upper[2]:
            return None
        return Violation(
            "tip position", f"({x:.4f}, {y:.4f}, {z:.4f}) m", f"between {lower} m and {upper} m", Cause.MOTION
        )


@dataclass(frozen=True, slots=True)
class InsideJointRange:
    """Every joint of the arm stays in its range [rad or m]."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        joints = now.arm.joint_position
        if len(joints) != len(self.lower):
            return Violation(
                "number of the arm's joints",
                str(len(joints)),
                f"the {len(self.lower)} that are limited",
                Cause.DEVICE,
            )
        for i, (low, q, high) in enumerate(zip(self.lower, joints, self.upper, strict=True)):
            if not low <= q <= high:
                return Violation(f"position of joint {i + 1}", f"{q:.4f}", f"{low:g} to {high:g}", Cause.MOTION)
        return None
