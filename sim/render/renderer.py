"""Pictures of a MuJoCo scene without a screen, with the contact force drawn in."""

from dataclasses import dataclass
from types import TracebackType
from typing import Self

import mujoco
import numpy as np
import numpy.typing as npt

from palpate.errors import InvalidValueError, positive
from palpate.sim.render.gl import offscreen_context
from palpate.sim.render.place import ScenePlacement
from palpate.sim.tip import TIP_GEOM
from palpate.spatial import Vector, add_scaled, norm

Picture = npt.NDArray[np.uint8]
"""Rows from above, shape (height, width, 3), RGB."""

MOST_PIXELS = 4096
"""Largest side of a picture: drivers take at least this (OpenGL 3's usual GL_MAX_RENDERBUFFER_SIZE)."""

ARROW_LENGTH = 0.015
"""Length of an arrow per force [m/N]: at 2 N it sticks out of an 8 mm fingertip."""

ARROW_RADIUS = 0.0012
"""Of the arrow's shaft [m]."""

WEAKEST = 0.01
"""Forces below this are not drawn [N]: an arrow of a fifth of a millimetre."""

TIP_COLOUR, OBJECT_COLOUR, ARROW_COLOUR = (0.90, 0.62, 0.0, 1.0), (0.34, 0.71, 0.91, 1.0), (0.84, 0.37, 0.0, 1.0)
"""RGBA, of the palette of Okabe and Ito."""

CAMERA_DISTANCE = 1.5
"""Of the camera from the middle of a scene, over the scene's extent: all in view at MuJoCo's 45 degrees."""

AMBIENT, DIFFUSE = 0.4, 0.6
"""Of the light beside the camera, 0 to 1; MuJoCo's own 0.1 and 0.4 leave blue almost black."""

GROUND = (245, 246, 248)
"""RGB where nothing is."""

_SPARE_GEOMS = 100
"""Room in the drawn scene beyond the model's own geoms: arrows."""


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


def camera_on(model: mujoco.MjModel) -> Camera:
    """Return a camera that has a whole scene in view."""
    x, y, z = model.stat.center.tolist()
    return Camera((x, y, z), CAMERA_DISTANCE * float(model.stat.extent))


class SceneRenderer:
    """Draws a scene at given places of its tip. Use it as a context manager, from one thread."""

    def __init__(
        self, model: mujoco.MjModel, width: int = 640, height: int = 480, camera: Camera | None = None
    ) -> None:
        """Prepare; takes some 100 ms.

        Args:
            model: The scene; stays as it is.
            width: Of the pictures [pixels].
            height: Likewise.
            camera: Where to look from; the whole scene if not given.

        Raises:
            NoRendererError: This machine cannot draw off screen.
            InvalidValueError: The size is impossible.
        """
        for name, pixels in (("width", width), ("height", height)):
            if not 1 <= pixels <= MOST_PIXELS:
                raise InvalidValueError(f"{name} = {pixels}: must be from 1 to {MOST_PIXELS} pixels")
        self._model, self._placement = model, ScenePlacement(model)
        self._gl = offscreen_context(width, height)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        mujoco.mjr_resizeOffscreen(width, height, self._context)
        self._scene = mujoco.MjvScene(model, model.ngeom + _SPARE_GEOMS)
        self._option, self._camera = mujoco.MjvOption(), _mujoco_camera(camera or camera_on(model))
        self._viewport = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), np.uint8)
        self._depth = np.empty((height, width), np.float32)
        self._closed = False

    def picture(
        self, position: Vector, joint_position: tuple[float, ...] = (), force: ContactForce | None = None
    ) -> Picture:
        """Draw the scene.

        Args:
            position: Origin of the tip frame, base frame [m]; an arm is where its joints say.
            joint_position: Of the arm [rad]; empty for a stage.
            force: The contact force, if there is one to draw.

        Raises:
            InvalidValueError: It is closed, or has other joints.
        """
        if self._closed:
            raise InvalidValueError("the renderer is closed: make a new one")
        self._gl.make_current()
        data = self._placement.place(position, joint_position)
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, data, self._option, None, self._camera, everything, self._scene)
        self._colour()
        self._light()
        if force is not None and norm(force.force) > WEAKEST:
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

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close, whatever happened."""
        self.close()

    def _colour(self) -> None:
        """Give tip and object their colours; the model keeps its own."""
        for i in range(self._scene.ngeom):
            geom = self._scene.geoms[i]
            if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM or geom.objid < 0:
                continue
            name = self._model.geom(geom.objid).name
            if name == TIP_GEOM:
                geom.rgba[:] = TIP_COLOUR
            elif self._model.geom_bodyid[geom.objid] in self._placement.fixed_bodies:
                geom.rgba[:] = OBJECT_COLOUR

    def _light(self) -> None:
        for light in self._scene.lights[: self._scene.nlight]:
            if light.headlight:
                light.ambient[:], light.diffuse[:] = AMBIENT, DIFFUSE

    def _add_arrow(self, force: ContactForce) -> None:
        scene = self._scene
        if scene.ngeom >= scene.maxgeom:
            return
        arrow = scene.geoms[scene.ngeom]
        kind = mujoco.mjtGeom.mjGEOM_ARROW
        mujoco.mjv_initGeom(
            arrow, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(ARROW_COLOUR, np.float32)
        )
        end = add_scaled(force.point, ARROW_LENGTH, force.force)
        mujoco.mjv_connector(arrow, kind, ARROW_RADIUS, np.array(force.point), np.array(end))
        arrow.size[2] *= 2.0  # mjv_connector takes it for a half length, the arrow is drawn once as long (4.0)
        scene.ngeom += 1


def _mujoco_camera(camera: Camera) -> mujoco.MjvCamera:
    found = mujoco.MjvCamera()
    found.type = mujoco.mjtCamera.mjCAMERA_FREE
    found.lookat[:] = camera.looks_at
    found.distance, found.azimuth, found.elevation = camera.distance, camera.azimuth_deg, camera.elevation_deg
    return found
