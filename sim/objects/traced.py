"""Surfaces that MuJoCo cannot represent, touched through their tangent plane.

MuJoCo 4 collides convex geoms only. Its alternatives were measured with a spherical tip of 8 mm, 0.1 mm deep
(stiffness of all contacts over the wanted one, median and 99th percentile; errors of the contact point and of the
normal, medians; time of the collision):

    torus 30/12 mm, SDF plugin       6.7/9.9   0.06 mm   0.2 deg    67 us   at 0.02 mm some contacts are missed
    the same, mesh as SDF (octree)   4.5/7.0   0.09 mm   0.5 deg   430 us   at 0.02 mm most of them
    bumps, height field, 1 mm grid    12/15    0.05 mm   0.4 deg    30 us   at 0.02 mm 5/7
    bumps, height field, 2 mm grid   5.4/7.3   0.21 mm   1.5 deg    11 us   at 0.02 mm 3/7
    torus, mesh: its convex hull     1.9/175   0.7 mm    5 deg       7 us

None keeps to a contact law, and as the stiffness depends on the depth, no factor mends it. But a sphere touches
a surface in one point, where the surface and its tangent plane are the same: before every time step `Trace.place`
puts a plane under the tip, tangent at the nearest point of the exact surface. That is one contact, of MuJoCo's
most exact kind (stiffness 1, errors below 0.1 um; 1 us on the torus, 3 us on bumps). The plane is a mocap body,
which has no velocity, as the fixed object has none: friction feels how the tip slides.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable

import mujoco
import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.sim.objects.nearest import (
    each,
    lay_on_heights,
    lay_on_mesh,
    lay_on_torus,
    nearest_on_heights,
    nearest_on_mesh,
    nearest_on_torus,
)

IndexArray = npt.NDArray[np.int64]

Nearest = Callable[[FloatArray, float, float, float], tuple[float, float, float, float, float, float]]
"""(parameters, x, y, z) -> nearest point and outward unit normal there."""

PLANE_SIZE = 0.02
"""Half length of the tangent plane as it is drawn [m]; contact knows no end of it."""

PICTURE_COLOUR = [0.6, 0.65, 0.7, 1.0]
"""Red, green, blue, opacity."""


class TracedObject(ABC):
    """A fixed object of any shape, for tips that are spheres. Its geom is a plane that `Trace` keeps tangent."""

    @property
    @abstractmethod
    def nearest(self) -> Nearest:
        """Kernel of the exact surface, one of `palpate.sim.objects.nearest`."""

    @property
    @abstractmethod
    def parameters(self) -> FloatArray:
        """Its first argument."""

    @abstractmethod
    def check_tip(self, radius: float) -> None:
        """Refuse a tip that would touch in two places at once.

        Args:
            radius: Of the tip [m].

        Raises:
            InvalidValueError: The surface bends inwards more tightly than the tip outwards.
        """

    @abstractmethod
    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """Add what is seen of it, geom and its data, to the world: it touches nothing."""

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add the tangent plane to a body of the world, which becomes a mocap body.

        Raises:
            InvalidValueError: The body hangs on another one, or has joints.
        """
        if body.parent is None or body.parent.name != "world" or body.joints:
            raise InvalidValueError(
                f"{type(self).__name__} on body {body.name!r}: must be fixed in the world, its surface does not "
                "move with a body; take a convex object"
            )
        body.mocap = True
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[PLANE_SIZE, PLANE_SIZE, 0.01],
            rgba=[0.0, 0.0, 0.0, 0.0],
            contype=0,
            conaffinity=0,
        )

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        found, normals = each(self.nearest, self.parameters, points)
        return np.asarray(np.sum((points - found) * normals, axis=1))


class Trace:
    """Keeps the plane of one traced object tangent under one tip of one simulation. A `Placer`.

    Holds no state: where the plane lies follows from where the tip is, so snapshots need not know of it.
    """

    def __init__(
        self, target: TracedObject, model: mujoco.MjModel, data: mujoco.MjData, tip_geom: str, object_geom: str
    ) -> None:
        """Take a scene, and compile; then place the plane.

        Args:
            target: Whose plane it is.
            model: The scene.
            data: Its state.
            tip_geom: The tip's geom, a sphere.
            object_geom: The name that the object's geom was given.

        Raises:
            InvalidValueError: The tip is no sphere, or too large for the object's hollows.
        """
        tip, plane = model.geom(tip_geom), model.geom(object_geom)
        if int(tip.type[0]) != int(mujoco.mjtGeom.mjGEOM_SPHERE):
            kind = mujoco.mjtGeom(int(tip.type[0])).name.removeprefix("mjGEOM_").lower()
            raise InvalidValueError(
                f"geom {tip_geom!r} is of kind {kind}: {type(target).__name__} is touched through its tangent "
                "plane, by a sphere only; take a Sphere as tip, or a convex object"
            )
        mocap = int(model.body_mocapid[int(plane.bodyid[0])])
        if mocap < 0:
            raise InvalidValueError(f"geom {object_geom!r} is on no mocap body: add it by {type(target).__name__}")
        target.check_tip(float(tip.size[0]))
        self._model, self._data = model, data
        self._place = _PLACES[target.nearest]
        self._arrays = (
            target.parameters,
            data.geom_xpos[int(tip.id)],
            data.mocap_pos[mocap],
            data.mocap_quat[mocap],
        )
        self.place()

    def place(self) -> None:
        """Lay the plane under where the tip is now; call it before each mj_step, and after a reset."""
        mujoco.mj_kinematics(self._model, self._data)
        self._place(*self._arrays)


_PLACES: dict[Nearest, Callable[[FloatArray, FloatArray, FloatArray, FloatArray], None]] = {
    nearest_on_torus: lay_on_torus,
    nearest_on_heights: lay_on_heights,
    nearest_on_mesh: lay_on_mesh,
}


def picture_name(name: str) -> str:
    """Return the name of what is seen of an object whose own geom has this name."""
    return f"{name}_picture"


def add_mesh_picture(spec: mujoco.MjSpec, name: str, vertices: FloatArray, triangles: IndexArray) -> None:
    """Add a mesh to the world that is only seen.

    Args:
        spec: The scene.
        name: Of mesh and geom.
        vertices: Shape (n, 3) [m].
        triangles: Shape (m, 3).
    """
    mesh = spec.add_mesh(name=name, uservert=vertices.ravel(), userface=triangles.ravel())
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # nothing is weighed: no volume is asked for
    spec.worldbody.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, contype=0, conaffinity=0, rgba=PICTURE_COLOUR
    )
