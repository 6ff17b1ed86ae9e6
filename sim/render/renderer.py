"""Pictures of a MuJoCo scene without a screen, with the contact force drawn in."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.kinematics import Pose
from palpate.kinematics.framing import framing
from palpate.kinematics.posture import Posture
from palpate.runtime import palette
from palpate.runtime.closing import Closing
from palpate.sim.hand.mount import PALM
from palpate.sim.render.gl import offscreen_context
from palpate.sim.render.palm import THICKNESS, PalmDisc, palm_disc
from palpate.sim.render.parts import Role, roles_of
from palpate.sim.render.place import ScenePlacement
from palpate.sim.render.shapes import DEFAULT_COLOUR, shapes_of
from palpate.spatial import Vector, add_scaled, norm

Figure = npt.NDArray[np.uint8]
"""Rows from above, shape (height, width, 3), RGB."""

MAX_PIXELS = 4096
"""Largest side of a picture: drivers take at least this (OpenGL 3's usual GL_MAX_RENDERBUFFER_SIZE)."""

ARROW_LENGTH = 0.015
"""Length of an arrow per force [m/N]: at 2 N it sticks out of an 8 mm fingertip."""

ARROW_RADIUS = 0.0012
"""Of the arrow's shaft [m]."""

WEAKEST = 0.01
"""Forces below this are not drawn [N]: an arrow of a fifth of a millimetre."""

COLOURS = {
    Role.TIP: (0.90, 0.62, 0.0, 1.0),
    Role.OBJECT: (0.34, 0.71, 0.91, 1.0),
    Role.MACHINE: (0.59, 0.61, 0.64, 1.0),
    Role.GROUND: (0.86, 0.87, 0.88, 1.0),
}
"""RGBA, of the palette of Okabe and Ito, and greys; an object that was given a colour keeps it."""

_RED, _GREEN, _BLUE = (part / 255.0 for part in palette.rgb(palette.FELT))
ARROW_COLOUR = (_RED, _GREEN, _BLUE, 1.0)
"""Of a force that is felt, as in reports and in the browser."""

CAMERA_ROOM = 1.2
"""Around what is in view."""

WIDTH, HEIGHT = 640, 480
"""Of pictures, if nobody says [pixels]."""

AMBIENT, DIFFUSE = 0.4, 0.6
"""Of the light beside the camera, 0 to 1; MuJoCo's own 0.1 and 0.4 leave blue almost black."""

GROUND = (245, 246, 248)
"""RGB where nothing is."""

_SPARE_GEOMS = 100
"""Room in the drawn scene beyond the model's own geoms: arrows, a palm."""


@dataclass(frozen=True, slots=True)
class Camera:
    """Where pictures are taken from.

    Attributes:
        looks_at: Middle of the picture, base frame [m].
        distance: From there [m].
        azimuth_deg: Direction in which it looks, seen from above; 90 along y.
        elevation_deg: Negative when it looks down.
    """

    looks_at: Vector
    distance: float
    azimuth_deg: float = 125.0
    elevation_deg: float = -25.0

    def __post_init__(self) -> None:
        positive("distance", self.distance, "m")


@dataclass(frozen=True, slots=True)
class ContactForce:
    """A force to draw.

    Attributes:
        point: Where it acts, base frame [m].
        force: What the object exerts on the finger, base frame [N].
    """

    point: Vector
    force: Vector


def camera_on(
    model: mujoco.MjModel,
    placement: ScenePlacement,
    postures: Sequence[Posture] = (),
    aspect: float = WIDTH / HEIGHT,
    azimuth_deg: float = 125.0,
    elevation_deg: float = -25.0,
) -> Camera:
    """Return a camera that has a whole scene in view; the ground may reach beyond.

    Args:
        model: The scene.
        placement: Of its bodies.
        postures: In which it is to be in view, besides how it starts.
        aspect: Width of the picture over its height.
        azimuth_deg: See `Camera`.
        elevation_deg: Likewise, not vertical.
    """
    shapes, corners = [shape for shape in shapes_of(model) if shape.role is not Role.GROUND], []
    for posture in (placement.start, *postures):
        data = placement.place(posture)
        for shape in shapes:
            body = data.body(shape.body)
            corners.append(shape.vertices @ body.xmat.reshape(3, 3).T + body.xpos)
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    level = math.cos(elevation)
    towards = (-level * math.cos(azimuth), -level * math.sin(azimuth), -math.sin(elevation))
    points = np.concatenate(corners) if corners else np.zeros((1, 3))
    seen = framing(points, towards, math.radians(model.vis.global_.fovy), aspect, CAMERA_ROOM)
    return Camera(seen.looks_at, seen.distance, azimuth_deg, elevation_deg)


class SceneRenderer(Closing):
    """Draws a scene in given postures. Use it as a context manager, from one thread."""

    def __init__(
        self,
        model: mujoco.MjModel,
        width: int = WIDTH,
        height: int = HEIGHT,
        camera: Camera | None = None,
        placement: ScenePlacement | None = None,
    ) -> None:
        """Prepare; takes some 100 ms.

        Args:
            model: The scene; stays as it is.
            width: Of the pictures [pixels].
            height: Likewise.
            camera: Where to look from; the whole scene if not given.
            placement: Of this model's bodies; needed where some have a prescribed motion.

        Raises:
            NoRendererError: This machine cannot draw off screen.
            InvalidValueError: The size is impossible.
        """
        for name, pixels in (("width", width), ("height", height)):
            if not 1 <= pixels <= MAX_PIXELS:
                raise InvalidValueError(f"{name} = {pixels}: must be from 1 to {MAX_PIXELS} pixels")
        self._model, self._placement = model, placement or ScenePlacement(model)
        self._roles, self._palm = roles_of(model), palm_disc(model)
        self._gl = offscreen_context(width, height)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        mujoco.mjr_resizeOffscreen(width, height, self._context)
        self._scene = mujoco.MjvScene(model, model.ngeom + _SPARE_GEOMS)
        self._option, self._camera = (
            mujoco.MjvOption(),
            _mujoco_camera(camera or camera_on(model, self._placement, aspect=width / height)),
        )
        self._viewport = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), np.uint8)
        self._depth = np.empty((height, width), np.float32)
        self._closed = False

    def picture(self, posture: Posture, forces: Sequence[ContactForce] = ()) -> Figure:
        """Draw the scene.

        Args:
            posture: Where everything is; of a stage, only the tip's position counts.
            forces: The contact forces to draw: one per finger that touches.

        Raises:
            InvalidValueError: It is closed, or has other joints or bodies.
        """
        if self._closed:
            raise InvalidValueError("the renderer is closed: make a new one")
        self._gl.make_current()
        data = self._placement.place(posture)
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, data, self._option, None, self._camera, everything, self._scene)
        self._colour()
        self._light()
        if self._palm is not None:
            self._add_palm(self._palm)
        for force in forces:
            if norm(force.force) > WEAKEST:
                self._add_arrow(force)
        mujoco.mjr_render(self._viewport, self._scene, self._context)
        mujoco.mjr_readPixels(self._pixels, self._depth, self._viewport, self._context)
        picture = self._pixels.copy()
        # what lets light through leaves no depth, but colour
        picture[(self._depth >= 1.0) & ~self._pixels.any(axis=2)] = GROUND
        return np.ascontiguousarray(picture[::-1])  # OpenGL counts rows from below

    def close(self) -> None:
        """Give the context back; may be called more than once."""
        if not self._closed:
            self._closed = True
            self._gl.make_current()
            self._context.free()
            self._gl.free()

    def _colour(self) -> None:
        """Give everything its colour; the model keeps its own."""
        for i in range(self._scene.ngeom):
            geom = self._scene.geoms[i]
            if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM or geom.objid < 0:
                continue
            role = self._roles[geom.objid]
            if role is not Role.OBJECT or tuple(self._model.geom_rgba[geom.objid].tolist()) == DEFAULT_COLOUR:
                geom.rgba[:] = COLOURS[role]

    def _light(self) -> None:
        for light in self._scene.lights[: self._scene.nlight]:
            if light.headlight:
                light.ambient[:], light.diffuse[:] = AMBIENT, DIFFUSE

    def _add_arrow(self, force: ContactForce) -> None:
        kind = mujoco.mjtGeom.mjGEOM_ARROW
        arrow = self._add(kind, np.zeros(3), np.zeros(3), np.eye(3), ARROW_COLOUR)
        if arrow is None:
            return
        end = add_scaled(force.point, ARROW_LENGTH, force.force)
        mujoco.mjv_connector(arrow, kind, ARROW_RADIUS, np.array(force.point), np.array(end))
        arrow.size[2] *= 2.0  # mjv_connector takes it for a half length, the arrow is drawn once as long (4.0)

    def _add_palm(self, disc: PalmDisc) -> None:
        pose = self._placement.pose_of(PALM) @ Pose((0.0, 0.0, disc.middle))
        size = np.array([disc.radius, 0.5 * THICKNESS, 0.0])  # as a model's geom has it
        kind, colour = mujoco.mjtGeom.mjGEOM_CYLINDER, COLOURS[Role.MACHINE]
        self._add(kind, size, np.array(pose.position), np.array(pose.rotation), colour)

    def _add(
        self,
        kind: mujoco.mjtGeom,
        size: FloatArray,
        position: FloatArray,
        rotation: FloatArray,
        colour: tuple[float, float, float, float],
    ) -> mujoco.MjvGeom | None:
        """Add what is not in the model; None where there is no room."""
        scene = self._scene
        if scene.ngeom >= scene.maxgeom:
            return None
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, kind, size, position, rotation.ravel(), np.array(colour, np.float32))
        scene.ngeom += 1
        return geom


def _mujoco_camera(camera: Camera) -> mujoco.MjvCamera:
    found = mujoco.MjvCamera()
    found.type = mujoco.mjtCamera.mjCAMERA_FREE
    found.lookat[:] = camera.looks_at
    found.distance, found.azimuth, found.elevation = camera.distance, camera.azimuth_deg, camera.elevation_deg
    return found
