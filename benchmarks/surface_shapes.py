"""Surfaces known in closed form, touched along the rows of a raster with noise that is correlated along the
path."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from palpate.errors import FloatArray
from palpate.mapping import TouchCloud

SPEED = 0.02  # [m/s]
RATE = 500.0  # [Hz]
STEP = SPEED / RATE  # [m] of path between contacts

Surface = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Points and outward unit normals of parameters (u, v)."""


@dataclass(frozen=True)
class Shape:
    """A surface (u, v) -> (points, normals), scanned along u at rows of v.

    Attributes:
        name: Name in tables.
        surface: The map.
        u: Range of u along a row.
        v: Range of v over the rows.
    """

    name: str
    surface: Surface
    u: tuple[float, float]
    v: tuple[float, float]

    def rows(self, distance: float) -> tuple[FloatArray, FloatArray]:
        """Return u and v along a meander whose contacts are `STEP` and whose rows `distance` apart at most."""
        v = np.linspace(*self.v, 2000)
        middle = np.full_like(v, 0.5 * sum(self.u))
        across = arc(self.surface(middle, v)[0])
        count = max(2, round(across[-1] / distance) + 1)
        parts = []
        for i, row in enumerate(np.interp(np.linspace(0.0, across[-1], count), across, v)):
            u = np.linspace(*self.u, 4000)
            along = arc(self.surface(u, np.full_like(u, row))[0])
            at = np.interp(np.arange(0.0, max(along[-1], STEP), STEP), along, u)
            parts.append((at[:: (-1) ** i], np.full_like(at, row)))
        return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])

    def samples(self, count: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Return `count` points evenly over the area, and their normals."""
        u = rng.uniform(*self.u, 20 * count)
        v = rng.uniform(*self.v, 20 * count)
        h = 1e-6
        du = self.surface(u + h * (self.u[1] - self.u[0]), v)[0] - self.surface(u, v)[0]
        dv = self.surface(u, v + h * (self.v[1] - self.v[0]))[0] - self.surface(u, v)[0]
        area = np.linalg.norm(np.cross(du, dv), axis=1)
        kept = rng.choice(len(u), count, replace=False, p=area / area.sum())
        return self.surface(u[kept], v[kept])


def arc(points: FloatArray) -> FloatArray:
    """Return the length of the polygon up to each point."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


@dataclass(frozen=True)
class Noise:
    """Errors of contacts, with correlation exp(-s / length) along the path.

    Attributes:
        noise: Standard deviation of each coordinate of a position [m].
        tilt: Standard deviation of a normal about each tangent [rad].
        length: Correlation length [m].
        bias: Constant error, outward along the normal [m].
        white_tilt: Whether the tilts are independent from contact to contact instead.
    """

    noise: float = 0.03e-3
    tilt: float = float(np.radians(0.5))
    length: float = 1e-3
    bias: float = 0.0
    white_tilt: bool = False


def felt(points: FloatArray, normals: FloatArray, noise: Noise, rng: np.random.Generator) -> TouchCloud:
    """Return noisy contacts at points along a path."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    turn = rng.normal(size=points.shape) if noise.white_tilt else along_path(steps, noise.length, rng)
    tilted = normals + noise.tilt * np.cross(turn, normals)
    tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
    n = len(points)
    return TouchCloud(
        time=np.arange(n) / RATE,
        position=points + noise.noise * along_path(steps, noise.length, rng) + noise.bias * normals,
        normal=tilted,
        normal_force=np.full(n, 2.0),
        tangential_force=np.zeros((n, 3)),
        spin_torque=np.zeros(n),
    )


def along_path(steps: FloatArray, length: float, rng: np.random.Generator) -> FloatArray:
    """Return three unit Ornstein-Uhlenbeck processes along a path, shape (n, 3)."""
    regular = np.isclose(steps, STEP, rtol=0.5)
    decay = np.exp(-STEP / length)
    white = rng.normal(size=(len(steps) + 1, 3))
    starts = np.concatenate([[0], np.flatnonzero(~regular) + 1])  # a jump to another row begins anew
    parts = []
    for i, j in zip(starts, np.append(starts[1:], len(white)), strict=True):
        drive = white[i:j] * np.sqrt(1.0 - decay**2)
        drive[0] = white[i]
        parts.append(lfilter([1.0], [1.0, -decay], drive, axis=0))
    return np.concatenate(parts)


def _ellipsoid(a: float, b: float, c: float) -> Surface:
    axes = np.array([a, b, c])

    def surface(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        unit = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=1)
        normal = unit / axes
        return unit * axes, normal / np.linalg.norm(normal, axis=1, keepdims=True)

    return surface


def torus(R: float, r: float) -> Surface:
    """Return a torus about z, of radii R [m] of its ring and r of its tube; u goes round the ring."""

    def surface(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        out = np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=1)
        normal = np.cos(v)[:, None] * out
        normal[:, 2] = np.sin(v)
        return R * out + r * normal, normal

    return surface


def _bumps(height: float, wavelength: float) -> Surface:
    k = 2.0 * np.pi / wavelength

    def surface(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        z = height * np.sin(k * u) * np.sin(k * v)
        normal = np.stack(
            [
                -height * k * np.cos(k * u) * np.sin(k * v),
                -height * k * np.sin(k * u) * np.cos(k * v),
                np.ones_like(u),
            ],
            axis=1,
        )
        return np.stack([u, v, z], axis=1), normal / np.linalg.norm(normal, axis=1, keepdims=True)

    return surface


def _rounded_box(half: FloatArray, radius: float) -> Surface:
    """Top and sides down to the middle: u runs over a profile of arc length across the top, v along it."""

    def profile(s: FloatArray, flat: float) -> tuple[FloatArray, FloatArray]:
        """Where a curve at arc length s from the middle is, along and how far it has turned."""
        turn = np.clip((np.abs(s) - flat) / radius, 0.0, 0.5 * np.pi)
        return np.sign(s) * (np.minimum(np.abs(s), flat)), np.sign(s) * turn

    def surface(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, turn_x = profile(u, half[0])
        y, turn_y = profile(v, half[1])
        normal = np.stack(
            [np.sin(turn_x), np.cos(turn_x) * np.sin(turn_y), np.cos(turn_x) * np.cos(turn_y)], axis=1
        )
        core = np.stack([x, y, np.zeros_like(x)], axis=1)
        return core + radius * normal, normal

    return surface


SHAPES = (
    Shape("sphere", _ellipsoid(0.02, 0.02, 0.02), (0.0, 2.0 * np.pi), (0.02, 0.5 * np.pi - 0.01)),
    Shape("ellipsoid", _ellipsoid(0.03, 0.02, 0.015), (0.0, 2.0 * np.pi), (0.02, 0.5 * np.pi - 0.01)),
    Shape("torus", torus(0.025, 0.008), (0.0, 2.0 * np.pi), (-0.5 * np.pi, 0.5 * np.pi)),
    Shape(
        "rounded box",
        _rounded_box(np.array([0.015, 0.010]), 0.004),
        (-0.015 - 0.5 * np.pi * 0.004, 0.015 + 0.5 * np.pi * 0.004),
        (-0.010 - 0.5 * np.pi * 0.004, 0.010 + 0.5 * np.pi * 0.004),
    ),
    Shape("bumps", _bumps(3e-3, 60e-3), (-0.03, 0.03), (-0.03, 0.03)),
)
