"""Built contacts on every kind of fingertip: how many are found, how exactly, how fast.

    python benchmarks/every_tip.py [--quick] [--seed N]

Choose a point c of the surface, a force that pushes there and a spin torque about the normal; build the wrench in
extended precision; recover the contact. Shapes, normals and curvatures are written down here a second time,
independently of the library, and every contact found is checked against them: a point of the surface, its normal,
the moment balanced, the force pushing. A contact is *missed* if the status is not OK, *wrong* if any check fails.
"""

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from harness.command import start
from harness.study import Check, Effort, Study
from harness.tables import grid
from numba import njit

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
"""Offsets of contacts near a seam, relative to the size of the tip: below, at and above what float64 resolves
there."""

CONDITION = 1e3
"""Contacts of general quadrics beyond this condition number are not held to the limit."""

YIELDING, TOO_SOFT = (0.0, 0.95), (1.05, 3.0)
"""Ranges of delta times the sharpest curvature of tips that yield."""

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


@dataclass(frozen=True, eq=False)
class Quadric(Shape):
    """x'Bx + 2 h.x = rho, gradient outwards.

    Attributes:
        surface: Builds the library's surface.
        draw: Draws n of its points.
        size: Length that errors are relative to [m].
        B: Diagonal of the matrix.
        h: Linear term.
        rho: Constant term.
        top: Points above belong to another sheet, which is no fingertip [m].
    """

    surface: Callable[..., Any]
    draw: Callable[[Rng, int], Array]
    size: float
    B: Array
    h: Array = field(default_factory=lambda: np.zeros(3, LONG))
    rho: float = 1.0
    top: float = math.inf

    def build(self, **frame: Any) -> Any:
        return self.surface(**frame)

    def points(self, rng: Rng, n: int) -> Array:
        return self.draw(rng, n)

    def at(self, points: Array) -> Local:
        value = dot(points * self.B, points) + 2 * dot(points, self.h) - self.rho
        gradient = 2 * (points * self.B + self.h)
        found = local_of(value, gradient, np.broadcast_to(2 * np.diag(self.B), (len(points), 3, 3)))
        return replace(found, distance=np.where(points[:, 2] < self.top, found.distance, np.inf))


def circle(rng: Rng, n: int) -> Array:
    """Return points of the unit circle, shape (n, 2)."""
    return unit(long(rng.normal(size=(n, 2))))


def ellipsoid(*axes: float) -> Quadric:
    surface, semi = partial(Ellipsoid, axes), long(axes)
    return Quadric(surface, lambda rng, n: directions(rng, n) * semi, max(axes), 1 / semi**2)


def sphere(radius: float) -> Quadric:
    return replace(ellipsoid(radius, radius, radius), surface=partial(Sphere, radius))


def cylinder(radius: float) -> Quadric:
    def draw(rng: Rng, n: int) -> Array:
        return np.column_stack([circle(rng, n) * radius, radius * rng.uniform(-3, 3, n)])

    return Quadric(partial(Cylinder, radius), draw, radius, long([1, 1, 0]) / long(radius) ** 2)


def plane(distance: float) -> Quadric:
    def draw(rng: Rng, n: int) -> Array:
        sides = distance * rng.choice([-1.0, 1.0], n)
        return long(np.column_stack([distance * rng.uniform(-3, 3, (n, 2)), sides]))

    return Quadric(partial(Plane, distance), draw, distance, long([0, 0, 1]) / long(distance) ** 2)


def paraboloid(*radii: float) -> Quadric:
    def draw(rng: Rng, n: int) -> Array:
        slope = circle(rng, n) * long(10 ** rng.uniform(-3, 0.7, (n, 1)))
        across = slope * long(radii)
        return np.column_stack([across, -dot(across, slope) / 2])

    B = np.append(1 / long(radii), LONG(0))
    return Quadric(partial(Paraboloid, radii), draw, max(radii), B, long([0, 0, 1]), 0.0)


def hyperboloid(*axes: float) -> Quadric:
    a, b, c = long(axes)

    def draw(rng: Rng, n: int) -> Array:
        u = long(10 ** rng.uniform(-3, 0.5, n))
        across = circle(rng, n) * np.sinh(u)[:, None] * long(axes)[:2]
        return np.column_stack([across, -2 * c * np.sinh(u / 2) ** 2])

    B, h = long([1 / a**2, 1 / b**2, -1 / c**2]), long([0, 0, 1 / c])
    return Quadric(partial(Hyperboloid, axes), draw, max(axes), B, h, 0.0, float(c))


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
        self.upper, self.lower = ellipsoid(radius, radius, radius), ellipsoid(radius, radius, depth)
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
        return v * np.where(v[:, 2:] > 0, self.upper.B**-0.5, self.lower.B**-0.5)

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


