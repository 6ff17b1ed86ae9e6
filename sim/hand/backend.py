"""A MuJoCo grasp scene as a back end."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.closing import Closing
from palpate.runtime.data import ArmSample, Command, Sample
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.runtime.watchdog import STEPPED, DeviceWatchdog
from palpate.sim.contact_truth import UNKNOWN, Truth
from palpate.sim.friction.plant import FrictionContact, FrictionPlant, FrictionState, check_friction
from palpate.sim.friction.step import FrictionStep, MujocoFriction
from palpate.sim.hand.hand import finger_name
from palpate.sim.hand.hand_model import HandDrive
from palpate.sim.hand.load import NO_LOAD, LoadDrive, ObjectLoad
from palpate.sim.hand.scene import FIXTURE, OBJECT, SENSORS_AT_ALL, SENSORS_PER_FINGER, GraspScene
from palpate.sim.hand.touched import TOUCHED, TOUCHED_READINGS
from palpate.sim.hand.truth import HandTruth, truth_of_contacts, truth_of_readings
from palpate.sim.hand.truth_numbers import hand_columns, numbers_of_hand
from palpate.sim.objects.target import Nowhere, Placer
from palpate.sim.physics import check_converged, check_motion, set_state, state_of, state_size, whole_steps
from palpate.sim.scene import OBJECT_GEOM
from palpate.sim.sensor.model import SeededSensor
from palpate.sim.sensor.simulation import SensorState, simulated_sensor
from palpate.sim.tip import TIP_GEOM
from palpate.spatial import IDENTITY, ZERO, Vector, Wrench


@dataclass(frozen=True, slots=True, eq=False)
class HandState:
    """A `HandBackend`'s state between two periods, opaque."""

    physics: FloatArray
    readings: FloatArray
    last_time: float
    drive: tuple[float, ...]
    grip: Any
    sensors: tuple[SensorState, ...]
    friction: FrictionState | None
    load: Wrench


