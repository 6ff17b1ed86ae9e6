"""A MuJoCo scene as a back end."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.kinematics.pose import Pose
from palpate.runtime.closing import Closing
from palpate.runtime.data import Command, Sample
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.runtime.watchdog import STEPPED, DeviceWatchdog
from palpate.sim.contact_truth import CONTACT_COLUMNS, Truth, numbers_of_truth
from palpate.sim.friction.plant import FrictionPlant, FrictionState, check_friction
from palpate.sim.friction.resultant import resultant
from palpate.sim.friction.step import FrictionStep, MujocoFriction
from palpate.sim.objects.target import Mount
from palpate.sim.objects.traced import TracedObject
from palpate.sim.physics import check_converged, check_motion, set_state, state_of, state_size, whole_steps
from palpate.sim.scene import OBJECT_GEOM, Scene
from palpate.sim.sensor.model import SeededSensor
from palpate.sim.sensor.simulation import SensorState, simulated_sensor
from palpate.sim.tip import TIP_GEOM
from palpate.spatial import ZERO, add, rotate, scale


@dataclass(frozen=True, slots=True, eq=False)
class BackendState:
    """A moment of a simulation, opaque: see `MujocoBackend.snapshot`.

    Attributes:
        simulation: MuJoCo's own state, as it integrates it.
        drive: What the carrier's drive remembers.
        sensor: What the force/torque sensor remembers.
        readings: Of the last sample.
        friction: What the friction plant remembers, if there is one.
    """

    simulation: FloatArray
    drive: tuple[float, ...]
    sensor: SensorState
    readings: tuple[float, ...]
    friction: FrictionState | None


class MujocoBackend(Closing):
    """Runs a scene: one call of `step` is one control period of simulated time.

    The machine measures the force on its tip without flaws, as with an ideal sensor in its flange, whatever flaws
    the fingertip's own sensor has.

    Every sensor value belongs to the state before the last time step, as MuJoCo computes them; the sample's
    time says so.
    """

    def __init__(
        self,
        scene: Scene,
        period: float = 1e-3,
        sensor: SeededSensor | None = None,
        pacer: Pacer | None = None,
    ) -> None:
        """Take a scene.

        Args:
            scene: What to simulate.
            period: Control period [s], a whole number of time steps.
            sensor: The force/torque sensor behind the tip; a perfect one if not given.
            pacer: Where time comes from; as fast as it can be computed if not given.

        Raises:
            InvalidValueError: The period is not a whole number of time steps.
        """
        self.scene = scene
        self._period = period
        self._pacer = pacer or SimulatedTime()
        self._steps = whole_steps("period", period, scene.fidelity.time_step)
        given = sensor or SeededSensor()
        self._seed = given.seed
        self._sensor = simulated_sensor(given.model, period, given.seed)
        self._data = mujoco.MjData(scene.model)
        self._readings = self._data.sensordata  # a view that lives as long as the data
        self._drive = scene.carrier.drive(scene.model, self._data, period)
        self._plant = FrictionPlant(scene.model, self._data, scene.rubbing) if scene.rubbing else None
        tip = scene.tip.placer(scene.model, self._data, TIP_GEOM, scene.target.shape)
        target = scene.target.placer(scene.model, self._data, OBJECT_GEOM, TIP_GEOM)
        # a tangent plane lies under the tip's geom; what moves by itself is moved before the tip's geom
        self._placers = (tip, target) if isinstance(scene.target.shape, TracedObject) else (target, tip)
        # of an object that moves, sensors tell
        self._still = Pose(scene.target.position) if scene.target.mount is Mount.FIXED else None
        self._matrix = np.zeros(9)
        self._friction: FrictionStep = self._plant or MujocoFriction(scene.model, self._data)
        self._readings_now: list[float] = []

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self._period

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    def start(self) -> Sample:
        """Put everything at its start, standing still, and return the first sample."""
        mujoco.mj_resetData(self.scene.model, self._data)
        self._sensor.restart(self._seed)  # the same run again
        self._drive.start()
        self._place()
        self._friction.reset()
        # every sample belongs to the state before the last time step, the first one too: time goes on from here
        self._drive.advance()
        self._friction.advance()
        return self._sample(0.0)

    def step(self, command: Command) -> Sample:
        """Simulate one period with the commanded velocity.

        Raises:
            InvalidValueError: A motion that the carrier cannot do, or of absurd numbers.
            SimulationDivergedError: The simulation diverged.
        """
        data, drive, friction = self._data, self._drive, self._friction
        check_motion(command.velocity_base_tip, command.angular_velocity_base_tip)
        drive.begin(command.velocity_base_tip, command.angular_velocity_base_tip)
        for _ in range(self._steps):
            drive.advance()
            self._place()
            friction.advance()
        sample = self._sample(data.time - self.scene.fidelity.time_step)
        check_converged(self._readings_now, data.time)
        self._pacer.wait()
        return sample

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`."""
        return (STEPPED,)

    def close(self) -> None:
        """Stop: the reference stays where the carrier is."""
        self._data.qvel[:] = 0.0
        self._drive.start()

    def snapshot(self) -> BackendState:
        """Return this moment, to come back to with `restore`."""
        return BackendState(
            state_of(self.scene.model, self._data),
            self._drive.snapshot(),
            self._sensor.state(),
            tuple(self._readings_now),
            None if self._plant is None else self._plant.snapshot(),
        )

    def restore(self, state: BackendState) -> None:
        """Go back, or on, to a moment of this scene: from there on all is bit for bit as it was.

        Raises:
            InvalidValueError: It is a moment of another scene.
        """
        size = state_size(self.scene.model)
        if state.simulation.shape != (size,):
            raise InvalidValueError(
                f"the state holds {state.simulation.size} numbers, this scene {size}: take one of this scene"
            )
        check_friction(state.friction, self._plant)
        set_state(self.scene.model, self._data, state.simulation)
        self._drive.restore(state.drive)
        if self._plant is not None and state.friction is not None:
            self._plant.restore(state.friction)
        self._sensor.set_state(state.sensor)
        self._readings_now = list(state.readings)

    def truth(self) -> Truth:
        """Return what really happened at the time of the last sample."""
        pose = self._pose_base_object()
        if self._plant is not None:
            contacts = self._plant.contacts
            return Truth(True, *resultant(contacts), pose) if contacts else Truth(False, ZERO, ZERO, ZERO, pose)
        found, fx, fy, fz, tx, ty, tz, x, y, z = self._readings_now[15:25]
        # the contact sensor gives what its first geom, the tip, exerts on the object
        return Truth(found > 0.0, (x, y, z), (-fx, -fy, -fz), (-tx, -ty, -tz), pose)

    @property
    def truth_columns(self) -> tuple[str, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        return CONTACT_COLUMNS

    def truth_row(self) -> tuple[float, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        return numbers_of_truth(self.truth())

    def _place(self) -> None:
        """Put what follows from time and poses alone where it belongs."""
        for placer in self._placers:
            placer.place()

    def _pose_base_object(self) -> Pose:
        if self._still is not None:
            return self._still
        x, y, z, *quat_wxyz = self._readings_now[25:32]
        mujoco.mju_quat2Mat(self._matrix, quat_wxyz)
        a, b, c, d, e, f, g, h, i = self._matrix.tolist()
        return Pose((x, y, z), ((a, b, c), (d, e, f), (g, h, i)))

    def _sample(self, time: float) -> Sample:
        self._readings_now = s = self._readings.tolist()
        # the site sensors give what the tip exerts on what carries it, inertia included: the load is the opposite
        load, acceleration = (-s[6], -s[7], -s[8], -s[9], -s[10], -s[11]), (s[12], s[13], s[14])
        arm = self._drive.sample(time, s)
        x, y, z = add(load[:3], scale(self.scene.tip.mass, acceleration))
        arm = replace(arm, tip_force_base=rotate(arm.rotation_base_tip, (x, y, z)))
        return Sample(time, arm, (self._sensor.step(time, load, acceleration),))
