"""How the arm moves under each motion command: a twist of the TCP in every controller cycle.

Moves and servo motions close a loop over the measured pose, since the plant follows velocities with a lag; speed
motions do not, as little as the real ones come back after having been pushed.
"""

import math
from typing import Protocol

from palpate.hw.emulators.ur.arm import STILL, Arm, Joints, Twist, difference, scaled
from palpate.kinematics.pose import Pose, rotation_from_rotvec, times
from palpate.spatial import ZERO, Vector, add_scaled, dot, norm, scale, toward

FEEDBACK = 20.0
"""[1/s] from a pose error to a velocity; well damped for a plant whose lag is below 1/(2 x 20 s) = 25 ms."""

NEAR = 5e-5
"""[m, rad] at which a move has arrived."""

ARRIVAL_TIMEOUT = 0.5
"""[s] after which it counts as arrived anyway: something blocks it."""

ZERO_LENGTH = 1e-9
"""Distances [m, rad] below this count as zero."""


class ArmMotion(Protocol):
    """What the arm is doing."""

    @property
    def finished(self) -> bool:
        """Whether a command that waits for it may go on."""
        ...

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return how the TCP is to move during the next cycle of `dt` [s].

        Args:
            arm: As measured.
            dt: Of the cycle [s].
            fraction: Of full speed that the slider allows.
        """
        ...


class Rest:
    """The arm stands still."""

    finished = True

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return none."""
        return STILL


class Braking:
    """The arm slows down to rest."""

    def __init__(self, before: Twist, deceleration: float) -> None:
        """Slow down from a twist with a deceleration [m/s^2, rad/s^2]."""
        self._now, self._deceleration = before, deceleration
        self.finished = False

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return a slower one each time."""
        most = self._deceleration * dt
        self._now = (toward(self._now[0], ZERO, most), toward(self._now[1], ZERO, most))
        self.finished = self._now == STILL
        return self._now


class ToolSpeed:
    """A steady twist of the TCP: speedL, jog."""

    finished = True

    def __init__(self, before: Twist, target: Twist, acceleration: float) -> None:
        """Go over from one twist to another with an acceleration [m/s^2, rad/s^2]."""
        self._now = before
        self.target, self.acceleration = target, acceleration

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return one nearer to the target each time."""
        most = self.acceleration * dt
        velocity, turning = scaled(fraction, self.target)
        self._now = (toward(self._now[0], velocity, most), toward(self._now[1], turning, most))
        return self._now


class JointSpeed:
    """Steady joint speeds: speedJ."""

    finished = True

    def __init__(self, before: Joints, target: Joints, acceleration: float) -> None:
        """Go over from some joint speeds to others [rad/s] with an acceleration of the leading axis [rad/s^2]."""
        self._now = before
        self.target, self.acceleration = target, acceleration

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return that of joint speeds nearer to the target each time."""
        change = [fraction * wanted - now for wanted, now in zip(self.target, self._now, strict=True)]
        leading = max(abs(c) for c in change)
        share = 1.0 if leading <= self.acceleration * dt else self.acceleration * dt / leading
        self._now = tuple(now + share * c for now, c in zip(self._now, change, strict=True))
        return arm.twist_of(self._now)


class PoseServo:
    """A pose that is followed, first order, with the lookahead time: servoL."""

    finished = True

    def __init__(self, target: Pose, lookahead: float) -> None:
        """Follow a pose of the TCP."""
        self.target, self.lookahead = target, lookahead

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return the displacement to it over the lookahead time."""
        return scaled(1.0 / self.lookahead, difference(self.target, arm.tcp))


