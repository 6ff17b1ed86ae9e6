"""A hand around what it holds, seen from the object's frame."""

from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.sim.hand.exploring_finger import EXPLORING
from palpate.sim.hand.hand import finger_name
from palpate.sim.hand.scene import OBJECT
from palpate.sim.render.place import ScenePlacement

_TIP = f"{finger_name(EXPLORING)}_tip"


class HeldPlacement:
    """Places a scene whose samples are those of an `ExploringFinger`: the object is the base frame.

    Attributes:
        start: Where everything starts.
        scene: The same as it is simulated.
    """

    def __init__(self, scene: ScenePlacement) -> None:
        """Take the scene as it is simulated."""
        self.scene = scene
        poses = scene.poses(scene.start)
        self._pose_start_world = poses[OBJECT].inverse()
        self.start = Posture(self._pose_start_world @ poses[_TIP], (), scene.start.hand, ())

    def in_scene(self, posture: Posture) -> Posture:
        """Return a posture as the simulated scene has it."""
        return Posture(self.scene.start.pose_base_tip, (), posture.hand)

    def poses(self, posture: Posture) -> dict[str, Pose]:
        """Return pose_base_body of every body that moves in the scene, by name.

        Raises:
            InvalidValueError: The posture has other joints.
        """
        found = self.scene.poses(self.in_scene(posture))
        pose_base_world = posture.pose_base_tip @ found[_TIP].inverse()
        return {name: pose_base_world @ pose for name, pose in found.items()} | {OBJECT: Pose()}

    def pose_of(self, body: str) -> Pose:
        """Return where a body is that does not move in the scene: as at the start, but for micrometres."""
        return self._pose_start_world @ self.scene.pose_of(body)
