"""Motion of the arm under each command: a twist of the TCP in every controller cycle.

Moves and servo motions close a loop over the measured pose, since the plant follows velocities with a lag. Speed
motions do not: the real ones do not return after a push either. Compliance overlays any motion (force mode).
"""

import math
from dataclasses import dataclass
from typing import Protocol

from palpate.hw.emulators.ur.arm import STILL, Arm, Joints, Twist, difference, scaled, turned, turned_back
from palpate.kinematics.pose import Pose, rotation_from_rotvec, times
from palpate.spatial import ZERO, Vector, add_scaled, norm, rotate_back, scale, toward

FEEDBACK = 20.0
"""Gain from a pose error to a velocity [1/s]; well damped for a plant whose lag is below 1/(2 x 20 s) = 25 ms."""

ARRIVAL_ERROR = 5e-5
"""Error at which a move has arrived [m, rad]."""

ARRIVAL_TIMEOUT = 0.5
"""[s] after which a move counts as arrived although something blocks it."""

ZERO_LENGTH = 1e-9
"""Distances [m, rad] below this count as zero."""

COMPLIANCE = 0.002
"""Speed per force [m/s per N]: pressing on 2 kN/m settles in 1 / (0.002 x 2000) = 0.25 s, and 50 kN/m is still
stable with the 10 ms lag of the arm. The real controller's is not published."""

ANGULAR_COMPLIANCE = 0.5
"""Angular speed per moment [rad/s per N m]: equal to `COMPLIANCE` at a lever of 6 cm."""


class ArmMotion(Protocol):
    """Motion of the arm."""

    @property
    def finished(self) -> bool:
        """Whether a command that waits for the motion may go on."""
        ...

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return the twist of the TCP for the next cycle.

        Args:
            arm: Arm as measured.
            dt: Duration of the cycle [s].
            fraction: Fraction of full speed that the slider allows.
        """
        ...


class Rest:
    """Standstill."""

    finished = True

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return zero."""
        return STILL


class Braking:
    """Deceleration to rest."""

    def __init__(self, before: Twist, deceleration: float) -> None:
        """Slow down from a twist with a deceleration [m/s^2, rad/s^2]."""
        self._now, self._deceleration = before, deceleration
        self.finished = False

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return a slower twist each time."""
        most = self._deceleration * dt
        self._now = (toward(self._now[0], ZERO, most), toward(self._now[1], ZERO, most))
        self.finished = self._now == STILL
        return self._now


class ToolSpeed:
    """A steady twist of the TCP: speedL, jog."""

    finished = True

    def __init__(self, before: Twist, target: Twist, acceleration: float) -> None:
        """Change from one twist to another with an acceleration [m/s^2, rad/s^2]."""
        self._now = before
        self.target, self.acceleration = target, acceleration

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return a twist nearer to the target each time."""
        most = self.acceleration * dt
        velocity, turning = scaled(fraction, self.target)
        self._now = (toward(self._now[0], velocity, most), toward(self._now[1], turning, most))
        return self._now


class JointSpeed:
    """Steady joint speeds: speedJ."""

    finished = True

    def __init__(self, before: Joints, target: Joints, acceleration: float) -> None:
        """Change joint speeds [rad/s] with an acceleration of the leading axis [rad/s^2]."""
        self._now = before
        self.target, self.acceleration = target, acceleration

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return the twist of joint speeds nearer to the target each time."""
        change = [fraction * target - now for target, now in zip(self.target, self._now, strict=True)]
        leading = max(abs(c) for c in change)
        share = 1.0 if leading <= self.acceleration * dt else self.acceleration * dt / leading
        self._now = tuple(now + share * c for now, c in zip(self._now, change, strict=True))
        return arm.twist_of(self._now)


class JointServo:
    """Joint angles followed with a first-order lag, the lookahead time: servoJ."""

    finished = True

    def __init__(self, target: Joints, lookahead: float) -> None:
        """Follow joint angles [rad]."""
        self.target, self.lookahead = target, lookahead

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return the twist of the joint displacements over the lookahead time."""
        rates = [(target - q) / self.lookahead for target, q in zip(self.target, arm.joints, strict=True)]
        fastest = max(
            abs(speed) / limit.speed for speed, limit in zip(rates, arm.mounting.arm.limits, strict=True)
        )
        most = max(1.0, fastest)
        return arm.twist_of(tuple(speed / most for speed in rates))


