"""A MuJoCo scene as a back end."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.closing import Closing
from palpate.runtime.data import Command, Sample
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.runtime.watchdog import STEPPED, DeviceWatchdog
from palpate.sim.contact_truth import CONTACT_COLUMNS, Truth, truth_of_numbers
from palpate.sim.friction.plant import FrictionPlant, FrictionState, check_friction
from palpate.sim.friction.resultant import resultant
from palpate.sim.friction.step import FrictionStep, MujocoFriction
from palpate.sim.objects.target import Mount, Nowhere
from palpate.sim.objects.traced import TracedObject
from palpate.sim.physics import check_converged, check_motion, set_state, state_of, state_size, whole_steps
from palpate.sim.scene import OBJECT_GEOM, Scene
from palpate.sim.sensor.model import SeededSensor
from palpate.sim.sensor.simulation import SensorState, simulated_sensor
from palpate.sim.tip import TIP_GEOM
from palpate.spatial import IDENTITY, ZERO


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
        placers = (tip, target) if isinstance(scene.target.shape, TracedObject) else (target, tip)
        self._placers = tuple(placer for placer in placers if not isinstance(placer, Nowhere))
        # of an object that moves, sensors tell
        still = scene.target.mount is Mount.FIXED
        self._still = (*scene.target.position, *chain.from_iterable(IDENTITY)) if still else None
        self._matrix = np.zeros(9)
        self._friction: FrictionStep = self._plant or MujocoFriction(scene.model, self._data)
        self._readings_now: list[float] = []
        self._mass, self._time_step = scene.tip.mass, scene.fidelity.time_step

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
        sample = self._sample(data.time - self._time_step)
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
        return truth_of_numbers(self.truth_row())

    @property
    def truth_columns(self) -> tuple[str, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        return CONTACT_COLUMNS

    def truth_row(self) -> tuple[float, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        if self._plant is not None:
            contacts = self._plant.contacts
            position, force, torque = resultant(contacts) if contacts else (ZERO, ZERO, ZERO)
            return (float(bool(contacts)), *position, *force, *torque, *self._object_pose())
        found, fx, fy, fz, tx, ty, tz, x, y, z = self._readings_now[15:25]
        # the contact sensor gives what its first geom, the tip, exerts on the object
        return (float(found > 0.0), x, y, z, -fx, -fy, -fz, -tx, -ty, -tz, *self._object_pose())

    def _object_pose(self) -> Sequence[float]:
        if self._still is not None:
            return self._still
        pose = self._readings_now[25:28]
        mujoco.mju_quat2Mat(self._matrix, self._readings_now[28:32])
        return pose + self._matrix.tolist()

    def _place(self) -> None:
        """Put what follows from time and poses alone where it belongs."""
        for placer in self._placers:
            placer.place()

    def _sample(self, time: float) -> Sample:
        self._readings_now = s = self._readings.tolist()
        fx, fy, fz, mx, my, mz, ax, ay, az = s[6:15]
        mass = self._mass
        # the site sensors give what the tip exerts on what carries it, inertia included: the load is the opposite
        arm = self._drive.sample(time, s, (mass * ax - fx, mass * ay - fy, mass * az - fz))
        reading = self._sensor.step(time, (-fx, -fy, -fz, -mx, -my, -mz), (ax, ay, az))
        return Sample(time, arm, (reading,))
