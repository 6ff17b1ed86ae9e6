"""Built contacts on every kind of fingertip: how many are found, how exactly, how fast.

    python benchmarks/every_tip.py [--contacts 1000000] [--seed 1]

Choose a point c of the surface, a force that pushes there and a spin torque about the normal; build the wrench in
extended precision; recover the contact. Shapes, normals and curvatures are written down here a second time,
independently of the library, and every contact found is checked against them: a point of the surface, its normal,
the moment balanced, the force pushing. A contact is *missed* if the status is not OK, *wrong* if any check fails.
"""

import argparse
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from rich.console import Console
from rich.table import Table

from palpate import (
    Capsule,
    CompliantTip,
    Composite,
    ContactStatus,
    Cylinder,
    Ellipsoid,
    Hyperboloid,
    ImplicitSurface,
    Paraboloid,
    Patch,
    Plane,
    RoundedBox,
    Sphere,
    Superellipsoid,
    contacts_from_wrenches,
)

Array = np.ndarray[Any, np.dtype[Any]]
Rng = np.random.Generator
LONG = np.longdouble
SEAM_OFFSETS = (0.0, 1e-13, -1e-13, 1e-10, -1e-10)
"""Of contacts near a seam, relative to the size of the tip: below, at and above what float64 resolves there."""

CONDITION = 1e3
"""Contacts of general quadrics beyond this condition number are not held to the limit."""

YIELDING, TOO_SOFT = (0.0, 0.95), (1.05, 3.0)
"""delta times the sharpest curvature, of tips that yield."""

TOUCHING = 1e-12
"""Largest moment left over, distance from the surface and tilt of the normal of a contact: see `Checked`."""


def long(value: Any) -> Array:
    return np.asarray(value, dtype=LONG)


def unit(v: Array) -> Array:
    return v / norm(v)[..., None]


def norm(v: Array) -> Array:
    return np.sqrt((v * v).sum(axis=-1))


def dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=-1)


def directions(rng: Rng, n: int) -> Array:
    return unit(long(rng.normal(size=(n, 3))))


def turned(rng: Rng) -> Array:
    """A random rotation, rounded to float64."""
    Q, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(upper))
    return Q if np.linalg.det(Q) > 0 else -Q


# ---------------------------------------------------------------------------------------------- the shapes


@dataclass(frozen=True)
class Local:
    """A surface near n points: signed distance to first order [m], outward normals, shape operators [1/m]."""

    distance: Array
    normal: Array
    curvature: Array

    @property
    def sharpest(self) -> Array:
        """Largest principal curvature, by the two invariants of a matrix with one zero eigenvalue."""
        W = self.curvature
        trace = np.trace(W, axis1=1, axis2=2)
        both = (trace**2 - (W * W).sum(axis=(1, 2))) / 2
        return trace / 2 + np.sqrt(np.maximum(trace**2 / 4 - both, 0))


def local_of(value: Array, gradient: Array, hessian: Array) -> Local:
    length = norm(gradient)
    n = gradient / length[:, None]
    tangent = np.eye(3, dtype=LONG) - n[:, :, None] * n[:, None, :]
    return Local(value / length, n, tangent @ (hessian / length[:, None, None]) @ tangent)


class Shape(ABC):
    """A fingertip in its own frame, known without the library."""

    size: float

    @abstractmethod
    def build(self, **frame: Any) -> Any:
        """Return the library's surface."""

    @abstractmethod
    def points(self, rng: Rng, n: int) -> Array:
        """Return points of the surface, shape (n, 3)."""

    @abstractmethod
    def at(self, points: Array) -> Local:
        """Return the surface at points."""


class Quadric(Shape):
    """x'Bx + 2 h.x = rho, gradient outwards."""

    B: Array
    h: Array = np.zeros(3, LONG)
    rho: float = 1.0

    def at(self, points: Array) -> Local:
        B = np.diag(self.B)
        value = dot(points * self.B, points) + 2 * dot(points, self.h) - self.rho
        gradient = 2 * (points * self.B + self.h)
        return local_of(value, gradient, np.broadcast_to(2 * B, (len(points), 3, 3)))


