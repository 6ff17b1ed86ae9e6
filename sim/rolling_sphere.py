"""Contact of fingertips that MuJoCo has no geom for: a sphere inside the tip that rolls to where the tip touches.

MuJoCo has such a tip as a mesh only, and its facets are felt: 4 um of sag made the force swing by 76 mN RMS, where
a sphere's does by 2. But where a convex tip touches, a sphere inside that touches its surface from within touches,
too, with the same depth and normal. So before every time step the tip's geom, a sphere not larger than the
surface's least radius of curvature, is put to the point of the tip that is deepest in (or nearest to) the object:
one contact, of MuJoCo's most exact kind. What a sphere keeps within another surface at, its centre, runs on the
inner parallel surface, which is convex, so that the point is unique: Newton's method until both surfaces' normals
are opposite there.
"""

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.sim.objects.primitives import Solid
from palpate.sim.objects.traced import TracedObject
from palpate.sim.tip_boundary import Boundary, Exit
from palpate.spatial import (
    Matrix,
    Vector,
    add,
    add_scaled,
    as_vector,
    cross,
    dot,
    norm,
    rotate,
    rotate_back,
    scale,
    subtract,
    unit,
)

STEPS = 12
"""Of Newton's method, at most; two are common."""

CLOSE = 5e-6
"""A step [m] after which Newton's method is as near as MuJoCo's closest points are exact: it converges to the
second order, and the depth errs by the second order of what is left."""

PROBE = 1e-4
"""[m] Over which the object's normal is differentiated."""

LEAST_CURVATURE = 0.1
"""[1/m] Added where tip and object are both flat: the point moves slowly there."""

NEAR = 1e-3
"""A gap [m] at which the sphere is where it will touch."""

REACH = 1.0
"""Farthest object that is looked for [m]."""

Gap = Callable[[Vector], tuple[float, Vector]]
"""Point, base frame [m] -> its distance to an object, negative inside [m], and the object's outward normal."""


class RollingSphere:
    """Rolls the sphere of one tip in one simulation. A `Placer`, without state: all follows from the poses."""

    def __init__(
        self,
        boundary: Boundary,
        flattest: float,
        farthest: float,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        tip_geom: str,
        shape: Solid,
    ) -> None:
        """Take a scene, and place the sphere.

        Args:
            boundary: Of the tip.
            flattest: Largest radius of curvature of it [m].
            farthest: Largest distance of the surface from the boundary's origin [m].
            model: The scene; what its pairs let the tip touch is looked for.
            data: Its state.
            tip_geom: The tip's geom, a sphere.
            shape: Of the object.

        Raises:
            InvalidValueError: The tip is too flat for the object's hollows.
        """
        tip = int(model.geom(tip_geom).id)
        pairs = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
        others = [first + second - tip for first, second in pairs if tip in (first, second)]
        self._gaps: list[Gap] = []
        if isinstance(shape, TracedObject):
            shape.check_tip(flattest)
            self._gaps.append(_TracedGap(shape))
            # its own geom is the tangent plane, which lies under the sphere
            others = [other for other in others if model.body_mocapid[model.geom_bodyid[other]] < 0]
        self._gaps.extend(_GeomGap(model, data, tip, other) for other in others)
        model.geom_sameframe[tip] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # it will move in its body
        self._boundary, self._farthest = boundary, farthest
        self._radius = float(model.geom_size[tip, 0])
        self._model, self._data, self._geom_position = model, data, model.geom_pos[tip]
        body = int(model.geom_bodyid[tip])
        self._place, self._rotation = data.xpos[body], data.xmat[body]
        up, still = (0.0, 0.0, 1.0), ((0.0, 0.0, 0.0),) * 3
        _step(up, still, up, still, self._radius)  # compiles
        self.place()

    def place(self) -> None:
        """See `Placer`."""
        mujoco.mj_kinematics(self._model, self._data)
        frame = _Frame(as_vector(self._place), _rows(self._rotation), self._boundary)
        start = frame.outward((0.0, 0.0, 0.0))
        if not math.isfinite(norm(start)):
            return  # the simulation has diverged, which others report
        gap, (distance, normal) = min(((gap, gap(start)) for gap in self._gaps), key=lambda found: found[1][0])
        exit = self._boundary.along(scale(-1.0, frame.inward(normal)))
        if distance < self._farthest + NEAR:  # else nothing is touched, wherever the sphere is
            exit = self._deepest(exit, gap, frame)
        boundary = self._boundary
        self._geom_position[:] = add(boundary.center, rotate(boundary.rotation, self._center(exit)))

    def _center(self, exit: Exit) -> Vector:
        """Return the centre of the sphere that touches the surface from within, boundary's frame [m]."""
        return add_scaled(exit.position, -self._radius, exit.normal)

    def _deepest(self, at: Exit, gap: Gap, frame: "_Frame") -> Exit:
        """Return the point of the surface that is deepest in the object, from one that is near it."""
        distance, normal = self._felt(at, gap, frame)
        bend = _bend(lambda point: frame.inward(gap(frame.outward(point))[1]), self._center(at), normal)
        for _ in range(STEPS):
            step = _step(at.normal, at.bend, normal, bend, self._radius)
            length = norm(step)
            if length < CLOSE:
                return self._boundary.along(unit(add(at.position, step)))
            step = scale(min(1.0, 0.5 * norm(at.position) / length), step)
            while True:
                tried = self._boundary.along(unit(add(at.position, step)))
                nearer, turned = self._felt(tried, gap, frame)
                if nearer <= distance or norm(step) < CLOSE:
                    break
                step = scale(0.5, step)
            at, distance, normal = tried, nearer, turned
        return at

    def _felt(self, at: Exit, gap: Gap, frame: "_Frame") -> tuple[float, Vector]:
        distance, normal = gap(frame.outward(self._center(at)))
        return distance, frame.inward(normal)


