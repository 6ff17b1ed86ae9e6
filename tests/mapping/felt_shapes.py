"""Shapes known in closed form, felt along a path as a finger does: error correlated over a millimetre of path."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval2d

from palpate.mapping import TouchCloud

POINTS = 200
ROWS = 12
CORRELATION = 1e-3
NORMAL_SD = np.radians(0.5)


@dataclass(frozen=True)
class Felt:
    """A case: what was felt, what it truly is, and over how many points errors are alike."""

    cloud: TouchCloud
    kind: str
    size: float
    noise: float
    correlation_points: float


def random_rotation(rng):
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


def meander(rows=ROWS, dense=400):
    """A raster over the unit square, shape (rows * dense, 2)."""
    along = np.linspace(0.0, 1.0, dense)
    return np.concatenate(
        [np.column_stack([along[:: (-1) ** i], np.full(dense, (i + 0.5) / rows)]) for i in range(rows)]
    )


def evenly(position, normal, count=POINTS):
    """Of a dense path, `count` points evenly spaced along it."""
    arc = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1)))
    at = np.searchsorted(arc, np.linspace(0.0, arc[-1], count)).clip(0, len(arc) - 1)
    return position[at], normal[at], arc[at]


def correlated(arc, length, sd, rng, columns=3):
    """Ornstein-Uhlenbeck noise along the path."""
    white = rng.normal(size=(len(arc), columns))
    noise = np.empty_like(white)
    noise[0] = white[0]
    kept = np.exp(-np.diff(arc) / length)
    for i, k in enumerate(kept):
        noise[i + 1] = k * noise[i] + np.sqrt(1.0 - k * k) * white[i + 1]
    return sd * noise


def felt(position, normal, rng, noise=0.0, normal_sd=0.0, tilt_bias=0.0, place=True, count=POINTS):
    """The cloud of `count` contacts along a dense path, with noise, anywhere; and the correlated points."""
    position, normal, arc = evenly(position, normal, count)
    position = position + correlated(arc, CORRELATION, noise, rng)
    normal = normal + normal_sd * rng.normal(size=normal.shape)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rotation, shift = (random_rotation(rng), rng.uniform(-0.5, 0.5, 3)) if place else (np.eye(3), np.zeros(3))
    cloud = cloud_at(position @ rotation.T + shift, normal @ rotation.T)
    step = arc[-1] / (count - 1)
    # long-run variance of an exponential correlation in steps: (1 + k) / (1 - k)
    k = np.exp(-step / CORRELATION)
    return cloud, float((1.0 + k) / (1.0 - k))


def cloud_at(position, normal):
    n = len(position)
    zero = np.zeros((n, 3))
    return TouchCloud(np.arange(n) * 2e-3, position, normal, np.ones(n), zero, np.zeros(n))


def plane(rng, size):
    uv = (meander() - 0.5) * size * [1.0, rng.uniform(0.3, 1.0)]
    return np.column_stack([uv, np.zeros(len(uv))]), np.tile([0.0, 0.0, 1.0], (len(uv), 1))


def cap(uv, half_angle):
    """Directions over a cap about z, rows across it."""
    polar, azimuth = half_angle * np.sqrt(uv[:, 1]), 2.0 * np.pi * uv[:, 0]
    return np.column_stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


def ellipsoid(semi_axes, half_angle):
    semi_axes = np.asarray(semi_axes)
    direction = cap(meander(), half_angle)
    normal = direction / semi_axes
    return direction * semi_axes, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def sphere(radius, half_angle):
    return ellipsoid([radius] * 3, half_angle)


def cylinder(radius, half_angle, length):
    uv = meander()
    angle = half_angle * (2.0 * uv[:, 1] - 1.0)
    normal = np.column_stack([np.sin(angle), np.zeros(len(uv)), np.cos(angle)])
    position = radius * normal
    position[:, 1] = length * (uv[:, 0] - 0.5)
    return position, normal


def box(half, rounding, faces=5):
    """Rows over a rounded box: paths over the top, down the sides, round the edges.

    Directions from the center, pushed out to the surface of the rounded box; faces = 5 from above, 3 a corner, 2
    an edge, 1 the top.
    """
    half = np.asarray(half, dtype=float)
    half_angle, towards = {5: (115.0, None), 3: (50.0, (1, 1, 1)), 2: (38.0, (1, 0, 1)), 1: (40.0, None)}[faces]
    direction = cap(meander(), np.radians(half_angle))
    if towards is not None:
        direction = direction @ _to_diagonal(towards).T
    target = direction / np.abs(direction).max(axis=1, keepdims=True) * half
    core = np.clip(target, -(half - rounding), half - rounding)
    away = target - core
    length = np.linalg.norm(away, axis=1)
    lost = length < 1e-12
    if rounding == 0.0 or lost.any():
        face = (np.abs(target) / half).argmax(axis=1)
        flat = np.zeros_like(target)
        flat[np.arange(len(target)), face] = np.sign(target[np.arange(len(target)), face])
        if rounding == 0.0:
            return target, flat
        away[lost], length[lost] = flat[lost], 1.0
    normal = away / length[:, None]
    return core + rounding * normal, normal


def _to_diagonal(towards):
    z = np.array(towards) / np.linalg.norm(towards)
    x = np.cross(z, [0.3, 1.0, 0.2])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def torus(ring, tube, reach):
    """The upper part of a torus about z, `reach` of the way round the ring."""
    uv = meander()
    a, b = reach * 2.0 * np.pi * uv[:, 0], np.radians(140.0) * (uv[:, 1] - 0.5) * 2.0
    normal = np.column_stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)])
    return ring * np.column_stack([np.cos(a), np.sin(a), np.zeros(len(a))]) + tube * normal, normal


def cone(half_opening, base, reach):
    """The side of a truncated cone."""
    uv = meander()
    a = reach * 2.0 * np.pi * (uv[:, 1] - 0.5)
    radius = base * (0.3 + 0.7 * uv[:, 0])
    height = -(radius - base) / np.tan(half_opening)
    position = np.column_stack([radius * np.cos(a), radius * np.sin(a), height])
    s, c = np.sin(half_opening), np.cos(half_opening)
    return position, np.column_stack([c * np.cos(a), c * np.sin(a), np.full(len(a), s)])


def heights(size, z, slope):
    """A height field over a square; z and slope are functions of (x, y)."""
    x, y = ((meander() - 0.5) * size).T
    zx, zy = slope(x, y)
    normal = np.column_stack([-zx, -zy, np.ones(len(x))])
    return np.column_stack([x, y, z(x, y)]), normal / np.linalg.norm(normal, axis=1, keepdims=True)


def bumps(size, rng):
    """Waves of 5 to 8 % of the size, two to three across."""
    amplitude, k = rng.uniform(0.02, 0.05) * size, 2.0 * np.pi * rng.uniform(1.5, 3.0) / size
    p, q = rng.uniform(0, 2 * np.pi, 2)
    return heights(
        size,
        lambda x, y: amplitude * np.sin(k * x + p) * np.sin(k * y + q),
        lambda x, y: (
            amplitude * k * np.cos(k * x + p) * np.sin(k * y + q),
            amplitude * k * np.sin(k * x + p) * np.cos(k * y + q),
        ),
    )


def freeform(size, rng):
    """A sum of polynomials of third and fourth degree and a bow."""
    h, C = size / 2.0, np.zeros((4, 4))
    powers = ([2, 1, 0, 3, 2, 1, 0, 3, 1], [0, 1, 2, 0, 1, 2, 3, 1, 3])
    C[powers] = rng.normal(size=9) * size * np.repeat([0.15, 0.08], [3, 6])
    return heights(
        size,
        lambda x, y: polyval2d(x / h, y / h, C),
        lambda x, y: [polyval2d(x / h, y / h, polyder(C, axis=k)) / h for k in (0, 1)],
    )


def permuted_ellipsoid(size, rng):
    """Semi-axes that differ, in any order."""
    axes = 0.5 * size * np.array([1.0, rng.uniform(0.65, 0.85), rng.uniform(0.4, 0.6)])
    return ellipsoid(rng.permutation(axes), np.radians(rng.uniform(60.0, 120.0)))


def any_box(size, rng):
    """A box with or without rounding, felt from above, at an edge or at a corner."""
    half = 0.5 * size * np.array([1.0, rng.uniform(0.5, 1.0), rng.uniform(0.4, 1.0)])
    rounding = float(rng.choice([0.0, rng.uniform(0.05, 0.3)])) * half.min()
    return box(half, rounding, faces=int(rng.choice([5, 3, 2])))


def one_face(size, rng):
    """The contacts of a sharp box that lie on its top."""
    position, normal = box(size * rng.uniform(0.3, 0.5, 3), 0.0, faces=1)
    flat = normal[:, 2] > 0.999
    return position[flat], normal[flat]


CASES = {  # of a size and a generator: a path, drawn so that the shape can be told; and the shape that is right
    "plane": (lambda size, rng: plane(rng, size), "plane"),
    "box, one face": (one_face, "plane"),
    "sphere": (lambda size, rng: sphere(0.5 * size, np.radians(rng.uniform(30.0, 120.0))), "sphere"),
    "cylinder": (
        lambda size, rng: cylinder(0.5 * size, np.radians(rng.uniform(30.0, 150.0)), size * rng.uniform(0.5, 2.0)),
        "cylinder",
    ),
    "ellipsoid": (permuted_ellipsoid, "ellipsoid"),
    "box": (any_box, "box"),
    "torus": (lambda size, rng: torus(0.35 * size, size * rng.uniform(0.08, 0.2), rng.uniform(0.3, 1.0)), "torus"),
    "cone": (lambda size, rng: cone(np.radians(rng.uniform(15.0, 45.0)), 0.5 * size, rng.uniform(0.4, 1.0)), None),
    "bumps": (lambda size, rng: bumps(size, rng), None),
    "freeform": (lambda size, rng: freeform(size, rng), None),
}
ANSWER = {kind: answer for kind, (_, answer) in CASES.items()}


def random_case(kind, rng):
    """A random case of one kind, 5 to 100 mm large, with noise of 0.01 to 0.1 mm and normals of 0.5 degrees."""
    size, noise = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in ((5e-3, 0.1), (1e-5, 1e-4)))
    cloud, correlation = felt(*CASES[kind][0](size, rng), rng, noise, NORMAL_SD)
    return Felt(cloud, kind, size, noise, correlation)