class EllipsoidShape(Quadric):
    def __init__(self, *axes: float, kind: str = "Ellipsoid") -> None:
        self.axes, self.kind, self.size = long(axes), kind, max(axes)
        self.B = 1 / self.axes**2

    def build(self, **frame: Any) -> Any:
        axes = tuple(float(a) for a in self.axes)
        return Sphere(axes[0], **frame) if self.kind == "Sphere" else Ellipsoid(axes, **frame)

    def points(self, rng: Rng, n: int) -> Array:
        return directions(rng, n) * self.axes


class CylinderShape(Quadric):
    def __init__(self, radius: float) -> None:
        self.size = radius
        self.B = long([1, 1, 0]) / long(radius) ** 2

    def build(self, **frame: Any) -> Any:
        return Cylinder(self.size, **frame)

    def points(self, rng: Rng, n: int) -> Array:
        across = unit(long(rng.normal(size=(n, 2)))) * self.size
        return np.column_stack([across, self.size * rng.uniform(-3, 3, n)])


class PlaneShape(Quadric):
    def __init__(self, distance: float) -> None:
        self.size = distance
        self.B = long([0, 0, 1]) / long(distance) ** 2

    def build(self, **frame: Any) -> Any:
        return Plane(self.size, **frame)

    def points(self, rng: Rng, n: int) -> Array:
        sides = self.size * rng.choice([-1.0, 1.0], n)
        return long(np.column_stack([self.size * rng.uniform(-3, 3, (n, 2)), sides]))


class ParaboloidShape(Quadric):
    rho = 0.0

    def __init__(self, *radii: float) -> None:
        self.radii, self.size = long(radii), max(radii)
        self.B, self.h = np.append(1 / self.radii, LONG(0)), long([0, 0, 1])

    def build(self, **frame: Any) -> Any:
        return Paraboloid(tuple(float(r) for r in self.radii), **frame)

    def points(self, rng: Rng, n: int) -> Array:
        slope = unit(long(rng.normal(size=(n, 2)))) * long(10 ** rng.uniform(-3, 0.7, (n, 1)))
        across = slope * self.radii
        return np.column_stack([across, -dot(across, slope) / 2])


class HyperboloidShape(Quadric):
    rho = 0.0

    def __init__(self, *axes: float) -> None:
        self.axes, self.size = long(axes), max(axes)
        a, b, c = self.axes
        self.B, self.h = long([1 / a**2, 1 / b**2, -1 / c**2]), long([0, 0, 1 / c])

    def build(self, **frame: Any) -> Any:
        return Hyperboloid(tuple(float(a) for a in self.axes), **frame)

    def points(self, rng: Rng, n: int) -> Array:
        u = long(10 ** rng.uniform(-3, 0.5, n))
        across = unit(long(rng.normal(size=(n, 2)))) * np.sinh(u)[:, None] * self.axes[:2]
        return np.column_stack([across, -2 * self.axes[2] * np.sinh(u / 2) ** 2])

    def at(self, points: Array) -> Local:
        found = super().at(points)
        # the other sheet is no fingertip
        return Local(np.where(points[:, 2] < self.axes[2], found.distance, np.inf), found.normal, found.curvature)


def rounded(points: Array, core: Array, radius: float) -> Local:
    """Everything within `radius` of a core: its nearest point gives normal and distance; curvature is not flat
    along those axes only where the core ends."""
    apart = points - core
    length = norm(apart)
    n = apart / length[:, None]
    # moving along an axis in which the core's nearest point follows does not turn the normal
    free = np.where(apart == 0.0, LONG(0), LONG(1))
    eye = np.eye(3, dtype=LONG) * free[:, :, None]
    tangent = eye - n[:, :, None] * n[:, None, :]
    several = (free.sum(axis=1) > 1)[:, None, None]
    return Local(length - radius, n, np.where(several, tangent / radius, LONG(0)))