PEBBLE = np.array([[1.0, 0.2, 0.1], [-0.8, 0.7, 0.0], [-0.2, -0.9, 0.4], [0.1, 0.1, -1.0], [0.0, 0.2, 1.1]])
PEBBLE_SIZE, PEBBLE_SHARPNESS = 0.01, 4.0


def pebble_value(point: Array) -> float:
    """log(mean(exp(s a.x))) - s over a few directions a: a polyhedron with soft edges and no symmetry."""
    weights = np.exp(PEBBLE_SHARPNESS / PEBBLE_SIZE * (PEBBLE * point).sum(axis=1))
    return math.log(weights.sum() / len(PEBBLE)) - PEBBLE_SHARPNESS


def pebble_gradient(point: Array) -> Array:
    weights = np.exp(PEBBLE_SHARPNESS / PEBBLE_SIZE * (PEBBLE * point).sum(axis=1))
    turned = weights.reshape(-1, 1) * PEBBLE
    return PEBBLE_SHARPNESS / PEBBLE_SIZE * turned.sum(axis=0) / weights.sum()


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
        rows = long(PEBBLE_SHARPNESS) * long(PEBBLE) / long(PEBBLE_SIZE)
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
        name: Name in the table.
        shapes: Draws a shape of that kind.
        error_limit: Largest error of the centroid over max(|c|, size).
        by_condition: Whether that limit grows with the condition number; else it holds below `CONDITION`.
        exponent: Exponent of the law by which the surface yields; 0 for rigid ones.
        softness: Range of delta times the tip's sharpest curvature; beyond 1 a tip folds over where it is that
            sharp, and a contact may be missed or not be the only one, but nothing may be found that is none.
        share: Share of the contacts, relative to the other kinds.
        surfaces: Number of different surfaces.
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


def sphere_of(rng: Rng) -> Quadric:
    return sphere(size_of(rng))


def ellipsoid_of(rng: Rng) -> Quadric:
    return ellipsoid(*sizes(rng, 3))


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
    yield Kind("cylinder", lambda rng: cylinder(size_of(rng)), QUADRIC, False)
    yield Kind("plane", lambda rng: plane(size_of(rng)), QUADRIC, False)
    yield Kind("paraboloid", lambda rng: paraboloid(*sizes(rng, 2)), QUADRIC, False)
    yield Kind("hyperboloid", lambda rng: hyperboloid(*sizes(rng, 3)), QUADRIC, False)
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
        centroid: Centroid for the rounded wrench, to first order in rounding, shape (n, 3) [m].
        normal: Outward normals, shape (n, 3).
        wrench: Rounded wrenches, shape (n, 6).
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
        status: Status of each contact.
        error: |c - c built| over max(|c|, size), about the tip's centre.
        off_surface: Distance of the (undeformed) point from the surface over max(|c|, size).
        tilt: |n - normal there|.
        unbalanced: |m - c x f - spin n| over |m| + max(|c|, size) |f|, about the tip's centre.
        decomposed: Error of the split of the force into normal and tangential part, over |f|.
        softness: delta times the sharpest curvature at the contact found.
        sound: Whether all fields are finite and the force pushes.
        condition: Condition number reported.
        spread: `Built.spread`.
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


def built(effort: Effort, contacts: int = 1_000_000) -> Study:
    """Measure every kind of fingertip; contacts are shared among them."""
    chosen, seed = list(kinds()), effort.seed or 1
    per_share = (contacts // effort.of(1, 50)) / sum(kind.share for kind in chosen)
    heads = ("contacts, by status", "wrong", "error / size", "off surface", "unbalanced", "us")
    table, total, missed, wrong = grid("Built contacts", "kind", *heads), 0, 0, 0
    for number, kind in enumerate(chosen):
        effort.tell(f"built: {kind.name}")
        row = measure(kind, math.ceil(kind.share * per_share), np.random.default_rng([seed, number]))
        total, wrong = total + len(row.every("status")), wrong + row.wrong
        missed += 0 if kind.beyond else row.missed
        figures = [f"{row.largest(name):.1e}" for name in ("error", "off_surface", "unbalanced")]
        figures[0] = "-" if kind.beyond else figures[0]  # not the only contact
        table.add_row(kind.name, row.statuses, str(row.wrong), *figures, f"{row.seconds * 1e6:.2f}")
    about = f"Largest errors of contacts with a condition number below {CONDITION:g}."
    checks = (
        Check(f"missed of {total}, too soft tips apart", "0", str(missed), missed == 0),
        Check(f"wrong of {total}", "0", str(wrong), wrong == 0),
    )
    return Study("Built contacts", about, checks=checks, tables=(table,))


PARTS = {"built": built}

if __name__ == "__main__":
    start(__doc__, PARTS)
