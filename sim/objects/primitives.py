"""Objects to touch, at the origin of the base frame, with their exact surface beside the simulated one."""

import math
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np

from palpate.errors import FloatArray, check_positive, positive

STEEPEST = math.radians(60.0)
"""Steepest slope [rad] that a tip is sent to from above."""


class Solid(Protocol):
    """A piece that puts one geom into a scene, and knows how far points are from it."""

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """Add what its geom of that name refers to (a mesh), or what is only seen; before `add_geom`."""
        ...

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add its geom to a body."""
        ...

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """Return the distance of points (n, 3) to the surface [m], positive outside, shape (n,)."""
        ...


class SceneObject(Solid, Protocol):
    """One that can be touched from above: it knows its own surface."""

    @property
    def top(self) -> float:
        """Largest z of its surface [m]."""
        ...

    @property
    def bottom(self) -> float:
        """Least z of its surface [m]."""
        ...

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the z of the upper surface above (x, y) [m]; NaN beside the object."""
        ...

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """Whether a tip whose centre is above (x, y) [m] touches where it is less than `STEEPEST` steep."""
        ...


class Primitive:
    """An object that MuJoCo knows without further data."""

    __slots__ = ()

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """See `SceneObject`: nothing."""


@dataclass(frozen=True, slots=True)
class SphereObject(Primitive):
    """A sphere of given radius [m]."""

    radius: float = 0.04

    def __post_init__(self) -> None:
        positive("radius", self.radius, "m")

    @property
    def top(self) -> float:
        """The radius [m]."""
        return self.radius

    @property
    def bottom(self) -> float:
        """See `SceneObject`."""
        return -self.top

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add a sphere geom."""
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[self.radius, 0.0, 0.0], **_PAIRS_ONLY)

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        return np.asarray(np.linalg.norm(points, axis=1) - self.radius)

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        return _root(self.radius**2 - x**2 - y**2)

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`."""
        return math.hypot(x, y) <= (self.radius + tip_radius) * math.sin(STEEPEST)


@dataclass(frozen=True, slots=True)
class EllipsoidObject(Primitive):
    """An ellipsoid of given semi-axes [m]."""

    semi_axes: tuple[float, float, float] = (0.05, 0.04, 0.03)

    def __post_init__(self) -> None:
        for i, length in enumerate(self.semi_axes):
            positive(f"semi_axes[{i}]", length, "m")

    @property
    def top(self) -> float:
        """The vertical semi-axis [m]."""
        return self.semi_axes[2]

    @property
    def bottom(self) -> float:
        """See `SceneObject`."""
        return -self.top

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add an ellipsoid geom."""
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, size=self.semi_axes, **_PAIRS_ONLY)

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`; by bisection on the Lagrange multiplier of the nearest point (Eberly 2013)."""
        squared = np.square(np.asarray(self.semi_axes))
        p = np.abs(np.asarray(points, dtype=np.float64))
        # the nearest point is squared p / (squared + t), where t > -min(squared) makes it lie on the surface
        weight = np.sqrt(squared) * p
        low = np.maximum(np.max(weight - squared, axis=1), -squared.min() * (1.0 - 1e-15))
        high = np.maximum(np.linalg.norm(weight, axis=1) - squared.min(), low)
        for _ in range(80):
            middle = 0.5 * (low + high)
            outside = np.sum(np.square(weight / (squared + middle[:, None])), axis=1) > 1.0
            low = np.where(outside, middle, low)
            high = np.where(outside, high, middle)
        t = (0.5 * (low + high))[:, None]
        shift = p * t / (squared + t)
        # deep inside, the multiplier reaches -min(squared) and says nothing of the nearest point's coordinate
        # along the shortest axis: there it follows from the surface itself
        least = int(np.argmin(squared))
        nearest = squared * p / (squared + t)
        others = np.delete(np.arange(3), least)
        room = 1.0 - np.sum(np.square(nearest[:, others]) / squared[others], axis=1)
        along = np.sqrt(squared[least] * np.maximum(room, 0.0)) - p[:, least]
        deep = t[:, 0] < -0.5 * squared.min()
        shift[:, least] = np.where(deep, along, shift[:, least])
        return np.asarray(np.copysign(np.linalg.norm(shift, axis=1), t[:, 0]))

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        a, b, c = self.semi_axes
        return np.asarray(c * _root(1.0 - (x / a) ** 2 - (y / b) ** 2))

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`; the tip's own size is left out, which errs on the safe side."""
        a, b, c = self.semi_axes
        # slope of z = c sqrt(1 - s): |grad z| = c^2/z |(x/a^2, y/b^2)|
        height = 1.0 - (x / a) ** 2 - (y / b) ** 2
        return height > 0.0 and c * math.hypot(x / a**2, y / b**2) <= math.tan(STEEPEST) * math.sqrt(height)


@dataclass(frozen=True, slots=True)
class Box(Primitive):
    """A box of given edge lengths [m]."""

    size: tuple[float, float, float] = (0.08, 0.08, 0.04)

    def __post_init__(self) -> None:
        for i, length in enumerate(self.size):
            positive(f"size[{i}]", length, "m")

    @property
    def top(self) -> float:
        """Half the height [m]."""
        return self.size[2] / 2

    @property
    def bottom(self) -> float:
        """See `SceneObject`."""
        return -self.top

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add a box geom."""
        half = [length / 2 for length in self.size]
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=half, **_PAIRS_ONLY)

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        return _beyond(np.abs(points) - np.asarray(self.size) / 2)

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        on_top = (np.abs(x) <= self.size[0] / 2) & (np.abs(y) <= self.size[1] / 2)
        return np.where(on_top, self.top, np.nan)

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`."""
        return abs(x) <= self.size[0] / 2 and abs(y) <= self.size[1] / 2


@dataclass(frozen=True, slots=True)
class CylinderObject(Primitive):
    """A cylinder lying along the x axis, of given radius and length [m]."""

    radius: float = 0.03
    length: float = 0.12

    def __post_init__(self) -> None:
        check_positive(self, radius="m", length="m")

    @property
    def top(self) -> float:
        """The radius [m]."""
        return self.radius

    @property
    def bottom(self) -> float:
        """See `SceneObject`."""
        return -self.top

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add a cylinder geom, turned to lie along x."""
        half_turn = np.sqrt(0.5)
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[self.radius, self.length / 2, 0.0],
            quat=[half_turn, 0.0, half_turn, 0.0],
            **_PAIRS_ONLY,
        )

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        radial = np.hypot(points[:, 1], points[:, 2]) - self.radius
        return _beyond(np.stack([radial, np.abs(points[:, 0]) - self.length / 2], axis=1))

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        return np.where(np.abs(x) <= self.length / 2, _root(self.radius**2 - y**2), np.nan)

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`."""
        return abs(x) <= self.length / 2 and abs(y) <= (self.radius + tip_radius) * math.sin(STEEPEST)


_PAIRS_ONLY = {"contype": 0, "conaffinity": 0}
"""Geoms collide in explicitly named pairs only: a scene pays for the contacts it needs."""


def _root(squared: FloatArray) -> FloatArray:
    """Square root, NaN where there is none, without a warning."""
    return np.sqrt(np.where(squared >= 0.0, squared, np.nan))


def _beyond(excess: FloatArray) -> FloatArray:
    """Signed distance of a convex product shape from how far each of its coordinates exceeds its bound."""
    outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
    return np.asarray(outside + np.minimum(excess.max(axis=1), 0.0))