class CapsuleShape(Shape):
    def __init__(self, radius: float, length: float, *, seam: bool = False) -> None:
        self.radius, self.length, self.size, self.seam = radius, length, radius, seam

    def build(self, **frame: Any) -> Any:
        return Capsule(self.radius, self.length, **frame)

    def points(self, rng: Rng, n: int) -> Array:
        z = long(rng.uniform(-self.length / self.radius, 1, n))
        if self.seam:
            z = long(rng.choice(SEAM_OFFSETS, n))
        ring = np.sqrt(1 - np.maximum(z, 0) ** 2)[:, None]
        return np.column_stack([unit(long(rng.normal(size=(n, 2)))) * ring, z]) * self.radius

    def at(self, points: Array) -> Local:
        core = np.zeros_like(points)
        core[:, 2] = np.minimum(points[:, 2], 0)
        return rounded(points, core, self.radius)


class BoxShape(Shape):
    def __init__(self, *half: float, radius: float, seam: bool = False) -> None:
        self.half, self.radius, self.size, self.seam = long(half), radius, max(half), seam
        self.inner = self.half - long(radius)

    def build(self, **frame: Any) -> Any:
        return RoundedBox(tuple(float(a) for a in self.half), self.radius, **frame)

    def points(self, rng: Rng, n: int) -> Array:
        corner = self.inner * rng.choice([-1.0, 1.0], (n, 3))
        inside = self.inner * rng.uniform(-1, 1, (n, 3))
        # an axis points along the normal (corner), or the core point moves along it (inside)
        along = rng.permuted(np.arange(3) < rng.integers(1, 4, (n, 1)), axis=1)
        core = np.where(along, corner, inside)
        v = np.where(along, np.sign(corner) * np.abs(rng.normal(size=(n, 3))), 0)
        if self.seam:
            offset = rng.choice(SEAM_OFFSETS, (n, 3)) * self.size
            v = np.where(~along & (offset > 0), np.sign(corner) * offset / self.radius, v)
            core = np.where(~along, corner + np.sign(corner) * np.minimum(offset, 0), core)
        return core + self.radius * unit(long(v))

    def at(self, points: Array) -> Local:
        return rounded(points, np.clip(points, -self.inner, self.inner), self.radius)


class EggShape(Shape):
    """A composite of one's own: a hemisphere on half an ellipsoid of the same girth."""

    def __init__(self, radius: float, depth: float, *, seam: bool = False) -> None:
        self.upper = EllipsoidShape(radius, radius, radius)
        self.lower = EllipsoidShape(radius, radius, depth)
        self.size, self.seam, self.radius, self.depth = max(radius, depth), seam, radius, depth

    def build(self, **frame: Any) -> Any:
        center = np.asarray(frame.get("center", np.zeros(3)))
        up = np.asarray(frame.get("rotation", np.eye(3)))[:, 2]
        below = [[*up, up @ center]]
        return Composite(
            [
                Patch(Sphere(self.radius, **frame), -np.array(below)),
                Patch(Ellipsoid((self.radius, self.radius, self.depth), **frame), below),
            ]
        )

    def points(self, rng: Rng, n: int) -> Array:
        v = directions(rng, n)
        if self.seam:
            z = long(rng.choice(SEAM_OFFSETS, n))
            v = np.column_stack([unit(v[:, :2]) * np.sqrt(1 - z**2)[:, None], z])
        return v * np.where(v[:, 2:] > 0, self.upper.axes, self.lower.axes)

    def at(self, points: Array) -> Local:
        a, b = self.upper.at(points), self.lower.at(points)
        above = points[:, 2] > 0
        return Local(
            np.where(above, a.distance, b.distance),
            np.where(above[:, None], a.normal, b.normal),
            np.where(above[:, None, None], a.curvature, b.curvature),
        )


