"""Objects from triangle meshes: convex ones as MuJoCo holds them, others through their tangent plane."""

import math
from dataclasses import dataclass, field

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sim.objects.mesh_file import Triangles
from palpate.sim.objects.nearest import nearest_on_mesh
from palpate.sim.objects.primitives import STEEPEST
from palpate.sim.objects.traced import PICTURE_COLOUR, Nearest, TracedObject, add_mesh_picture, picture_name
from palpate.sim.objects.vertical import heights_of_mesh, upper_surface, windings
from palpate.sim.one_contact import one_contact
from palpate.surfaces.triangle_tree import merged, nearest_of_all, triangle_tree

CONVEX_TOLERANCE = 1e-5
"""How far a vertex may lie outside a facet's plane, relative to the mesh's size: rounding of a file in float32."""

TIGHTEST_FIT = 0.02
"""By so much of its radius a tip may overlap a mesh where it touches a vertex: facets of a smooth hollow do that,
and an inner edge of less than 2 acos(1 - 0.02) = 23 degrees."""


ASIDE = 1e-7
"""How far off a facet's middle its two sides are looked at, relative to the mesh's size: far above rounding."""


@dataclass(frozen=True, eq=False, slots=True)
class _MeshBase:
    """What both kinds know of their exact surface, the triangles themselves.

    Pieces may overlap: from outside, where a tip is, the nearest point of all triangles is one of their union.

    Raises:
        InvalidValueError: The mesh, or a part of it, is inside out.
    """

    triangles: Triangles
    _tree: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        tree = triangle_tree(*merged(self.triangles.vertices, self.triangles.faces))
        object.__setattr__(self, "_tree", tree)
        _refuse_inside_out(self.triangles, tree)

    @property
    def top(self) -> float:
        """Height of the highest vertex [m]."""
        return float(self.triangles.vertices[:, 2].max())

    @property
    def bottom(self) -> float:
        """Height of the lowest vertex [m]."""
        return float(self.triangles.vertices[:, 2].min())

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        distance, _, _ = nearest_of_all(self._tree, points)
        return np.asarray(np.where(windings(self._tree, points) > 0, -distance, distance))

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        return np.asarray(heights_of_mesh(self._tree, x.ravel(), y.ravel())).reshape(x.shape)

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`; the slope counts where the tip is above, which errs on the safe side."""
        height, upright = upper_surface(self._tree, x, y)
        return not math.isnan(height) and upright >= math.cos(STEEPEST)


@dataclass(frozen=True, eq=False, slots=True)
class ConvexMesh(_MeshBase):
    """A convex mesh, touched by tips of every kind.

    Raises:
        InvalidValueError: It is not convex: MuJoCo would simulate its hull.
    """

    def __post_init__(self) -> None:
        _MeshBase.__post_init__(self)
        dent = deepest_dent(self.triangles)
        limit = CONVEX_TOLERANCE * float(np.ptp(self.triangles.vertices, axis=0).max())
        if dent > limit:
            raise InvalidValueError(
                f"{self.triangles.name}: not convex, a vertex lies {dent:.2g} m beyond a facet's plane, the limit "
                f"is {limit:.2g} m; take a TracedMesh, or its convex hull"
            )

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """See `SceneObject`."""
        one_contact(spec)
        mesh = spec.add_mesh(
            name=f"{name}_mesh", uservert=self.triangles.vertices.ravel(), userface=self.triangles.faces.ravel()
        )
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """Add a mesh geom."""
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=f"{name}_mesh",
            contype=0,
            conaffinity=0,
            rgba=PICTURE_COLOUR,
        )


@dataclass(frozen=True, eq=False, slots=True)
class TracedMesh(_MeshBase, TracedObject):
    """A mesh of any shape, fixed, touched by spheres."""

    @property
    def nearest(self) -> Nearest:
        """See `TracedObject`."""
        kernel: Nearest = nearest_on_mesh
        return kernel

    @property
    def parameters(self) -> FloatArray:
        """See `TracedObject`."""
        return self._tree

    def check_tip(self, radius: float) -> None:
        """See `TracedObject`; tried at all vertices that face up enough to be touched from above."""
        normals = _vertex_normals(self.triangles)
        up = normals[:, 2] >= math.cos(STEEPEST)
        centers = self.triangles.vertices[up] + radius * normals[up]
        if not len(centers):
            return
        overlap = radius - nearest_of_all(self._tree, centers)[0]
        worst = int(np.argmax(overlap))
        if overlap[worst] > TIGHTEST_FIT * radius:
            raise InvalidValueError(
                f"tip radius = {radius:g} m: at {self.triangles.vertices[up][worst].round(4).tolist()} m "
                f"{self.triangles.name} is too hollow for it ({overlap[worst]:.2g} m of overlap, the limit is "
                f"{TIGHTEST_FIT * radius:.2g} m), and it would touch in two places; take a smaller tip, or round "
                "the mesh's inner edges"
            )

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """See `TracedObject`."""
        add_mesh_picture(spec, picture_name(name), self.triangles.vertices, self.triangles.faces)


def _refuse_inside_out(triangles: Triangles, tree: FloatArray) -> None:
    """Outside of every facet there must be nothing, or another piece: never less than nothing."""
    corners = triangles.corners
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    flat = length > 1e-12 * length.max()  # slivers have no sides
    aside = ASIDE * float(np.ptp(triangles.vertices, axis=0).max())
    middles = corners[flat].mean(axis=1)
    wrong = windings(tree, middles + aside * normals[flat] / length[flat, None]) < 0
    if wrong.any():
        raise InvalidValueError(
            f"{triangles.name}: {int(wrong.sum())} of its triangles face inwards, one at "
            f"{middles[wrong][0].round(4).tolist()} m: a part of the mesh is inside out, or it crosses itself; "
            "turn that part round, or repair the mesh where it was made"
        )


def deepest_dent(triangles: Triangles) -> float:
    """Largest distance of a vertex outside a facet's plane [m]: 0, but for rounding, of a convex mesh."""
    corners = triangles.corners
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    flat = length > 1e-12 * length.max()  # slivers have no plane
    normals = normals[flat] / length[flat, None]
    offsets = np.sum(normals * corners[flat, 0], axis=1)
    return max(
        float((normals[i : i + 512] @ triangles.vertices.T - offsets[i : i + 512, None]).max())
        for i in range(0, len(normals), 512)
    )


def _vertex_normals(triangles: Triangles) -> FloatArray:
    """Means of the adjoining facets' normals, weighted by area."""
    corners = triangles.corners
    facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(triangles.vertices)
    for i in range(3):
        np.add.at(normals, triangles.faces[:, i], facets)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))
