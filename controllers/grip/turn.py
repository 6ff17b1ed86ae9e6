"""Turns a held object about the hand's axis: the fingers move sideways, and every contact rolls.

An object that turns with the rate w about the hand's axis moves at a contact with w x p. So must the tip's
material, and each finger is sent sideways with that velocity's part along its own sideways axis; the part along
its closing direction it follows by itself, for it is held by force. In the plane three fingers are three sideways
positions for three freedoms of the object: they fix it, and there is nothing left by which contacts could be
strained against each other. With two fingers the object is free along their line.

Normals are never quite level, so that every contact is spun by some hundredths of a degree. An elastic contact
makes next to nothing of that, a rigid one its full spin torque, which grows with the grip: with MuJoCo's own
friction, which is rigid, a grip that covers each finger's spin torque rises without end. There, plan with what all
fingers bear together (`palpate.controllers.grip.shared_grip`), in which such torques cancel, or without spin
(`NeedWithoutSpin`): contacts that are not in one line hold any load without it.

How far the object has turned and gone astray, touch tells (`palpate.controllers.grip.turn_meter`). What is missing
of either is added to the fingers' velocities.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from palpate.controllers.grip.turn_meter import TurnMeter
from palpate.errors import InvalidValueError, check_not_negative, check_positive, positive
from palpate.kinematics.hand import HandKinematics
from palpate.kinematics.pose import Pose
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.live import LiveParameters
from palpate.spatial import ZERO, Vector, as_vector, cross, dot, subtract

_AXIS: Vector = (0.0, 0.0, 1.0)

_MIN_LEVER = 1e-3
"""[m] A contact nearer to the axis does not move when the object turns: its finger's travel sets no limit."""


class HoldingGrip(Protocol):
    """How the fingers press meanwhile: `SlipSafeGrip`, for one."""

    @property
    def live(self) -> LiveParameters:
        """What may be changed while it runs."""
        ...

    @property
    def faulty(self) -> bool:
        """Whether a finger feels nothing, or nothing to be believed."""
        ...

    @property
    def targets(self) -> tuple[float, ...]:
        """Grip that is wanted of each finger [N]."""
        ...

    def step(self, now: Observation) -> tuple[float, ...]:
        """Return with which force each finger is to press during the next period [N]."""
        ...


@dataclass(frozen=True, slots=True)
class TurnParameters:
    """How an object is turned.

    Attributes:
        angles: To which it is turned, one after the other, about the hand's z axis, from how it was at the start
            [rad]. An infinite one: to the end of the fingers' travel.
        rate: At most [rad/s].
        acceleration: To that and from it [rad/s^2].
        finger_speed: Of any finger, sideways, at most [m/s].
        travel: Of any finger sideways, from where its joint is at 0, in either direction [m]: 1 mm less than what
            the hand's joints allow is left for their lag.
        gain: Rate per angle that is missing, and velocity per distance that the object has drifted [1/s].
        tolerance: Of an angle that counts as reached [rad].
        settle_time: For which it then rests [s].
        patience: How long a finger may feel nothing, or nothing to be believed, and how long an angle may take
            beyond the profile, before the run ends [s].
    """

    angles: tuple[float, ...]
    rate: float = 0.25
    acceleration: float = 0.5
    finger_speed: float = 0.02
    travel: float = 0.011
    gain: float = 4.0
    tolerance: float = math.radians(0.1)
    settle_time: float = 0.3
    patience: float = 0.5

    def __post_init__(self) -> None:
        if not self.angles or any(math.isnan(angle) for angle in self.angles):
            raise InvalidValueError(
                f"angles = {self.angles!r} rad: must be one or more numbers; infinity turns to the end of travel"
            )
        check_positive(
            self,
            rate="rad/s",
            acceleration="rad/s^2",
            finger_speed="m/s",
            travel="m",
            tolerance="rad",
            patience="s",
        )
        check_not_negative(self, gain="1/s", settle_time="s")