class HandBackend(Closing):
    """Runs a grasp scene: one call of `step` is one control period of simulated time.

    The arm in its samples is what carries the hand: its tip frame is the hand frame. Where each sensor frame is in
    that, `HandModel.sensor_poses` tells from the joint positions. Sensor values belong to the state before the
    last time step, as MuJoCo computes them; the sample's time says so. Joint positions are as old as the bus made
    them.
    """

    def __init__(
        self,
        scene: GraspScene,
        period: float = 1e-3,
        sensor: SeededSensor | Sequence[SeededSensor] | None = None,
        pacer: Pacer | None = None,
        load: ObjectLoad | None = None,
        grip: Callable[[Any, mujoco.MjModel, mujoco.MjData], HandDrive] | None = None,
    ) -> None:
        """Take a scene.

        Args:
            scene: What to simulate.
            period: Control period [s], a whole number of time steps.
            sensor: Behind each fingertip, each with the next seed, or one for each; a perfect one if not given.
            pacer: Where time comes from; as fast as it can be computed if not given.
            load: What pulls at the object, besides its weight; nothing if not given.
            grip: What drives the fingers, if it is not the hand's own drive: a `ServoGrip` takes goals from
                somebody else's bus.

        Raises:
            InvalidValueError: Period or bus period is not a whole number of time steps.
        """
        self.scene = scene
        self._period = period
        self._steps = whole_steps("period", period, scene.fidelity.time_step)
        self._pacer = pacer or SimulatedTime()
        model, n = scene.model, scene.hand.fingers
        given = sensor or SeededSensor()
        if isinstance(given, SeededSensor):
            given = [SeededSensor(given.model, given.seed + i) for i in range(n)]
        self._seeds = [each.seed for each in given]
        self._data = data = mujoco.MjData(model)
        self._sensors = tuple(simulated_sensor(each.model, period, each.seed) for each in given)
        self._grip = scene.hand.drive(model, data) if grip is None else grip(scene.hand, model, data)
        self._drive = scene.carrier.drive(model, data, period)
        tips = [
            tip.placer(model, data, f"{finger_name(i)}_{TIP_GEOM}", scene.target.shape)
            for i, tip in enumerate(scene.hand.tips)
        ]
        if scene.touched is not None:
            tips = [scene.touched.placer(model, data, OBJECT_GEOM), *tips]
        self._tips: tuple[Placer, ...] = tuple(tip for tip in tips if not isinstance(tip, Nowhere))
        self._plant = FrictionPlant(model, data, scene.rubbing) if scene.rubbing else None
        self._friction: FrictionStep = self._plant or MujocoFriction(model, data)
        self._load = None if load is None else LoadDrive(load, model, data, OBJECT)
        self._readings = data.sensordata  # a view that lives as long as the data
        self._values: list[float] = []
        self._row: tuple[float, ...] = ()
        self._time = 0.0
        self._arm = ArmSample(0.0, ZERO, IDENTITY, ZERO, ())

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self._period

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    @property
    def grip(self) -> HandDrive:
        """What drives the fingers."""
        return self._grip

    def start(self) -> Sample:
        """Open the hand, put the object at its start, and return the first sample."""
        mujoco.mj_resetData(self.scene.model, self._data)
        self._grip.start()
        self._drive.start()
        for each, seed in zip(self._sensors, self._seeds, strict=True):
            each.restart(seed)
        self._place_tips()
        self._friction.reset()
        if self._load is not None:
            self._load.start()
        # every sample belongs to the state before the last time step, the first one too: time goes on from here
        self._advance()
        return self._sample(0.0)

    def step(self, command: Command) -> Sample:
        """Simulate one period; grip forces reach the fingers with the next exchange on the bus.

        Raises:
            InvalidValueError: A motion that the carrier cannot do, or of absurd numbers; or see `Grip.command`
                and `Grip.move`.
            SimulationDivergedError: The simulation diverged.
        """
        data, drive, grip = self._data, self._drive, self._grip
        check_motion(command.velocity_base_tip, command.angular_velocity_base_tip)
        drive.begin(command.velocity_base_tip, command.angular_velocity_base_tip)
        if command.grip_force is not None:
            grip.command(command.grip_force)
        grip.move(command.finger_velocity)
        for _ in range(self._steps):
            self._advance()
        sample = self._sample(data.time - self.scene.fidelity.time_step)
        check_converged(self._values, data.time)
        self._pacer.wait()
        return sample

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`."""
        return (STEPPED,)

    def release(self) -> None:
        """Let go of the object that a fixture holds, until the next start."""
        self._data.eq_active[self.scene.model.equality(FIXTURE).id] = 0

    def close(self) -> None:
        """Stop the carrier where it is. The grip stays as it is: nothing is dropped."""
        self._data.qvel[:] = 0.0
        self._drive.start()

    def truth(self) -> HandTruth:
        """Return what really happened at the time of the last sample."""
        s = self._values
        x, y, z, u, v, w, qw, qx, qy, qz, a, b, c = s[6:SENSORS_AT_ALL]
        contacts = None if self._plant is None else self._plant.contacts
        fingers = []
        joints, currents = self._grip.last()
        for i, current in enumerate(currents):
            if contacts is None:
                at = SENSORS_AT_ALL + SENSORS_PER_FINGER * i
                fingers.append(truth_of_readings(s[at + 9 : at + SENSORS_PER_FINGER], current))
            else:
                its = tuple(contact for contact in contacts if contact.pair is self.scene.rubbing[i])
                fingers.append(truth_of_contacts(its, current))
        return HandTruth(self._time, tuple(fingers), joints, (x, y, z), (qw, qx, qy, qz), (u, v, w), (a, b, c))

    def push(self, force: Vector) -> None:
        """Push at the object's centre of mass from now on, base frame [N]; a start ends it."""
        self._data.xfrc_applied[self.scene.model.body(OBJECT).id, :3] = force

    def touched_truth(self) -> Truth:
        """Return what really happened then between the object and what it touches; unknown of nothing."""
        touched = self.scene.touched
        if touched is None:
            return UNKNOWN
        at = SENSORS_AT_ALL + SENSORS_PER_FINGER * self.scene.hand.fingers
        return touched.truth(self._values[at : at + TOUCHED_READINGS])

    def touched_points(self) -> FloatArray:
        """Return where the object touches what it is to touch now, base frame, shape (n, 3) [m]; for checks."""
        geoms = {int(self.scene.model.geom(name).id) for name in (OBJECT_GEOM, TOUCHED)}
        found = [each.pos for each in self._data.contact if {int(each.geom1), int(each.geom2)} == geoms]
        return np.array(found).reshape(-1, 3)

    @property
    def pull(self) -> Wrench:
        """What pulled at the object at the time of the last sample, as `ObjectLoad.wrench` tells it."""
        return NO_LOAD if self._load is None else self._load.last

    @property
    def rubbing(self) -> tuple[FrictionContact, ...]:
        """How fingertips and object stick and slip at that time, for checks; only a friction plant tells."""
        return () if self._plant is None else self._plant.contacts

    @property
    def truth_columns(self) -> tuple[str, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        return hand_columns(self.scene.hand)

    def truth_row(self) -> tuple[float, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        if not self._row:  # which two ask for in every period
            self._row = numbers_of_hand(self.truth(), self.pull, self._arm, self.rubbing, self.scene)
        return self._row

    def snapshot(self) -> HandState:
        """Return a copy of all that decides about what comes."""
        physics = state_of(self.scene.model, self._data)
        return HandState(
            physics,
            self._readings.copy(),
            self._time,
            self._drive.snapshot(),
            self._grip.state(),
            tuple(sensor.state() for sensor in self._sensors),
            None if self._plant is None else self._plant.snapshot(),
            self.pull,
        )

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
        check_friction(state.friction, self._plant)
        set_state(self.scene.model, self._data, state.physics)
        np.copyto(self._readings, state.readings)
        self._values = self._readings.tolist()
        self._time, self._row = state.last_time, ()
        self._drive.restore(state.drive)
        self._grip.set_state(state.grip)
        if self._plant is not None and state.friction is not None:
            self._plant.restore(state.friction)
        if self._load is not None:
            self._load.last = state.load
        for sensor, its in zip(self._sensors, state.sensors, strict=True):
            sensor.set_state(its)

    def _advance(self) -> None:
        """Simulate one time step."""
        self._drive.advance()
        self._grip.advance()
        if self._load is not None:
            self._load.advance()
        self._place_tips()
        self._friction.advance()

    def _place_tips(self) -> None:
        for tip in self._tips:
            tip.place()

    def _sample(self, time: float) -> Sample:
        self._time, self._row = time, ()
        self._values = s = self._readings.tolist()
        wrenches = []
        at = SENSORS_AT_ALL
        for sensor in self._sensors:
            a, b, c, d, e, f, x, y, z = s[at : at + 9]
            # the site sensors give what the tip exerts on the finger, inertia included: the load is the opposite
            wrenches.append(sensor.step(time, (-a, -b, -c, -d, -e, -f), (x, y, z)))
            at += SENSORS_PER_FINGER
        self._arm = self._drive.sample(time, s)
        return Sample(time, self._arm, tuple(wrenches), self._grip.sample)


class WrappedHand(Closing):
    """Base of back ends that show a hand which holds something as a robot with one fingertip."""

    def __init__(self, hand: HandBackend, pacer: Pacer | None) -> None:
        """Take the back end of the hand, and the pacer of the run; that of the hand, if not given."""
        self._hand = hand
        self._pacer = pacer or hand.pacer
        self._begin = 0.0

    @property
    def scene(self) -> GraspScene:
        """What is simulated."""
        return self._hand.scene

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self._hand.period

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`."""
        return (STEPPED,)

    def close(self) -> None:
        """Stop the hand where it is; what it holds stays held."""
        self._hand.close()
