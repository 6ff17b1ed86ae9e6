"""Simulated scenes of experiments: their files in a log, and their view."""

from collections.abc import Mapping
from typing import TypeVar

import mujoco
import numpy as np

from palpate.errors import InvalidValueError
from palpate.kinematics import Pose
from palpate.sim.hand.scene import FIXTURE, OBJECT
from palpate.sim.hand.touched import TOUCHED
from palpate.sim.objects.motion import Motion
from palpate.sim.objects.scene_file import SceneFile
from palpate.sim.render.held import HeldPlacement
from palpate.sim.render.parts import Role, finger_bodies
from palpate.sim.render.place import ScenePlacement
from palpate.sim.render.shapes import DEFAULT_COLOUR, Shape, shapes_of
from palpate.sim.render.tool import ToolPlacement
from palpate.viewing import BASE, Part, ViewScene

SCENE_TEXT = "scene.xml"
"""Attachment of a log with the scene file itself."""

SCENE_FILES_TEXT = "scene-files.json"
"""Attachment of a log with the files that the scene refers to: path and content in base64."""

_COLOURS = {
    Role.TIP: (230, 159, 0),
    Role.OBJECT: (86, 180, 233),
    Role.MACHINE: (150, 156, 164),
    Role.GROUND: (215, 218, 222),
}
"""RGB, of the palette of Okabe and Ito, and greys; an object with a colour of its own keeps its colour."""

_OPACITY = {Role.TIP: 0.6, Role.OBJECT: 0.35, Role.MACHINE: 1.0, Role.GROUND: 1.0}
"""Opacity of tip and object leaves contact and map visible behind them."""

_Kind = TypeVar("_Kind", bound=SceneFile)


def scene_attachments(scene: SceneFile) -> dict[str, str]:
    """Return a scene as texts, by file name."""
    return {SCENE_TEXT: scene.text, SCENE_FILES_TEXT: scene.files_text()}


def attached_scene(attachments: Mapping[str, str], kind: type[_Kind]) -> _Kind:
    """Return the scene that a log keeps.

    Args:
        attachments: Texts of the log, by file name.
        kind: Class of the returned scene.

    Raises:
        InvalidValueError: If the log keeps no scene.
    """
    for name in (SCENE_TEXT, SCENE_FILES_TEXT):
        if name not in attachments:
            raise InvalidValueError(f"{name!r} is missing: there are {', '.join(attachments) or 'no files'}")
    return kind.kept(SCENE_TEXT, attachments[SCENE_TEXT], attachments[SCENE_FILES_TEXT])


def scene_view(
    title: str,
    model: mujoco.MjModel,
    map_spacing: float | None = None,
    motions: Mapping[str, Motion] | None = None,
) -> ViewScene:
    """Return the view of a scene.

    Args:
        title: Title of the view.
        model: Scene with a tip or a hand.
        map_spacing: Distance below which points of the map are merged [m], as in `ViewScene`.
        motions: Motions of driven joints, by name; for a `MovingTarget` of name n, `n_0`, `n_1`, ...

    Raises:
        InvalidValueError: If the scene has neither tip nor hand.
    """
    scene = ScenePlacement(model, motions)
    scene.place(scene.start)
    fingers = finger_bodies(model)
    placement: ScenePlacement | HeldPlacement | ToolPlacement = scene
    if any(model.equality(i).name == FIXTURE for i in range(model.neq)):
        if any(model.body(i).name == TOUCHED for i in range(model.nbody)):
            placement = ToolPlacement(scene)
            fingers = (OBJECT, *fingers)  # in the order of the samples' wrenches
        else:
            placement = HeldPlacement(scene)
    parts = tuple(_part(shape, placement.pose_of(shape.body)) for shape in shapes_of(model))
    return ViewScene(title, parts, placement, fingers, map_spacing)


def _part(shape: Shape, pose: Pose) -> Part:
    colour, opacity = _COLOURS[shape.role], _OPACITY[shape.role]
    if shape.role is Role.OBJECT and shape.colour != DEFAULT_COLOUR:
        red, green, blue = (round(255.0 * channel) for channel in shape.colour[:3])
        colour, opacity = (red, green, blue), opacity * shape.colour[3]
    ground = shape.role is Role.GROUND
    if shape.moves:
        return Part(shape.vertices, shape.triangles, colour, shape.body, opacity, ground)
    fixed = shape.vertices @ np.array(pose.rotation).T + np.array(pose.position)
    return Part(np.asarray(fixed), shape.triangles, colour, BASE, opacity, ground)
