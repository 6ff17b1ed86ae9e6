"""Rolls a fingertip over an object without slip.

Where the tip touches, at c, its material moves over the object with v + w x c (see
`palpate.sensing.contact_motion`). So the tip turns with w across the normal, and its frame goes with v = -w x c,
c being what touch says: where it will be when the machine does what is commanded, for the tip's middle turns about
the frame meanwhile. What little is wrong of c and of the machine winds the contact up sideways: the tip gives
way along the tangential force, long before it is enough to slip. The normal force is held by another velocity,
along the normal.
"""

import math
from dataclasses import dataclass

from palpate.errors import FloatArray, InvalidValueError, not_negative, positive
from palpate.runtime.data import Command, FingerObservation, Observation, Phase
from palpate.sensing.contact_motion import ContactMotion, MotionThresholds, contact_motion
from palpate.spatial import ZERO, Vector, add, add_scaled, cross, dot, norm, rotate, rotate_back, scale, unit


@dataclass(frozen=True, slots=True)
class RollParameters:
    """How a fingertip is rolled.

    Attributes:
        way: Of the contact over the object [m].
        direction: In which it goes, base frame; what is along the normal is left out.
        radius: Of the tip across the normal [m]: with it a speed becomes a rate.
        towards: In which the object lies, base frame.
        speed: Of the contact over the object [m/s].
        acceleration: To that and from it [m/s^2].
        force: With which it presses [N].
        approach_speed: Until it touches [m/s].
        settle_time: Pressed and at rest, before it rolls and after [s].
        normal_gain: Velocity along the normal per error of force [m/s/N]; times stiffness, the rate of the loop.
        tangential_gain: Velocity along the tangential force [m/s/N], likewise.
        lag: Of the machine behind a steady command [s].
    """

    way: float
    direction: Vector
    radius: float
    towards: Vector = (0.0, 0.0, -1.0)
    speed: float = 0.01
    acceleration: float = 0.05
    force: float = 2.0
    approach_speed: float = 0.005
    settle_time: float = 0.3
    normal_gain: float = 1e-3
    tangential_gain: float = 1e-3
    lag: float = 0.02

    def __post_init__(self) -> None:
        for name, unit_of in (
            ("way", "m"),
            ("radius", "m"),
            ("speed", "m/s"),
            ("acceleration", "m/s^2"),
            ("force", "N"),
            ("approach_speed", "m/s"),
            ("normal_gain", "m/s/N"),
        ):
            positive(name, getattr(self, name), unit_of)
        not_negative("tangential_gain", self.tangential_gain, "m/s/N")
        not_negative("settle_time", self.settle_time, "s")
        not_negative("lag", self.lag, "s")
        for name in ("direction", "towards"):
            value: Vector = getattr(self, name)
            if not 0.0 < norm(value) < math.inf:
                raise InvalidValueError(f"{name} = {value}: must be a finite vector that has a direction")
            object.__setattr__(self, name, unit(value))
        if norm(cross(self.direction, self.towards)) < 1e-6:
            raise InvalidValueError(f"direction = {self.direction}: must not be along towards = {self.towards}")


class RollController:
    """Lands, rolls, and stays pressed; ends with DONE, or LOST where the contact is lost. One finger.

    Attributes:
        phase: APPROACH, SETTLE, SCAN while it rolls, HOLD, then DONE or LOST.
        rolled: Way of the contact over the object so far, as commanded [m].
        motion: How the tip moves over the object, as arm and touch tell it; None before it touches.
        slip: That motion's slip velocity, added up [m], base frame.
    """

    def __init__(self, period: float, parameters: RollParameters) -> None:
        """Take the period of control [s] and how to roll."""
        self._period, self._parameters = positive("period", period, "s"), parameters
        self._thresholds = MotionThresholds()
        self.phase, self._since = Phase.APPROACH, 0.0
        self.rolled = self._speed = 0.0
        self.slip: Vector = ZERO
        self.motion: ContactMotion | None = None

    def start(self, first: Observation) -> None:
        """Take the first observation."""
        self.rolled = self._speed = 0.0
        self.slip, self.motion = ZERO, None
        self._go_on(Phase.APPROACH, first.time)

    def step(self, now: Observation) -> Command:
        """Return what the arm is to do during the next period."""
        p, finger = self._parameters, now.fingers[0]
        if self.phase is Phase.APPROACH:
            if not finger.touching:
                return Command(scale(p.approach_speed, p.towards), self.phase)
            self._go_on(Phase.SETTLE, now.time)
        if not self.phase.is_final and not finger.believed:
            self._go_on(Phase.LOST, now.time)
        if self.phase.is_final:
            return Command(ZERO, self.phase)
        self._watch(now, finger)
        gone = now.time - self._since
        if self.phase is Phase.SETTLE and gone >= p.settle_time:
            self._go_on(Phase.SCAN, now.time)
        elif self.phase is Phase.SCAN and self.rolled >= p.way:
            self._go_on(Phase.HOLD, now.time)
        elif self.phase is Phase.HOLD and gone >= p.settle_time:
            self._go_on(Phase.DONE, now.time)
        rate = self._next_speed() / p.radius if self.phase is Phase.SCAN else 0.0
        return self._rolling(now, finger, rate)

    def _rolling(self, now: Observation, finger: FingerObservation, rate: float) -> Command:
        p, contact, rotation = self._parameters, finger.contact, now.arm.rotation_base_tip
        normal = rotate(rotation, _tuple(contact.normal))
        turn = ZERO
        if rate:
            along = add_scaled(p.direction, -dot(p.direction, normal), normal)
            turn = scale(rate, unit(cross(along, normal)))
        centroid = rotate(rotation, _tuple(contact.centroid))
        middle = add_scaled(centroid, -p.radius, normal)
        centroid = add_scaled(centroid, p.lag, cross(turn, middle))
        velocity = scale(-1.0, cross(turn, centroid))
        velocity = add_scaled(velocity, p.normal_gain * (p.force - float(contact.normal_force)), normal)
        tangential = rotate(rotation, _tuple(contact.tangential_force))
        return Command(
            add_scaled(velocity, p.tangential_gain, tangential), self.phase, angular_velocity_base_tip=turn
        )

    def _next_speed(self) -> float:
        """The speed of the next period: as fast as lets it stop after the way [m/s]."""
        p, dt = self._parameters, self._period
        left = max(p.way - self.rolled, 0.0)
        stoppable = math.sqrt(2.0 * p.acceleration * left)
        self._speed = min(p.speed, stoppable, self._speed + p.acceleration * dt)
        self._speed = min(max(self._speed, p.acceleration * dt), left / dt)
        self.rolled = p.way if self._speed * dt >= left else self.rolled + self._speed * dt
        return self._speed

    def _watch(self, now: Observation, finger: FingerObservation) -> None:
        arm, contact = now.arm, finger.contact
        rotation = arm.rotation_base_tip
        self.motion = motion = contact_motion(
            now.time,
            _tuple(contact.centroid),
            _tuple(contact.normal),
            ZERO,  # what migrates does not count for slip
            rotate_back(rotation, arm.velocity_base_tip),
            rotate_back(rotation, arm.angular_velocity_base_tip),
            self._thresholds,
        )
        self.slip = add(self.slip, scale(self._period, rotate(rotation, motion.slip_velocity)))

    def _go_on(self, phase: Phase, time: float) -> None:
        self.phase, self._since = phase, time


def _tuple(array: FloatArray) -> Vector:
    x, y, z = array.tolist()
    return (x, y, z)