class SuperShape(Shape):
    def __init__(self, axes: Sequence[float], exponent: float) -> None:
        self.axes, self.p, self.size = long(axes), LONG(exponent), max(axes)

    def build(self, **frame: Any) -> Any:
        return Superellipsoid(tuple(float(a) for a in self.axes), float(self.p), **frame)

    def points(self, rng: Rng, n: int) -> Array:
        v = long(rng.normal(size=(n, 3)))
        v[rng.random((n, 3)) < 0.04] = 0  # the middle of faces and edges, where curvatures vanish
        v[(v == 0).all(axis=1)] = 1
        p_norm = (np.abs(v) ** self.p).sum(axis=1) ** (1 / self.p)
        return v / p_norm[:, None] * self.axes

    def at(self, points: Array) -> Local:
        u = np.abs(points / self.axes)
        size = (u**self.p).sum(axis=1) ** (1 / self.p)
        u = u / size[:, None]
        g = np.sign(points) * u ** (self.p - 1) / self.axes
        diagonal = u ** (self.p - 2) / self.axes**2
        k = (self.p - 1) / size
        hessian = k[:, None, None] * (diagonal[:, :, None] * np.eye(3) - g[:, :, None] * g[:, None, :])
        return local_of(size - 1, g, hessian)


PEBBLE_NORMALS = np.array(
    [[1.0, 0.2, 0.1], [-0.8, 0.7, 0.0], [-0.2, -0.9, 0.4], [0.1, 0.1, -1.0], [0.0, 0.2, 1.1]]
)
PEBBLE_SIZE = 0.01
PEBBLE_SHARPNESS = 4.0


def pebble_value(point: Array) -> float:
    """log(mean(exp(s a.x))) - s over a few directions a: a polyhedron with soft edges and no symmetry."""
    total = 0.0
    for i in range(len(PEBBLE_NORMALS)):
        a = PEBBLE_NORMALS[i]
        total += math.exp(PEBBLE_SHARPNESS * (a[0] * point[0] + a[1] * point[1] + a[2] * point[2]) / PEBBLE_SIZE)
    return math.log(total / len(PEBBLE_NORMALS)) - PEBBLE_SHARPNESS


def pebble_gradient(point: Array) -> Array:
    total = 0.0
    gradient = np.zeros(3)
    for i in range(len(PEBBLE_NORMALS)):
        a = PEBBLE_NORMALS[i]
        weight = math.exp(PEBBLE_SHARPNESS * (a[0] * point[0] + a[1] * point[1] + a[2] * point[2]) / PEBBLE_SIZE)
        total += weight
        for j in range(3):
            gradient[j] += weight * a[j] * PEBBLE_SHARPNESS / PEBBLE_SIZE
    return gradient / total


class PebbleShape(Shape):
    size = 2 * PEBBLE_SIZE

    def __init__(self, *, compiled: bool) -> None:
        self.compiled = compiled

    def build(self, **frame: Any) -> Any:
        value, gradient = (njit(f) if self.compiled else f for f in (pebble_value, pebble_gradient))
        return ImplicitSurface(value, gradient, size=PEBBLE_SIZE, **frame)

    def points(self, rng: Rng, n: int) -> Array:
        v = directions(rng, n)
        t = np.full(n, 20 * LONG(PEBBLE_SIZE))
        for _ in range(60):  # Newton from outside on a convex function: monotone
            found = self.at(t[:, None] * v)
            t = t - found.distance / dot(found.normal, v)
        return t[:, None] * v

    def at(self, points: Array) -> Local:
        rows = long(PEBBLE_SHARPNESS) * long(PEBBLE_NORMALS) / long(PEBBLE_SIZE)
        power = points @ rows.T
        most = power.max(axis=1, keepdims=True)
        weight = np.exp(power - most)
        total = weight.sum(axis=1)
        value = most[:, 0] + np.log(total / LONG(len(rows))) - LONG(PEBBLE_SHARPNESS)
        weight = weight / total[:, None]
        gradient = weight @ rows
        second = np.einsum("ni,ij,ik->njk", weight, rows, rows)
        return local_of(value, gradient, second - gradient[:, :, None] * gradient[:, None, :])


