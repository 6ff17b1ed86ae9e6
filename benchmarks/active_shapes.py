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

Profile = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Value and derivative over distance / full width at half height."""

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


def crossed_waves(rng: np.random.Generator) -> Shape:
    """Two crossed waves, as an egg tray."""
    length, angle = rng.uniform(10.0, 30.0), rng.uniform(0.0, np.pi)
    k, height = 2.0 * np.pi / length, 0.5 * rng.uniform(0.02, 0.05) * length
    phases = rng.uniform(0.0, 2.0 * np.pi, 2)
    turned = zip((0.0, 0.5 * np.pi), phases, strict=True)
    return waves([(height, k * math.cos(angle + t), k * math.sin(angle + t), p) for t, p in turned])


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


def gaussian(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    k = 4.0 * math.log(2.0)
    value = np.exp(-k * q * q)
    return value, -2.0 * k * q * value


def cosine(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A raised cosine: nothing beyond one width."""
    inside = np.abs(q) < 1.0
    value = np.where(inside, 0.5 + 0.5 * np.cos(np.pi * q), 0.0)
    return value, np.where(inside, -0.5 * np.pi * np.sin(np.pi * q), 0.0)


def mesa(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Flat on top, flanks of raised cosine over 0.7 widths: nothing beyond 0.85 widths."""
    begin, end = 0.15, 0.85
    t = np.clip((np.abs(q) - begin) / (end - begin), 0.0, 1.0)
    return 0.5 + 0.5 * np.cos(np.pi * t), -0.5 * np.pi / (end - begin) * np.sin(np.pi * t) * np.sign(q)


PROFILES: tuple[Profile, ...] = (gaussian, cosine, mesa)


def any_profile(rng: np.random.Generator) -> Profile:
    return PROFILES[rng.integers(len(PROFILES))]


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
        """Where it is at least a tenth of its height: about 0.9 widths to all sides (both profiles) [mm^2]."""
        return 0.9 * self.width * (math.pi * 0.9 * self.width + 4.0 * self.half)


def with_details(base: Shape, details: list[Detail], profile: Profile) -> Shape:
    def shape(x, y):
        z, zx, zy = base(x, y)
        for d in details:
            c, s = math.cos(d.direction), math.sin(d.direction)
            u, v = c * (x - d.x) + s * (y - d.y), c * (y - d.y) - s * (x - d.x)
            u = u - np.clip(u, -d.half, d.half)
            away = np.hypot(u, v)
            value, slope = profile(away / d.width)
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
    """Shapes of a kind: a generator for tuning and another one for the report."""

    name: str
    local: bool
    tuning: Callable[[np.random.Generator], Shape]
    report: Callable[[np.random.Generator], Shape]


FAMILIES = (
    Family("sphere", False, lambda r: ball(r.uniform(48, 90)), lambda r: ball(r.uniform(45, 120))),
    Family(
        "ellipsoid",
        False,
        lambda r: ellipsoid(r.uniform(52, 100), r.uniform(48, 90), r.uniform(22, 60)),
        lambda r: ellipsoid(r.uniform(48, 75), r.uniform(60, 130), r.uniform(30, 90)),
    ),
    Family("bumps everywhere", False, crossed_waves, many_waves),
    Family(
        "flat, details",
        True,
        lambda r: with_details(flat, few_details(r), any_profile(r)),
        lambda r: with_details(flat, few_details(r), cosine),
    ),
    Family(
        "curved, details",
        True,
        lambda r: with_details(ball(r.uniform(120, 230)), few_details(r), any_profile(r)),
        lambda r: with_details(
            ellipsoid(r.uniform(90, 180), r.uniform(90, 180), r.uniform(60, 90)), few_details(r), cosine
        ),
    ),
)
