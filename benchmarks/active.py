"""How far an active exploration goes, against the best raster in hindsight.

    python benchmarks/active.py [--seeds 10] [--tune] [--shapes WORD]

Pure geometry: contacts at 500 Hz and 20 mm/s on 40 x 40 mm seen from above, position noise of 0.03 mm correlated
over 1 mm of path, normals off by 0.5 degrees. Both explorations feed the same map (a smoothing spline through
heights and slopes, smoothness by maximum likelihood) and stop by the same rule: true RMS error below 0.02 mm, or
largest below 0.1 mm. Rasters of 2 to 41 rows are tried and the shortest way that meets the rule is the best; the
way of the active exploration counts lifted travel too. `--tune` uses other shapes and seeds: those that the
settings were chosen with.
"""

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.signal import lfilter

from palpate.controllers.paths import Active, Ended, Felt, Goal, Hop, LegEnd, Measure, Stroke

HALF = 20.0
"""Half side of the field [mm]; this file computes in mm."""
KNOT = 0.8
KNOTS = int(2 * HALF / KNOT) + 3
BANDS = 3 * KNOTS + 3
HEIGHT_SD, CORRELATION, NORMAL_SD = 0.03, 1.0, math.radians(0.5)
STEP = 20.0 / 500.0
STRETCH = 15  # contacts, 0.6 mm
HEIGHT_VARIANCE = HEIGHT_SD**2 * 2.0 * CORRELATION / (STRETCH * STEP)  # effective number, as independent
SLOPE_VARIANCE = NORMAL_SD**2 / STRETCH
STIFFNESSES = (3e1, 3e2, 3e3)
RASTERS = (*range(2, 25), 26, 28, 31, 35, 41)
TUNE_SEED, REPORT_SEED = 0, 1000

Shape = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Heights and slopes dz/dx, dz/dy at places x, y [mm]."""


@dataclass(frozen=True)
class Rule:
    """When to stop, how the exploration is told, and what is asked."""

    name: str
    measure: Measure
    limit: float  # [mm], of the true error
    goal: float  # [m], what the planner aims at


RULES = (Rule("RMS 0.02 mm", Measure.RMS, 0.02, 2e-5), Rule("max 0.1 mm", Measure.LARGEST, 0.1, 6e-5))


# -- shapes -----------------------------------------------------------------------------------------------------


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


def gaussian(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Profile of distance over full width at half height: value and derivative."""
    k = 4.0 * math.log(2.0)
    value = np.exp(-k * q * q)
    return value, -2.0 * k * q * value


