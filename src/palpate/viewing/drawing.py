"""What is on the screen: parts, contact force, map, plots, a line of numbers."""

import html
from time import monotonic

import matplotlib as mpl
import numpy as np
import viser
from viser import transforms

from palpate.errors import FloatArray
from palpate.spatial import Matrix
from palpate.viewing.frames import Frames
from palpate.viewing.plots import ForcePlots
from palpate.viewing.touch_map import CHUNK, TouchMap
from palpate.viewing.view_scene import Part, Place, ViewScene, link_poses

ARROW_LENGTH = 0.015
"""Length of the arrow per force [m/N]: at 2 N it sticks out of an 8 mm fingertip, as in `sim.render.renderer`."""

WEAKEST = 0.01
"""Forces below this are not drawn [N]: an arrow of a fifth of a millimetre."""

SLOW_INTERVAL = 0.2
"""Between two updates of map, plots and numbers [s]: what is large, or read by people."""

ARROW_COLOUR = (213, 94, 0)
"""Of the palette of Okabe and Ito, as in the report."""

_HEIGHT_COLOURS = mpl.colormaps["viridis"]

CAMERA_DIRECTION = (0.5, -1.0, 0.7)
"""From the middle of the scene to the camera."""

CAMERA_DISTANCE = 1.5
"""Over the largest extent of what is fixed: all in view, with room for the panel and an arm's wrist."""


GROUND = 2.0
"""Of the grid below, over the largest extent of what is fixed."""

_PADDED = '<div style="padding: 0 1em">{}</div>'


