"""Makes the surface grow: contacts in, triangles out. It is slow, and lives in a process of its own."""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.mapping import Knowledge, MapSettings, SurfaceMap, TouchCloud, surface_mesh
from palpate.mapping.arc_bins import stretch_means, stretch_starts
from palpate.mapping.layers import vertex_layer
from palpate.mapping.mesh_metrics import MeshMetrics, known_triangles, voxel_for
from palpate.viewing.frames import Frames
from palpate.viewing.surface_view import GrownSurface, SurfaceView

TIME, POSITION, NORMAL, NORMAL_FORCE, TANGENTIAL_FORCE, SPEED = 0, slice(1, 4), slice(4, 7), 7, slice(8, 11), 11
CONTACT_WIDTH = 12
"""Columns of a contact as it is handed to the grower."""

MOST_VERTICES = 15_000
"""Half a megabyte for the browser, twice a second."""

FIRST_LEARNED = 64
"""Stretches after which noise and surface are learned for the first time: of about as many a patch consists. Then
each time there are twice as many."""

SLIDES = 0.5
"""Of the usual speed: slower, around corners, friction may not be all there yet."""

FRICTION_STRETCH = 0.25
"""Of the distance of rows, over which friction is averaged."""


class SurfaceGrower:
    """A map with its mesh and what else was felt."""

    def __init__(self, view: SurfaceView) -> None:
        """Begin without a contact."""
        self._view = view
        self._map = SurfaceMap(MapSettings.for_rows(view.rows, bias=view.bias))
        self._learn_at, self._contacts = FIRST_LEARNED, 0
        self._slid: list[FloatArray] = []  # position and friction of stretches, shape (k, 4) each
        self._last = -np.inf

    def add(self, contacts: FloatArray) -> None:
        """Take contacts (n, CONTACT_WIDTH), in the order in which they were felt."""
        contacts = contacts[contacts[:, TIME] >= self._last]  # as a map asks for; a view may send one twice
        if not len(contacts):
            return
        self._last = float(contacts[-1, TIME])
        self._contacts += len(contacts)
        self._map.add(
            TouchCloud(
                time=contacts[:, TIME],
                position=contacts[:, POSITION],
                normal=contacts[:, NORMAL],
                normal_force=contacts[:, NORMAL_FORCE],
                tangential_force=contacts[:, TANGENTIAL_FORCE],
                spin_torque=np.zeros(len(contacts)),
            )
        )
        if len(self._map) >= self._learn_at:
            self._map.relearn()
            self._learn_at = 2 * len(self._map)
        self._take_friction(contacts)

    def grown(self) -> GrownSurface:
        """Return the surface as it is now."""
        stretches = self._map.stretches.position
        voxel = voxel_for(stretches, self._view.voxel, MOST_VERTICES)
        mesh = surface_mesh(self._map, voxel, Knowledge.EXTRAPOLATED)
        observed = known_triangles(mesh, self._view.worst)
        slid = np.concatenate([np.zeros((0, 4)), *self._slid])
        friction = vertex_layer("friction", mesh.vertices, slid[:, :3], slid[:, 3], self._view.rows)
        return GrownSurface(
            vertices=mesh.vertices,
            normals=mesh.normals,
            observed=mesh.triangles[observed],
            rim=mesh.triangles[~observed],
            edge=rim_edges(mesh.triangles[observed]),
            sd=mesh.sd,
            friction=friction.mean,
            metrics=MeshMetrics.of(mesh, self._view.worst),
            contacts=self._contacts,
        )

    def _take_friction(self, contacts: FloatArray) -> None:
        slid = contacts[contacts[:, SPEED] > SLIDES * np.median(contacts[:, SPEED])]
        if not len(slid):
            return
        starts = stretch_starts(
            slid[:, TIME],
            slid[:, POSITION],
            slid[:, NORMAL],
            FRICTION_STRETCH * self._view.rows,
            self._map.settings.longest_pause,
        )
        ratio = np.linalg.norm(slid[:, TANGENTIAL_FORCE], axis=1) / slid[:, NORMAL_FORCE]
        self._slid.append(stretch_means(np.column_stack([slid[:, POSITION], ratio]), starts))


def contacts_of(frames: Frames, view: SurfaceView) -> FloatArray:
    """Return the contacts of a scan, base frame, on the surface of the object, shape (n, CONTACT_WIDTH)."""
    kept = frames.scanning & (frames.finger(0).normal_force > 0.0)
    turn, contact = frames.rotation[kept], frames.finger(0)
    normal = -np.einsum("nij,nj->ni", turn, contact.normal[kept])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(length > 0.0, length, 1.0)
    pressed = contact.normal_force[kept]
    force = frames.force[kept]
    found = np.empty((len(pressed), CONTACT_WIDTH))
    found[:, TIME], found[:, NORMAL_FORCE] = frames.time[kept], pressed
    inside = view.half_compliance * (2.0 * pressed - view.sensed_force)
    found[:, POSITION] = frames.centroid[kept] + inside[:, None] * normal
    found[:, NORMAL] = normal
    # what pushes the finger away acts along the object's normal
    found[:, TANGENTIAL_FORCE] = force - (force * normal).sum(axis=1, keepdims=True) * normal
    found[:, SPEED] = _speed(frames)[kept]
    return found


def _speed(frames: Frames) -> FloatArray:
    """Speed of the tip, shape (n,) [m/s]."""
    if len(frames) < 2:
        return np.zeros(len(frames))
    step = np.diff(frames.time)
    lengths = np.linalg.norm(np.diff(frames.position, axis=0), axis=1)
    speed = lengths / np.where(step > 0.0, step, np.inf)
    return np.concatenate([speed[:1], speed])


def rim_edges(triangles: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the sides that one triangle alone has, as both their corners, shape (k, 2)."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(unique[counts == 1], np.int64)