class _Frame:
    """Of a boundary, on a body that is somewhere."""

    __slots__ = ("_body", "_boundary", "_rotation")

    def __init__(self, position: Vector, rotation: Matrix, boundary: Boundary) -> None:
        self._body, self._rotation, self._boundary = position, rotation, boundary

    def outward(self, point: Vector) -> Vector:
        """Map a point to the base frame."""
        on_body = add(self._boundary.center, rotate(self._boundary.rotation, point))
        return add(self._body, rotate(self._rotation, on_body))

    def inward(self, direction: Vector) -> Vector:
        """Map a direction from the base frame."""
        return rotate_back(self._boundary.rotation, rotate_back(self._rotation, direction))


class _GeomGap:
    """To one of MuJoCo's geoms. A `Gap`."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, tip: int, other: int) -> None:
        self._geoms, self._position, self._ends = (model, data, tip, other), data.geom_xpos[tip], np.zeros(6)
        self._radius = float(model.geom_size[tip, 0])

    def __call__(self, point: Vector) -> tuple[float, Vector]:
        self._position[:] = point
        distance = mujoco.mj_geomDistance(*self._geoms, REACH, self._ends) + self._radius
        x, y, z = self._ends.tolist()[3:]
        apart = subtract(point, (x, y, z))
        if not any(apart):  # on the very surface: every direction is as good until it moves
            return distance, (0.0, 0.0, 1.0)
        return distance, unit(apart if distance > 0.0 else scale(-1.0, apart))


class _TracedGap:
    """To a surface that MuJoCo does not have, fixed in the base frame. A `Gap`."""

    def __init__(self, shape: TracedObject) -> None:
        self._nearest, self._parameters = shape.nearest, shape.parameters

    def __call__(self, point: Vector) -> tuple[float, Vector]:
        x, y, z, *normal = self._nearest(self._parameters, *point)
        u, v, w = normal
        return dot(subtract(point, (x, y, z)), (u, v, w)), (u, v, w)


def _bend(normal_at: Callable[[Vector], Vector], point: Vector, normal: Vector) -> Matrix:
    """How an object's normal changes with the place, by differences within its tangent plane [1/m]."""
    changes = []
    axes = _tangents(normal)
    for axis in axes:
        change = scale(1.0 / PROBE, subtract(normal_at(add_scaled(point, PROBE, axis)), normal))
        changes.append(change)
    (a, b), (u, v) = changes, axes
    return tuple(tuple(a[i] * u[j] + b[i] * v[j] for j in range(3)) for i in range(3))  # type: ignore[return-value]


@njit(error_model="numpy", cache=True)
def _step(normal: Any, bend: Any, away: Any, turn: Any, radius: Any) -> Any:
    """By how much the point must move along the surface for the normals to be opposite, to first order [m].

    With the tip's curvature W and the object's V: moved by d, the tip's normal turns by W d, the sphere's centre
    moves by (1 - r W) d and the object's normal there turns by V (1 - r W) d.

    Args:
        normal: Of the tip, n.
        bend: Its curvature: `Exit.bend`.
        away: Normal of the object.
        turn: Its curvature, likewise.
        radius: Of the sphere, r [m].
    """
    x, y, z = normal
    if abs(x) < 0.5:
        length = math.sqrt(y * y + z * z)
        ux, uy, uz = 0.0, z / length, -y / length
    else:
        length = math.sqrt(x * x + z * z)
        ux, uy, uz = -z / length, 0.0, x / length
    u, v = (ux, uy, uz), (y * uz - z * uy, z * ux - x * uz, x * uy - y * ux)
    e = f = wuu = wuv = wvv = vuu = vuv = vvu = vvv = 0.0
    for i in range(3):
        e += (normal[i] + away[i]) * u[i]
        f += (normal[i] + away[i]) * v[i]
        for j in range(3):
            wuu += u[i] * bend[i][j] * u[j]
            wuv += u[i] * bend[i][j] * v[j]
            wvv += v[i] * bend[i][j] * v[j]
            vuu += u[i] * turn[i][j] * u[j]
            vuv += u[i] * turn[i][j] * v[j]
            vvu += v[i] * turn[i][j] * u[j]
            vvv += v[i] * turn[i][j] * v[j]
    muu, muv, mvv = 1.0 - radius * wuu, -radius * wuv, 1.0 - radius * wvv
    a, b = wuu + vuu * muu + vuv * muv + LEAST_CURVATURE, wuv + vuu * muv + vuv * mvv
    c, d = wuv + vvu * muu + vvv * muv, wvv + vvu * muv + vvv * mvv + LEAST_CURVATURE
    det = a * d - b * c
    p, q = -e * radius, -f * radius
    if det > 0.0:
        p, q = (b * f - d * e) / det, (c * e - a * f) / det
    return (p * u[0] + q * v[0], p * u[1] + q * v[1], p * u[2] + q * v[2])


def _tangents(normal: Vector) -> tuple[Vector, Vector]:
    axis = (1.0, 0.0, 0.0) if abs(normal[0]) < 0.5 else (0.0, 1.0, 0.0)
    first = unit(cross(normal, axis))
    return first, cross(normal, first)


def _rows(nine: FloatArray) -> Matrix:
    a, b, c, d, e, f, g, h, i = nine.tolist()
    return ((a, b, c), (d, e, f), (g, h, i))
