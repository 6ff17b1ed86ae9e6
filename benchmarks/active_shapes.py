"""Surfaces seen from above, in closed form: curved all over, or smooth with details on a given share of the
field."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

HALF = 30.0
"""Half side of the field [mm]."""

Shape = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Heights and slopes dz/dx, dz/dy at places x, y [mm]."""

NARROWEST, WIDEST = 2.0, 8.0
"""Full width of details at half height [mm]: seam, rivet, dent, weld spot, embossed mark."""


FEW = 0.05
"""Part of the field that details cover at most where "detail is local"."""


# -- curved all over --------------------------------------------------------------------------------------------


def flat(x, y):
    return 0.0 * x, 0.0 * x, 0.0 * x


def ball(radius: float) -> Shape:
    def shape(x, y):
        z = np.sqrt(radius**2 - x * x - y * y)
        return z - radius, -x / z, -y / z

    return shape


def ellipsoid(a: float, b: float, c: float) -> Shape:
    def shape(x, y):
        q = np.sqrt(1.0 - (x / a) ** 2 - (y / b) ** 2)
        return c * q - c, -c * x / a**2 / q, -c * y / b**2 / q

    return shape


def waves(terms: list[tuple[float, float, float, float]]) -> Shape:
    """A sum of amplitude sin(kx x + ky y + phase)."""

    def shape(x, y):
        z, zx, zy = 0.0 * x, 0.0 * x, 0.0 * x
        for amplitude, kx, ky, phase in terms:
            angle = kx * x + ky * y + phase
            z = z + amplitude * np.sin(angle)
            zx = zx + amplitude * kx * np.cos(angle)
            zy = zy + amplitude * ky * np.cos(angle)
        return z, zx, zy

    return shape


def many_waves(rng: np.random.Generator) -> Shape:
    """Five waves of like length in any direction: bumps everywhere, none like another."""
    length = rng.uniform(10.0, 30.0)
    terms = []
    for _ in range(5):
        k, angle = 2.0 * np.pi / (length * rng.uniform(0.9, 1.2)), rng.uniform(0.0, np.pi)
        height = 0.3 * rng.uniform(0.02, 0.05) * length
        terms.append((height, k * math.cos(angle), k * math.sin(angle), rng.uniform(0.0, 2.0 * np.pi)))
    return waves(terms)


# -- details on something smooth --------------------------------------------------------------------------------


def cosine(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a raised cosine over distance / full width at half height, and its slope: 0 beyond one width."""
    inside = np.abs(q) < 1.0
    value = np.where(inside, 0.5 + 0.5 * np.cos(np.pi * q), 0.0)
    return value, np.where(inside, -0.5 * np.pi * np.sin(np.pi * q), 0.0)


@dataclass(frozen=True, slots=True)
class Detail:
    """A bump or dent, or with a length a ridge or groove with round ends.

    Attributes:
        x: Middle [mm].
        y: Middle [mm].
        width: Width at half its height [mm].
        half: Half its length, without the ends [mm].
        direction: Direction of its length [rad].
        height: Height; negative for a dent or groove [mm].
    """

    x: float
    y: float
    width: float
    half: float
    direction: float
    height: float

    @property
    def area(self) -> float:
        """Where it is at least a tenth of its height: about 0.9 widths to all sides [mm^2]."""
        return 0.9 * self.width * (math.pi * 0.9 * self.width + 4.0 * self.half)


def with_details(base: Shape, details: list[Detail]) -> Shape:
    def shape(x, y):
        z, zx, zy = base(x, y)
        for d in details:
            c, s = math.cos(d.direction), math.sin(d.direction)
            u, v = c * (x - d.x) + s * (y - d.y), c * (y - d.y) - s * (x - d.x)
            u = u - np.clip(u, -d.half, d.half)
            away = np.hypot(u, v)
            value, slope = cosine(away / d.width)
            slope = d.height * slope / d.width / np.where(away > 0.0, away, 1.0)
            z, zx, zy = z + d.height * value, zx + slope * (c * u - s * v), zy + slope * (s * u + c * v)
        return z, zx, zy

    return shape


def one_detail(rng: np.random.Generator) -> Detail:
    """Round ones as wide as details come, every third one long and narrow; 0.1 to 0.4 widths high or deep."""
    ridge = rng.uniform() < 1.0 / 3.0
    width = rng.uniform(NARROWEST, 0.5 * (NARROWEST + WIDEST) if ridge else WIDEST)
    half = rng.uniform(2.0, 6.0) if ridge else 0.0
    reach = HALF - width - half
    x, y = rng.uniform(-reach, reach, 2)
    height = rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.4) * width
    return Detail(x, y, width, half, rng.uniform(0.0, np.pi), height)


def few_details(rng: np.random.Generator) -> list[Detail]:
    """One to four that together cover at most `FEW` of the field."""
    while True:
        found = [one_detail(rng) for _ in range(rng.integers(1, 5))]
        if sum(d.area for d in found) <= FEW * (2.0 * HALF) ** 2:
            return found


# -- what is measured -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Family:
    """Shapes of a kind, and whether their detail is local."""

    name: str
    local: bool
    draw: Callable[[np.random.Generator], Shape]


FAMILIES = (
    Family("sphere", False, lambda r: ball(r.uniform(45, 120))),
    Family("ellipsoid", False, lambda r: ellipsoid(r.uniform(48, 75), r.uniform(60, 130), r.uniform(30, 90))),
    Family("bumps everywhere", False, many_waves),
    Family("flat, details", True, lambda r: with_details(flat, few_details(r))),
    Family(
        "curved, details",
        True,
        lambda r: with_details(ellipsoid(*r.uniform((90, 90, 60), (180, 180, 90)).tolist()), few_details(r)),
    ),
)