def cosine(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same, raised cosine: nothing beyond one width."""
    inside = np.abs(q) < 1.0
    value = np.where(inside, 0.5 + 0.5 * np.cos(np.pi * q), 0.0)
    return value, np.where(inside, -0.5 * np.pi * np.sin(np.pi * q), 0.0)


def with_details(base: Shape, details: list[tuple[float, ...]], profile) -> Shape:
    """Add bumps, dents and ridges: (x, y, width, half length, direction, height)."""

    def shape(x, y):
        z, zx, zy = base(x, y)
        for cx, cy, width, half, direction, height in details:
            c, s = math.cos(direction), math.sin(direction)
            u, v = c * (x - cx) + s * (y - cy), c * (y - cy) - s * (x - cx)
            u = u - np.clip(u, -half, half)
            away = np.hypot(u, v)
            value, slope = profile(away / width)
            slope = height * slope / width / np.where(away > 0.0, away, 1.0)
            z, zx, zy = z + height * value, zx + slope * (c * u - s * v), zy + slope * (s * u + c * v)
        return z, zx, zy

    return shape


def details(rng: np.random.Generator) -> list[tuple[float, ...]]:
    """Two to four, 1 to 8 mm wide at half height, 0.2 to 0.4 of that high or deep; every third one a ridge."""
    found = []
    for _ in range(rng.integers(2, 5)):
        width, ridge = rng.uniform(1.0, 8.0), rng.uniform() < 1.0 / 3.0
        x, y = rng.uniform(-15.0, 15.0, 2)
        half = rng.uniform(2.0, 6.0) if ridge else 0.0
        height = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.4) * width
        found.append((x, y, width, half, rng.uniform(0.0, np.pi), height))
    return found


def crossed_waves(rng: np.random.Generator) -> Shape:
    """Two crossed waves, as an egg tray."""
    length, angle = rng.uniform(10.0, 25.0), rng.uniform(0.0, np.pi)
    k, height = 2.0 * np.pi / length, 0.5 * rng.uniform(0.02, 0.05) * length
    phases = rng.uniform(0.0, 2.0 * np.pi, 2)
    return waves(
        [
            (height, k * math.cos(angle + t), k * math.sin(angle + t), p)
            for t, p in zip((0.0, 0.5 * np.pi), phases, strict=True)
        ]
    )


def many_waves(rng: np.random.Generator) -> Shape:
    """Five waves of like length in any direction: bumps everywhere, none like another."""
    length = rng.uniform(10.0, 25.0)
    terms = []
    for _ in range(5):
        k, angle = 2.0 * np.pi / (length * rng.uniform(0.9, 1.2)), rng.uniform(0.0, np.pi)
        height = 0.3 * rng.uniform(0.02, 0.05) * length
        terms.append((height, k * math.cos(angle), k * math.sin(angle), rng.uniform(0.0, 2.0 * np.pi)))
    return waves(terms)


def flat(x, y):
    return 0.0 * x, 0.0 * x, 0.0 * x


HOMOGENEOUS, LOCAL = "homogeneous", "local detail"
SHAPES: dict[str, tuple[str, Callable, Callable]] = {
    "sphere": (HOMOGENEOUS, lambda r: ball(r.uniform(32, 60)), lambda r: ball(r.uniform(30, 80))),
    "ellipsoid": (
        HOMOGENEOUS,
        lambda r: ellipsoid(r.uniform(35, 70), r.uniform(32, 60), r.uniform(15, 40)),
        lambda r: ellipsoid(r.uniform(32, 50), r.uniform(40, 90), r.uniform(20, 60)),
    ),
    "bumps everywhere": (HOMOGENEOUS, crossed_waves, many_waves),
    "flat, details": (
        LOCAL,
        lambda r: with_details(flat, details(r), gaussian),
        lambda r: with_details(flat, details(r), cosine),
    ),
    "curved, details": (
        LOCAL,
        lambda r: with_details(ball(r.uniform(80, 150)), details(r), gaussian),
        lambda r: with_details(ellipsoid(r.uniform(60, 120), r.uniform(60, 120), 40.0), details(r), cosine),
    ),
}
"""Kind, and how a shape is drawn for tuning and for the report."""

ASKED = {
    (HOMOGENEOUS, Measure.RMS): 1.1,
    (HOMOGENEOUS, Measure.LARGEST): 1.1,
    (LOCAL, Measure.RMS): 0.75,
    (LOCAL, Measure.LARGEST): 0.65,
}


# -- the map ----------------------------------------------------------------------------------------------------


def basis(u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First knot, values and derivatives of the four cubic B-splines at u."""
    t = (u + HALF) / KNOT
    first = np.clip(np.floor(t).astype(int), 0, KNOTS - 4)
    f = t - first
    value = np.stack([(1 - f) ** 3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3], 1) / 6
    slope = np.stack([-((1 - f) ** 2), 3 * f**2 - 4 * f, -3 * f**2 + 2 * f + 1, f**2], 1) / 2 / KNOT
    return first, value, slope


def bending() -> np.ndarray:
    """Integral of squared second derivatives, lower band form."""
    n = 6 * KNOTS
    at = ((np.arange(n) + 0.5) / n * 2 - 1) * HALF
    first, value, slope = basis(at)
    f = (at + HALF) / KNOT - first
    second = np.stack([1 - f, 3 * f - 2, -3 * f + 1, f], 1) / KNOT**2
    grams = []
    for w in (value, slope, second):
        gram = np.zeros((KNOTS, KNOTS))
        for a in range(4):
            for b in range(4):
                np.add.at(gram, (first + a, first + b), w[:, a] * w[:, b] * (2 * HALF / n))
        grams.append(gram)
    g0, g1, g2 = grams
    whole = np.kron(g2, g0) + 2 * np.kron(g1, g1) + np.kron(g0, g2)
    band = np.zeros((BANDS + 1, len(whole)))
    for k in range(BANDS + 1):
        band[k, : len(whole) - k] = np.diagonal(whole, -k)
    return band


BENDING = bending()
GRID = np.linspace(-HALF, HALF, 81)
GRID_X, GRID_Y = np.meshgrid(GRID, GRID)


def grid_values() -> np.ndarray:
    first, value, _ = basis(GRID)
    out = np.zeros((len(GRID), KNOTS))
    for a in range(4):
        out[np.arange(len(GRID)), first + a] = value[:, a]
    return out


GRID_BASIS = grid_values()


class SplineMap:
    """Heights from means over stretches of contacts, by penalised least squares."""

    def __init__(self) -> None:
        self._a, self._b, self._square = np.zeros_like(BENDING), np.zeros(KNOTS**2), 0.0

    def add(self, x, y, z, zx, zy) -> None:
        """Take means over stretches."""
        ix, wx, dx = basis(x)
        iy, wy, dy = basis(y)
        index = (iy[:, None] + np.arange(4))[:, :, None] * KNOTS + (ix[:, None] + np.arange(4))[:, None, :]
        index = index.reshape(len(x), 16)
        for across, along, variance, felt in (
            (wy, wx, HEIGHT_VARIANCE, z),
            (wy, dx, SLOPE_VARIANCE, zx),
            (dy, wx, SLOPE_VARIANCE, zy),
        ):
            w = (across[:, :, None] * along[:, None, :]).reshape(len(x), 16)
            np.add.at(self._b, index, w * felt[:, None] / variance)
            for p in range(16):
                below = index[:, p : p + 1] - index
                use = below >= 0
                np.add.at(self._a, (below[use], index[use]), (w[:, p : p + 1] * w)[use] / variance)
            self._square += float(np.sum(felt**2)) / variance

    def heights(self) -> np.ndarray:
        """On the grid, with the smoothness of greatest evidence."""
        best, least = self._b, np.inf
        for stiffness in STIFFNESSES:
            factor = cholesky_banded(self._a + stiffness * BENDING, lower=True, check_finite=False)
            c = cho_solve_banded((factor, True), self._b, check_finite=False)
            evidence = self._square - self._b @ c + 2 * np.log(factor[0]).sum()
            evidence -= (KNOTS**2 - 3) * math.log(stiffness)
            if evidence < least:
                best, least = c, evidence
        return GRID_BASIS @ best.reshape(KNOTS, KNOTS) @ GRID_BASIS.T

    def error(self, shape: Shape, measure: Measure) -> float:
        """True error along the normal, RMS or largest."""
        z, zx, zy = shape(GRID_X, GRID_Y)
        off = (self.heights() - z) / np.sqrt(1 + zx**2 + zy**2)
        return float(np.sqrt((off**2).mean()) if measure is Measure.RMS else np.abs(off).max())


# -- the two explorations ---------------------------------------------------------------------------------------


def feel(shape: Shape, corners: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Contacts along a polygon, columns x, y, z, dz/dx, dz/dy."""
    pieces = []
    for a, b in pairwise(corners):
        n = max(int(np.linalg.norm(b - a) / STEP), 2)
        pieces.append(a + ((np.arange(n) + 0.5) / n)[:, None] * (b - a))
    xy = np.concatenate(pieces)
    keep = math.exp(-STEP / CORRELATION)
    white = rng.normal(size=len(xy)) * math.sqrt(1 - keep * keep)
    white[0] = rng.normal()
    z, zx, zy = shape(*xy.T)
    tilt = NORMAL_SD * rng.normal(size=(2, len(xy)))
    slant = np.sqrt(1 + zx**2 + zy**2)
    z = z + HEIGHT_SD * slant * lfilter([1.0], [1.0, -keep], white)
    return np.column_stack([xy, z, zx + slant * tilt[0], zy + slant * tilt[1]])


def means(contacts: np.ndarray) -> np.ndarray:
    """Means over stretches, shape (5, n)."""
    size = min(STRETCH, len(contacts))
    n = len(contacts) // size
    return contacts[: n * size].reshape(n, size, 5).mean(axis=1).T


def best_raster(shape: Shape, rule: Rule, seed: int) -> float:
    """Length of the shortest raster that meets the rule [mm]."""
    for rows in RASTERS:
        corners = []
        for k, y in enumerate(np.linspace(-HALF, HALF, rows)):
            corners += [(-HALF, y), (HALF, y)][:: 1 if k % 2 == 0 else -1]
        found = SplineMap()
        found.add(*means(feel(shape, np.array(corners), np.random.default_rng((seed, 1)))))
        if found.error(shape, rule.measure) <= rule.limit:
            return 2 * HALF * (rows + 1)
    return math.inf


def active_way(shape: Shape, rule: Rule, seed: int, longest: float) -> tuple[float, bool]:
    """Way until the rule is met [mm], and whether the planner stopped by itself before."""
    rng = np.random.default_rng((seed, 2))
    planner = Active(2e-3 * HALF, 2e-3 * HALF, Goal(rule.goal, rule.measure))
    found, at, way, leg = SplineMap(), np.full(2, -HALF), 0.0, planner.next(None)
    while leg is not None and way < longest:
        if isinstance(leg, Hop):
            to = 1e3 * np.array(leg.to)
            way += float(np.linalg.norm(to - at))
        else:
            assert isinstance(leg, Stroke)
            to = 1e3 * np.array(leg.corners[-1])
            way += float(np.linalg.norm(to - at))
            contacts = feel(shape, np.array([at, to]), rng)
            for x, y, z, zx, zy in contacts.tolist():
                s = 1.0 / math.sqrt(1.0 + zx * zx + zy * zy)
                point = (1e-3 * x, 1e-3 * y, 1e-3 * z)
                planner.feel(Felt(point, point, (-zx * s, -zy * s, s)))
            found.add(*means(contacts))
            if found.error(shape, rule.measure) <= rule.limit:
                return way, False
        at = to
        leg = planner.next(Ended(LegEnd.REACHED, (1e-3 * at[0], 1e-3 * at[1], 0.0)))
    return math.inf, leg is None


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--tune", action="store_true", help="the shapes and seeds that settings were chosen with")
    parser.add_argument("--shapes", default="", help="only shapes whose name contains this")
    arguments = parser.parse_args()
    table = Table(title="Way of the active exploration over that of the best raster in hindsight")
    for heading in ("shape", "stop at", "asked", "median", "each (inf: not within 1.6 of the best raster)"):
        table.add_column(heading)
    jobs = [(name, rule) for name in SHAPES if arguments.shapes in name for rule in RULES]
    pooled: dict[tuple[str, Measure], list[float]] = {}
    first = TUNE_SEED if arguments.tune else REPORT_SEED
    for name, rule in track(jobs, "exploring", transient=True):
        kind, tuning, report = SHAPES[name]
        ratios, stopped = [], 0
        for seed in range(first, first + arguments.seeds):
            shape = (tuning if arguments.tune else report)(np.random.default_rng(seed))
            best = best_raster(shape, rule, seed)
            way, early = active_way(shape, rule, seed, 1.6 * best if math.isfinite(best) else 1000.0)
            ratios.append(way / best)
            stopped += early
        pooled.setdefault((kind, rule.measure), []).extend(ratios)
        each = " ".join(f"{ratio:.2f}" for ratio in ratios) + (f"; {stopped} stopped early" if stopped else "")
        table.add_row(name, rule.name, f"{ASKED[kind, rule.measure]}", f"{np.median(ratios):.2f}", each)
    for (kind, measure), ratios in pooled.items():
        table.add_row(kind, measure.name, f"{ASKED[kind, measure]}", f"{np.median(ratios):.2f}", "all of these")
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
