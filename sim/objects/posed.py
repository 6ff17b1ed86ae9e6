"""A geom of MuJoCo's, placed and turned at will: its exact surface, in closed form."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sim.objects.primitives import STEEPEST, Box, CylinderObject, EllipsoidObject, SphereObject

SLOPE_STEP = 1e-6
"""[m] Over which the slope of the upper surface is taken: rounding leaves 1e-9 of it."""

_Geom = mujoco.mjtGeom
_Span = tuple[float, float]
"""Where a line enters and leaves a convex body, along it."""

_MISSED: _Span = (math.nan, math.nan)


@dataclass(frozen=True, eq=False, slots=True)
class PosedGeom:
    """The surface of a sphere, ellipsoid, box, cylinder or capsule that is already in a scene. A `SceneObject`.

    Attributes:
        kind: Of the geom.
        size: As MuJoCo has it: radius; semi-axes; half lengths; radius and half length along the geom's z [m].
        position: Of its centre [m].
        rotation: From its axes, shape (3, 3).

    Raises:
        InvalidValueError: It is of another kind.
    """

    kind: mujoco.mjtGeom
    size: FloatArray
    position: FloatArray
    rotation: FloatArray

    def __post_init__(self) -> None:
        if self.kind not in _HALF:
            raise InvalidValueError(
                f"kind = {kind_name(self.kind)}: must be one of {', '.join(map(kind_name, _HALF))}"
            )

    @property
    def extent(self) -> tuple[float, float, float]:
        """Of its bounding box along x, y and z [m]."""
        x, y, z = (2.0 * float(_HALF[self.kind](self.size, axis)) for axis in self.rotation)
        return x, y, z

    @property
    def top(self) -> float:
        """See `SceneObject`."""
        return float(self.position[2]) + 0.5 * self.extent[2]

    @property
    def bottom(self) -> float:
        """See `SceneObject`."""
        return float(self.position[2]) - 0.5 * self.extent[2]

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """See `SceneObject`: nothing."""

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add such a geom to a body at the origin."""
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, self.rotation.ravel())
        body.add_geom(
            name=name, type=self.kind, size=self.size, pos=self.position, quat=quat, contype=0, conaffinity=0
        )

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        local, size = (np.asarray(points) - self.position) @ self.rotation, self.size.tolist()
        match self.kind:
            case _Geom.mjGEOM_SPHERE:
                return SphereObject(size[0]).signed_distance(local)
            case _Geom.mjGEOM_ELLIPSOID:
                return EllipsoidObject((size[0], size[1], size[2])).signed_distance(local)
            case _Geom.mjGEOM_BOX:
                return Box((2.0 * size[0], 2.0 * size[1], 2.0 * size[2])).signed_distance(local)
            case _Geom.mjGEOM_CYLINDER:  # ours lies along x
                return CylinderObject(size[0], 2.0 * size[1]).signed_distance(local[:, [2, 0, 1]])
            case _:
                local[:, 2] -= np.clip(local[:, 2], -size[1], size[1])
                return np.asarray(np.linalg.norm(local, axis=1) - size[0])

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        found = [self._upper(u, v) for u, v in zip(x.ravel().tolist(), y.ravel().tolist(), strict=True)]
        return np.array(found).reshape(x.shape)

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`; the slope counts where the tip is above, which errs on the safe side."""
        h = SLOPE_STEP
        along = self._upper(x + h, y) - self._upper(x - h, y)
        if math.isnan(along):  # beside the object, as most places of a survey
            return False
        across = self._upper(x, y + h) - self._upper(x, y - h)
        return math.hypot(along, across) <= 2.0 * h * math.tan(STEEPEST)

    def _upper(self, x: float, y: float) -> float:
        """Height of the upper surface over one place [m]; NaN beside it: where a line straight up leaves it."""
        (px, py, pz), turn = self.position.tolist(), self.rotation.tolist()
        u, v, size, up = x - px, y - py, self.size.tolist(), turn[2]
        start = [turn[0][i] * u + turn[1][i] * v for i in range(3)]
        match self.kind:
            case _Geom.mjGEOM_SPHERE:
                return float(pz + _ball(start, up, size[:1] * 3)[1])
            case _Geom.mjGEOM_ELLIPSOID:
                return float(pz + _ball(start, up, size)[1])
            case _Geom.mjGEOM_BOX:
                return float(pz + _common(*(_slab(*each) for each in zip(start, up, size, strict=True)))[1])
        radius, half, _ = size
        tube = _common(_ball(start[:2], up[:2], [radius] * 2), _slab(start[2], up[2], half))
        if self.kind == _Geom.mjGEOM_CYLINDER:
            return float(pz + tube[1])
        balls = (_ball([start[0], start[1], start[2] + end], up, [radius] * 3) for end in (-half, half))
        tops = [top for _, top in (tube, *balls) if not math.isnan(top)]
        return float(pz + max(tops, default=math.nan))


def kind_name(kind: mujoco.mjtGeom) -> str:
    """Return what MJCF calls a kind of geom."""
    return str(kind.name).removeprefix("mjGEOM_").lower()


_HALF: dict[mujoco.mjtGeom, Callable[[FloatArray, FloatArray], Any]] = {
    _Geom.mjGEOM_SPHERE: lambda size, axis: size[0],
    _Geom.mjGEOM_ELLIPSOID: lambda size, axis: np.linalg.norm(size * axis),
    _Geom.mjGEOM_BOX: lambda size, axis: size @ np.abs(axis),
    _Geom.mjGEOM_CYLINDER: lambda size, axis: size[0] * np.hypot(axis[0], axis[1]) + size[1] * abs(axis[2]),
    _Geom.mjGEOM_CAPSULE: lambda size, axis: size[0] + size[1] * abs(axis[2]),
}
"""From the centre to the farthest point along an axis, which is given in the geom's own: the support function."""


def _ball(start: list[float], along: list[float], half: list[float]) -> _Span:
    """Through an ellipsoid or, of two coordinates, a tube."""
    s, d = ([x / h for x, h in zip(each, half, strict=True)] for each in (start, along))
    a, b = sum(x * x for x in d), sum(x * y for x, y in zip(s, d, strict=True))
    c = sum(x * x for x in s) - 1.0
    if a < 1e-24:  # along a tube: inside or not, for ever
        return (-math.inf, math.inf) if c <= 0.0 else _MISSED
    if b * b < a * c:
        return _MISSED
    root = math.sqrt(b * b - a * c)
    return (-b - root) / a, (-b + root) / a


def _slab(start: float, along: float, half: float) -> _Span:
    """Through what lies between two planes."""
    if abs(along) < 1e-12:
        return (-math.inf, math.inf) if abs(start) <= half else _MISSED
    reach, middle = half / abs(along), -start / along
    return middle - reach, middle + reach


def _common(*spans: _Span) -> _Span:
    """Through all of them."""
    low, high = max(low for low, _ in spans), min(high for _, high in spans)
    return (low, high) if low <= high and not any(math.isnan(low) for low, _ in spans) else _MISSED
