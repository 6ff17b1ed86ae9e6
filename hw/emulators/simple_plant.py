"""Built-in plants behind emulated devices: a tip over a plane with servos, or a load alone."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from palpate.errors import InvalidValueError, check_positive, not_negative, positive
from palpate.hw.emulators.server import PlantState, ServoGoal, ServoState
from palpate.kinematics.pose import Pose, checked_pose, orthonormal, rotation_from_rotvec, times
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.spatial import IDENTITY, ZERO, Vector, Wrench, add, add_scaled, rotate_back, scale

GRAVITY = 9.81
"""Specific force of an accelerometer at rest, upwards [m/s^2]."""

SILENT: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Noise of a sensor without noise."""

STANDING: Vector = (0.0, 0.0, 9.80665)
"""Specific force of a sensor that stands upright [m/s^2]."""

STEADY_PERIOD = 0.01
"""Period of a plant with a constant load [s]."""


@dataclass(frozen=True, slots=True)
class ElasticPlane:
    """A horizontal plane without friction that pushes the tip's origin upwards.

    Attributes:
        height: Height of its surface [m], base frame.
        stiffness: [N/m].
        damping: [N s/m]; the plane never pulls.
    """

    height: float
    stiffness: float = 2000.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.height):
            raise InvalidValueError(f"height = {self.height!r} m: must be finite; for no plane give none")
        positive("stiffness", self.stiffness, "N/m")
        not_negative("damping", self.damping, "N s/m")

    def force(self, height: float, speed: float) -> float:
        """Return the normal force [N] on a point at a height [m] that rises with a speed [m/s]."""
        depth = self.height - height
        if depth <= 0.0:
            return 0.0
        return max(0.0, self.stiffness * depth - self.damping * speed)


