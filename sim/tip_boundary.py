"""Where a ray from inside a fingertip leaves it, and how the surface bends there: exact, of any surface."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.errors import FloatArray, InvalidValueError
from palpate.spatial import Matrix, Vector, as_vector, scale
from palpate.surfaces import CenteredQuadric, Composite
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.open_quadric import OpenQuadric

RAY_STEPS = 80
"""At most, of Newton's method or bisection along a ray; five are common."""

RAY_TOLERANCE = 1e-14
"""Of the distance along a ray: rounding."""


@dataclass(frozen=True, slots=True)
class Exit:
    """Where a ray leaves a fingertip, in the boundary's frame.

    Attributes:
        position: On the surface [m].
        normal: Outward, of unit length.
        bend: Second derivatives of a level function whose gradient is the normal: in the tangent plane, the
            surface's curvature [1/m].
    """

    position: Vector
    normal: Vector
    bend: Matrix


def boundary_of(surface: Composite | Implicit | OpenQuadric, reach: float) -> "Boundary":
    """Return the boundary of a fingertip.

    Args:
        surface: Of the fingertip.
        reach: How far from its apex an open quadric is cut off [m].

    Raises:
        InvalidValueError: A composite without an end.
    """
    if isinstance(surface, Implicit):
        return ImplicitBoundary(surface)
    return _cut_off(surface, reach) if isinstance(surface, OpenQuadric) else _of_patches(surface)


class ImplicitBoundary:
    """Of an implicit surface, in its own frame: Newton's method along the ray, kept in a bracket."""

    def __init__(self, surface: Implicit) -> None:
        """Take a surface."""
        self.center, self.rotation = as_vector(surface.center), _matrix(surface.rotation)
        self._evaluate, self._parameters = surface.evaluate, surface.parameters
        self._start = float(surface.half_lengths.max())

    def along(self, direction: Vector) -> Exit:
        """Return where a ray from the origin along a unit vector leaves."""
        evaluate, parameters, (x, y, z) = self._evaluate, self._parameters, direction
        t, low, high = self._start, 0.0, math.inf
        gx = gy = gz = 0.0
        second: list[float] = []
        for _ in range(RAY_STEPS):
            value, gx, gy, gz, *second = evaluate(parameters, t * x, t * y, t * z)
            low, high = (low, t) if value > 0.0 else (t, high)
            rate = gx * x + gy * y + gz * z
            guess = t - value / rate if rate > 0.0 else math.inf
            if not low <= guess <= high:
                guess = 2.0 * t if high == math.inf else 0.5 * (low + high)
            done = abs(guess - t) <= RAY_TOLERANCE * t
            t = guess
            if done:
                break
        length = math.sqrt(gx * gx + gy * gy + gz * gz)
        xx, yy, zz, yz, xz, xy = (each / length for each in second)
        return Exit(
            scale(t, direction),
            (gx / length, gy / length, gz / length),
            ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)),
        )


@dataclass(frozen=True, slots=True, eq=False)
class QuadricBoundary:
    """Of quadrics x'Qx + 2 l.x + k = 0, each with its half spaces, and of planes where it ends.

    Attributes:
        center: A point inside, sensor frame [m]: the frame is the sensor's, shifted there.
        squares: Q of each, shape (n, 3, 3) [1/m^2].
        lines: l of each, shape (n, 3) [1/m].
        constants: k of each, shape (n,).
        domains: Half spaces (a, b), a.x <= b, of each, shape (n, m, 4).
        ends: Half spaces that all of it lies in, shape (e, 4).
    """

    center: Vector
    squares: FloatArray
    lines: FloatArray
    constants: FloatArray
    domains: FloatArray
    ends: FloatArray
    rotation: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def along(self, direction: Vector) -> Exit:
        """Return where a ray from the origin along a unit vector leaves."""
        k, t = _leaves(self.squares, self.lines, self.constants, self.domains, self.ends, *direction)
        if not math.isfinite(t):
            raise InvalidValueError(
                f"the tip has no end along {[round(each, 3) for each in direction]}: bound its patches by half "
                "spaces, a simulated tip is closed"
            )
        if k < 0:
            return Exit(scale(t, direction), as_vector(self.ends[-k - 1, :3]), _FLAT)
        gradient = t * (self.squares[k] @ direction) + self.lines[k]
        length = float(np.linalg.norm(gradient))
        return Exit(scale(t, direction), as_vector(gradient / length), _matrix(self.squares[k] / length))


Boundary = ImplicitBoundary | QuadricBoundary
"""A closed convex surface."""


@njit(error_model="numpy", cache=True)
def _leaves(squares: Any, lines: Any, constants: Any, domains: Any, ends: Any, x: Any, y: Any, z: Any) -> Any:
    """Return which quadric a ray leaves by (of ends: -1, -2, ...), and how far along it; infinity: by none."""
    ray = (x, y, z)
    found, at, least = 0, math.inf, math.inf
    for k in range(len(constants)):
        a = b = 0.0
        for i in range(3):
            b += lines[k, i] * ray[i]
            for j in range(3):
                a += ray[i] * squares[k, i, j] * ray[j]
        inner = b * b - a * constants[k]
        if inner < 0.0:
            continue
        root = math.sqrt(inner)
        # inside, the nearest exit; outside, as of a small sphere at a corner, the far side
        t = -constants[k] / (b + root) if constants[k] <= 0.0 else (root - b) / a
        if not 0.0 < t < math.inf:
            continue
        beyond = 0.0
        for row in domains[k]:
            beyond = max(beyond, t * (row[0] * x + row[1] * y + row[2] * z) - row[3])
        if beyond < least:
            found, at, least = k, t, beyond
    for k in range(len(ends)):
        rate = ends[k, 0] * x + ends[k, 1] * y + ends[k, 2] * z
        if rate > 0.0 and ends[k, 3] / rate < at:
            found, at = -k - 1, ends[k, 3] / rate
    return found, at


