"""What is on the screen: parts, contact forces, map, plan, plots, a line of numbers."""

import html
import math
from collections.abc import Sequence
from time import monotonic

import matplotlib as mpl
import numpy as np
import viser
from viser import transforms

from palpate.errors import FloatArray
from palpate.kinematics.framing import Framing, framing
from palpate.kinematics.posture import Posture
from palpate.runtime import palette
from palpate.runtime.shown_plan import ShownPlan
from palpate.spatial import ZERO, Matrix, add, norm, rotate, scale
from palpate.viewing.frames import Frames
from palpate.viewing.look import legend, linear_rgb, style_sheet
from palpate.viewing.plan_drawing import PlanDrawing
from palpate.viewing.plots import ForcePlots
from palpate.viewing.surface_drawing import SurfaceDrawing
from palpate.viewing.surface_worker import SurfaceFeed
from palpate.viewing.touch_map import CHUNK, TouchMap
from palpate.viewing.view_scene import BASE, Part, ViewScene

ARROW_LENGTH = 0.015
"""Length of the arrow per force [m/N]: at 2 N it sticks out of an 8 mm fingertip, as in `sim.render.renderer`."""

WEAKEST = 0.01
"""Forces below this are not drawn [N]: an arrow of a fifth of a millimetre."""

SLOW_INTERVAL = 0.2
"""Between two updates of map, plots and numbers [s]: what is large, or read by people."""

ARROW_COLOUR = linear_rgb(palette.FELT)
"""Of a force that is felt, as in reports."""

_HEIGHT_COLOURS = mpl.colormaps["viridis"]

CAMERA_DIRECTION = (0.5, -1.0, 0.7)
"""From the middle of the scene to the camera."""

CAMERA_ANGLE = math.radians(50.0)
"""Of view, from top to bottom [rad]: about a photographer's normal lens; viser's own 75 degrees bend the edges."""

CAMERA_ASPECT = 0.9
"""Of what is free about the middle of a usual window, beside the panel."""

CAMERA_ROOM = 1.25
"""Around what is in view."""

NEAR_CONTACT = 0.06
"""Half of what is in view from near [m]: a few fingertips."""

GRID_CELLS = 0.25
"""Of the grid below, over the largest extent of the scene, before it is rounded."""

GROUND = 2.0
"""Of the grid below, likewise."""

_FROM_AFAR, _FROM_NEAR = "everything", "contact"

_PADDED = '<div style="padding: 0 1em">{}</div>'