# ------------------------------------------------------------------------------------- a kind and its contacts


@dataclass(frozen=True)
class Kind:
    """A kind of fingertip.

    Attributes:
        name: For the table.
        shapes: Draws one of that kind.
        error_limit: Largest error of the centroid over max(|c|, size).
        by_condition: Whether that limit grows with the condition number; else it holds below `CONDITION`.
        exponent: Of the law by which the surface yields; 0 for rigid ones.
        softness: Range of delta times the tip's sharpest curvature; beyond 1 a tip folds over where it is that
            sharp, and a contact may be missed or not be the only one, but nothing may be found that is none.
        share: Of the contacts, relative to the other kinds.
        surfaces: How many different ones to build.
    """

    name: str
    shapes: Callable[[Rng], Shape]
    error_limit: float
    by_condition: bool = True
    exponent: float = 0.0
    softness: tuple[float, float] = YIELDING
    share: float = 1.0
    surfaces: int = 8

    @property
    def beyond(self) -> bool:
        """Whether the tip is pressed beyond what it is made for."""
        return self.softness[1] > 1.0


def size_of(rng: Rng, low: float = 0.003, high: float = 0.03) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def sizes(rng: Rng, count: int) -> list[float]:
    return [size_of(rng) for _ in range(count)]


def sphere_of(rng: Rng) -> EllipsoidShape:
    return EllipsoidShape(*[size_of(rng)] * 3, kind="Sphere")


def ellipsoid_of(rng: Rng) -> EllipsoidShape:
    return EllipsoidShape(*sizes(rng, 3))


def box_of(rng: Rng, seam: bool) -> BoxShape:
    half = sizes(rng, 3)
    return BoxShape(*half, radius=min(half) * float(rng.uniform(0.1, 0.95)), seam=seam)


def super_of(rng: Rng, exponent: float, stretch: float = 3.0) -> SuperShape:
    middle = size_of(rng)
    return SuperShape([middle * float(stretch ** rng.uniform(-0.5, 0.5)) for _ in range(3)], exponent)


def any_super(rng: Rng) -> SuperShape:
    return super_of(rng, float(rng.uniform(2.0, 10.0)))


YIELDS = (("sphere", sphere_of), ("ellipsoid", ellipsoid_of), ("superellipsoid", any_super))
"""Tips that are also made to yield."""

QUADRIC, COMPOSITE, ITERATED = 5e-14, 5e-15, 1e-12
"""Limits on the error of the centroid: the issue's, and for the iterated ones what its residual means."""


def kinds() -> Iterator[Kind]:
    """Every kind of fingertip there is."""
    yield Kind("sphere", sphere_of, QUADRIC, False)
    yield Kind("ellipsoid", ellipsoid_of, QUADRIC, False)
    yield Kind("cylinder", lambda rng: CylinderShape(size_of(rng)), QUADRIC, False)
    yield Kind("plane", lambda rng: PlaneShape(size_of(rng)), QUADRIC, False)
    yield Kind("paraboloid", lambda rng: ParaboloidShape(*sizes(rng, 2)), QUADRIC, False)
    yield Kind("hyperboloid", lambda rng: HyperboloidShape(*sizes(rng, 3)), QUADRIC, False)
    for seam in (False, True):
        where = ", seams" if seam else ""
        yield Kind(f"capsule{where}", lambda rng, s=seam: CapsuleShape(*sizes(rng, 2), seam=s), COMPOSITE)
        yield Kind(f"rounded box{where}", lambda rng, s=seam: box_of(rng, s), COMPOSITE)
        yield Kind(f"own composite{where}", lambda rng, s=seam: EggShape(*sizes(rng, 2), seam=s), COMPOSITE)
    for exponent in (2.0, 2.5, 4.0, 10.0):
        yield Kind(f"superellipsoid {exponent:g}", lambda rng, p=exponent: super_of(rng, p), ITERATED)
    yield Kind("superellipsoid 2..10", lambda rng: super_of(rng, float(rng.uniform(2.0, 10.0)), 10.0), ITERATED)
    yield Kind("own function, compiled", lambda _: PebbleShape(compiled=True), ITERATED, surfaces=2)
    yield Kind("own function, Python", lambda _: PebbleShape(compiled=False), ITERATED, share=0.02, surfaces=2)
    for law, exponent in (("linear", 1.0), ("Hertz", 2.0 / 3.0), ("power 0.4", 0.4)):
        for softness in (YIELDING, TOO_SOFT):
            for name, shapes in YIELDS:
                label = f"{name}, {law}" + (", too soft" if softness is TOO_SOFT else "")
                yield Kind(label, shapes, ITERATED, exponent=exponent, softness=softness)


