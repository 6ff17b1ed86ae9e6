"""A grasp scene behind the seam."""

from dataclasses import dataclass
from types import TracebackType
from typing import Self

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.data import ArmSample, Command, Sample
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.sim.hand.grip import Grip, GripState
from palpate.sim.hand.mount import LIFT, Lift
from palpate.sim.hand.scene import SENSORS_AT_ALL, SENSORS_PER_FINGER, GraspScene
from palpate.sim.physics import check_converged, set_state, state_of, state_size, whole_steps
from palpate.sim.sensor.model import SeededSensor
from palpate.sim.sensor.simulation import SensorState, simulated_sensor
from palpate.spatial import IDENTITY, Vector


@dataclass(frozen=True, slots=True)
class FingerTruth:
    """What really happens at one fingertip; base frame.

    Attributes:
        touching: Whether it touches the object.
        position: Force-weighted centroid of the contacts [m].
        force: What the object exerts on the tip [N].
        torque: Likewise, about `position` [N m].
        current: Of its servo [A].
        joint_position: Without rounding [rad or m].
    """

    touching: bool
    position: Vector
    force: Vector
    torque: Vector
    current: float
    joint_position: float


@dataclass(frozen=True, slots=True)
class HandTruth:
    """What really happens in a grasp, for checks; no controller sees it. Base frame.

    Attributes:
        time: To which it belongs, that of the last sample [s].
        fingers: One per finger.
        position: Of the object's frame [m].
        quat_wxyz: Its orientation, object to base.
        velocity: Of its frame [m/s].
        angular_velocity: Of the object [rad/s].
    """

    time: float
    fingers: tuple[FingerTruth, ...]
    position: Vector
    quat_wxyz: tuple[float, float, float, float]
    velocity: Vector
    angular_velocity: Vector


@dataclass(frozen=True, slots=True, eq=False)
class HandState:
    """A `HandBackend`'s state between two periods, opaque."""

    physics: FloatArray
    readings: FloatArray
    last_time: float
    height: float
    grip: GripState
    sensors: tuple[SensorState, ...]


