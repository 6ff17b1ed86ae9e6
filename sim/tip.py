"""A fingertip of any surface on a six-axis force/torque sensor."""

import math
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from palpate.errors import FloatArray, InvalidValueError, check_positive, vector
from palpate.runtime.touch import Finger
from palpate.sensing.compensation import SensorPayload
from palpate.sim.objects.primitives import Solid
from palpate.sim.objects.target import Nowhere, Placer
from palpate.sim.one_contact import one_contact
from palpate.sim.rolling_sphere import RollingSphere
from palpate.sim.tip_boundary import Boundary, boundary_of, outline
from palpate.spatial import Vector
from palpate.surfaces import (
    Capsule,
    CenteredQuadric,
    CompliantTip,
    Composite,
    Ellipsoid,
    MeshSurface,
    Sphere,
)
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.open_quadric import OpenQuadric

TipSurface = CenteredQuadric | OpenQuadric | Composite | Implicit

SENSOR_SITE = "sensor"
TIP_GEOM = "tip"
TIP_MESH = "tip"

PICTURE_POINTS = 2000
"""Of what is seen and weighed of a tip that MuJoCo has no geom for: its moments of inertia err by one per cent."""

SMALL = 0.5
"""Radius of the sphere that rolls in such a tip, relative to the least radius of curvature of its surface there: a
sharper place may lie between the points."""

REACH = 0.02
"""Where unbounded surfaces are cut off [m], by default: about a finger's length."""


@dataclass(frozen=True, slots=True)
class Tip:
    """A fingertip on its sensor. The sensor frame is the body frame; the surface gives shape and centre.

    Spheres, ellipsoids, capsules and circular cylinders are MuJoCo's own geoms, a plane is a box and a mesh is a
    mesh, all exact. In everything else a sphere rolls to where it touches, see `palpate.sim.rolling_sphere`: such
    a scene is not for several threads. Beyond its open end a capsule has a second hemisphere.

    Attributes:
        surface: Outer shape, in the sensor frame.
        mass: Of everything on the tip side of the sensor [kg], turned as if it were spread evenly over the shape.
        reach: Where an unbounded surface ends [m]: from its centre along a cylinder's axis or a plane, from the
            apex of an open one.
        balance: Centre of mass in the sensor frame [m]; None: that of the shape, filled evenly.
    """

    surface: TipSurface
    mass: float = 0.03
    reach: float = REACH
    balance: Vector | None = None
    _form: "_Form" = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        check_positive(self, mass="kg", reach="m")
        surface: object = self.surface
        if isinstance(surface, CompliantTip):
            raise InvalidValueError(
                "surface is a CompliantTip: in a simulation the contact yields; take its undeformed surface "
                "as tip, and its stiffness as the contact law's"
            )
        if not isinstance(surface, TipSurface):
            raise InvalidValueError(f"surface is a {type(surface).__name__}: must be one of palpate.surfaces")
        form = _form(surface, self.reach)
        if self.balance is not None:
            form = replace(form, center_of_mass=vector("balance", self.balance, 3, "m"))
        object.__setattr__(self, "_form", form)

    def finger(self) -> Finger:
        """Return what contact sensing knows of this tip on a perfect sensor: its surface and its weight."""
        return Finger(self.surface, SensorPayload(self.mass, self.center_of_mass))

    @property
    def approximation(self) -> str:
        """What of it is not exact, in words; empty where nothing is."""
        if not isinstance(self.surface, MeshSurface):
            return ""
        turn = math.degrees(self.surface.facet_turn)
        return (
            f"a mesh with {len(self.surface.triangles)} facets, up to {turn:.2g} degrees from the smooth normals"
        )

    @property
    def center_of_mass(self) -> tuple[float, float, float]:
        """Centre of mass in the sensor frame [m]."""
        x, y, z = self._form.center_of_mass.tolist()
        return (x, y, z)

    def add_assets(self, spec: mujoco.MjSpec) -> None:
        """Add the mesh that it is, or that is seen of it, to a scene; before or after `add_to`."""
        if self._form.vertices is not None:
            one_contact(spec)
            mesh = spec.add_mesh(name=TIP_MESH, uservert=self._form.vertices.ravel())
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, geom: str, shape: Solid) -> Placer:
        """Return what moves its geom in one simulation, and move it.

        Args:
            model: The scene.
            data: Its state, which must live on.
            geom: The name of its geom there.
            shape: What it is to touch.

        Raises:
            InvalidValueError: It cannot touch that.
        """
        rolling = self._form.rolling
        return Nowhere() if rolling is None else RollingSphere(*rolling, model, data, geom, shape)

    def add_to(self, parent: mujoco.MjsBody) -> mujoco.MjsBody:
        """Add the tip's body, geom and sensor site to a parent body, at its origin."""
        body = parent.add_body(name="tip")
        self.fill(body, TIP_GEOM)
        body.add_site(name=SENSOR_SITE)
        return body

    def fill(self, body: mujoco.MjsBody, name: str) -> None:
        """Give a body, whose frame is the sensor frame, the tip's mass and its geom of this name."""
        form = self._form
        body.explicitinertial = True
        body.mass = self.mass
        body.ipos = form.center_of_mass
        body.iquat = _quat_wxyz(form.axes)
        body.inertia = [self.mass * moment for moment in form.moments]
        if form.kind == mujoco.mjtGeom.mjGEOM_MESH:
            body.add_geom(name=name, type=form.kind, meshname=TIP_MESH, contype=0, conaffinity=0)
            return
        geom = body.add_geom(
            name=name,
            type=form.kind,
            size=form.size,
            pos=form.position,
            quat=_quat_wxyz(form.rotation),
            contype=0,
            conaffinity=0,
        )
        if form.vertices is not None:
            geom.rgba = [0.0, 0.0, 0.0, 0.0]
            mesh = mujoco.mjtGeom.mjGEOM_MESH
            body.add_geom(name=f"seen_{name}", type=mesh, meshname=TIP_MESH, contype=0, conaffinity=0)