@dataclass(frozen=True)
class Built:
    """Contacts and their wrenches, sensor frame, extended precision but for the wrench.

    Attributes:
        centroid: Of the rounded wrench: rounding is carried over to first order, shape (n, 3) [m].
        normal: Shape (n, 3).
        wrench: Rounded, shape (n, 6).
        push: Normal force [N].
        spin: Spin torque [N m].
        spread: |dc/dm| times (|f| + |m| / max(|c|, size)): condition number in the surface's own frame.
    """

    centroid: Array
    normal: Array
    wrench: Array
    push: Array
    spin: Array
    spread: Array


@dataclass(frozen=True)
class Tip:
    """A shape, how it yields, and where it sits."""

    shape: Shape
    exponent: float
    stiffness: float
    sharpest: float
    center: Array
    rotation: Array
    surface: Any

    @classmethod
    def draw(cls, kind: Kind, rng: Rng, *, placed: bool) -> "Tip":
        shape = kind.shapes(rng)
        center, rotation = np.zeros(3), np.eye(3)
        frame = {}
        if placed:
            center, rotation = shape.size * rng.normal(size=3), turned(rng)
            frame = {"center": center, "rotation": rotation}
        surface = shape.build(**frame)
        stiffness = math.inf
        if kind.exponent:
            stiffness = float(10 ** rng.uniform(2, 5))
            surface = CompliantTip(surface, stiffness, kind.exponent)
        sharpest = float(shape.at(shape.points(rng, 5000)).sharpest.max()) if kind.exponent else 0.0
        return cls(shape, kind.exponent, stiffness, sharpest, center, rotation, surface)

    def delta(self, push: Array) -> Array:
        """Indentation [m]."""
        if not self.exponent:
            return np.zeros_like(push)
        return (np.maximum(push, 0) / LONG(self.stiffness)) ** LONG(self.exponent)

    def contacts(self, rng: Rng, n: int, softness: tuple[float, float]) -> Built:
        """Build n contacts."""
        x = self.shape.points(rng, n)
        here = self.shape.at(x)
        normal, W = here.normal, here.curvature
        push = long(10 ** rng.uniform(-2, 2, n))
        if self.exponent:
            delta = rng.uniform(*softness, n) / self.sharpest
            push = long(delta) ** (1 / LONG(self.exponent)) * LONG(self.stiffness)
        c = x - self.delta(push)[:, None] * normal
        tangent = unit(np.cross(normal, directions(rng, n)))
        slope = np.abs(rng.normal(size=n)) * np.where(rng.random(n) < 0.1, 10 ** rng.uniform(0, 1.5, n), 0.7)
        slope[rng.random(n) < 0.05] = 0.0
        f = push[:, None] * (slope[:, None] * tangent - normal)
        spin = push * self.shape.size * rng.choice([-1.0, 1.0], n) * 10 ** rng.uniform(-6, 0.5, n)
        spin[rng.random(n) < 0.25] = 0.0
        R, o = long(self.rotation), long(self.center)
        own = np.cross(c, f) + spin[:, None] * normal
        c, f, normal = c @ R.T + o, f @ R.T, normal @ R.T
        m = np.cross(c, f) + spin[:, None] * normal
        wrench = np.column_stack([f, m]).astype(np.float64)
        df, dm = wrench[:, :3] - f, wrench[:, 3:] - m
        # S = dc/dm, rigid surfaces (palpate.sensing.contact_jacobian)
        W = R @ W @ R.T
        trace = np.trace(W, axis1=1, axis2=2)
        gauss = (trace**2 - (W * W).sum(axis=(1, 2))) / 2
        eye = np.eye(3, dtype=LONG)
        tangential = eye - normal[:, :, None] * normal[:, None, :]
        across = np.zeros((n, 3, 3), LONG)
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            across[:, i, j], across[:, j, i] = -normal[:, k], normal[:, k]
        S = spin[:, None, None] * (trace[:, None, None] * eye - W) - push[:, None, None] * across
        S = S @ tangential / (push**2 + spin**2 * gauss)[:, None, None]
        moved = np.zeros_like(c)
        if not self.exponent:
            moved = (S @ (dm - np.cross(c, df))[:, :, None])[:, :, 0]
        # in the surface's own frame
        reach = np.maximum(norm(c - o), self.shape.size)
        size = np.sqrt((S * S).sum(axis=(1, 2)))
        spread = size * (norm(f) + norm(own) / reach)
        return Built(c + moved, normal, wrench, push, spin, spread)


