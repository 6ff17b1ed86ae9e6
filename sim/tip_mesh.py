"""Fingertips that MuJoCo has no geom for, as meshes of their own surface.

Vertices lie on the surface, so a mesh is inside the tip everywhere, by `sag` at most. A facet at that depth under
a surface of radius r reaches sqrt(2 sag r) to each side of where it is parallel to it, so normals are off by up to
sqrt(2 sag / r): 1.8 degrees at 4 um and 8 mm.
"""

import math
from collections.abc import Iterator

import numpy as np
from scipy.spatial import ConvexHull

from palpate.errors import FloatArray, InvalidValueError
from palpate.surfaces import CenteredQuadric, Composite, MeshSurface, Patch
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.open_quadric import OpenQuadric

MAX_VERTICES = 20_000
"""Of a tip's mesh: MuJoCo takes a second to compile so many."""

LATTICE = 5.0
"""A lattice of n directions makes a unit sphere's hull sag by less than LATTICE / n. A hexagonal one would have
2.4 (its holes have the radius sqrt(4.84 / n)); where a patch ends, holes are larger: 4.8 was measured at rounded
corners."""

FIRST = 500
"""Points on an implicit surface to begin with."""

BISECTIONS = 48
"""Halvings of the interval in which a ray leaves an implicit surface: 4e-15 of its size."""


def tip_mesh(
    surface: CenteredQuadric | OpenQuadric | Composite | Implicit, reach: float, sag: float
) -> FloatArray:
    """Return vertices on a surface whose convex hull stands for it, sensor frame, shape (n, 3) [m].

    Args:
        surface: Of the fingertip.
        reach: How far from its apex an open quadric is cut off [m].
        sag: Largest depth of the mesh below the surface [m].

    Raises:
        InvalidValueError: A kind that is unbounded with no apex, or `sag` asks for more than `MAX_VERTICES`.
    """
    if isinstance(surface, MeshSurface):
        return np.asarray(surface.center + surface.vertices @ surface.rotation.T)
    if isinstance(surface, Composite):
        return np.concatenate([_on_patch(patch, sag) for patch in surface.patches])
    if isinstance(surface, OpenQuadric):
        local = _on_open_quadric(surface, reach, sag)
    elif isinstance(surface, Implicit):
        local = _on_implicit(surface, sag)
    else:
        kind = type(surface).__name__
        raise InvalidValueError(f"surface is a {kind}: has no mesh; take a Composite, or an implicit surface")
    return np.asarray(surface.center + local @ surface.rotation.T)


def _on_implicit(surface: Implicit, sag: float) -> FloatArray:
    """Points along rays from the centre; where a facet of their hull lies too deep, one more above its middle."""
    directions = lattice(FIRST)
    vertices = _rays(surface, directions)[:, None] * directions
    while True:
        middles = vertices[ConvexHull(vertices).simplices].mean(axis=1)
        depth = np.linalg.norm(middles, axis=1)
        directions = middles / depth[:, None]
        reach = _rays(surface, directions)
        deep = reach - depth > sag
        if not deep.any():
            return vertices
        _enough(len(vertices) + int(deep.sum()), sag)
        vertices = np.concatenate([vertices, reach[deep, None] * directions[deep]])


def _rays(surface: Implicit, directions: FloatArray) -> FloatArray:
    """Distance from the centre to the surface along unit directions (n, 3), in the surface's frame."""
    evaluate, parameters = surface.evaluate, surface.parameters
    start = 2.0 * float(surface.half_lengths.max())
    found = np.empty(len(directions))
    for i, (x, y, z) in enumerate(directions.tolist()):
        low, high = 0.0, start
        while evaluate(parameters, high * x, high * y, high * z)[0] < 0.0:
            high *= 2.0
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            if evaluate(parameters, middle * x, middle * y, middle * z)[0] < 0.0:
                low = middle
            else:
                high = middle
        found[i] = 0.5 * (low + high)
    return found


