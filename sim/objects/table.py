"""A table: a fixed box under the things that lie on it."""

from dataclasses import dataclass

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.sim.objects.primitives import Box, Primitive


@dataclass(frozen=True, slots=True)
class Table(Primitive):
    """A box whose upper face lies at a given height.

    Attributes:
        top: Height of the upper face [m].
        size: Edge lengths [m].
    """

    top: float = 0.0
    size: tuple[float, float, float] = (0.4, 0.4, 0.02)

    def __post_init__(self) -> None:
        for i, length in enumerate(self.size):
            positive(f"size[{i}]", length, "m")
        if not np.isfinite(self.top):
            raise InvalidValueError(f"top = {self.top} m: must be finite")

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
