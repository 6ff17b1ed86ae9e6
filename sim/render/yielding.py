"""What is touched and hangs on one joint: where the joint is, from where the body is."""

import math
from collections.abc import Collection, Iterator

import mujoco
import numpy as np

from palpate.errors import FloatArray
from palpate.kinematics import Pose
from palpate.sim.render.parts import ancestors
from palpate.sim.scene import OBJECT_GEOM

_KINDS = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


class YieldingBody:
    """A body that one hinge or slide carries, its start remembered.

    Attributes:
        body: Its number.
        address: Of the joint's position among all positions.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, joint: int, body: int) -> None:
        """Take a scene where it starts.

        Args:
            model: The scene.
            data: Its kinematics, computed.
            joint: That carries the body.
            body: That is touched.
        """
        self.body, self.address = body, int(model.jnt_qposadr[joint])
        self._turns = int(model.jnt_type[joint]) == _KINDS[0]
        self._start, self._axis = float(data.qpos[self.address]), data.xaxis[joint].copy()
        self._position, self._rotation = data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy()

    def joint_position(self, pose: Pose) -> float:
        """Return where the joint is while the body is there [rad, or m if it slides]; turns from -pi to pi."""
        if not self._turns:
            return self._start + float(self._axis @ (np.array(pose.position) - self._position))
        turned: FloatArray = np.array(pose.rotation) @ self._rotation.T
        skew = turned - turned.T
        sine = 0.5 * float(self._axis @ [skew[2, 1], skew[0, 2], skew[1, 0]])
        return self._start + math.atan2(sine, 0.5 * (float(np.trace(turned)) - 1.0))


def yielding_bodies(model: mujoco.MjModel, data: mujoco.MjData, driven: Collection[str]) -> Iterator[YieldingBody]:
    """Find the touched body, if one hinge or slide that is not driven is all that carries it.

    Args:
        model: The scene.
        data: Its kinematics, computed, where it starts.
        driven: Names of joints with a prescribed motion.
    """
    geom = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, OBJECT_GEOM))
    if geom < 0:
        return
    body = int(model.geom_bodyid[geom])
    carrying = set(ancestors(model, body))
    joints = [j for j in range(model.njnt) if int(model.jnt_bodyid[j]) in carrying]
    if len(joints) == 1 and int(model.jnt_type[joints[0]]) in _KINDS and model.joint(joints[0]).name not in driven:
        yield YieldingBody(model, data, joints[0], body)
