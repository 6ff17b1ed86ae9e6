"""From a wanted velocity of the tip to the servo references of a stage, time step by time step."""

import mujoco

from palpate.runtime.data import ArmSample
from palpate.sim.carriers.carrier import refuse_to_turn
from palpate.spatial import IDENTITY, ZERO, Vector, toward

FIRST_SLIDE = "x"
"""Joint and servo of the first of three slides, which come one after the other."""


class StageDrive:
    """Integrates velocities into references within the following-error limit of where the stage is."""

    def __init__(self, following_error_limit: float, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Take a stage in a scene.

        Args:
            following_error_limit: Largest distance of the reference from the actual position [m].
            model: The compiled scene.
            data: Its state, which must live on.
        """
        self._limit, self._dt = following_error_limit, float(model.opt.timestep)
        # views that live as long as the data: fetching them anew costs a microsecond a period
        at, of = int(model.joint(FIRST_SLIDE).qposadr[0]), int(model.actuator(FIRST_SLIDE).id)
        self._position, self._control = data.qpos[at : at + 3], data.ctrl[of : of + 3]
        self._reference: Vector = ZERO
        self._step: Vector = ZERO

    def start(self) -> None:
        """See `Drive`."""
        x, y, z = self._position.tolist()
        self._reference, self._step = (x, y, z), ZERO

    def begin(self, velocity: Vector, angular_velocity: Vector) -> None:
        """See `Drive`: the servos get a ramp, not stairs, whose ripple would break friction."""
        refuse_to_turn(angular_velocity, "stage")
        dt = self._dt
        self._reference = self._limited()
        self._step = (dt * velocity[0], dt * velocity[1], dt * velocity[2])

    def advance(self) -> None:
        """See `Drive`."""
        (x, y, z), (dx, dy, dz), control = self._reference, self._step, self._control
        x, y, z = x + dx, y + dy, z + dz
        control[0], control[1], control[2] = x, y, z
        self._reference = (x, y, z)

    def sample(self, time: float, readings: list[float], force: Vector | None = None) -> ArmSample:
        """See `Drive`."""
        s = readings
        return ArmSample(time, (s[0], s[1], s[2]), IDENTITY, (s[3], s[4], s[5]), (), ZERO, force)

    def snapshot(self) -> tuple[float, ...]:
        """See `Drive`."""
        return (*self._reference, *self._step)

    def restore(self, state: tuple[float, ...]) -> None:
        """See `Drive`."""
        x, y, z, dx, dy, dz = state
        self._reference, self._step = (x, y, z), (dx, dy, dz)

    def _limited(self) -> Vector:
        """The servos' reference, drawn back to within the following-error limit of the actual position."""
        x, y, z = self._position.tolist()
        return toward((x, y, z), self._reference, self._limit)