def _on_open_quadric(surface: OpenQuadric, reach: float, sag: float) -> FloatArray:
    """Points of x^2/a^2 + y^2/b^2 + beta z^2 + 2 eta z = 0 to z = -reach, evenly spaced seen from above."""
    a, b, beta, eta = surface.coefficients

    def rim(depth: float) -> float:
        return math.sqrt(max(2.0 * eta * depth - beta * depth**2, 0.0))

    # the sharpest place is the apex, of radii eta a^2 and eta b^2: all else is flatter
    width = max(a, b) * rim(reach)
    blunt = eta * max(a, b) ** 2
    step = math.sqrt(6.0 * sag * blunt)
    rings = max(8, math.ceil(math.hypot(width, reach) / step))
    _enough(3 * rings**2, sag)
    points = [(0.0, 0.0, 0.0)]
    for k in range(1, rings + 1):
        depth = reach * (k / rings) ** 2
        around = 6 * k
        for j in range(around):
            turn = 2.0 * math.pi * (j + 0.5 * (k % 2)) / around
            points.append((a * rim(depth) * math.cos(turn), b * rim(depth) * math.sin(turn), -depth))
    return np.array(points)


def _on_patch(patch: Patch, sag: float) -> FloatArray:
    """Points of a quadric within its half spaces, sensor frame; none of a plane, whose rim its neighbours hold."""
    surface = patch.surface
    lengths = np.array(surface.half_lengths)
    finite = np.isfinite(lengths)
    if finite.sum() == 1:
        return np.empty((0, 3))
    if finite.all():
        largest = float(lengths.max() ** 2 / lengths.min())
        count = _enough(math.ceil(LATTICE * largest / sag), sag)
        sphere = lattice(count)
        # the point of an ellipsoid with a given normal
        points = lengths**2 * sphere / np.linalg.norm(lengths * sphere, axis=1)[:, None]
        points = surface.center + points @ surface.rotation.T
        rows = patch.half_spaces
        return np.asarray(points[(points @ rows[:, :3].T <= rows[:, 3] + 1e-12).all(axis=1)])
    return np.array(list(_generators(patch, sag))).reshape(-1, 3)


def _generators(patch: Patch, sag: float) -> Iterator[FloatArray]:
    """Both ends of a cylinder's straight lines within its half spaces, sensor frame."""
    surface = patch.surface
    lengths = np.array(surface.half_lengths)
    (axis,) = np.flatnonzero(~np.isfinite(lengths))
    u, v = (i for i in range(3) if i != axis)
    largest = float(max(lengths[u], lengths[v]) ** 2 / min(lengths[u], lengths[v]))
    count = _enough(4 * math.ceil(0.5 * math.pi / math.sqrt(8.0 * sag / largest)), sag)
    along = surface.rotation[:, axis]
    for turn in np.linspace(0.0, 2.0 * np.pi, count, endpoint=False):
        start = np.zeros(3)
        start[u], start[v] = lengths[u] * math.cos(turn), lengths[v] * math.sin(turn)
        start = surface.center + surface.rotation @ start
        rates = patch.half_spaces[:, :3] @ along
        room = patch.half_spaces[:, 3] - patch.half_spaces[:, :3] @ start
        across = np.abs(rates) < 1e-12
        if (room[across] < -1e-9 * float(lengths[u])).any():
            continue
        ends = room[~across] / rates[~across]
        forward, back = ends[rates[~across] > 0.0], ends[rates[~across] < 0.0]
        if not len(forward) or not len(back):
            raise InvalidValueError(
                f"patch {surface!r} has no end along its axis: bound it by half spaces, a simulated tip is closed"
            )
        if forward.min() >= back.max():
            yield start + forward.min() * along
            yield start + back.max() * along


def lattice(count: int) -> FloatArray:
    """Return unit vectors spread evenly over the sphere (Fibonacci lattice), shape (count, 3)."""
    i = np.arange(count)
    z = 1.0 - (2.0 * i + 1.0) / count
    turn = i * (math.pi * (3.0 - math.sqrt(5.0)))
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def _enough(count: int, sag: float) -> int:
    if count > MAX_VERTICES:
        raise InvalidValueError(
            f"a mesh of this tip that lies at most sag = {sag:g} m deep asks for {count} vertices, the limit is "
            f"{MAX_VERTICES}; is the tip that large? (sizes are in metres) If so, take a sag of at least "
            f"{1.1 * sag * count / MAX_VERTICES:.2g} m"
        )
    return count