@dataclass(frozen=True)
class Checked:
    """What came of n built contacts; every entry has shape (n,).

    Attributes:
        status: Of each.
        error: |c - c built| over max(|c|, size), about the tip's centre.
        off_surface: Distance of the (undeformed) point from the surface over max(|c|, size).
        tilt: |n - normal there|.
        unbalanced: |m - c x f - spin n| over |m| + max(|c|, size) |f|, about the tip's centre.
        decomposed: Of force into normal and tangential, over |f|.
        softness: delta times the sharpest curvature at the contact found.
        sound: All finite, pushing.
        condition: Reported.
        spread: Of `Built`.
    """

    status: Array
    error: Array
    off_surface: Array
    tilt: Array
    unbalanced: Array
    decomposed: Array
    softness: Array
    sound: Array
    condition: Array
    spread: Array

    @property
    def ok(self) -> Array:
        return self.status == ContactStatus.OK

    @property
    def is_contact(self) -> Array:
        """Whether what was found is a contact of this tip with this wrench, be it the built one or not."""
        worst = np.maximum.reduce([self.off_surface, self.tilt, self.unbalanced, self.decomposed])
        # a rotation matrix of float64 is orthonormal to rounding, so is the normal
        return self.sound & (worst <= TOUCHING) & (self.softness < 1.0)

    def within(self, kind: Kind) -> Array:
        """Whether the centroid is the built one within the kind's limit."""
        if kind.beyond:
            return np.ones_like(self.ok)
        if kind.by_condition:
            return self.error <= kind.error_limit * np.maximum(1.0, self.spread)
        return (self.error <= kind.error_limit) | (self.spread > CONDITION) & (self.error <= 1e-15 * self.spread)


def check(tip: Tip, built: Built) -> tuple[Checked, float]:
    """Recover the contacts and check each; also the time per contact [s]."""
    started = time.perf_counter()
    found = contacts_from_wrenches(tip.surface, built.wrench)
    seconds = (time.perf_counter() - started) / len(built.wrench)
    f, m = long(built.wrench[:, :3]), long(built.wrench[:, 3:])
    c, n = long(found.centroid), long(found.normal)
    o, R = long(tip.center), long(tip.rotation)
    push, spin = long(found.normal_force), long(found.spin_torque)
    with np.errstate(invalid="ignore"):
        x = (c - o + tip.delta(push)[:, None] * n) @ R
        here = tip.shape.at(x)
        reach = np.maximum(norm(c - o), tip.shape.size)
        left = m - np.cross(c, f) - spin[:, None] * n
        split = np.maximum(norm(f + push[:, None] * n - found.tangential_force), np.abs(push + dot(f, n)))
        fields = np.column_stack([found.centroid, found.normal, found.tangential_force, found.normal_force])
        finite = np.isfinite(fields).all(axis=1) & np.isfinite(found.spin_torque) & np.isfinite(found.condition)
        result = Checked(
            status=found.status,
            error=norm(c - built.centroid) / reach,
            off_surface=np.abs(here.distance) / reach,
            tilt=norm(n - here.normal @ R.T),
            unbalanced=norm(left) / (norm(m - np.cross(o, f)) + reach * norm(f)),
            decomposed=split / norm(f),
            softness=tip.delta(push) * here.sharpest,
            sound=finite & (push > 0.0) & (found.force == built.wrench[:, :3]).all(axis=1),
            condition=found.condition,
            spread=built.spread,
        )
    return result, seconds


