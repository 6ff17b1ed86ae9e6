"""A ring: the simplest object with a hole."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, check_positive
from palpate.sim.objects.nearest import nearest_on_torus
from palpate.sim.objects.primitives import STEEPEST
from palpate.sim.objects.traced import Nearest, TracedObject, add_mesh_picture, picture_name


@dataclass(frozen=True, slots=True)
class Torus(TracedObject):
    """A torus lying about the z axis.

    Attributes:
        ring: Radius of the circle in the middle of the tube [m].
        tube: Radius of the tube [m], less than `ring`.
    """

    ring: float = 0.03
    tube: float = 0.012

    def __post_init__(self) -> None:
        check_positive(self, ring="m", tube="m")
        if self.tube >= self.ring:
            raise InvalidValueError(f"tube = {self.tube:g} m: must be less than ring = {self.ring:g} m")

    @property
    def top(self) -> float:
        """The tube's radius [m]."""
        return self.tube

    @property
    def bottom(self) -> float:
        """See `SceneObject`."""
        return -self.tube

    @property
    def nearest(self) -> Nearest:
        """See `TracedObject`."""
        kernel: Nearest = nearest_on_torus
        return kernel

    @property
    def parameters(self) -> FloatArray:
        """See `TracedObject`."""
        return np.array([self.ring, self.tube])

    def check_tip(self, radius: float) -> None:
        """See `TracedObject`."""
        if radius >= self.ring - self.tube:
            raise InvalidValueError(
                f"tip radius = {radius:g} m: must be less than the hole's, {self.ring - self.tube:g} m"
            )

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """See `TracedObject`."""
        n, m = 96, 48
        u, v = (np.linspace(0.0, 2.0 * np.pi, k, endpoint=False) for k in (n, m))
        out = self.ring + self.tube * np.cos(v)
        along = np.stack([np.outer(np.cos(u), out), np.outer(np.sin(u), out)], axis=-1)
        up = np.broadcast_to(self.tube * np.sin(v), (n, m))[..., None]
        i, j = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
        a, b = i * m + j, (i + 1) % n * m + j
        c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
        faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        add_mesh_picture(spec, picture_name(name), np.concatenate([along, up], axis=-1).reshape(-1, 3), faces)

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        squared = self.tube**2 - (np.hypot(x, y) - self.ring) ** 2
        return np.sqrt(np.where(squared >= 0.0, squared, np.nan))

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`."""
        return abs(math.hypot(x, y) - self.ring) <= (self.tube + tip_radius) * math.sin(STEEPEST)
