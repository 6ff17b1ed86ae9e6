"""What is touched in a scene of one's own: one geom of an MJCF file, in its surroundings."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, shown
from palpate.sim.contact_law import ContactLaw
from palpate.sim.objects.mesh import ConvexMesh, TracedMesh
from palpate.sim.objects.mesh_file import LARGEST, SMALLEST, Triangles
from palpate.sim.objects.posed import PosedGeom, kind_name
from palpate.sim.objects.primitives import SceneObject
from palpate.sim.objects.scene_file import SceneFile, line_of, refused
from palpate.sim.objects.target import Mount, Placer, placer_of
from palpate.sim.one_contact import one_contact
from palpate.spatial import ZERO, Vector

MOST_NAMES = 12
"""Listed in a message."""

_Geom = mujoco.mjtGeom


@dataclass(frozen=True, eq=False, slots=True)
class SceneTarget:
    """One geom of a scene from a file, with all that stands and moves around it. A `Target`.

    The scene is moved, never turned, until the geom stands on z = 0 with the middle of its bounding box over the
    origin. Its joints, springs and masses are simulated as they are; gravity, time step and solver are those of
    `Fidelity`, keyframes and sensors are left out, and actuators are held at a control of 0. Other geoms that
    collide in the file meet the tip, too, with the same contact law: the sensor feels them, the truth is of the
    touched geom alone.

    Attributes:
        file: The scene.
        geom: Number of the touched geom in it.
        touched: What it is called, for people.
        shape: Its surface where it starts, base frame.
        shift: By which the scene is moved [m].
        moves: Whether joints carry it.
    """

    file: SceneFile
    geom: int
    touched: str
    shape: SceneObject = field(repr=False)
    shift: Vector
    moves: bool

    @classmethod
    def of(cls, file: SceneFile, touch: str, mesh: type[TracedMesh | ConvexMesh] = TracedMesh) -> "SceneTarget":
        """Look a geom up.

        Args:
            file: The scene.
            touch: Name of a geom, or of a body with one geom that collides; empty if the whole scene has one.
            mesh: What a mesh becomes if it stands still: `ConvexMesh` for a tip that is no sphere. One that
                moves is always convex.

        Raises:
            InvalidValueError: There is no such geom, or it cannot be touched.
        """
        spec = file.spec()
        number = _number_of(spec, touch, file)
        touched = touch or spec.geoms[number].name or f"geom {number}"
        model, data = _start(spec, file)
        moves = bool(model.body_weldid[int(model.geom_bodyid[number])])
        kind, where = _Geom(int(model.geom_type[number])), f"file = {file.name}{line_of(file.text, touched)}"
        shape: SceneObject
        if kind != _Geom.mjGEOM_MESH:
            shape, shift = _posed(model, data, number, kind, f"{where}: {touched}")
        else:
            shape, shift = _mesh(model, data, number, ConvexMesh if moves else mesh, f"{where}: {touched}")
        return cls(file, number, touched, shape, shift, moves)

    @property
    def mount(self) -> Mount:
        """Jointed if it moves, else fixed."""
        return Mount.JOINTED if self.moves else Mount.FIXED

    @property
    def position(self) -> Vector:
        """The origin [m]: the shape is in the base frame."""
        return ZERO

    def law(self, press: ContactLaw) -> ContactLaw:
        """See `Target`: the file's friction is for what is around it."""
        return press

    def add_to(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add the whole scene, and give the touched geom that name; its body keeps its own."""
        around = f"{name}_scene"
        child = self.file.spec()
        for i, each in enumerate(child.geoms):
            each.name = each.name or f"geom {i}"
        own = f"{around}/{child.geoms[self.geom].name}"
        root = spec.worldbody.add_body(name=around, pos=self.shift)
        spec.attach(child, prefix=f"{around}/", frame=root.add_frame())
        geom = spec.geom(own)
        if isinstance(self.shape, TracedMesh):  # touched through a plane of its own
            geom.contype = geom.conaffinity = 0
            body = spec.worldbody.add_body(name=name)
            self.shape.add_geom(body, name)
            return body
        if isinstance(self.shape, ConvexMesh):
            one_contact(spec)
        geom.name = name
        for pair in spec.pairs:
            pair.geomname1, pair.geomname2 = (name if it == own else it for it in (pair.geomname1, pair.geomname2))
        geom.parent.name = geom.parent.name or f"{around}_body"
        return geom.parent

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, name: str, tip_geom: str) -> Placer:
        """See `Target`.

        Raises:
            InvalidValueError: It cannot be touched by this tip, or the tip starts inside something.
        """
        placer = placer_of(self.shape, model, data, name, tip_geom)
        start = mujoco.MjData(model)
        mujoco.mj_forward(model, start)
        tip = int(model.geom(tip_geom).id)
        for contact in start.contact:
            if tip in contact.geom and contact.dist < 0.0:
                other = model.geom(int(contact.geom.sum()) - tip).name.rpartition("/")[2]
                raise InvalidValueError(
                    f"file = {self.file.name}: the tip starts {-contact.dist:.2g} m inside geom {other!r}: must "
                    f"start clear of everything, above {self.touched}; move that geom, or touch elsewhere"
                )
        return placer


def _number_of(spec: mujoco.MjSpec, touch: str, file: SceneFile) -> int:
    """Return the number of the geom that a name stands for."""
    geoms = list(spec.geoms)
    if touch in (named := [each.name for each in geoms if each.name]):
        return next(i for i, each in enumerate(geoms) if each.name == touch)
    bodies = [each.name for each in spec.bodies if each.name and each.name != "world" and each.geoms]
    if touch and touch not in bodies:
        raise InvalidValueError(
            f"touch = {shown(touch)}: {file.name} has no such geom or body; geoms: {_listed(named)}; bodies with "
            f"geoms: {_listed(bodies)}"
        )
    own = [i for i, each in enumerate(geoms) if not touch or each.parent.name == touch]
    own = [i for i in own if geoms[i].contype or geoms[i].conaffinity] or own
    if len(own) == 1:
        return own[0]
    what = f"touch = {shown(touch)}: this body of {file.name}" if touch else f"touch: left out, and {file.name}"
    raise InvalidValueError(
        f"{what} has {len(own)} geoms: must be one; name it (--touch): "
        f"{_listed([geoms[i].name or 'one without a name' for i in own])}"
    )


def _start(spec: mujoco.MjSpec, file: SceneFile) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Compile a scene, alone and where it starts."""
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise refused(file.name, error) from None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def _posed(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, kind: mujoco.mjtGeom, where: str
) -> tuple[PosedGeom, Vector]:
    center, turn = data.geom_xpos[geom].copy(), data.geom_xmat[geom].reshape(3, 3).copy()
    try:
        found = PosedGeom(kind, model.geom_size[geom].copy(), center, turn)
    except InvalidValueError:
        raise InvalidValueError(
            f"{where} is a {kind_name(kind)}: must be a sphere, ellipsoid, box, cylinder, capsule or mesh; draw "
            "it as one of these"
        ) from None
    _check_size(max(found.extent), where)
    shift = (float(-center[0]), float(-center[1]), -found.bottom)
    return PosedGeom(kind, found.size, center + shift, turn), shift


def _mesh(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, kind: type[TracedMesh | ConvexMesh], where: str
) -> tuple[TracedMesh | ConvexMesh, Vector]:
    mesh = model.mesh(int(model.geom_dataid[geom]))
    first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
    face, faces = int(mesh.faceadr[0]), int(mesh.facenum[0])
    local: FloatArray = model.mesh_vert[first : first + count].astype(np.float64)
    vertices = local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    _check_size(float((high - low).max()), where)
    x, y = (-0.5 * (low + high)[:2]).tolist()
    shift = (x, y, -float(low[2]))
    triangles = model.mesh_face[face : face + faces].astype(np.int64)
    return kind(Triangles(vertices + shift, triangles, where)), shift


def _check_size(size: float, where: str) -> None:
    if not SMALLEST <= size <= LARGEST:
        raise InvalidValueError(
            f"{where} is {size:.4g} m across, must be {SMALLEST:g} to {LARGEST:g} m; is it in another unit? A "
            'mesh in millimetres takes scale="0.001 0.001 0.001", and every other number is in metres'
        )


def _listed(names: list[str]) -> str:
    shortened = names[:MOST_NAMES] + ["..."] * (len(names) > MOST_NAMES)
    return ", ".join(shortened) or "none"
