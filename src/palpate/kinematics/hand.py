"""Poses of a hand's fingertips, from its joint positions."""

from typing import Protocol

from palpate.kinematics.pose import Pose


class HandKinematics(Protocol):
    """A hand's geometry: all that a controller needs to bring what the fingers feel into one frame."""

    def sensor_poses(self, joint_position: tuple[float, ...]) -> tuple[Pose, ...]:
        """Return where each finger's sensor frame is in the hand frame, `pose_hand_sensor`, one per finger.

        Args:
            joint_position: As `HandSample.joint_position` has it [rad, or m if a joint slides].
        """
        ...
