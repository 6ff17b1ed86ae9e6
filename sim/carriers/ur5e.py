"""A Universal Robots UR5e made of primitives, with the numbers of `palpate.kinematics.ur5e`.

Every body's frame is the DH frame behind its joint, so that MuJoCo's kinematics are the DH product. Capsules show
the arm; they touch nothing and weigh nothing.

The joints are held by position servos, on top of what the real robot's controller feeds forward as well: gravity
(of the links and, once set, of the tip), and the velocity of the reference, so that a ramp is followed without
lag. A motor's torque, gravity included, ends at its limit.
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.kinematics import UR5E, ArmKinematics, FollowingErrorLimit, Pose
from palpate.kinematics.arm import LinkInertia
from palpate.kinematics.pose import checked_pose
from palpate.sim.carriers.carriage import add_position_servo
from palpate.spatial import Matrix, Vector

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
"""Names of joints and of their servos, as the robot's makers call them."""

LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
"""Names of bodies."""

FLANGE = "flange"

ARMATURE = (1.2, 1.2, 0.8, 0.3, 0.3, 0.2)
"""ASSUMPTION: inertia of rotors and gears as the joints feel it [kg m^2]. The maker publishes none; rotors of some
1e-4 kg m^2 behind gears of about 100:1 give this order. Joint friction is left out for want of numbers."""

LARGEST_LINK_INERTIA = (4.8, 4.6, 0.93, 0.025, 0.006, 0.0003)
"""Largest diagonal entries of the mass matrix over all poses, without armature and tip [kg m^2]: what the links
below are to a joint when the arm is stretched. Computed from the official masses, rounded up; a test checks."""

_CAPSULES: tuple[tuple[Vector, Vector, float], ...] = (
    ((0.0, -0.05, 0.0), (0.0, 0.0, 0.1), 0.06),
    ((0.425, 0.0, 0.11336), (0.0, 0.0, 0.11336), 0.055),
    ((0.3922, 0.0, 0.0265), (0.0, 0.0, 0.0265), 0.045),
    ((0.0, -0.05, 0.0), (0.0, 0.03, 0.0), 0.04),
    ((0.0, 0.05, 0.0), (0.0, -0.03, 0.0), 0.04),
    ((0.0, 0.0, -0.04), (0.0, 0.0, -0.02), 0.035),
)
"""Ends [m, the body's frame] and radius of what is seen of each link: as long as the DH rows say, on the side on
which the centres of mass lie."""


@dataclass(frozen=True, slots=True)
class Ur5e:
    """A UR5e with a tip on its flange, driven by position servos.

    Attributes:
        pose_base_robot: Where it stands in the scene.
        pose_flange_tip: Where the tip frame sits on its flange.
        bandwidth: Natural frequency of the servos where the arm is heaviest [rad/s]; elsewhere they are stiffer
            than they need be, and more than critically damped.
        following_error_limit: How far the reference may run ahead: bounds the force against an obstacle.
        armature: Of each joint [kg m^2]; an assumption, see `ARMATURE`.
    """

    pose_base_robot: Pose = field(default_factory=Pose)
    pose_flange_tip: Pose = field(default_factory=Pose)
    bandwidth: float = 100.0
    following_error_limit: FollowingErrorLimit = field(default_factory=FollowingErrorLimit)
    armature: tuple[float, float, float, float, float, float] = ARMATURE

    def __post_init__(self) -> None:
        checked_pose("pose_base_robot", self.pose_base_robot)
        checked_pose("pose_flange_tip", self.pose_flange_tip)
        positive("bandwidth", self.bandwidth, "rad/s")
        if len(self.armature) != UR5E.joints:
            raise InvalidValueError(f"armature has {len(self.armature)} entries: must have {UR5E.joints}")
        for i, inertia in enumerate(self.armature):
            positive(f"armature[{i}]", inertia, "kg m^2")

    @property
    def kinematics(self) -> ArmKinematics:
        """Of the arm as it stands, tip included."""
        return ArmKinematics(UR5E, self.pose_base_robot, self.pose_flange_tip)

    @property
    def lead(self) -> float:
        """2 / bandwidth [s]: by how much of its velocity a reference is led, lest the damping delay it.

        A servo k (u - q) - d q' with d = 2 k / bandwidth follows u = reference + lead * its rate without lag.
        """
        return 2.0 / self.bandwidth

    @property
    def stiffness(self) -> tuple[float, ...]:
        """Of the servos [N m/rad]: (armature + largest link inertia) bandwidth^2, critically damped."""
        inertias = zip(self.armature, LARGEST_LINK_INERTIA, strict=True)
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
            joint_position: Where [rad].
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
            joint_start: Where the arm starts [rad].

        Raises:
            InvalidValueError: Not six angles, each within its joint's range.
        """
        start = UR5E.joint_position("joint_start", joint_start)
        body = spec.worldbody.add_body(
            name="arm", pos=self.pose_base_robot.position, quat=_quat_wxyz(self.pose_base_robot.rotation)
        )
        for i in range(UR5E.joints):
            body = self._add_link(spec, body, i, start[i])
        return body.add_body(
            name=FLANGE, pos=self.pose_flange_tip.position, quat=_quat_wxyz(self.pose_flange_tip.rotation)
        )

    def _add_link(self, spec: mujoco.MjSpec, parent: mujoco.MjsBody, i: int, start: float) -> mujoco.MjsBody:
        row, limits = UR5E.rows[i], UR5E.limits[i]
        # a spec's joint angles are in degrees, unless its maker says otherwise
        unit = np.degrees(1.0) if spec.compiler.degree else 1.0
        angle = start + row.offset
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(row.alpha), np.sin(row.alpha)
        body = parent.add_body(
            name=LINKS[i],
            pos=[row.a * c, row.a * s, row.d],
            quat=_quat_wxyz(((c, -s * ca, s * sa), (s, c * ca, -c * sa), (0.0, sa, ca))),
        )
        _set_inertia(body, UR5E.links[i])
        body.gravcomp = 1.0
        joint = body.add_joint(
            name=JOINTS[i],
            type=mujoco.mjtJoint.mjJNT_HINGE,
            # the parent's z axis, seen from here
            axis=[0.0, sa, ca],
            pos=[-row.a, -row.d * sa, -row.d * ca],
            ref=unit * start,
            range=[unit * limits.lower, unit * limits.upper],
            armature=self.armature[i],
            # the motor carries gravity as well, and its limit holds for both together
            actgravcomp=True,
            actfrcrange=[-limits.torque, limits.torque],
        )
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
        stiffness = self.stiffness[i]
        add_position_servo(spec, JOINTS[i], stiffness, stiffness * self.lead)
        first, last, radius = _CAPSULES[i]
        body.add_geom(
            name=f"{LINKS[i]}_shape",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[*first, *last],
            size=[radius, 0.0, 0.0],
            contype=0,
            conaffinity=0,
            group=2,
        )
        return body


def _set_inertia(body: mujoco.MjsBody, link: LinkInertia) -> None:
    xx, xy, xz, yy, yz, zz = link.inertia
    body.explicitinertial = True
    body.mass = link.mass
    body.ipos = link.center_of_mass
    body.fullinertia = [xx, yy, zz, xy, xz, yz]


def _quat_wxyz(rotation: Matrix) -> list[float]:
    quat_wxyz = np.zeros(4)
    mujoco.mju_mat2Quat(quat_wxyz, np.array(rotation, dtype=np.float64).ravel())
    return [float(entry) for entry in quat_wxyz]
