"""What a fingertip can touch: a fixed object, one with a prescribed motion, or a free one."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol, runtime_checkable

import mujoco

from palpate.sim.contact_law import ContactLaw
from palpate.sim.objects.primitives import SceneObject
from palpate.sim.objects.traced import Trace, TracedObject
from palpate.spatial import ZERO, Vector


class Mount(Enum):
    """How a target stands in the scene."""

    FIXED = "fixed"
    FREE = "free"
    DRIVEN = "driven"
    SPRUNG = "sprung"
    JOINTED = "jointed"


class Placer(Protocol):
    """Puts what follows from time and tip alone where it belongs, in one simulation. Holds no state."""

    def place(self) -> None:
        """Call it before each mj_step, and after a reset."""
        ...


class Nowhere:
    """Nothing is to be placed. A `Placer`."""

    __slots__ = ()

    def place(self) -> None:
        """See `Placer`."""


@runtime_checkable
class Target(Protocol):
    """A body with a geom to touch: `StaticObject`, `ObjectBody`, `MovingTarget`, `SprungTarget`, `SceneTarget`."""

    @property
    def shape(self) -> SceneObject:
        """Its surface, in the frame of its body."""
        ...

    @property
    def mount(self) -> Mount:
        """How it stands in the scene."""
        ...

    @property
    def position(self) -> Vector:
        """Where its shape's origin starts, base frame [m]."""
        ...

    def law(self, press: ContactLaw) -> ContactLaw:
        """Return the law of a tip's contact with it, from what the scene asks for."""
        ...

    def add_to(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add body and geom, both of that name, to a scene's world."""
        ...

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, name: str, tip_geom: str) -> Placer:
        """Return what places it in one simulation, and place it.

        Args:
            model: The scene.
            data: Its state, which must live on.
            name: Under which it was added.
            tip_geom: Of the tip that touches it.

        Raises:
            InvalidValueError: It cannot be touched by this tip.
        """
        ...


@dataclass(frozen=True, slots=True)
class StaticObject:
    """A surface at the origin of the base frame, where nothing moves it. A `Target`.

    Attributes:
        shape: Its surface.
    """

    shape: SceneObject

    @property
    def mount(self) -> Mount:
        """Fixed."""
        return Mount.FIXED

    @property
    def position(self) -> Vector:
        """The origin [m]."""
        return ZERO

    def law(self, press: ContactLaw) -> ContactLaw:
        """See `Target`: it has no friction of its own."""
        return press

    def add_to(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """See `Target`."""
        self.shape.add_assets(spec, name)
        body = spec.worldbody.add_body(name=name)
        self.shape.add_geom(body, name)
        return body

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, name: str, tip_geom: str) -> Placer:
        """See `Target`."""
        return placer_of(self.shape, model, data, name, tip_geom)


def placer_of(shape: SceneObject, model: mujoco.MjModel, data: mujoco.MjData, name: str, tip_geom: str) -> Placer:
    """Return what a surface asks for before each time step, on a body that stands still or is MuJoCo's to move."""
    return Trace(shape, model, data, tip_geom, name) if isinstance(shape, TracedObject) else Nowhere()


def as_target(given: SceneObject | Target) -> Target:
    """Return a target: a surface alone stands still at the origin."""
    return given if isinstance(given, Target) else StaticObject(given)