def _hanging() -> Pose:
    """Return the pose of a UR5e's flange over its work place, z down: joints at -90, -90, 90, -90, -90, 0 deg."""
    return Pose((-0.1333, 0.4919, 0.4879), ((0.0, -1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))


@dataclass(slots=True, eq=False)
class SimpleTip:
    """Tip that follows velocities with a lag; its sensor is in the tip frame and weighs nothing.

    Attributes:
        pose_base_tip: Pose of the tip; before the first step, the start.
        plane: Plane that it may touch; None for nothing.
        lag: Time constant of the velocity [s]; that of a UR e-Series is about 10 ms [A].
    """

    pose_base_tip: Pose = field(default_factory=_hanging)
    plane: ElasticPlane | None = None
    lag: float = 0.01
    _velocity: Vector = field(default=ZERO, init=False)
    _turning: Vector = field(default=ZERO, init=False)

    def __post_init__(self) -> None:
        checked_pose("pose_base_tip", self.pose_base_tip)
        not_negative("lag", self.lag, "s")

    def step(self, velocity: Vector, angular_velocity: Vector, period: float) -> None:
        """Advance by a period [s] with the commanded velocities [m/s, rad/s]."""
        # exact for a first-order lag whose input is held
        share = 1.0 if self.lag == 0.0 else -math.expm1(-period / self.lag)
        before, turning = self._velocity, self._turning
        self._velocity = _towards(before, velocity, share)
        self._turning = _towards(turning, angular_velocity, share)
        pose = self.pose_base_tip
        step = scale(0.5 * period, add(before, self._velocity))
        turn = scale(0.5 * period, add(turning, self._turning))
        rotation = orthonormal(times(rotation_from_rotvec(turn), pose.rotation))
        self.pose_base_tip = Pose(add(pose.position, step), rotation)

    def measured(self, time: float) -> tuple[ArmSample, WrenchSample]:
        """Return the samples of arm and sensor at a time [s]."""
        pose = self.pose_base_tip
        arm = ArmSample(
            time, pose.position, pose.rotation, self._velocity, angular_velocity_base_tip=self._turning
        )
        push = 0.0
        if self.plane is not None:
            push = self.plane.force(pose.position[2], self._velocity[2])
        force = rotate_back(pose.rotation, (0.0, 0.0, push))
        up = rotate_back(pose.rotation, (0.0, 0.0, GRAVITY))
        return arm, WrenchSample(time, (*force, 0.0, 0.0, 0.0), up)


def _towards(a: Vector, b: Vector, share: float) -> Vector:
    """Interpolate linearly between a and b."""
    return add_scaled(scale(1.0 - share, a), share, b)


@dataclass(frozen=True, slots=True)
class ServoMotor:
    """Motor with its gear, at the shaft. Assumed, near a Dynamixel XL330-M288.

    Attributes:
        torque_constant: Torque per current [N m/A]: 0.52 N m at 1.47 A stall.
        drag: Torque per speed [N m s/rad]: 0.52 N m lost at its free speed of 103 rev/min, 10.8 rad/s.
        friction: Friction of the gear, the least torque that moves it [N m].
        gain: Gain of the position controller [A/rad]: full current at 0.15 rad.
    """

    torque_constant: float = 0.35
    drag: float = 0.048
    friction: float = 0.01
    gain: float = 10.0

    def __post_init__(self) -> None:
        check_positive(self, torque_constant="N m/A", drag="N m s/rad", gain="A/rad")
        not_negative("friction", self.friction, "N m")


@dataclass(frozen=True, slots=True)
class ElasticWall:
    """Elastic stop of the shaft.

    Attributes:
        position: Angle at which it begins [rad].
        stiffness: [N m/rad].
        below: Whether it blocks turning backwards instead of forwards.
    """

    position: float
    stiffness: float = 20.0
    below: bool = False

    def __post_init__(self) -> None:
        if not math.isfinite(self.position):
            raise InvalidValueError(f"position = {self.position!r} rad: must be finite; for no wall give none")
        positive("stiffness", self.stiffness, "N m/rad")

    def torque(self, position: float) -> float:
        """Return the torque on the shaft [N m] at a position [rad]."""
        depth = position - self.position
        return -self.stiffness * (min(depth, 0.0) if self.below else max(depth, 0.0))


@dataclass(slots=True, eq=False)
class SimpleServo:
    """Motor without inertia: its speed is the driving torque over the drag.

    Attributes:
        motor: Properties of the motor.
        wall: Stop that it may run into; None for nothing.
        state: Measurements of the servo.
    """

    motor: ServoMotor = field(default_factory=ServoMotor)
    wall: ElasticWall | None = None
    state: ServoState = field(default_factory=lambda: ServoState(0.0, 0.0, 0.0))

    def step(self, goal: ServoGoal, period: float) -> None:
        """Advance by a period [s]."""
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


class SimplePlant:
    """Tip that may touch an elastic plane, and servos independent of it."""

    def __init__(
        self,
        tip: SimpleTip | None = None,
        servos: tuple[SimpleServo, ...] = (),
        period: float = 0.002,
        noise: Sequence[Wrench] = (SILENT,),
    ) -> None:
        """Stand still at the start.

        Args:
            tip: Tip of the arm; None: one with nothing in its reach.
            servos: Servos of the hand.
            period: Duration of a step [s]; 0.002 is the cycle of an e-Series controller.
            noise: Standard deviation of a reading of each force/torque sensor behind the tip [N, N m].

        Raises:
            InvalidValueError: If the period is not above zero.
        """
        if not 0.0 < period < 1.0:
            raise InvalidValueError(f"period = {period!r} s: must be between 0 and 1 s")
        self._period = period
        self._tip = SimpleTip() if tip is None else tip
        self._servos = servos
        self._steps = 0
        self._noise, self._random = np.array(noise), np.random.default_rng(0)

    @property
    def period(self) -> float:
        """Duration of a step [s]."""
        return self._period

    def start(self) -> PlantState:
        """Return the state before the first step."""
        return self._state()

    def step(
        self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector, servos: tuple[ServoGoal, ...]
    ) -> PlantState:
        """Advance by one period; servos without a goal stay as they are.

        Raises:
            InvalidValueError: If there are more goals than servos.
        """
        if len(servos) > len(self._servos):
            raise InvalidValueError(
                f"{len(servos)} servo goals for a plant with {len(self._servos)} servos: give it more servos"
            )
        self._steps += 1
        self._tip.step(velocity_base_tip, angular_velocity_base_tip, self._period)
        for servo, goal in zip(self._servos, servos, strict=False):
            servo.step(goal, self._period)
        return self._state()

    def close(self) -> None:
        """See `Plant`."""

    def _state(self) -> PlantState:
        time = self._steps * self._period
        arm, felt = self._tip.measured(time)
        drawn = self._noise * self._random.standard_normal(self._noise.shape)
        wrenches = tuple(replace(felt, wrench=tuple(row)) for row in (drawn + felt.wrench).tolist())
        return PlantState(time, arm, wrenches, tuple(servo.state for servo in self._servos))


class LoadPlant:
    """Plant behind a sensor alone: a load that follows a function of time. Nothing moves."""

    def __init__(self, load: Callable[[float], Wrench], period: float = 0.002) -> None:
        """Take the load.

        Args:
            load: Load [N, N m] as a function of the time since the start [s].
            period: Duration of a step [s].
        """
        self._load = load
        self._period = period
        self._steps = 0

    @property
    def period(self) -> float:
        """See `Plant`."""
        return self._period

    def start(self) -> PlantState:
        """See `Plant`."""
        self._steps = 0
        return self._state()

    def step(
        self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector, servos: tuple[ServoGoal, ...]
    ) -> PlantState:
        """See `Plant`."""
        self._steps += 1
        return self._state()

    def close(self) -> None:
        """See `Plant`."""

    def _state(self) -> PlantState:
        time = self._steps * self._period
        arm = ArmSample(time, ZERO, IDENTITY, ZERO)
        return PlantState(time, arm, (WrenchSample(time, self._load(time), STANDING),))


def steady_plant(load: Wrench) -> LoadPlant:
    """Return a plant with a constant load [N, N m]."""
    return LoadPlant(lambda time: load, STEADY_PERIOD)
