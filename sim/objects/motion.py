"""Targets with a prescribed motion, on slides and hinges that no force holds up.

A mocap body would have no velocity, and a tip would rub on it as if it stood still. Here the joints' position and
velocity are set before every time step, and a force gives them the acceleration in between. What makes them too
heavy to be pushed is inertia of each joint's own, as of a rotor behind a gear, not the body's: so no joint feels
what the others do, wherever their axes point.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np

from palpate.errors import InvalidValueError, check_positive, positive, vector
from palpate.kinematics import JointKind as JointKind
from palpate.sim.contact_law import ContactLaw
from palpate.sim.objects.primitives import SceneObject
from palpate.sim.objects.target import Mount
from palpate.sim.objects.traced import TracedObject
from palpate.spatial import ZERO, Vector

HEAVY = 1e4
"""Inertia of each joint of a moving target [kg or kg m^2]: 10 N on it for a step of 1 ms change its speed by
1 um/s."""

LIGHT = 1e-3
"""Mass [kg] and inertia [kg m^2] of its body, and how far its centre of mass is off [m]: 1e-7 of what moves it."""


class Motion(Protocol):
    """A prescribed motion, a function of time alone."""

    def at(self, time: float) -> tuple[float, float, float]:
        """Return position, velocity and acceleration at a time [s]: [m] or [rad], per s, per s^2."""
        ...


@dataclass(frozen=True, slots=True)
class Ramp:
    """Stands still until `begin`, then moves at constant rate: a sudden start.

    Attributes:
        rate: [m/s] or [rad/s]; negative ones go backwards.
        begin: [s].
    """

    rate: float
    begin: float = 0.0

    def __post_init__(self) -> None:
        vector("rate, begin", (self.rate, self.begin), 2, "SI")

    def at(self, time: float) -> tuple[float, float, float]:
        """See `Motion`."""
        return (self.rate * (time - self.begin), self.rate, 0.0) if time >= self.begin else (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Sine:
    """amplitude sin(2 pi frequency t + phase).

    Attributes:
        amplitude: [m] or [rad].
        frequency: [Hz].
        phase: [rad]; pi/2 starts at the turning point, at rest.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        check_positive(self, amplitude="m or rad", frequency="Hz")
        vector("phase", (self.phase,), 1, "rad")

    def at(self, time: float) -> tuple[float, float, float]:
        """See `Motion`."""
        rate = 2.0 * math.pi * self.frequency
        s, c = math.sin(rate * time + self.phase), math.cos(rate * time + self.phase)
        return self.amplitude * s, self.amplitude * rate * c, -self.amplitude * rate**2 * s


_MUJOCO_KIND = {
    JointKind.SLIDE: mujoco.mjtJoint.mjJNT_SLIDE,
    JointKind.HINGE: mujoco.mjtJoint.mjJNT_HINGE,
}


@dataclass(frozen=True, slots=True)
class DrivenJoint:
    """A joint with a prescribed motion.

    Attributes:
        kind: Slide or hinge.
        axis: Direction, in the frame that the joints before it have moved; its length does not matter.
        motion: Of the joint.
        through: A point on a hinge's axis, in the target's frame [m].
    """

    kind: JointKind
    axis: Vector
    motion: Motion
    through: Vector = ZERO

    def __post_init__(self) -> None:
        positive("length of axis", float(np.linalg.norm(vector("axis", self.axis, 3, ""))), "")
        vector("through", self.through, 3, "m")


@dataclass(frozen=True, slots=True)
class MovingTarget:
    """An object on driven joints. A `Target`.

    Attributes:
        shape: Its surface, where it is when all joints are at 0.
        joints: In order, the first one next to the world.
        position: Of the shape's origin then, base frame [m].
    """

    shape: SceneObject
    joints: Sequence[DrivenJoint]
    position: Vector = ZERO

    def __post_init__(self) -> None:
        vector("position", self.position, 3, "m")
        joints = tuple(self.joints)
        if not joints or not all(isinstance(joint, DrivenJoint) for joint in joints):
            raise InvalidValueError(f"joints = {self.joints!r}: must be one DrivenJoint or more")
        object.__setattr__(self, "joints", joints)
        if isinstance(self.shape, TracedObject):
            raise InvalidValueError(
                f"shape is a {type(self.shape).__name__}: must be fixed, its surface does not move with a body; "
                "take a convex object"
            )

    @property
    def mount(self) -> Mount:
        """Driven."""
        return Mount.DRIVEN

    def law(self, press: ContactLaw) -> ContactLaw:
        """See `Target`: it has no friction of its own."""
        return press

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, name: str, tip_geom: str) -> "TargetDrive":
        """See `Target`."""
        return TargetDrive(self, model, data, name)

    def add_to(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add body and geom, both of that name, to a scene's world, and joints name_0, name_1, ..."""
        self.shape.add_assets(spec, name)
        body = spec.worldbody.add_body(name=name, pos=self.position)
        body.explicitinertial = True
        body.mass = LIGHT
        body.inertia = [LIGHT] * 3
        # off its frame: of a body that slides along its own axes, MuJoCo would take the mass alone for inertia
        body.ipos = [LIGHT, 0.0, 0.0]
        body.gravcomp = 1.0
        for i, joint in enumerate(self.joints):
            body.add_joint(
                name=f"{name}_{i}",
                type=_MUJOCO_KIND[joint.kind],
                axis=joint.axis,
                pos=joint.through,
                armature=HEAVY,
            )
        self.shape.add_geom(body, name)
        return body


class TargetDrive:
    """Moves one target in one simulation. A `Placer`: all follows from the time, snapshots need not know."""

    def __init__(self, target: MovingTarget, model: mujoco.MjModel, data: mujoco.MjData, name: str) -> None:
        """Take a scene, and put the target where it belongs at the data's time.

        Args:
            target: What moves.
            model: The scene.
            data: Its state.
            name: Under which the target was added.
        """
        self._data = data
        self._joints = []
        for i, joint in enumerate(target.joints):
            row = model.joint(f"{name}_{i}")
            self._joints.append((joint.motion, int(row.qposadr[0]), int(row.dofadr[0])))
        self._inertia = [float(model.dof_M0[dof]) for _, _, dof in self._joints]
        self.place()

    def place(self) -> None:
        """Set position, velocity and force for the time step to come; call it before each, and after a reset."""
        data = self._data
        time = data.time
        for (motion, position, dof), inertia in zip(self._joints, self._inertia, strict=True):
            q, rate, acceleration = motion.at(time)
            data.qpos[position], data.qvel[dof] = q, rate
            data.qfrc_applied[dof] = inertia * acceleration
