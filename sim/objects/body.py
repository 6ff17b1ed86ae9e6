"""An object with weight, friction and a colour, fixed or free to move."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, check_positive, not_negative, vector
from palpate.sim.contact_law import ContactLaw
from palpate.sim.objects.primitives import SceneObject
from palpate.sim.objects.target import Mount, Placer, placer_of
from palpate.sim.objects.traced import TracedObject
from palpate.spatial import ZERO, Vector

__all__ = ["Mount", "ObjectBody"]


@dataclass(frozen=True, slots=True)
class ObjectBody:
    """An object as a body of a scene. A `Target`.

    Attributes:
        shape: Its surface.
        mass: [kg], spread evenly over its volume.
        friction: Coulomb coefficient mu against a tip that touches it; a table has its own.
        spin_length: e [m], against both.
        mount: Fixed, or free to move: then it falls, unless it stands on a table.
        position: Of the shape's origin, base frame [m].
        colour: Red, green, blue, opacity, each 0 to 1.
    """

    shape: SceneObject
    mass: float = 0.1
    friction: float = 0.3
    spin_length: float = 0.004
    mount: Mount = Mount.FIXED
    position: Vector = ZERO
    colour: tuple[float, float, float, float] = (0.6, 0.65, 0.7, 1.0)

    def __post_init__(self) -> None:
        check_positive(self, mass="kg", friction="", spin_length="m")
        vector("position", self.position, 3, "m")
        for i, part in enumerate(vector("colour", self.colour, 4, "").tolist()):
            if not_negative(f"colour[{i}]", part, "") > 1.0:
                raise InvalidValueError(f"colour[{i}] = {part:g}: must lie between 0 and 1")
        if self.mount not in (Mount.FIXED, Mount.FREE):
            raise InvalidValueError(
                f"mount = {self.mount}: must be FIXED or FREE; take a MovingTarget to drive it"
            )
        if isinstance(self.shape, TracedObject) and (self.mount is Mount.FREE or any(self.position)):
            raise InvalidValueError(
                f"shape is a {type(self.shape).__name__}: must be fixed at the origin, where its tangent plane is "
                "computed; take a convex object"
            )

    def law(self, press: ContactLaw) -> ContactLaw:
        """Return a contact's law with this object's friction, the rest as given."""
        return replace(press, friction=self.friction, spin_length=self.spin_length)

    def add_to(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add body and geom, both of that name, to a scene's world; a free one with a joint of that name, too."""
        self.shape.add_assets(spec, name)
        body = spec.worldbody.add_body(name=name, pos=self.position)
        self.shape.add_geom(body, name)
        if not isinstance(self.shape, TracedObject):
            (geom,) = body.geoms
            geom.mass, geom.rgba = self.mass, self.colour
        if self.mount is Mount.FREE:
            body.add_freejoint(name=name)
        return body

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, name: str, tip_geom: str) -> Placer:
        """See `Target`."""
        return placer_of(self.shape, model, data, name, tip_geom)

    def inertia(self) -> FloatArray:
        """Return its inertia about its centre of mass, axes along the base frame's, shape (3, 3) [kg m^2].

        Raises:
            InvalidValueError: A traced object, which is fixed and has none.
        """
        if isinstance(self.shape, TracedObject):
            raise InvalidValueError(f"{type(self.shape).__name__} is fixed: nothing asks for its inertia")
        spec = mujoco.MjSpec()
        self.add_to(spec, "object")
        model = spec.compile()
        k = model.body("object").id
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[k])
        axes = turn.reshape(3, 3)
        return np.asarray(axes @ np.diag(model.body_inertia[k]) @ axes.T)