class JointServo:
    """Joint angles that are followed, first order, with the lookahead time: servoJ."""

    finished = True

    def __init__(self, target: Joints, lookahead: float) -> None:
        """Follow joint angles [rad]."""
        self.target, self.lookahead = target, lookahead

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return that of the joint displacements over the lookahead time."""
        rates = [(wanted - q) / self.lookahead for wanted, q in zip(self.target, arm.joints, strict=True)]
        fastest = max(
            abs(speed) / limit.speed for speed, limit in zip(rates, arm.mounting.arm.limits, strict=True)
        )
        most = max(1.0, fastest)
        return arm.twist_of(tuple(speed / most for speed in rates))


class Profile:
    """How far along its path a move is: full speed, ramps of one acceleration."""

    def __init__(self, length: float, speed: float, acceleration: float) -> None:
        """Cover a length with a speed and an acceleration, all in the units of the path."""
        self.length, self._most, self._acceleration = length, speed, acceleration
        self.at, self.speed = 0.0, 0.0

    @property
    def over(self) -> bool:
        """Whether the end is reached."""
        return self.at >= self.length

    def advance(self, dt: float, fraction: float) -> None:
        """Go on by `dt` [s]; the slider slows down time."""
        dt *= fraction
        if dt <= 0.0 or self.over:
            self.speed = 0.0
            return
        left = self.length - self.at
        # the speed v from which v dt + v^2 / 2a is what is left: never beyond the end
        a = self._acceleration
        braking = a * (math.sqrt(dt * dt + 2.0 * left / a) - dt)
        speed = min(self.speed + a * dt, self._most, braking)
        self.speed = speed
        step = speed * dt
        if left - step < ZERO_LENGTH or speed < 1e-4 * a * dt:
            step = left
        self.at += step


class LinearMove:
    """The TCP goes straight to a pose: moveL."""

    def __init__(self, start: Pose, target: Pose, speed: float, acceleration: float) -> None:
        """Go from one pose to another with a speed [m/s] and acceleration [m/s^2]; turn in the meantime.

        Where there is nothing but a turn, the same numbers are in rad.
        """
        self._start, self.target = start, target
        self._path, self._turn = difference(target, start)
        length = norm(self._path)
        self._length = length if length > ZERO_LENGTH else max(norm(self._turn), ZERO_LENGTH)
        self._profile = Profile(self._length, speed, acceleration)
        self._arrival = _Arrival()
        self.finished = False

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return the profile's speed, and what corrects the error."""
        self._profile.advance(dt, fraction)
        share, speed = self._profile.at / self._length, self._profile.speed / self._length * fraction
        rotation = times(rotation_from_rotvec(scale(share, self._turn)), self._start.rotation)
        wanted = Pose(add_scaled(self._start.position, share, self._path), rotation)
        offset, turn = difference(wanted, arm.tcp)
        self.finished = self._arrival.over(self._profile.over, max(norm(offset), norm(turn)), dt)
        return (
            add_scaled(scale(speed, self._path), FEEDBACK, offset),
            add_scaled(scale(speed, self._turn), FEEDBACK, turn),
        )


class JointMove:
    """The joints go to angles together: moveJ."""

    def __init__(self, start: Joints, target: Joints, speed: float, acceleration: float) -> None:
        """Go from some angles to others [rad]; speed [rad/s] and acceleration [rad/s^2] of the leading axis."""
        self._start, self.target = start, target
        self._path = tuple(b - a for a, b in zip(start, target, strict=True))
        self._length = max(ZERO_LENGTH, max(abs(w) for w in self._path))
        self._profile = Profile(self._length, speed, acceleration)
        self._arrival = _Arrival()
        self.finished = False

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return that of the profile's speed, and what corrects the error."""
        self._profile.advance(dt, fraction)
        share, speed = self._profile.at / self._length, self._profile.speed / self._length * fraction
        error = [a + share * w - q for a, w, q in zip(self._start, self._path, arm.joints, strict=True)]
        self.finished = self._arrival.over(self._profile.over, max(abs(e) for e in error), dt)
        return arm.twist_of(tuple(speed * w + FEEDBACK * e for w, e in zip(self._path, error, strict=True)))


class _Arrival:
    """Says when a move is over."""

    def __init__(self) -> None:
        self._waited = 0.0

    def over(self, arrived: bool, error: float, dt: float) -> bool:
        if not arrived:
            return False
        self._waited += dt
        return error < NEAR or self._waited > ARRIVAL_TIMEOUT


def along(velocity: Vector, direction: Vector) -> float:
    """Return the part of a vector along a direction that need not have length 1; its length if it is zero."""
    length = norm(direction)
    if length == 0.0:
        return norm(velocity)
    return dot(velocity, direction) / length