@dataclass(frozen=True)
class Row:
    """What came of a kind's contacts; times in seconds per contact."""

    kind: Kind
    checked: Sequence[tuple[Tip, Built, Checked]]
    seconds: float

    def every(self, name: str) -> Array:
        return np.concatenate([getattr(checked, name) for _, _, checked in self.checked])

    @property
    def missed(self) -> int:
        return int((~self.every("ok")).sum())

    @property
    def wrong(self) -> int:
        return sum(int((c.ok & ~(c.is_contact & c.within(self.kind))).sum()) for _, _, c in self.checked)

    @property
    def statuses(self) -> str:
        codes, counts = np.unique(self.every("status"), return_counts=True)
        return ", ".join(f"{count} {ContactStatus(code).name}" for code, count in zip(codes, counts, strict=True))

    def largest(self, name: str) -> float:
        ok = self.every("ok") & (self.every("spread") < CONDITION)
        return float(self.every(name)[ok].max(initial=0.0))


def measure(kind: Kind, n: int, rng: Rng) -> Row:
    """Build, recover and check about n contacts of a kind, half of them in the sensor's own frame."""
    checked, seconds = [], []
    each = max(1, n // kind.surfaces)
    for i in range(kind.surfaces):
        tip = Tip.draw(kind, rng, placed=i % 2 == 0)
        contacts_from_wrenches(tip.surface, np.ones((1, 6)))  # compiles
        built = tip.contacts(rng, each, kind.softness)
        result, taken = check(tip, built)
        checked.append((tip, built, result))
        seconds.append(taken)
    return Row(kind, checked, float(np.median(seconds)))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--contacts", type=int, default=10**6, help="in total (default: 1000000)")
    parser.add_argument("--seed", type=int, default=1, help="of the random contacts (default: 1)")
    parser.add_argument("--only", default="", help="kinds whose name contains this")
    arguments = parser.parse_args()
    chosen = [kind for kind in kinds() if arguments.only in kind.name]
    per_share = arguments.contacts / sum(kind.share for kind in chosen)
    table = Table(title="built contacts")
    for heading in ("kind", "contacts, by status", "wrong", "error / size", "off surface", "unbalanced", "us"):
        table.add_column(heading, justify="left" if heading.startswith(("kind", "contacts")) else "right")
    total = missed = wrong = 0
    for number, kind in enumerate(chosen):
        row = measure(kind, math.ceil(kind.share * per_share), np.random.default_rng([arguments.seed, number]))
        total, wrong = total + len(row.every("status")), wrong + row.wrong
        missed += 0 if kind.beyond else row.missed
        figures = [f"{row.largest(name):.1e}" for name in ("error", "off_surface", "unbalanced")]
        if kind.beyond:
            figures[0] = "-"  # not the only contact
        table.add_row(kind.name, row.statuses, str(row.wrong), *figures, f"{row.seconds * 1e6:.2f}")
    table.caption = (
        f"{total} built contacts: {missed} missed (those of too soft tips apart), {wrong} wrong. "
        f"Errors: the largest of those with a condition number below {CONDITION:g}."
    )
    Console(width=130).print(table)
    raise SystemExit(0 if wrong == missed == 0 else 1)


if __name__ == "__main__":
    main()