@dataclass(frozen=True, slots=True, eq=False)
class _Form:
    """A tip as MuJoCo holds it, all in the sensor frame.

    Attributes:
        kind: Of geom.
        size: Of geom, as its kind takes it [m].
        position: Of geom, shape (3,) [m].
        rotation: Of geom, shape (3, 3).
        center_of_mass: Shape (3,) [m].
        moments: Principal moments of inertia about it, per mass [m^2].
        axes: Principal axes, columns, shape (3, 3).
        vertices: Of the mesh that it is or that is seen of it, shape (n, 3) [m].
        rolling: Where a sphere rolls in it, the largest radius of curvature, and how far it reaches [m].
    """

    kind: mujoco.mjtGeom
    size: list[float]
    position: FloatArray
    rotation: FloatArray
    center_of_mass: FloatArray
    moments: list[float]
    axes: FloatArray
    vertices: FloatArray | None = None
    rolling: tuple[Boundary, float, float] | None = None


def _form(surface: TipSurface, reach: float) -> _Form:
    if isinstance(surface, Capsule):
        return _capsule(surface)
    if isinstance(surface, CenteredQuadric):
        lengths = surface.half_lengths
        finite = [math.isfinite(length) for length in lengths]
        if all(finite):
            squares = [length**2 for length in lengths]
            is_sphere = isinstance(surface, Sphere)
            kind = mujoco.mjtGeom.mjGEOM_SPHERE if is_sphere else mujoco.mjtGeom.mjGEOM_ELLIPSOID
            # an ellipsoid's: m (b^2 + c^2) / 5
            moments = [(sum(squares) - square) / 5 for square in squares]
            return _about(surface, kind, [lengths[0], 0.0, 0.0] if is_sphere else list(lengths), moments)
        if sum(finite) == 1:  # a slab
            half = [length if math.isfinite(length) else reach for length in lengths]
            squares = [length**2 for length in half]
            return _about(
                surface, mujoco.mjtGeom.mjGEOM_BOX, half, [(sum(squares) - square) / 3 for square in squares]
            )
        if finite == [True, True, False] and lengths[0] == lengths[1]:
            radius = lengths[0]
            across = radius**2 / 4 + reach**2 / 3
            return _about(
                surface, mujoco.mjtGeom.mjGEOM_CYLINDER, [radius, reach, 0.0], [across, across, radius**2 / 2]
            )
        raise InvalidValueError(
            f"surface = {surface!r}: an endless elliptic cylinder, or one that is not about z, has no geom; take "
            f"a Cylinder, or an {Ellipsoid.__name__} with a long finite axis"
        )
    if isinstance(surface, MeshSurface):
        return _hull(surface.center + surface.vertices @ surface.rotation.T)
    boundary = boundary_of(surface, reach)
    points, sharper, flatter = outline(boundary, PICTURE_POINTS)
    farthest = float(np.linalg.norm(points - boundary.center, axis=1).max())
    with np.errstate(divide="ignore"):
        flattest = float(1.0 / flatter.min(initial=np.inf))
    return replace(
        _hull(points),
        kind=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[SMALL / float(sharper.max()), 0.0, 0.0],
        position=np.array(boundary.center),
        rolling=(boundary, max(flattest, 0.0), farthest),
    )


