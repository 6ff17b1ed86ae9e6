"""A simulated arm by itself, under control at 1 kHz."""

import mujoco
import numpy as np

from palpate.sim.carriers.arm_drive import ArmDrive
from palpate.spatial import ZERO


class ArmRun:
    """An arm under control.

    Attributes:
        joint_speed: Fastest motion of each joint in any time step so far [rad/s, m/s].
    """

    def __init__(self, model, arm):
        self.model, self.data = model, mujoco.MjData(model)
        self.drive, self.kinematics = ArmDrive(arm, model, self.data, 1e-3), arm.kinematics
        self.drive.start()
        self.speeds = [each.speed for each in arm.model.arm.limits]
        self.joint_speed = np.zeros(len(self.speeds))

    def period(self, velocity=ZERO, angular_velocity=ZERO):
        self.drive.begin(tuple(velocity), tuple(angular_velocity))
        motion = self.drive.reference.motion
        for _ in range(self.drive.steps):
            self.drive.advance()
            mujoco.mj_step(self.model, self.data)
            self.joint_speed = np.maximum(self.joint_speed, np.abs(self.data.qvel))
        assert np.all(np.abs(motion.joint_velocity) <= self.speeds)
        return motion

    def go(self, periods, velocity=ZERO, angular_velocity=ZERO):
        for _ in range(periods):
            motion = self.period(velocity, angular_velocity)
        return motion

    def check_speeds(self):
        """Check that no joint has been faster than it may be."""
        assert np.all(self.joint_speed <= self.speeds)

    @property
    def tip(self):
        return self.kinematics.pose(self.data.qpos.tolist())
