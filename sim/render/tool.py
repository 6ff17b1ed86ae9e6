"""A hand with a tool, seen by the tool: its frame is the tip frame of the samples."""

import numpy as np

from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.sim.hand.mount import PALM
from palpate.sim.hand.scene import OBJECT
from palpate.sim.render.parts import finger_bodies
from palpate.sim.render.place import ScenePlacement
from palpate.spatial import as_vector


class ToolPlacement:
    """Places a scene whose samples are those of a `GraspedTool`: the tool has not moved in the hand.

    Attributes:
        start: Where everything starts.
        scene: The same as it is simulated.
    """

    def __init__(self, scene: ScenePlacement) -> None:
        """Take the scene as it is simulated."""
        self.scene = scene
        tip = scene.poses(scene.start)[OBJECT]
        self.start = Posture(tip, scene.start.arm, scene.start.hand, ())

    def in_scene(self, posture: Posture) -> Posture:
        """Return a posture as the simulated scene has it."""
        start, model = self.scene.start, self.scene.model
        found = self.scene.poses(Posture(start.pose_base_tip, start.arm, posture.hand))
        tips = [(found[name] @ Pose(as_vector(model.body(name).ipos))).position for name in finger_bodies(model)]
        pose_tip_palm = Pose(as_vector(np.mean(tips, axis=0))).inverse() @ found[PALM]
        tip = posture.pose_base_tip
        return Posture(tip @ pose_tip_palm, posture.arm, posture.hand, (tip,))

    def poses(self, posture: Posture) -> dict[str, Pose]:
        """Return pose_base_body of every body that moves in the scene, by name.

        Raises:
            InvalidValueError: The posture has other joints.
        """
        return self.scene.poses(self.in_scene(posture))

    def pose_of(self, body: str) -> Pose:
        """Return where a body is that does not move."""
        return self.scene.pose_of(body)
