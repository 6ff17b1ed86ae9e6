"""A MuJoCo scene behind the seam."""

from dataclasses import dataclass
from types import TracebackType
from typing import Self

import mujoco

from palpate.errors import InvalidValueError, SimulationDivergedError, positive
from palpate.runtime.data import ArmSample, Command, Sample, WrenchSample
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.sim.noise import NoiseSource, WrenchNoise
from palpate.sim.scene import StageScene
from palpate.spatial import IDENTITY, Vector, add_scaled, norm, subtract

_DIVERGED = 1e8
"""A sum of sensor values beyond this [N, m, m/s, ...], or NaN, comes from no scene that people build."""


@dataclass(frozen=True, slots=True)
class Truth:
    """What really happens at the contact, for checks; no controller sees it.

    Attributes:
        touching: Whether tip and object are in contact.
        position: Force-weighted centroid of the contacts, base frame [m].
        force: What the object exerts on the tip, base frame [N].
        torque: Likewise, about `position` [N m].
    """

    touching: bool
    position: Vector
    force: Vector
    torque: Vector


class MujocoBackend:
    """Runs a stage scene: one call of `step` is one control period of simulated time.

    Every sensor value belongs to the state before the last time step, as MuJoCo computes them; the sample's
    time says so.
    """

    def __init__(
        self,
        scene: StageScene,
        period: float = 1e-3,
        noise: WrenchNoise | None = None,
        pacer: Pacer | None = None,
    ) -> None:
        """Take a scene.

        Args:
            scene: What to simulate.
            period: Control period [s], a whole number of time steps.
            noise: Of the force/torque sensor; none if not given.
            pacer: Where time comes from; as fast as it can be computed if not given.

        Raises:
            InvalidValueError: The period is not a whole number of time steps.
        """
        steps = round(positive("period", period, "s") / scene.time_step)
        if steps < 1 or abs(steps * scene.time_step - period) > 1e-9 * period:
            raise InvalidValueError(
                f"period = {period:g} s: must be a whole number of time steps of {scene.time_step:g} s"
            )
        self.scene = scene
        self._period = period
        self._pacer = pacer or SimulatedTime()
        self._steps = steps
        self._given_noise = noise or WrenchNoise()
        self._noise = NoiseSource(self._given_noise)
        self._data = mujoco.MjData(scene.model)
        # views that live as long as the data: fetching them anew costs a microsecond a period
        self._position, self._control, self._readings = self._data.qpos, self._data.ctrl, self._data.sensordata
        self._start: Vector = tuple(scene.model.body("stage").pos.tolist())
        self._reference: Vector = (0.0, 0.0, 0.0)
        self._sensors: list[float] = []

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self._period

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    def start(self) -> Sample:
        """Put the stage at its start, standing still, and return the first sample."""
        mujoco.mj_resetData(self.scene.model, self._data)
        self._noise = NoiseSource(self._given_noise)  # the same run again
        self._reference = (0.0, 0.0, 0.0)
        mujoco.mj_forward(self.scene.model, self._data)
        return self._sample(self._data.time)

    def step(self, command: Command) -> Sample:
        """Simulate one period with the commanded velocity.

        Raises:
            SimulationDivergedError: The simulation diverged.
        """
        model, data, dt, control = self.scene.model, self._data, self.scene.time_step, self._control
        velocity, (x, y, z) = command.velocity_base_tip, self._leashed()
        # the servos get a ramp, not stairs, whose ripple would break friction
        dx, dy, dz = dt * velocity[0], dt * velocity[1], dt * velocity[2]
        for _ in range(self._steps):
            x, y, z = x + dx, y + dy, z + dz
            control[0], control[1], control[2] = x, y, z
            mujoco.mj_step(model, data)
        self._reference = (x, y, z)
        sample = self._sample(data.time - self.scene.time_step)
        if not abs(sum(self._sensors)) < _DIVERGED:
            raise SimulationDivergedError(
                f"the simulation diverged at t = {data.time:.4f} s: take a softer contact or a smaller time step"
            )
        self._pacer.wait()
        return sample

    def close(self) -> None:
        """Stop: the reference stays where the stage is."""
        x, y, z = self._data.qpos.tolist()
        self._reference = (x, y, z)
        self._data.qvel[:] = 0.0

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close, whatever happened."""
        self.close()

    def truth(self) -> Truth:
        """Return what really happened at the time of the last sample."""
        found, fx, fy, fz, tx, ty, tz, x, y, z = self._sensors[15:25]
        # the contact sensor gives what its first geom, the tip, exerts on the object
        return Truth(found > 0.0, (x, y, z), (-fx, -fy, -fz), (-tx, -ty, -tz))

    def _leashed(self) -> Vector:
        """The servos' reference, drawn back to within the leash of the actual position."""
        x, y, z = self._position.tolist()
        ahead = subtract(self._reference, (x, y, z))
        distance, leash = norm(ahead), self.scene.stage.leash
        return self._reference if distance <= leash else add_scaled((x, y, z), leash / distance, ahead)

    def _sample(self, time: float) -> Sample:
        self._sensors = s = self._readings.tolist()
        # the site sensors give what the tip exerts on the stage, inertia included: the load is the opposite
        wrench = self._noise.add_to((-s[6], -s[7], -s[8], -s[9], -s[10], -s[11]))
        arm = ArmSample(time, (s[0], s[1], s[2]), IDENTITY, (s[3], s[4], s[5]))
        return Sample(time, arm, (WrenchSample(time, wrench, (s[12], s[13], s[14])),))
