"""From a wanted twist of the tip to the servo references of a turning stage, time step by time step."""

import math

import mujoco

from palpate.kinematics import FollowingErrorLimit
from palpate.runtime.data import ArmSample
from palpate.sim.carriers.carriage import TURNING_SENSORS, read_turning
from palpate.sim.carriers.stage_drive import StageDrive
from palpate.spatial import ZERO, Vector, norm, rotate, scale

Quaternion = tuple[float, float, float, float]
"""(w, x, y, z); maps coordinates of the turned frame to those of the frame that it is seen from."""

UNTURNED: Quaternion = (1.0, 0.0, 0.0, 0.0)

_SMALL_ANGLE = 1e-4
"""[rad] below which sin(x/2)/x is taken from its series, exact to x^4/3840 < 1e-19."""


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return a b: the turn b, then the turn a, both about axes that stand still."""
    w, x, y, z = a
    p, q, r, s = b
    return (
        w * p - x * q - y * r - z * s,
        w * q + x * p + y * s - z * r,
        w * r - x * s + y * p + z * q,
        w * s + x * r - y * q + z * p,
    )


def turn_by(rotvec: Vector) -> Quaternion:
    """Return the turn about the direction of `rotvec` by its length [rad]."""
    x, y, z = rotvec
    angle = math.sqrt(x * x + y * y + z * z)
    factor = 0.5 - angle * angle / 48.0 if angle < _SMALL_ANGLE else math.sin(0.5 * angle) / angle
    return (math.cos(0.5 * angle), factor * x, factor * y, factor * z)


def turn_between(start: Quaternion, end: Quaternion) -> Vector:
    """Return axis times angle [rad], at most half a turn, of the turn from `start` to `end`; the same for -q."""
    w, x, y, z = start
    w, x, y, z = product(end, (w, -x, -y, -z))
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return (0.0, 0.0, 0.0)
    factor = 2.0 * math.atan2(math.copysign(sine, w), abs(w)) / sine
    return (factor * x, factor * y, factor * z)


def normalised(a: Quaternion) -> Quaternion:
    """Return a / |a|: rounding of many products taken out."""
    w, x, y, z = a
    factor = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return (factor * w, factor * x, factor * y, factor * z)


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
