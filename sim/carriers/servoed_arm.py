"""A serial arm in a scene, its joints held by position servos.

What the controllers of real arms feed forward is fed forward here as well: gravity (of the links and, once set, of
the tip), and the velocity of the reference, so that a ramp is followed without lag. A motor's torque, gravity
included, ends at its limit. The arm touches nothing: what it looks like is only seen.
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from palpate.errors import FloatArray, positive
from palpate.kinematics import ArmKinematics, FollowingErrorLimit, Pose
from palpate.kinematics.pose import checked_pose
from palpate.sim.carriers.arm_model import ArmModel, quat_wxyz
from palpate.sim.carriers.carriage import add_position_servo
from palpate.spatial import Vector

FLANGE = "flange"
"""Name of the body whose frame is the tip frame."""

PREFIX = "arm/"
"""Of all names that come from the arm's own model."""


@dataclass(frozen=True, slots=True)
class ServoedArm:
    """An arm with a tip on its flange, driven by position servos.

    Attributes:
        model: The arm.
        pose_base_robot: Where it stands in the scene.
        pose_flange_tip: Where the tip frame sits on its flange.
        bandwidth: Natural frequency of the servos where the arm is heaviest [rad/s]; elsewhere they are stiffer
            than they need be, and more than critically damped.
        following_error_limit: How far the reference may run ahead: bounds the force against an obstacle.
    """

    model: ArmModel
    pose_base_robot: Pose = field(default_factory=Pose)
    pose_flange_tip: Pose = field(default_factory=Pose)
    bandwidth: float = 100.0
    following_error_limit: FollowingErrorLimit = field(default_factory=FollowingErrorLimit)

    def __post_init__(self) -> None:
        checked_pose("pose_base_robot", self.pose_base_robot)
        checked_pose("pose_flange_tip", self.pose_flange_tip)
        positive("bandwidth", self.bandwidth, "rad/s")

    @property
    def kinematics(self) -> ArmKinematics:
        """Of the arm as it stands, tip included."""
        return ArmKinematics(self.model.arm, self.pose_base_robot, self.pose_flange_tip)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of joints and of their servos in the scene."""
        return tuple(PREFIX + name for name in self.model.joints)

    @property
    def lead(self) -> float:
        """2 / bandwidth [s]: by how much of its velocity a reference is led, lest the damping delay it.

        A servo k (u - q) - d q' with d = 2 k / bandwidth follows u = reference + lead * its rate without lag.
        """
        return 2.0 / self.bandwidth

    @property
    def stiffness(self) -> tuple[float, ...]:
        """Of the servos [N m/rad or N/m]: (armature + link inertia) bandwidth^2, critically damped."""
        inertias = zip(self.model.armature, self.model.link_inertia, strict=True)
        return tuple((rotor + links) * self.bandwidth**2 for rotor, links in inertias)

    def tip_compliance(self, joint_position: tuple[float, ...]) -> FloatArray:
        """Return J K^-1 J' [m/N, rad/(N m), ...], shape (6, 6): how the tip yields to a wrench at rest.

        About the tip frame's origin, in base coordinates.
        """
        J = self.kinematics.jacobian(joint_position)
        result: FloatArray = (J / np.array(self.stiffness)) @ J.T
        return result

    def push(self, joint_position: tuple[float, ...], direction: Vector) -> float:
        """Return the force on a wall without friction, at rest at the following-error limit [N].

        The wall takes up a force f along the wanted direction n, and no moment: the tip yields by f n.C n ahead,
        with C the upper left block of `tip_compliance`. The motors' torque limits may end it earlier.

        Args:
            joint_position: Where [rad or m].
            direction: In which it is wanted to move, base coordinates; a unit vector.
        """
        n, C = np.array(direction), self.tip_compliance(joint_position)[:3, :3]
        return float(self.following_error_limit.distance / (n @ C @ n))

    def add_to(self, spec: mujoco.MjSpec, joint_start: tuple[float, ...]) -> mujoco.MjsBody:
        """Add arm and servos to a scene; returns the body on the flange whose frame is the tip frame.

        The model's own reference state (`qpos0`, to which a reset leads) is `joint_start`, and with it what MuJoCo
        derives from that: the tip's `body_invweight0` is the one at the start.

        What is put on the returned body is not lifted yet: see `palpate.sim.carriers.carriage.lift_load`.

        Args:
            spec: The scene.
            joint_start: Where the arm starts [rad or m].

        Raises:
            InvalidValueError: Not one position per joint, each within its joint's range.
        """
        model = self.model
        alone = model.spec_at(model.arm.joint_position("joint_start", joint_start))
        alone.option = spec.option  # the scene's count, not those of the arm's file
        stand = self.pose_base_robot
        frame = spec.worldbody.add_frame(pos=stand.position, quat=quat_wxyz(stand.rotation))
        spec.attach(alone, prefix=PREFIX, frame=frame)
        for name, stiffness in zip(self.joints, self.stiffness, strict=True):
            add_position_servo(spec, name, stiffness, stiffness * self.lead)
        tip = model.pose_body_flange @ self.pose_flange_tip
        return spec.body(PREFIX + model.flange).add_body(
            name=FLANGE, pos=tip.position, quat=quat_wxyz(tip.rotation)
        )