_FLAT: Matrix = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def _cut_off(surface: OpenQuadric, reach: float) -> QuadricBoundary:
    """An open quadric to z = -reach in its own frame."""
    a, b, beta, eta = surface.coefficients
    turn, up = surface.rotation, surface.rotation[:, 2]
    shift = np.array([0.0, 0.0, -0.5 * reach])
    own = np.diag([1.0 / a**2, 1.0 / b**2, beta])
    line, constant = own @ shift + [0.0, 0.0, eta], shift @ own @ shift + 2.0 * eta * shift[2]
    return QuadricBoundary(
        as_vector(surface.center + turn @ shift),
        (turn @ own @ turn.T)[None],
        (turn @ line)[None],
        np.array([constant]),
        np.zeros((1, 0, 4)),
        np.array([[*-up, 0.5 * reach]]),
    )


def _of_patches(surface: Composite) -> QuadricBoundary:
    rows = np.concatenate([patch.half_spaces for patch in surface.patches])
    # a half space that no patch continues beyond is where the tip ends
    ends = np.array([row for row in rows if not (np.abs(rows + row).max(axis=1) < 1e-9).any()]).reshape(-1, 4)
    thin = min(min(patch.surface.half_lengths) for patch in surface.patches)
    inside = np.mean([_middle(patch.surface, patch.half_spaces) for patch in surface.patches], axis=0)
    for row in ends:
        inside = inside - max(float(row[:3] @ inside - row[3]) + 0.5 * thin, 0.0) * row[:3]

    def moved(half_spaces: FloatArray) -> FloatArray:
        return np.column_stack([half_spaces[..., :3], half_spaces[..., 3] - half_spaces[..., :3] @ inside])

    squares = np.array([_square(patch.surface) for patch in surface.patches])
    offsets = np.array([inside - patch.surface.center for patch in surface.patches])
    lines = np.einsum("nij,nj->ni", squares, offsets)
    domains = np.array([moved(domain) for domain in surface.domains])
    constants = np.einsum("ni,ni->n", lines, offsets) - 1.0
    boundary = QuadricBoundary(as_vector(inside), squares, lines, constants, domains, moved(ends))
    for patch in surface.patches:
        for axis in np.flatnonzero(~np.isfinite(patch.surface.half_lengths)):
            for sign in (1.0, -1.0):  # refuses one without end
                boundary.along(as_vector(sign * patch.surface.rotation[:, axis]))
    return boundary


def _square(surface: CenteredQuadric) -> FloatArray:
    turn = surface.rotation
    return np.asarray(turn @ np.diag([1.0 / length**2 for length in surface.half_lengths]) @ turn.T)


def _middle(surface: CenteredQuadric, half_spaces: FloatArray) -> FloatArray:
    """A quadric's centre, half way between its ends along axes in which it has none of its own."""
    point = surface.center
    for axis in np.flatnonzero(~np.isfinite(surface.half_lengths)):
        along = surface.rotation[:, axis]
        rates = half_spaces[:, :3] @ along
        across = np.abs(rates) > 1e-9
        ends = (half_spaces[across, 3] - half_spaces[across, :3] @ point) / rates[across]
        if len(ends) > 1:
            point = point + 0.5 * float(ends.min() + ends.max()) * along
    return point


def outline(boundary: Boundary, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points of a boundary along so many rays, and the principal curvatures there.

    Args:
        boundary: Of the fingertip.
        count: Of the rays.

    Returns:
        Points, sensor frame, shape (count, 3) [m]; larger and smaller curvature at each, shape (count,) [1/m].
    """
    exits = [boundary.along(as_vector(direction)) for direction in lattice(count)]
    points = np.array([each.position for each in exits]) @ np.array(boundary.rotation).T + boundary.center
    bends, normals = np.array([each.bend for each in exits]), np.array([each.normal for each in exits])
    tangents = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    W = tangents @ bends @ tangents
    mean, product = 0.5 * np.trace(W, axis1=1, axis2=2), 0.5 * np.trace(W, axis1=1, axis2=2) ** 2
    spread = np.sqrt(np.maximum(mean**2 - product + 0.5 * (W * W).sum(axis=(1, 2)), 0.0))
    return points, mean + spread, mean - spread


def lattice(count: int) -> FloatArray:
    """Return unit vectors spread evenly over the sphere (Fibonacci lattice), shape (count, 3)."""
    i = np.arange(count)
    z = 1.0 - (2.0 * i + 1.0) / count
    turn = i * (math.pi * (3.0 - math.sqrt(5.0)))
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def _matrix(rows: FloatArray) -> Matrix:
    (a, b, c), (d, e, f), (g, h, i) = rows.tolist()
    return ((a, b, c), (d, e, f), (g, h, i))
