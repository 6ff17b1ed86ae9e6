"""What holds the palm: a wall, or a vertical slide that lifts."""

from dataclasses import dataclass
from typing import Protocol

import mujoco

from palpate.errors import positive
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
        body = spec.worldbody.add_body(name=PALM, pos=position)
        body.explicitinertial = True
        body.mass = self.mass
        body.inertia = [0.01 * self.mass] * 3  # it never turns: any value does
        # lifts the fingers too, from outside: their sensors still feel the tips' weight
        body.gravcomp = (self.mass + carried) / self.mass
        body.add_joint(name=LIFT, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(0.0, 0.0, 1.0))
        stiffness = (self.mass + carried) * self.bandwidth**2
        damping = 2.0 * (self.mass + carried) * self.bandwidth
        spec.add_actuator(
            name=LIFT,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=LIFT,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[stiffness] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, -stiffness, -damping] + [0.0] * 7,
        )
        return body
