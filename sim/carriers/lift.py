"""A vertical slide: the cheapest machine that can lift what a hand holds."""

from dataclasses import dataclass

import mujoco

from palpate.errors import InvalidValueError, check_positive
from palpate.runtime.data import ArmSample
from palpate.sim.carriers.carriage import add_carriage, add_position_servo
from palpate.sim.carriers.carrier import CarriedMass, refuse_to_turn
from palpate.spatial import IDENTITY, ZERO, Vector

LIFT = "lift"
"""Name of body, joint and servo."""


@dataclass(frozen=True, slots=True)
class Lift:
    """A vertical slide with a critically damped position servo, all weight balanced. A `Carrier`.

    Attributes:
        mass: Of the slide, without its load [kg].
        bandwidth: Natural frequency of the servo [rad/s].
        following_error_limit: Largest distance of the reference from the actual position [m].
    """

    mass: float = 5.0
    bandwidth: float = 100.0
    following_error_limit: float = 0.0025

    def __post_init__(self) -> None:
        check_positive(self, mass="kg", bandwidth="rad/s", following_error_limit="m")

    def mount(self, spec: mujoco.MjSpec, load: CarriedMass, start: Vector) -> mujoco.MjsBody:
        """See `Carrier`."""
        body, moving = add_carriage(spec, LIFT, start, self.mass, load.mass), self.mass + load.mass
        body.add_joint(name=LIFT, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(0.0, 0.0, 1.0))
        add_position_servo(spec, LIFT, moving * self.bandwidth**2, 2.0 * moving * self.bandwidth)
        return body

    def add_sensors(self, spec: mujoco.MjSpec) -> None:
        """It needs none: it does not turn."""

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> "LiftDrive":
        """See `Carrier`."""
        return LiftDrive(self.following_error_limit, model, data)


class LiftDrive:
    """Integrates the vertical velocity into the servo's reference, on a following-error limit. A `Drive`."""

    def __init__(self, following_error_limit: float, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Take a lift in a scene.

        Args:
            following_error_limit: Largest distance of the reference from the actual position [m].
            model: The compiled scene.
            data: Its state, which must live on.
        """
        self._limit, self._dt = following_error_limit, float(model.opt.timestep)
        at, of = int(model.joint(LIFT).qposadr[0]), int(model.actuator(LIFT).id)
        # views that live as long as the data
        self._position, self._control = data.qpos[at : at + 1], data.ctrl[of : of + 1]
        self._height = self._rise = 0.0

    def start(self) -> None:
        """See `Drive`."""
        self._height, self._rise = float(self._position[0]), 0.0

    def begin(self, velocity: Vector, angular_velocity: Vector) -> None:
        """See `Drive`."""
        x, y, z = velocity
        if x or y:
            raise InvalidValueError(
                f"velocity_base_tip = {velocity} m/s: a lift moves along z only; leave x and y out, or take "
                "a robot that can"
            )
        refuse_to_turn(angular_velocity, "lift")
        actual, following_error_limit = float(self._position[0]), self._limit
        self._height = max(actual - following_error_limit, min(actual + following_error_limit, self._height))
        self._rise = self._dt * z

    def advance(self) -> None:
        """See `Drive`."""
        self._height = height = self._height + self._rise
        self._control[0] = height

    def sample(self, time: float, readings: list[float], force: Vector | None = None) -> ArmSample:
        """See `Drive`."""
        s = readings
        return ArmSample(time, (s[0], s[1], s[2]), IDENTITY, (s[3], s[4], s[5]), (), ZERO, force)

    def snapshot(self) -> tuple[float, ...]:
        """See `Drive`."""
        return (self._height, self._rise)

    def restore(self, state: tuple[float, ...]) -> None:
        """See `Drive`."""
        self._height, self._rise = state
