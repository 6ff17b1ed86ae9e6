"""What holds the palm: a wall, or a vertical slide that lifts."""

from dataclasses import dataclass
from typing import Protocol

import mujoco

from palpate.errors import positive
from palpate.sim.carriers.carriage import add_carriage, add_position_servo
from palpate.spatial import Vector

PALM = "palm"
LIFT = "lift"


class Mount(Protocol):
    """Puts a palm into a scene."""

    def add_to(self, spec: mujoco.MjSpec, position: Vector, carried: float) -> mujoco.MjsBody:
        """Add the palm at a position [m], axes as the base frame's, to carry a mass [kg]; return its body."""
        ...


@dataclass(frozen=True, slots=True)
class FixedMount:
    """The palm is fixed in the base frame."""

    def add_to(self, spec: mujoco.MjSpec, position: Vector, carried: float) -> mujoco.MjsBody:
        """See `Mount`."""
        return spec.worldbody.add_body(name=PALM, pos=position)


@dataclass(frozen=True, slots=True)
class Lift:
    """A vertical slide with a critically damped position servo, the hand's own weight balanced.

    Attributes:
        mass: Of palm and slide [kg].
        bandwidth: Natural frequency of the servo [rad/s].
        leash: Largest distance of the reference from the actual position [m].
    """

    mass: float = 5.0
    bandwidth: float = 100.0
    leash: float = 0.0025

    def __post_init__(self) -> None:
        positive("mass", self.mass, "kg")
        positive("bandwidth", self.bandwidth, "rad/s")
        positive("leash", self.leash, "m")

    def add_to(self, spec: mujoco.MjSpec, position: Vector, carried: float) -> mujoco.MjsBody:
        """See `Mount`."""
        body = add_carriage(spec, PALM, position, self.mass, carried)
        body.add_joint(name=LIFT, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(0.0, 0.0, 1.0))
        stiffness = (self.mass + carried) * self.bandwidth**2
        damping = 2.0 * (self.mass + carried) * self.bandwidth
        add_position_servo(spec, LIFT, stiffness, damping)
        return body
