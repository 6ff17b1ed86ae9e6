"""What a scene looks like, as triangles: for viewers that know nothing of MuJoCo."""

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt
import trimesh

from palpate.errors import FloatArray
from palpate.sim.hand.mount import PALM
from palpate.sim.render.palm import THICKNESS, palm_disc
from palpate.sim.render.parts import Role, roles_of

ROUND = 48
"""Corners of a circle: an 8 mm tip is round to 17 um."""

DEFAULT_COLOUR = (0.5, 0.5, 0.5, 1.0)
"""Of geoms that were given none (MuJoCo XML reference, geom/rgba)."""

_Geom = mujoco.mjtGeom


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """One geom.

    Attributes:
        name: Of the geom; empty if it has none. `PALM` for a palm that has none.
        body: Name of the body that it is fixed to.
        moves: Whether that body can move.
        vertices: In the body's frame, shape (n, 3) [m].
        triangles: Corners, counter-clockwise from outside, shape (m, 3).
        colour: RGBA, 0 to 1; `DEFAULT_COLOUR` if it was given none.
        role: What it belongs to.
    """

    name: str
    body: str
    moves: bool
    vertices: FloatArray
    triangles: npt.NDArray[np.int64]
    colour: tuple[float, float, float, float]
    role: Role


def shapes_of(model: mujoco.MjModel) -> tuple[Shape, ...]:
    """Return every geom of a scene that has a finite surface, and a hand's palm; endless planes are left out."""
    found = [] if (palm := _palm(model)) is None else [palm]
    roles = roles_of(model)
    for i in range(model.ngeom):
        surface = _surface(model, i)
        if surface is None:
            continue
        vertices, triangles = surface
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[i])
        body = int(model.geom_bodyid[i])
        red, green, blue, alpha = model.geom_rgba[i].tolist()
        found.append(
            Shape(
                model.geom(i).name,
                model.body(body).name,
                bool(model.body_weldid[body]),
                vertices @ rotation.reshape(3, 3).T + model.geom_pos[i],
                triangles,
                (red, green, blue, alpha),
                roles[i],
            )
        )
    return tuple(found)


def _palm(model: mujoco.MjModel) -> Shape | None:
    disc = palm_disc(model)
    if disc is None:
        return None
    made = trimesh.creation.cylinder(disc.radius, THICKNESS, sections=ROUND)
    made.apply_translation((0.0, 0.0, disc.middle))
    moves = bool(model.body_weldid[model.body(PALM).id])
    return Shape(
        PALM, PALM, moves, np.asarray(made.vertices), np.asarray(made.faces), DEFAULT_COLOUR, Role.MACHINE
    )


def _surface(model: mujoco.MjModel, geom: int) -> tuple[FloatArray, npt.NDArray[np.int64]] | None:
    """Vertices and triangles in the geom's own frame."""
    kind, (a, b, c) = _Geom(int(model.geom_type[geom])), model.geom_size[geom].tolist()
    if model.geom_dataid[geom] >= 0 and kind in (_Geom.mjGEOM_MESH, _Geom.mjGEOM_SDF):
        return _mesh(model, int(model.geom_dataid[geom]))
    if kind == _Geom.mjGEOM_HFIELD:
        return _height_field(model, int(model.geom_dataid[geom]))
    if kind in (_Geom.mjGEOM_SPHERE, _Geom.mjGEOM_ELLIPSOID):
        unit = trimesh.creation.uv_sphere(1.0, count=[ROUND // 2, ROUND])
        return unit.vertices * ((a, a, a) if kind == _Geom.mjGEOM_SPHERE else (a, b, c)), unit.faces
    if kind == _Geom.mjGEOM_BOX:
        made = trimesh.creation.box((2.0 * a, 2.0 * b, 2.0 * c))
    elif kind == _Geom.mjGEOM_CYLINDER:
        made = trimesh.creation.cylinder(a, 2.0 * b, sections=ROUND)
    elif kind == _Geom.mjGEOM_CAPSULE:
        made = trimesh.creation.capsule(2.0 * b, a, count=[ROUND // 2, ROUND])
        made.apply_translation(-made.bounds.mean(axis=0))  # some versions begin at the end, some in the middle
    elif kind == _Geom.mjGEOM_PLANE and a > 0.0 and b > 0.0:
        made = trimesh.creation.box((2.0 * a, 2.0 * b, 1e-4))
    else:
        return None
    return np.asarray(made.vertices), np.asarray(made.faces)


def _mesh(model: mujoco.MjModel, mesh: int) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    return model.mesh_vert[first : first + count].astype(float), model.mesh_face[face : face + faces].astype(
        np.int64
    )


def _height_field(model: mujoco.MjModel, field: int) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """The upper side of a height field; its base is not drawn."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, highest, _ = model.hfield_size[field].tolist()
    first = int(model.hfield_adr[field])
    heights = model.hfield_data[first : first + rows * columns].astype(float) * highest
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + columns + 1], axis=1)
    upper = np.stack([corner, corner + columns + 1, corner + columns], axis=1)
    return np.stack([x.ravel(), y.ravel(), heights], axis=1), np.concatenate([lower, upper])