def _about(surface: CenteredQuadric, kind: mujoco.mjtGeom, size: list[float], moments: list[float]) -> _Form:
    return _Form(kind, size, surface.center, surface.rotation, surface.center, moments, surface.rotation)


def _capsule(surface: Capsule) -> _Form:
    """MuJoCo's capsule: cylinder and a hemisphere at both ends."""
    sphere = surface.patches[0].surface
    # the cylinder's second half space is where it ends: -z.x <= length - z.center
    row = surface.patches[1].half_spaces[1]
    length = float(row[3] - row[:3] @ sphere.center)
    radius, axes = sphere.half_lengths[0], sphere.rotation
    middle = sphere.center - 0.5 * length * axes[:, 2]
    # volumes over pi r^2: cylinder and the two hemispheres, whose centres of mass are 3/8 r beyond its ends
    tube, cap = length, 2.0 * radius / 3.0
    whole = tube + 2.0 * cap
    about_z = (tube * radius**2 / 2 + 2.0 * cap * 0.4 * radius**2) / whole
    off = length / 2 + 0.375 * radius
    own = (0.4 - 0.375**2) * radius**2
    across = (tube * (radius**2 / 4 + length**2 / 12) + 2.0 * cap * (own + off**2)) / whole
    size = [radius, length / 2, 0.0]
    return _Form(mujoco.mjtGeom.mjGEOM_CAPSULE, size, middle, axes, middle, [across, across, about_z], axes)


def _hull(vertices: FloatArray) -> _Form:
    """The hull of points, as a solid: integrals over the tetrahedra from a point inside."""
    hull = ConvexHull(vertices)
    inside = vertices.mean(axis=0)
    a, b, c = (vertices[hull.simplices[:, i]] - inside for i in range(3))
    volumes = np.abs(np.sum(a * np.cross(b, c), axis=1)) / 6.0
    weights = volumes / volumes.sum()
    offset = weights @ (a + b + c) / 4.0
    # second moments of a tetrahedron with one corner at the origin: (sum v v' + s s') / 20, s the sum of the v
    s = a + b + c
    second = sum(np.einsum("i,ij,ik->jk", weights, v, v) for v in (a, b, c, s)) / 20.0
    second = second - np.outer(offset, offset)
    gyration = np.trace(second) * np.eye(3) - second
    moments, axes = np.linalg.eigh(gyration)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    center, on_hull = inside + offset, vertices[hull.vertices]
    return _Form(
        mujoco.mjtGeom.mjGEOM_MESH, [], center, np.eye(3), center, moments.tolist(), np.asarray(axes), on_hull
    )


def _quat_wxyz(rotation: FloatArray) -> list[float]:
    quat_wxyz = np.zeros(4)
    mujoco.mju_mat2Quat(quat_wxyz, np.ascontiguousarray(rotation).ravel())
    return [float(entry) for entry in quat_wxyz]