class Drawing:
    """The scene in a viewer; one thread draws."""

    def __init__(self, server: viser.ViserServer, scene: ViewScene) -> None:
        """Draw what does not change.

        Args:
            server: Where.
            scene: What.
        """
        self._server, self._scene = server, scene
        self._map, self._coarsened = TouchMap(scene.map_spacing), 0
        self._chunks: list[viser.PointCloudHandle] = []
        self._drawn, self._slow_due = 0, 0.0
        self._heights: tuple[float, float] | None = None
        server.scene.set_up_direction("+z")
        # nothing that people typed is in a node's name, where a slash would matter
        self._tip = server.scene.add_frame("/tip", show_axes=False)
        self._links = [server.scene.add_frame(f"/link_{i}", show_axes=False) for i in range(scene.joints)]
        for i, part in enumerate(scene.parts):
            self._add_part(i, part)
        self._arrow = server.scene.add_arrows(
            "/contact_force",
            np.zeros((1, 2, 3)),
            ARROW_COLOUR,
            shaft_radius=8e-4,
            head_radius=2e-3,
            head_length=4e-3,
            visible=False,
        )
        self._look()
        server.gui.configure_theme(show_share_button=False)
        server.gui.add_html(_PADDED.format(f"<b>{html.escape(scene.title)}</b>"))
        self._numbers = server.gui.add_html(_PADDED.format("waiting for the first period"))
        self._plots = ForcePlots(server)

    @property
    def touch_map(self) -> TouchMap:
        """What was touched so far."""
        return self._map

    def add(self, frames: Frames) -> None:
        """Take frames into the map and the plots, and show the last of them."""
        if not len(frames):
            return
        self._map.add(frames.centroid[frames.scanning])
        self._plots.add(frames)
        with self._server.atomic():
            self._move(frames)
        if monotonic() >= self._slow_due:
            self.refresh(frames)

    def refresh(self, frames: Frames) -> None:
        """Send map, plots and numbers, whether or not it is time."""
        self._slow_due = monotonic() + SLOW_INTERVAL
        self._draw_map()
        self._plots.show()
        self._numbers.content = _numbers(frames, len(self._map))

    def clear(self) -> None:
        """Forget map and past."""
        self._map.clear()
        self._plots.clear()
        self._drop_chunks()

    def _add_part(self, number: int, part: Part) -> None:
        above = {Place.BASE: "", Place.TIP: "/tip", Place.LINK: f"/link_{part.link}"}[part.place]
        self._server.scene.add_mesh_simple(
            f"{above}/part_{number}",
            part.vertices,
            part.triangles,
            color=part.colour,
            opacity=None if part.opacity >= 1.0 else part.opacity,
            side="double",
        )

    def _look(self) -> None:
        """Begin with a view of what is fixed: the object."""
        fixed = [part.vertices for part in self._scene.parts if part.place is Place.BASE]
        corners = np.concatenate(fixed) if fixed else np.array([[-0.1, -0.1, 0.0], [0.1, 0.1, 0.1]])
        low, high = corners.min(axis=0), corners.max(axis=0)
        middle, reach = (low + high) / 2.0, CAMERA_DISTANCE * float((high - low).max())
        direction = np.array(CAMERA_DIRECTION) / np.linalg.norm(CAMERA_DIRECTION)
        camera = self._server.initial_camera
        camera.position = tuple((middle + reach * direction).tolist())
        camera.look_at = tuple(middle.tolist())
        camera.near = 0.01 * reach
        size = float((high - low).max())
        self._server.scene.add_grid(
            "/ground",
            width=GROUND * size,
            height=GROUND * size,
            cell_size=size / 4.0,
            section_size=size,
            position=(0.0, 0.0, float(low[2])),
        )

    def _move(self, frames: Frames) -> None:
        last = frames[len(frames) - 1 :]
        self._tip.position = last.position[0]
        self._tip.wxyz = quat_wxyz(last.rotation[0])
        if self._scene.arm is not None and self._links:
            joints = tuple(last.joint_position[0].tolist())
            for link, pose in zip(self._links, link_poses(self._scene.arm, joints), strict=True):
                link.position, link.wxyz = pose.position, quat_wxyz(pose.rotation)
        force = last.force[0]
        shown = bool(last.touching[0]) and float(np.linalg.norm(force)) > WEAKEST
        if shown:
            start = last.centroid[0]
            self._arrow.points = np.stack([start, start + ARROW_LENGTH * force])[None].astype(np.float32)
        if shown != self._arrow.visible:
            self._arrow.visible = shown

    def _draw_map(self) -> None:
        """Send the chunks that have grown; all of them if colours or points changed."""
        touched = self._map
        if len(touched) == 0:
            return
        heights = touched.points[:, 2]
        bounds = (float(heights.min()), float(heights.max()))
        if touched.coarsened != self._coarsened or self._outgrown(bounds):
            self._coarsened, self._heights = touched.coarsened, _with_room(bounds)
            self._drop_chunks()
        elif len(touched) == self._drawn:
            return
        for number in range(self._drawn // CHUNK, touched.chunks):
            points = touched.chunk(number)
            handle = self._server.scene.add_point_cloud(
                f"/map/chunk_{number}",
                points,
                self._colours(points[:, 2]),
                point_size=max(0.7 * touched.spacing, 4e-4),
                point_shape="circle",
                precision="float32",
            )
            self._chunks[number:] = [handle]
        self._drawn = len(touched)

    def _outgrown(self, bounds: tuple[float, float]) -> bool:
        return self._heights is None or bounds[0] < self._heights[0] or bounds[1] > self._heights[1]

    def _colours(self, heights: FloatArray) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
        assert self._heights is not None  # the colours' range is set before the first point is drawn
        low, high = self._heights
        shades = _HEIGHT_COLOURS((heights - low) / (high - low), bytes=True)
        return np.asarray(shades[:, :3], np.uint8)

    def _drop_chunks(self) -> None:
        for chunk in self._chunks:
            chunk.remove()
        self._chunks, self._drawn = [], 0


def quat_wxyz(rotation: FloatArray | Matrix) -> FloatArray:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix (3, 3)."""
    return np.asarray(transforms.SO3.from_matrix(np.asarray(rotation)).wxyz, dtype=np.float64)


def _with_room(bounds: tuple[float, float]) -> tuple[float, float]:
    """Bounds with half of their extent more on each side, lest colours change with every new point."""
    room = 0.5 * max(bounds[1] - bounds[0], 1e-3)
    return bounds[0] - room, bounds[1] + room


def _numbers(frames: Frames, points: int) -> str:
    """The last period in numbers, as HTML; nothing in it was typed by anybody."""
    last = frames[len(frames) - 1 :]
    force = f"{last.normal_force[0]:.2f} N" if last.touching[0] else "no contact"
    said = f"t = {last.time[0]:.2f} s &middot; {last.phase(0).value} &middot; {force} &middot; {points} map points"
    return _PADDED.format(said)