class TurnInHand:
    """Turns a held object to one angle after the other; ends with DONE, or LOST with the grip as it is.

    It is LOST where a finger fails for longer than `patience`, where the fingers' travel ends before an angle is
    reached, or where an angle is not reached although the profile is over.

    Attributes:
        grip: How it presses.
        phase: SCAN while it turns, HOLD while it rests at an angle, then DONE or LOST.
        at: Index of the angle that it turns to.
        wanted: Set point of the angle now [rad].
        meter: How far it has turned and gone astray, as touch tells it.
        travel_ended: Whether the fingers' travel ended the last turn.
    """

    def __init__(
        self, grip: HoldingGrip, kinematics: HandKinematics, period: float, parameters: TurnParameters
    ) -> None:
        """Take the pieces.

        Args:
            grip: How it presses.
            kinematics: Where the fingers are.
            period: Of control [s].
            parameters: How to turn.
        """
        self.grip, self._kinematics = grip, kinematics
        self._period, self._parameters = positive("period", period, "s"), parameters
        self.meter = TurnMeter()
        self._centroids: list[Vector] = []
        self._middle: tuple[Pose, ...] = ()
        self.phase, self.at, self.wanted, self.travel_ended = Phase.SCAN, 0, 0.0, False
        self._rate = self._since = self._trusted = self._arrived = 0.0

    @property
    def live(self) -> LiveParameters:
        """See `palpate.runtime.live.Tunable`."""
        return self.grip.live

    @property
    def turn(self) -> float:
        """How far it has turned since the start, as measured by touch [rad]."""
        return self.meter.turn

    def start(self, first: Observation) -> None:
        """Take the first observation; the grip goes on as it is.

        Raises:
            InvalidValueError: No hand, or a finger that feels nothing to be believed.
        """
        if first.hand is None:
            raise InvalidValueError(
                "the observation has no hand: turning in the hand takes one that tells its joints"
            )
        for i, finger in enumerate(first.fingers):
            if not finger.believed:
                raise InvalidValueError(f"finger {i} feels nothing to be believed: hold the object first")
        joints = first.hand.joint_position
        self._centroids = [(0.0, 0.0, 0.0)] * len(first.fingers)
        self._middle = self._kinematics.sensor_poses((0.0,) * len(joints))
        self._feel(first)
        self.meter.start(self._kinematics.sensor_poses(joints), self._centroids)
        if not any(math.hypot(x, y) > _MIN_LEVER for x, y, _ in self.meter.points):
            raise InvalidValueError(
                f"all contacts are within {1e3 * _MIN_LEVER:g} mm of the hand's axis: no finger can turn it"
            )
        self._reset(first.time)

    def step(self, now: Observation) -> Command:
        """Return what the fingers are to do during the next period; the arm stands still."""
        forces = self.grip.step(now)
        # a finger pushed back presses harder by its gear friction and would get a lower command; keep the target
        # as a lower bound, since friction takes as much away when it follows again
        forces = tuple(max(pair) for pair in zip(forces, self.grip.targets, strict=True))
        if not self.grip.faulty:
            self._trusted = now.time
        elif now.time - self._trusted >= self._parameters.patience and not self.phase.is_final:
            self._go_on(Phase.LOST, now.time)
        if now.hand is None or self.phase.is_final:
            return Command(ZERO, self.phase, forces)
        self._feel(now)
        poses = self._kinematics.sensor_poses(now.hand.joint_position)
        self.meter.step(poses, self._centroids)
        # how fast each finger moves sideways per rate of the object
        levers = [dot(_sideways(pose), cross(_AXIS, p)) for pose, p in zip(poses, self.meter.points, strict=True)]
        if self._planned(now, poses, levers).is_final:
            return Command(ZERO, self.phase, forces)
        p, moved = self._parameters, self.meter.moved
        rate = self._rate + p.gain * (self.wanted - self.meter.turn)
        velocities = [
            rate * lever - p.gain * dot(_sideways(pose), moved) for pose, lever in zip(poses, levers, strict=True)
        ]
        share = min(1.0, p.finger_speed / max(map(abs, velocities), default=0.0)) if any(velocities) else 1.0
        return Command(ZERO, self.phase, forces, finger_velocity=tuple((0.0, share * v, 0.0) for v in velocities))

    def _planned(self, now: Observation, poses: tuple[Pose, ...], levers: list[float]) -> Phase:
        """Move the wanted angle on, go on where an angle is reached or cannot be, and return the phase."""
        p, aim = self._parameters, self._parameters.angles[self.at]
        if self.phase is Phase.SCAN:
            left = self._left(poses, levers, aim - self.wanted)
            if self._next_rate(left, max(map(abs, levers))):
                self._arrived = now.time
                return self.phase
            reached = self.travel_ended if math.isinf(aim) else abs(aim - self.meter.turn) <= p.tolerance
            if reached:
                self._go_on(Phase.HOLD, now.time)
            elif self.travel_ended or now.time - self._arrived >= p.patience:
                self._go_on(Phase.LOST, now.time)
        elif now.time - self._since >= p.settle_time and not self.grip.faulty:
            if self.at + 1 == len(p.angles):
                self._go_on(Phase.DONE, now.time)
            else:
                self.at, self.travel_ended = self.at + 1, False
                self._arrived = now.time
                self._go_on(Phase.SCAN, now.time)
        return self.phase

    def _left(self, poses: tuple[Pose, ...], levers: list[float], left: float) -> float:
        """The remaining turn [rad], signed, within the travel of every finger."""
        p, sign = self._parameters, math.copysign(1.0, left)
        lag = sign * (self.wanted - self.meter.turn)
        room = math.inf
        for pose, middle, lever in zip(poses, self._middle, levers, strict=True):
            if abs(lever) < _MIN_LEVER:
                continue
            offset = dot(_sideways(pose), subtract(pose.position, middle.position))
            ahead = p.travel - (offset if sign * lever > 0.0 else -offset)
            room = min(room, ahead / abs(lever) - lag)
        self.travel_ended = max(room, 0.0) < abs(left)
        return sign * max(0.0, min(abs(left), room))

    def _next_rate(self, left: float, lever: float) -> bool:
        """Move the wanted angle on by a period, as fast as lets it stop; return whether it still moves."""
        p, dt = self._parameters, self._period
        most = min(p.rate, p.finger_speed / lever) if lever > 0.0 else p.rate
        step = p.acceleration * dt
        aim = math.copysign(min(most, math.sqrt(2.0 * p.acceleration * abs(left)), abs(left) / dt), left)
        self._rate = max(self._rate - step, min(self._rate + step, aim))
        self.wanted += self._rate * dt
        return abs(left) > abs(self._rate) * dt or abs(self._rate) > step

    def _feel(self, now: Observation) -> None:
        for i, finger in enumerate(now.fingers):
            if finger.believed:
                self._centroids[i] = as_vector(finger.contact.centroid)

    def _reset(self, time: float) -> None:
        self.at, self.wanted, self.travel_ended = 0, 0.0, False
        self._trusted = self._arrived = time
        self._go_on(Phase.SCAN, time)

    def _go_on(self, phase: Phase, time: float) -> None:
        self.phase, self._since, self._rate = phase, time, 0.0


def _sideways(pose: Pose) -> Vector:
    """In which a finger moves sideways: y of its sensor frame, hand frame."""
    (_, x, _), (_, y, _), (_, z, _) = pose.rotation
    return (x, y, z)
