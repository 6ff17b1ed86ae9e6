"""A servo as a first-order motor with friction that may run into an elastic wall."""

import math
from dataclasses import dataclass, field

from palpate.errors import InvalidValueError, not_negative, positive
from palpate.hw.emulators.plant import ServoGoal, ServoState


@dataclass(frozen=True, slots=True)
class ServoMotor:
    """What a motor with its gear is like at the shaft. Made up, near a Dynamixel XL330-M288.

    Attributes:
        torque_constant: Torque per current [N m/A]: 0.52 N m at 1.47 A stall.
        drag: Torque per speed [N m s/rad]: 0.52 N m lost at its free speed of 103 rev/min, 10.8 rad/s.
        friction: Of the gear, that it takes to move at all [N m].
        gain: Of the position controller [A/rad]: full current at 0.15 rad.
    """

    torque_constant: float = 0.35
    drag: float = 0.048
    friction: float = 0.01
    gain: float = 10.0

    def __post_init__(self) -> None:
        positive("torque_constant", self.torque_constant, "N m/A")
        positive("drag", self.drag, "N m s/rad")
        not_negative("friction", self.friction, "N m")
        positive("gain", self.gain, "A/rad")


@dataclass(frozen=True, slots=True)
class ElasticWall:
    """What stops the shaft from turning further.

    Attributes:
        position: Where it begins [rad].
        stiffness: [N m/rad].
        below: Whether it blocks turning back, not forth.
    """

    position: float
    stiffness: float = 20.0
    below: bool = False

    def __post_init__(self) -> None:
        if not math.isfinite(self.position):
            raise InvalidValueError(f"position = {self.position!r} rad: must be finite; for no wall give none")
        positive("stiffness", self.stiffness, "N m/rad")

    def torque(self, position: float) -> float:
        """Return how it pushes the shaft [N m] at a position [rad]."""
        depth = position - self.position
        return -self.stiffness * (min(depth, 0.0) if self.below else max(depth, 0.0))


@dataclass(slots=True, eq=False)
class SimpleServo:
    """One motor without inertia: its speed is what drag leaves of the torque.

    Attributes:
        motor: What it is like.
        wall: What it may run into; None for nothing.
        state: As it measures itself.
    """

    motor: ServoMotor = field(default_factory=ServoMotor)
    wall: ElasticWall | None = None
    state: ServoState = field(default_factory=lambda: ServoState(0.0, 0.0, 0.0))

    def step(self, goal: ServoGoal, period: float) -> None:
        """Go on by a period [s]."""
        motor, wall = self.motor, self.wall
        position = self.state.position
        current = 0.0
        if goal.torque_on:
            current = max(-goal.current, min(goal.current, motor.gain * (goal.position - position)))
        torque = motor.torque_constant * current + (wall.torque(position) if wall is not None else 0.0)
        driving = math.copysign(max(0.0, abs(torque) - motor.friction), torque)
        # implicit in the stiffness that acts, so that no step overshoots however stiff the wall is
        stiffness = 0.0
        if wall is not None and wall.torque(position) != 0.0:
            stiffness += wall.stiffness
        if goal.torque_on and abs(current) < goal.current:
            stiffness += motor.torque_constant * motor.gain
        velocity = driving / (motor.drag + stiffness * period)
        if goal.torque_on and goal.speed > 0.0:
            velocity = max(-goal.speed, min(goal.speed, velocity))
        self.state = ServoState(position + velocity * period, velocity, current)
