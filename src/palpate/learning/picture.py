"""Pictures of a world while an agent moves in it."""

import numpy as np
import numpy.typing as npt

from palpate.errors import InvalidValueError
from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.runtime import Backend, Observation
from palpate.runtime.closing import Closing
from palpate.sim.render.renderer import ContactForce, SceneRenderer
from palpate.sim.scene import Scene
from palpate.spatial import add, rotate


class WorldPicture(Closing):
    """Draws the scene behind a back end, and the force that is felt."""

    def __init__(self, backend: Backend) -> None:
        """Prepare; takes some 100 ms.

        Raises:
            InvalidValueError: There is no scene: the robot is real.
            NoRendererError: This machine cannot draw off screen.
        """
        scene = getattr(backend, "scene", None)
        if not isinstance(scene, Scene):
            raise InvalidValueError(
                f"backend is a {type(backend).__name__}: it has no scene to draw; take a simulated one"
            )
        self._renderer = SceneRenderer(scene.model)

    def draw(self, now: Observation) -> npt.NDArray[np.uint8]:
        """Return the picture of an observation, shape (height, width, 3)."""
        arm, finger = now.arm, now.fingers[0]
        posture = Posture(Pose(arm.position_base_tip, arm.rotation_base_tip), arm.joint_position, time=now.time)
        forces = []
        if finger.touching:
            rotation, contact = arm.rotation_base_tip, finger.contact
            point = add(arm.position_base_tip, rotate(rotation, contact.centroid.tolist()))
            forces = [ContactForce(point, rotate(rotation, contact.force.tolist()))]
        return self._renderer.picture(posture, forces)

    def close(self) -> None:
        """See `Closing`."""
        self._renderer.close()