class Drawing:
    """The scene in a viewer; one thread draws."""

    def __init__(
        self,
        server: viser.ViserServer,
        scene: ViewScene,
        postures: Sequence[Posture] = (),
        feed: SurfaceFeed | None = None,
    ) -> None:
        """Draw what does not change.

        Args:
            server: Where.
            scene: What.
            postures: That the run will come to, as far as is known: they are in view from the beginning.
            feed: Where the growing surface comes from; if not given, the map is its contacts alone.
        """
        self._server, self._scene = server, scene
        self._map = None if scene.map_spacing is None else TouchMap(scene.map_spacing)
        self._coarsened = 0
        self._chunks: list[viser.PointCloudHandle] = []
        self._drawn, self._slow_due = 0, 0.0
        self._heights: tuple[float, float] | None = None
        self._poses = scene.placement.poses(scene.placement.start)
        server.scene.set_up_direction("+z")
        # nothing that people typed is in a node's name, where a slash would matter
        moving = dict.fromkeys(part.body for part in scene.parts if part.body != BASE)
        self._bodies = {
            body: server.scene.add_frame(f"/body_{i}", show_axes=False) for i, body in enumerate(moving)
        }
        nodes = {body: f"/body_{i}" for i, body in enumerate(moving)} | {BASE: ""}
        for i, part in enumerate(scene.parts):
            self._add_part(f"{nodes[part.body]}/part_{i}", part)
        self._arrows = [self._add_arrow(f"/contact_force_{i}") for i in range(len(scene.fingers))]
        self._look(postures)
        server.gui.configure_theme(show_share_button=False)
        server.gui.add_html(_PADDED.format(f"<b>{html.escape(scene.title)}</b>"))
        self._numbers = server.gui.add_html(_PADDED.format("waiting for the first period"))
        server.gui.add_button_group("look at", (_FROM_AFAR, _FROM_NEAR)).on_click(self._look_at)
        self._feed, self._plan = feed, PlanDrawing(server)
        self._surface = None if feed is None else SurfaceDrawing(server)
        self._contacts = server.scene.add_frame("/map", show_axes=False, visible=feed is None)
        server.gui.add_html(style_sheet() + legend(ARROW_LENGTH, has_map=self._map is not None))
        self._plots = ForcePlots(server, len(scene.fingers))

    def add(self, frames: Frames) -> None:
        """Take frames into the map and the plots, and show the last of them."""
        if not len(frames):
            return
        if self._map is not None:
            self._map.add(frames.centroid[frames.scanning])
        if self._feed is not None:
            self._feed.add(frames)
        self._plan.move(frames.position)
        self._plots.add(frames)
        with self._server.atomic():
            self._move(frames)
        if monotonic() >= self._slow_due:
            self.refresh(frames)

    def follow(self, plan: ShownPlan) -> None:
        """Take the plan as it is now."""
        self._plan.follow(plan)

    def step(self) -> None:
        """Show the surface as far as it has grown meanwhile; called for every picture, frames or not."""
        surface, feed = self._surface, self._feed
        if surface is None or feed is None:
            return
        failed = feed.failed
        grown = feed.take()
        if feed.failed is not None:
            if failed is None:
                surface.fail(feed.failed)
        elif grown is not None:
            surface.show(grown)
        if feed.failed is None:
            surface.show_lateness(feed.behind)
        surface.follow_choice()
        if surface.shows_points != self._contacts.visible:
            self._contacts.visible = surface.shows_points

    def refresh(self, frames: Frames) -> None:
        """Send map, plan, plots and numbers, whether or not it is time."""
        self._slow_due = monotonic() + SLOW_INTERVAL
        if self._map is not None:
            self._draw_map(self._map)
        self._plan.show()
        self._plots.show()
        self._numbers.content = _numbers(frames, self._map, self._plan)

    def clear(self) -> None:
        """Forget map, plan and past."""
        if self._map is not None:
            self._map.clear()
        if self._feed is not None and self._surface is not None:
            self._feed.clear()
            self._surface.clear()
        self._plan.clear()
        self._plots.clear()
        self._drop_chunks()

    def _add_part(self, node: str, part: Part) -> None:
        self._server.scene.add_mesh_simple(
            node,
            part.vertices,
            part.triangles,
            color=part.colour,
            opacity=None if part.opacity >= 1.0 else part.opacity,
            side="double",
        )

    def _add_arrow(self, node: str) -> viser.ArrowsHandle:
        return self._server.scene.add_arrows(
            node,
            np.zeros((1, 2, 3)),
            ARROW_COLOUR,
            shaft_radius=8e-4,
            head_radius=2e-3,
            head_length=4e-3,
            visible=False,
        )

    def _look(self, postures: Sequence[Posture]) -> None:
        """Begin with a view of everything, as it starts."""
        corners = self._scene.corners(self._poses)
        low, high = corners.min(axis=0), corners.max(axis=0)
        middle, size = (low + high) / 2.0, float((high - low).max())
        later = [self._scene.corners(self._scene.placement.poses(posture)) for posture in postures]
        seen, camera = _from(np.concatenate([corners, *later])), self._server.initial_camera
        camera.position, camera.look_at = seen.position, seen.looks_at
        camera.fov, camera.near = CAMERA_ANGLE, 0.01 * seen.distance
        cell = 10.0 ** float(np.round(np.log10(GRID_CELLS * size)))
        self._server.scene.add_grid(
            "/ground",
            width=GROUND * size,
            height=GROUND * size,
            cell_size=cell,
            section_size=10.0 * cell,
            position=(float(middle[0]), float(middle[1]), float(low[2])),
        )

    def _look_at(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        """Bring the camera of whoever asked for it to everything, or near to the fingertips."""
        client = event.client
        if client is None:
            return
        poses = self._poses  # as last drawn: a placement is for one thread
        if event.target.value == _FROM_AFAR:
            seen = _from(self._scene.corners(poses))
        else:
            tips = np.array([poses[body].position for body in self._scene.fingers])
            seen = _from(np.concatenate([tips - NEAR_CONTACT, tips + NEAR_CONTACT]))
        with client.atomic():
            client.camera.position, client.camera.look_at = seen.position, seen.looks_at
            client.camera.near = 0.01 * seen.distance

    def _move(self, frames: Frames) -> None:
        index = len(frames) - 1
        self._poses = poses = self._scene.placement.poses(frames.posture(index))
        for body, node in self._bodies.items():
            node.position, node.wxyz = poses[body].position, quat_wxyz(poses[body].rotation)
        for i, (arrow, body) in enumerate(zip(self._arrows, self._scene.fingers, strict=True)):
            contact, pose = frames.finger(i), poses[body]
            fx, fy, fz = contact.force[index].tolist()
            force = rotate(pose.rotation, (fx, fy, fz))
            shown = bool(contact.touching[index]) and norm(force) > WEAKEST
            if shown:
                x, y, z = contact.centroid[index].tolist()
                start = add(pose.position, rotate(pose.rotation, (x, y, z)))
                # browsers move nodes at once, as the bodies, but make new points into meshes later
                arrow.position = start
                arrow.points = np.array([[ZERO, scale(ARROW_LENGTH, force)]], np.float32)
            if shown != arrow.visible:
                arrow.visible = shown

    def _draw_map(self, touched: TouchMap) -> None:
        """Send the chunks that have grown; all of them if colours or points changed."""
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


def _from(points: FloatArray) -> Framing:
    return framing(points, CAMERA_DIRECTION, CAMERA_ANGLE, CAMERA_ASPECT, CAMERA_ROOM)


def quat_wxyz(rotation: FloatArray | Matrix) -> FloatArray:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix (3, 3)."""
    return np.asarray(transforms.SO3.from_matrix(np.asarray(rotation)).wxyz, dtype=np.float64)


def _with_room(bounds: tuple[float, float]) -> tuple[float, float]:
    """Bounds with half of their extent more on each side, lest colours change with every new point."""
    room = 0.5 * max(bounds[1] - bounds[0], 1e-3)
    return bounds[0] - room, bounds[1] + room


def _numbers(frames: Frames, touched: TouchMap | None, plan: PlanDrawing) -> str:
    """The last period in numbers, as HTML; nothing in it was typed by anybody."""
    last = len(frames) - 1
    parts = [f"t = {frames.time[last]:.2f} s", frames.phase(last).value]
    contacts = [frames.finger(i) for i in range(frames.layout.fingers)]
    forces = [f"{its.normal_force[last]:.2f} N" for its in contacts if its.touching[last]]
    parts += forces or ["no contact"]
    if touched is not None:
        parts.append(f"{len(touched)} map points")
    parts += [f"{count} x {event}" for event, count in plan.events.items() if count]
    return _PADDED.format(" &middot; ".join(parts))
