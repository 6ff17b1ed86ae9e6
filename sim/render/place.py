"""A scene put where a recorded sample says that it was: geometry alone, nothing is simulated."""

import mujoco
import numpy as np

from palpate.errors import InvalidValueError
from palpate.sim.tip import SENSOR_SITE
from palpate.spatial import Vector

_SLIDES, _HINGES = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE


class ScenePlacement:
    """Moves what carries the tip: the joints of an arm, or the slides of a stage.

    Attributes:
        fixed_bodies: Numbers of the bodies that never move.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        """Take a scene; joints are those between the base and the tip, in order."""
        self._model, self._data = model, mujoco.MjData(model)
        body, chain = int(model.site(SENSOR_SITE).bodyid[0]), []
        while body:
            chain.append(body)
            body = int(model.body_parentid[body])
        joints = [j for body in reversed(chain) for j in range(model.njnt) if model.jnt_bodyid[j] == body]
        self._slides = [j for j in joints if mujoco.mjtJoint(int(model.jnt_type[j])) == _SLIDES]
        self._hinges = [j for j in joints if mujoco.mjtJoint(int(model.jnt_type[j])) == _HINGES]
        self.fixed_bodies = frozenset(body for body in range(model.nbody) if not model.body_weldid[body])
        mujoco.mj_kinematics(model, self._data)
        self._start = self._data.site(SENSOR_SITE).xpos.copy()

    def place(self, position: Vector, joint_position: tuple[float, ...] = ()) -> mujoco.MjData:
        """Return the scene with its tip there; the same data every time.

        Args:
            position: Origin of the tip frame, base frame [m]; an arm is where its joints say.
            joint_position: Of the arm [rad]; empty for a stage.

        Raises:
            InvalidValueError: The scene has other joints.
        """
        data, model = self._data, self._model
        if len(joint_position) != len(self._hinges):
            raise InvalidValueError(
                f"joint_position has {len(joint_position)} entries: this scene's tip hangs on {len(self._hinges)} "
                "turning joints"
            )
        for joint, angle in zip(self._hinges, joint_position, strict=True):
            data.qpos[model.jnt_qposadr[joint]] = angle
        if self._slides:
            axes = np.array([model.jnt_axis[j] for j in self._slides])
            along = axes @ (np.array(position) - self._start)
            for joint, distance in zip(self._slides, along, strict=True):
                data.qpos[model.jnt_qposadr[joint]] = distance
        mujoco.mj_kinematics(model, data)
        # where lights and cameras are: mjv_updateScene needs them
        mujoco.mj_camlight(model, data)
        return data