class HandBackend:
    """Runs a grasp scene: one call of `step` is one control period of simulated time.

    The arm in its samples is the mount: its tip frame is the hand frame. Where each sensor frame is in that,
    `Hand.pose_hand_sensor` tells from the joint positions. Sensor values belong to the state before the last time
    step, as MuJoCo computes them; the sample's time says so. Joint positions are as old as the bus made them.
    """

    def __init__(
        self,
        scene: GraspScene,
        period: float = 1e-3,
        sensor: SeededSensor | None = None,
        pacer: Pacer | None = None,
    ) -> None:
        """Take a scene.

        Args:
            scene: What to simulate.
            period: Control period [s], a whole number of time steps.
            sensor: Behind each fingertip, each with the next seed; a perfect one if not given.
            pacer: Where time comes from; as fast as it can be computed if not given.

        Raises:
            InvalidValueError: Period or bus period is not a whole number of time steps.
        """
        self.scene = scene
        self._period = period
        self._steps = whole_steps("period", period, scene.fidelity.time_step)
        self._pacer = pacer or SimulatedTime()
        given = sensor or SeededSensor()
        self._seed = given.seed
        model, n = scene.model, scene.hand.fingers
        self._data = data = mujoco.MjData(model)
        self._sensors = tuple(simulated_sensor(given.model, period, given.seed + i) for i in range(n))
        self._grip = Grip(
            scene.hand, model, data, whole_steps("bus_period", scene.hand.bus_period, scene.fidelity.time_step)
        )
        self._lift = scene.mount if isinstance(scene.mount, Lift) else None
        if self._lift is not None:
            at, of = int(model.joint(LIFT).qposadr[0]), int(model.actuator(LIFT).id)
            # views that live as long as the data
            self._lift_position, self._lift_control = data.qpos[at : at + 1], data.ctrl[of : of + 1]
        self._readings = data.sensordata
        self._values: list[float] = []
        self._time = self._height = 0.0

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self._period

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    def start(self) -> Sample:
        """Open the hand, put the object at its start, and return the first sample."""
        mujoco.mj_resetData(self.scene.model, self._data)
        self._grip.start()
        self._height = 0.0
        for i, sensor in enumerate(self._sensors):
            sensor.restart(self._seed + i)
        # every sample belongs to the state before the last time step, the first one too: time goes on from here
        self._grip.advance()
        mujoco.mj_step(self.scene.model, self._data)
        return self._sample(0.0)

    def step(self, command: Command) -> Sample:
        """Simulate one period; grip forces reach the servos with the next exchange on the bus.

        Raises:
            InvalidValueError: A motion that the mount cannot do, or see `Grip.command`.
            SimulationDivergedError: The simulation diverged.
        """
        model, data, grip = self.scene.model, self._data, self._grip
        x, y, z = command.velocity_base_tip
        if x or y or (z and self._lift is None):
            can = "nothing" if self._lift is None else "z only"
            raise InvalidValueError(f"velocity_base_tip = {(x, y, z)} m/s: this hand's mount moves along {can}")
        if command.grip_force is not None:
            grip.command(command.grip_force)
        if self._lift is not None:
            actual, leash = float(self._lift_position[0]), self._lift.leash
            height, rise = (
                max(actual - leash, min(actual + leash, self._height)),
                self.scene.fidelity.time_step * z,
            )
            for _ in range(self._steps):
                self._height = height = height + rise
                self._lift_control[0] = height
                grip.advance()
                mujoco.mj_step(model, data)
        else:
            for _ in range(self._steps):
                grip.advance()
                mujoco.mj_step(model, data)
        sample = self._sample(data.time - self.scene.fidelity.time_step)
        check_converged(self._values, data.time)
        self._pacer.wait()
        return sample

    def close(self) -> None:
        """Stop the mount where it is. The grip stays as it is: nothing is dropped."""
        if self._lift is not None:
            self._height = float(self._lift_position[0])
            self._lift_control[0] = self._height

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close, whatever happened."""
        self.close()

    def truth(self) -> HandTruth:
        """Return what really happened at the time of the last sample."""
        s = self._values
        x, y, z, u, v, w, qw, qx, qy, qz, a, b, c = s[6:SENSORS_AT_ALL]
        fingers = []
        for i, (current, q) in enumerate(self._grip.last()):
            at = SENSORS_AT_ALL + SENSORS_PER_FINGER * i
            found, fx, fy, fz, tx, ty, tz, px, py, pz = s[at + 9 : at + SENSORS_PER_FINGER]
            # the contact sensor gives what its first geom, the tip, exerts on the object
            force, torque = (-fx, -fy, -fz), (-tx, -ty, -tz)
            fingers.append(FingerTruth(found > 0.0, (px, py, pz), force, torque, current, q))
        return HandTruth(self._time, tuple(fingers), (x, y, z), (qw, qx, qy, qz), (u, v, w), (a, b, c))

    def snapshot(self) -> HandState:
        """Return a copy of all that decides about what comes."""
        physics = state_of(self.scene.model, self._data)
        sensors = tuple(sensor.state() for sensor in self._sensors)
        return HandState(physics, self._readings.copy(), self._time, self._height, self._grip.state(), sensors)

    def restore(self, state: HandState) -> None:
        """Go on from a snapshot, bit for bit as from there before, in this back end or another of the same scene.

        Raises:
            InvalidValueError: It is another scene's.
        """
        size = state_size(self.scene.model)
        if state.physics.shape != (size,) or len(state.sensors) != len(self._sensors):
            raise InvalidValueError(
                f"the state holds {state.physics.size} numbers and {len(state.sensors)} fingers, this scene "
                f"{size} and {len(self._sensors)}: must come from the same scene"
            )
        set_state(self.scene.model, self._data, state.physics)
        np.copyto(self._readings, state.readings)
        self._values = self._readings.tolist()
        self._time, self._height = state.last_time, state.height
        self._grip.set_state(state.grip)
        for sensor, its in zip(self._sensors, state.sensors, strict=True):
            sensor.set_state(its)

    def _sample(self, time: float) -> Sample:
        self._time = time
        self._values = s = self._readings.tolist()
        wrenches = []
        at = SENSORS_AT_ALL
        for sensor in self._sensors:
            a, b, c, d, e, f, x, y, z = s[at : at + 9]
            # the site sensors give what the tip exerts on the finger, inertia included: the load is the opposite
            wrenches.append(sensor.step(time, (-a, -b, -c, -d, -e, -f), (x, y, z)))
            at += SENSORS_PER_FINGER
        arm = ArmSample(time, (s[0], s[1], s[2]), IDENTITY, (s[3], s[4], s[5]))
        return Sample(time, arm, tuple(wrenches), self._grip.sample)
