"""A table: a fixed box under the things that lie on it."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.sim.contact_law import ContactLaw
from palpate.sim.objects.primitives import Box, Primitive


@dataclass(frozen=True, slots=True)
class Table(Primitive):
    """A box whose upper face lies at a given height: to be touched, or for something to stand on.

    Attributes:
        top: Height of the upper face [m].
        size: Edge lengths [m].
        friction: Coulomb coefficient between it and what stands on it.
    """

    top: float = 0.0
    size: tuple[float, float, float] = (0.4, 0.4, 0.02)
    friction: float = 0.3

    def __post_init__(self) -> None:
        for i, length in enumerate(self.size):
            positive(f"size[{i}]", length, "m")
        positive("friction", self.friction, "")
        if not np.isfinite(self.top):
            raise InvalidValueError(f"top = {self.top} m: must be finite")

    @property
    def bottom(self) -> float:
        """See `SceneObject`."""
        return self.top - self.size[2]

    def law(self, press: ContactLaw) -> ContactLaw:
        """Return the law of its contacts with what stands on it: this table's friction, the rest as given."""
        return replace(press, friction=self.friction)

    def add_to(self, spec: mujoco.MjSpec, name: str) -> None:
        """Add it to a scene's world, for something to stand on.

        That is a plane, endless to what stands on it, of the table's size to the eye: MuJoCo finds all corners of
        a mesh on a plane, but only one point of a mesh on a box.
        """
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[self.size[0] / 2, self.size[1] / 2, 0.01],
            pos=[0.0, 0.0, self.top],
            contype=0,
            conaffinity=0,
        )

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add a box geom below the top."""
        Box(self.size).add_geom(body, name)
        body.geoms[-1].pos = [0.0, 0.0, self._middle]

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        return Box(self.size).signed_distance(points - np.array([0.0, 0.0, self._middle]))

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        return np.asarray(Box(self.size).height(x, y) + self._middle)

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`."""
        return Box(self.size).reachable(x, y, tip_radius)

    @property
    def _middle(self) -> float:
        return self.top - self.size[2] / 2
