"""What there is to see of a simulated scene, from its compiled model."""

from collections.abc import Mapping

import mujoco
import numpy as np

from palpate.kinematics import Pose
from palpate.sim.hand.scene import FIXTURE, OBJECT
from palpate.sim.hand.touched import TOUCHED
from palpate.sim.objects.motion import Motion
from palpate.sim.render.held import HeldPlacement
from palpate.sim.render.parts import Role, finger_bodies
from palpate.sim.render.place import ScenePlacement
from palpate.sim.render.shapes import DEFAULT_COLOUR, Shape, shapes_of
from palpate.sim.render.tool import ToolPlacement
from palpate.viewing import BASE, Part, ViewScene

COLOURS = {
    Role.TIP: (230, 159, 0),
    Role.OBJECT: (86, 180, 233),
    Role.MACHINE: (150, 156, 164),
    Role.GROUND: (215, 218, 222),
}
"""RGB, of the palette of Okabe and Ito, and greys; an object that was given a colour keeps it."""

Placed = ScenePlacement | HeldPlacement | ToolPlacement

OPACITY = {Role.TIP: 0.6, Role.OBJECT: 0.35, Role.MACHINE: 1.0, Role.GROUND: 1.0}
"""Contact and map lie on what would hide them."""


def scene_view(
    title: str,
    model: mujoco.MjModel,
    map_spacing: float | None = None,
    motions: Mapping[str, Motion] | None = None,
) -> ViewScene:
    """Return what there is to see of a scene.

    Args:
        title: For people.
        model: The scene, with a tip or a hand.
        map_spacing: See `ViewScene`.
        motions: Of driven joints, by name; for a `MovingTarget` of name n, `n_0`, `n_1`, ...

    Raises:
        InvalidValueError: The scene has neither tip nor hand.
    """
    scene = ScenePlacement(model, motions)
    scene.place(scene.start)
    placement, fingers = _placed(scene), finger_bodies(model)
    if isinstance(placement, ToolPlacement):
        fingers = (OBJECT, *fingers)  # in the order of the samples' wrenches
    parts = tuple(_part(shape, placement) for shape in shapes_of(model))
    return ViewScene(title, parts, placement, fingers, map_spacing)


def _placed(scene: ScenePlacement) -> Placed:
    model = scene.model
    if all(model.equality(i).name != FIXTURE for i in range(model.neq)):
        return scene
    touches = any(model.body(i).name == TOUCHED for i in range(model.nbody))
    return ToolPlacement(scene) if touches else HeldPlacement(scene)


def _part(shape: Shape, placement: Placed) -> Part:
    colour, opacity = COLOURS[shape.role], OPACITY[shape.role]
    if shape.role is Role.OBJECT and shape.colour != DEFAULT_COLOUR:
        red, green, blue = (round(255.0 * channel) for channel in shape.colour[:3])
        colour, opacity = (red, green, blue), opacity * shape.colour[3]
    ground = shape.role is Role.GROUND
    if shape.moves:
        return Part(shape.vertices, shape.triangles, colour, shape.body, opacity, ground)
    pose: Pose = placement.pose_of(shape.body)
    fixed = shape.vertices @ np.array(pose.rotation).T + np.array(pose.position)
    return Part(np.asarray(fixed), shape.triangles, colour, BASE, opacity, ground)