class Profile:
    """Progress of a move along its path: full speed, ramps of one acceleration."""

    def __init__(self, length: float, speed: float, acceleration: float) -> None:
        """Start at rest; length, speed and acceleration are in the units of the path."""
        self.length, self._most, self._acceleration = length, speed, acceleration
        self.at, self.speed = 0.0, 0.0

    @property
    def over(self) -> bool:
        """Whether the end is reached."""
        return self.at >= self.length

    def advance(self, dt: float, fraction: float) -> None:
        """Advance by `dt` [s]; the slider slows down time."""
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
    """Straight move of the TCP to a pose: moveL."""

    def __init__(self, start: Pose, target: Pose, speed: float, acceleration: float) -> None:
        """Move from one pose to another with a speed [m/s] and acceleration [m/s^2], and turn meanwhile.

        For a pure turn, the numbers are in rad/s and rad/s^2.
        """
        self._start, self.target = start, target
        self._path, self._turn = difference(target, start)
        length = norm(self._path)
        self._length = length if length > ZERO_LENGTH else max(norm(self._turn), ZERO_LENGTH)
        self._profile = Profile(self._length, speed, acceleration)
        self._arrival = _Arrival()
        self.finished = False

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return the twist of the profile, with the correction of the error."""
        self._profile.advance(dt, fraction)
        share, speed = self._profile.at / self._length, self._profile.speed / self._length * fraction
        rotation = times(rotation_from_rotvec(scale(share, self._turn)), self._start.rotation)
        planned = Pose(add_scaled(self._start.position, share, self._path), rotation)
        offset, turn = difference(planned, arm.tcp)
        self.finished = self._arrival.over(self._profile.over, max(norm(offset), norm(turn)), dt)
        return (
            add_scaled(scale(speed, self._path), FEEDBACK, offset),
            add_scaled(scale(speed, self._turn), FEEDBACK, turn),
        )


class JointMove:
    """Move of the joints to angles, together: moveJ."""

    def __init__(self, start: Joints, target: Joints, speed: float, acceleration: float) -> None:
        """Move between angles [rad]; speed [rad/s] and acceleration [rad/s^2] of the leading axis."""
        self._start, self.target = start, target
        self._path = tuple(b - a for a, b in zip(start, target, strict=True))
        self._length = max(ZERO_LENGTH, max(abs(w) for w in self._path))
        self._profile = Profile(self._length, speed, acceleration)
        self._arrival = _Arrival()
        self.finished = False

    def twist(self, arm: Arm, dt: float, fraction: float) -> Twist:
        """Return the twist of the profile, with the correction of the error."""
        self._profile.advance(dt, fraction)
        share, speed = self._profile.at / self._length, self._profile.speed / self._length * fraction
        error = [a + share * w - q for a, w, q in zip(self._start, self._path, arm.joints, strict=True)]
        self.finished = self._arrival.over(self._profile.over, max(abs(e) for e in error), dt)
        return arm.twist_of(tuple(speed * w + FEEDBACK * e for w, e in zip(self._path, error, strict=True)))


class _Arrival:
    """Decision when a move is over."""

    def __init__(self) -> None:
        self._waited = 0.0

    def over(self, arrived: bool, error: float, dt: float) -> bool:
        if not arrived:
            return False
        self._waited += dt
        return error < ARRIVAL_ERROR or self._waited > ARRIVAL_TIMEOUT


@dataclass(frozen=True, slots=True)
class Compliance:
    """Compliant axes of force mode.

    Attributes:
        frame: Pose of the task frame in the robot base; its axes are those below.
        selected: Which axes are compliant.
        wrench: Target wrench of the robot on the object [N, N m].
        limits: Largest speed along and about each axis [m/s, rad/s].
    """

    frame: Pose
    selected: tuple[bool, ...]
    wrench: tuple[float, ...]
    limits: tuple[float, ...]

    def overlaid(self, twist: Twist, force: Vector, torque: Vector) -> Twist:
        """Return a twist with the compliant axes replaced.

        Args:
            twist: Twist of the TCP, axes of the robot base.
            force: Force on the tool without its weight [N], axes of the robot base.
            torque: Torque on the tool about the TCP [N m], axes of the robot base.
        """
        linear, angular = turned_back(twist, self.frame)
        felt = rotate_back(self.frame.rotation, force) + rotate_back(self.frame.rotation, torque)
        given = list(linear + angular)
        for axis, gives_way in enumerate(self.selected):
            if gives_way:
                gain = COMPLIANCE if axis < 3 else ANGULAR_COMPLIANCE
                speed, limit = gain * (self.wrench[axis] + felt[axis]), abs(self.limits[axis])
                given[axis] = max(-limit, min(limit, speed))
        vx, vy, vz, wx, wy, wz = given
        return turned(((vx, vy, vz), (wx, wy, wz)), self.frame)
