"""Several things to touch that stand in one scene, each where it was put."""

from dataclasses import dataclass

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sim.contact_law import ContactLaw
from palpate.sim.objects.posed import PosedGeom
from palpate.sim.objects.target import Mount, Nowhere, Placer
from palpate.spatial import ZERO, Vector


@dataclass(frozen=True, eq=False, slots=True)
class FixedPieces:
    """Posed geoms that nothing moves, as one surface. A `SceneObject` and a `Target`.

    A tip touches each of them, and what the sensor feels is of all; the truth of contacts is of the first alone.

    Attributes:
        pieces: Base frame, one or more.
        seen: What is only seen, and nothing meets: posts below what they carry.
    """

    pieces: tuple[PosedGeom, ...]
    seen: tuple[PosedGeom, ...] = ()

    def __post_init__(self) -> None:
        if not self.pieces:
            raise InvalidValueError("pieces: there are none; give one at least")

    @property
    def shape(self) -> "FixedPieces":
        """See `Target`: itself."""
        return self

    @property
    def mount(self) -> Mount:
        """Fixed."""
        return Mount.FIXED

    @property
    def position(self) -> Vector:
        """The origin [m]."""
        return ZERO

    @property
    def top(self) -> float:
        """Of the highest [m]."""
        return max(each.top for each in self.pieces)

    @property
    def bottom(self) -> float:
        """Of the lowest [m]."""
        return min(each.bottom for each in self.pieces)

    def law(self, press: ContactLaw) -> ContactLaw:
        """See `Target`: they have no friction of their own."""
        return press

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """See `SceneObject`: nothing."""

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add the first under that name, and the others as what stands around it."""
        for i, piece in enumerate((*self.pieces, *self.seen)):
            own = name if i == 0 else f"{name}_{i}"
            piece.add_geom(body, own)
            if 0 < i < len(self.pieces):  # a scene pairs the tip with what collides
                next(geom for geom in body.geoms if geom.name == own).contype = 1

    def add_to(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """See `Target`."""
        body = spec.worldbody.add_body(name=name)
        self.add_geom(body, name)
        return body

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`: to the nearest."""
        return np.asarray(np.min([each.signed_distance(points) for each in self.pieces], axis=0))

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`: of the highest."""
        return np.asarray(np.fmax.reduce([each.height(x, y) for each in self.pieces]))

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`."""
        return any(each.reachable(x, y, tip_radius) for each in self.pieces)

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, name: str, tip_geom: str) -> Placer:
        """See `Target`: nothing is to be placed."""
        return Nowhere()
