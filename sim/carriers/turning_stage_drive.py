"""From a wanted twist of the tip to the servo references of a turning stage, time step by time step."""

import math

import mujoco

from palpate.kinematics import FollowingErrorLimit
from palpate.runtime.data import ArmSample
from palpate.sim.carriers.carriage import TURNING_SENSORS, read_turning
from palpate.sim.carriers.quaternion import UNTURNED, Quaternion, normalised, product, turn_between, turn_by
from palpate.sim.carriers.stage_drive import StageDrive
from palpate.spatial import ZERO, Vector, norm, rotate, scale

HEAD = "head"
"""Name of the body that turns, of its joint, and of its site."""

REFERENCE = "head_reference"
"""Name of the body, and of its site, that is turned as the head is wanted to be."""


class TurningStageDrive:
    """Integrates twists into the servos' references, on a following-error limit to where the stage is. A `Drive`.

    The reference turns in every time step by exactly what is wanted, but for rounding, which cannot gather.
    """

    def __init__(
        self, following_error_limit: FollowingErrorLimit, model: mujoco.MjModel, data: mujoco.MjData
    ) -> None:
        """Take a turning stage in a scene.

        Args:
            following_error_limit: Largest distances of the references from where the stage is.
            model: The compiled scene.
            data: Its state, which must live on.
        """
        self._slides = StageDrive(following_error_limit.distance, model, data)
        self._limit, self._dt = following_error_limit.angle, float(model.opt.timestep)
        self._near = math.cos(0.5 * following_error_limit.angle)  # of two unit quaternions' inner product
        at = int(model.joint(HEAD).qposadr[0])
        frame = int(model.body(REFERENCE).mocapid[0])
        # views that live as long as the data
        self._orientation, self._wanted = data.qpos[at : at + 4], data.mocap_quat[frame]
        self._reference: Quaternion = UNTURNED
        self._turn: Quaternion = UNTURNED

    def start(self) -> None:
        """See `Drive`."""
        self._slides.start()
        w, x, y, z = self._orientation.tolist()
        self._wanted[:] = self._reference = (w, x, y, z)
        self._turn = UNTURNED

    def begin(self, velocity: Vector, angular_velocity: Vector) -> None:
        """See `Drive`."""
        self._slides.begin(velocity, ZERO)
        self._wanted[:] = self._reference = self._limited()
        still = angular_velocity is ZERO or not any(angular_velocity)
        self._turn = UNTURNED if still else turn_by(scale(self._dt, angular_velocity))

    def advance(self) -> None:
        """See `Drive`."""
        self._slides.advance()
        if self._turn is not UNTURNED:
            self._wanted[:] = self._reference = product(self._turn, self._reference)

    def sample(self, time: float, readings: list[float], force: Vector | None = None) -> ArmSample:
        """See `Drive`."""
        s = readings
        rotation, angular_velocity = read_turning(s[-TURNING_SENSORS:])
        force = None if force is None else rotate(rotation, force)
        return ArmSample(time, (s[0], s[1], s[2]), rotation, (s[3], s[4], s[5]), (), angular_velocity, force)

    def snapshot(self) -> tuple[float, ...]:
        """See `Drive`."""
        return (*self._slides.snapshot(), *self._reference, *self._turn)

    def restore(self, state: tuple[float, ...]) -> None:
        """See `Drive`."""
        *slides, a, b, c, d, w, x, y, z = state
        self._slides.restore(tuple(slides))
        self._reference = (a, b, c, d)
        # the very object: between periods a stage that does not turn is recognised by it
        self._turn = UNTURNED if (w, x, y, z) == UNTURNED else (w, x, y, z)

    def _limited(self) -> Quaternion:
        """The reference, drawn back to within the following-error limit of where the head is."""
        a, b, c, d = self._reference
        w, x, y, z = self._orientation.tolist()
        if abs(a * w + b * x + c * y + d * z) >= self._near:
            return normalised(self._reference)
        ahead = turn_between((w, x, y, z), self._reference)
        back = turn_by(scale(self._limit / norm(ahead), ahead))
        return normalised(product(back, (w, x, y, z)))
