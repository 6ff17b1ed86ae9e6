"""A sphere from contacts on a cap of it: how well and how fast its radius is found."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from palpate.errors import FloatArray
from palpate.mapping import TouchCloud
from palpate.mapping.primitives import PrimitiveKind, fit_primitive
from studies.study import Row, Study, Tell
from studies.turns import timed_in_turns

RADIUS = 0.02
POINTS = 200
NOISE = 3e-5
"""Of a point, each axis [m]: a soft fingertip on a stage."""
TILT = math.radians(0.5)
"""Of a normal, each tangent [rad]."""
CAPS = (15.0, 25.0, 45.0)
"""Half-angles that were felt [degrees]: the smaller the cap, the harder."""

ABOUT = (
    f"{POINTS} contacts on a cap of a sphere of {1e3 * RADIUS:g} mm radius, noise of {1e3 * NOISE:g} mm and "
    "half a degree, independent from contact to contact. The error is that of the radius, root mean square and "
    "largest over the seeds. Other shapes, telling them apart, and whole maps: python benchmarks/fits.py and "
    "benchmarks/mapping_surface."
)


def felt_cap(half_angle: float, rng: np.random.Generator) -> TouchCloud:
    """Return contacts on a cap of a sphere about a random place; `half_angle` [rad]."""
    z = rng.uniform(np.cos(half_angle), 1.0, POINTS)
    angle = rng.uniform(0.0, 2.0 * np.pi, POINTS)
    across = np.sqrt(1.0 - z * z)
    true = np.column_stack([across * np.cos(angle), across * np.sin(angle), z])
    place = rng.uniform(-0.5, 0.5, 3) + RADIUS * true + NOISE * rng.normal(size=true.shape)
    normal = true + TILT * rng.normal(size=true.shape)
    normal = np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True), dtype=np.float64)
    zero = np.zeros(POINTS)
    return TouchCloud(np.linspace(0.0, 1.0, POINTS), place, normal, np.ones(POINTS), np.zeros((POINTS, 3)), zero)


def algebraic(points: FloatArray) -> float:
    """Return the radius of the algebraic fit, |p|^2 = 2 c.p + (r^2 - |c|^2): linear, and biased on a cap."""
    middle = points.mean(axis=0)
    p = points - middle
    found = np.linalg.lstsq(np.column_stack([2.0 * p, np.ones(len(p))]), np.sum(p * p, axis=1), rcond=None)[0]
    return float(np.sqrt(found[3] + found[:3] @ found[:3]))


def geometric(points: FloatArray) -> float:
    """Return the radius of scipy's least squares of distances, from the middle of the points."""
    middle = points.mean(axis=0)
    p = points - middle
    start = np.append(np.zeros(3), np.linalg.norm(p, axis=1).max())

    def left(x: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(p - x[:3], axis=1) - x[3])

    found = least_squares(left, start, xtol=1e-12, ftol=1e-12)
    return abs(float(found.x[3]))


METHODS: dict[str, Callable[[TouchCloud], float]] = {
    "palpate, points and normals": lambda cloud: fit_primitive(cloud, PrimitiveKind.SPHERE).shape.radius,
    "scipy least squares": lambda cloud: geometric(cloud.position),
    "algebraic, numpy": lambda cloud: algebraic(cloud.position),
}


def measure(quick: bool, seed: int, tell: Tell) -> Study:
    """Measure fits of a sphere."""
    rng = np.random.default_rng(seed)
    clouds = {cap: [felt_cap(math.radians(cap), rng) for _ in range(20 if quick else 100)] for cap in CAPS}
    rows = []
    for cap, felt in clouds.items():
        tell(f"mapping: a cap of {cap:g} degrees")
        first = felt[0]
        calls = {name: partial(method, first) for name, method in METHODS.items()}
        taken = timed_in_turns(calls, 5 if quick else 15)
        for name, method in METHODS.items():
            errors = np.array([abs(method(cloud) - RADIUS) for cloud in felt])
            rms = float(np.sqrt(np.mean(errors**2)))
            rows.append(Row(name, f"{name}, cap of {cap:g} degrees", taken[name], rms, float(errors.max())))
    rows.sort(key=lambda row: list(METHODS).index(row.series))
    return Study("A sphere from a cap of it", ABOUT, "time per fit", "s", "of the radius", "m", tuple(rows))
