"""The arm as its controller measures it: joints, flange, TCP and the load, in the arm's own base frame.

The plant has a tip frame in base coordinates of its scene; a controller has a TCP in the frame of the arm's robot
base, which ur_rtde calls base. This module is the one place where the two meet.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.hw.emulators.server import PlantState
from palpate.kinematics import UR5E, ArmKinematics, Pose, SerialArm, nearest_joint_position
from palpate.kinematics.pose import checked_pose, rotation_from_rotvec, rotvec_from_rotation, times, transposed
from palpate.spatial import ZERO, Vector, Wrench, add, cross, norm, rotate, rotate_back, scale, subtract

Joints = tuple[float, ...]
"""Six joint angles [rad] or speeds [rad/s]."""

Twist = tuple[Vector, Vector]
"""Velocity of the TCP [m/s] and angular velocity [rad/s], in the axes of the arm's robot base."""

STILL: Twist = (ZERO, ZERO)
NO_WRENCH: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

_QUARTER = math.pi / 2.0

HOME: Joints = (-_QUARTER, -_QUARTER, _QUARTER, -_QUARTER, -_QUARTER, 0.0)
"""[rad] -90, -90, 90, -90, -90, 0 deg: the tool hangs over the work place, far from singular poses."""

_DAMPING = 1e-3
"""Damping of least squares: joints follow the tip to 1e-4 per step at a smallest singular value of 0.1."""

MAX_FOLLOWING_ERROR = 1e-3
"""[m, rad] by which the joints may fail to follow the plant's tip before it counts as out of their reach."""

MAX_MOUNTING_ERROR = 0.005
"""[m, rad] between the plant's tip and where its joints hold it: more than factory calibrations differ by."""

_LONGEST_STEP = 0.1
"""Largest motion of a joint between two measurements [rad]: sixteen times 180 deg/s in a cycle of 2 ms, so that
only divergence is limited."""

GRAVITY = 9.82
"""Gravity that a UR controller assumes [m/s^2] [A]."""

_MOST_STEPS = 3
_ACCURACY = 1e-9
"""[m, rad] to which joints follow the tip."""


@dataclass(frozen=True, slots=True)
class ArmMounting:
    """Mounting of the arm in the plant's scene.

    Attributes:
        arm: Geometry and limits.
        pose_base_robot: The arm's own base frame in the plant's.
        pose_flange_tip: The plant's tip frame on the flange; also the TCP until a client sets another.
        joints: Joint angles to start near to [rad], if the plant has no joints.
        sensor: Index of the plant's wrench that the controller measures; its frame is the tip frame.
    """

    arm: SerialArm = UR5E
    pose_base_robot: Pose = field(default_factory=Pose)
    pose_flange_tip: Pose = field(default_factory=Pose)
    joints: Joints = HOME
    sensor: int = 0

    def __post_init__(self) -> None:
        checked_pose("pose_base_robot", self.pose_base_robot)
        checked_pose("pose_flange_tip", self.pose_flange_tip)
        self.arm.joint_position("joints", self.joints)


class Arm:
    """Arm as last measured.

    Attributes:
        mounting: Mounting of the arm.
        kinematics: Kinematics of the flange in the robot base's frame.
        pose_flange_tcp: TCP on the flange, as the installation or a client sets it.
        joints: Joint angles [rad].
        joint_speeds: Joint speeds [rad/s].
        flange: Pose of the flange in the robot base.
        tcp: Pose of the TCP in the robot base.
        twist: Twist of the TCP.
        out_of_reach: Whether the plant has moved the tip to where the joints cannot follow.
        sensed: Wrench on the sensor's tip side, its own frame, about its origin [N, N m]: what `Tool` starts from.
    """

    def __init__(self, mounting: ArmMounting) -> None:
        """Begin at the mounting's joints."""
        self.mounting = mounting
        self.kinematics = ArmKinematics(mounting.arm)
        self.pose_flange_tcp = mounting.pose_flange_tip
        self.joints: Joints = mounting.joints
        self.joint_speeds: Joints = (0.0,) * 6
        self.flange = Pose()
        self.tcp = Pose()
        self.twist = STILL
        self.sensed: Wrench = NO_WRENCH
        self._robot_base = mounting.pose_base_robot.inverse()
        self._tip_flange = mounting.pose_flange_tip.inverse()
        self._jacobian: FloatArray = np.zeros((6, 6))
        self.out_of_reach = False
        self._started = False

    def measure(self, state: PlantState) -> None:
        """Take a state of the plant.

        Raises:
            InvalidValueError: If neither the arm nor the plant's joints hold the tip where the plant begins.
        """
        sample = state.arm
        pose_base_tip = Pose(sample.position_base_tip, sample.rotation_base_tip)
        tip = self._robot_base @ pose_base_tip
        self.flange = tip @ self._tip_flange
        self.tcp = self.flange @ self.pose_flange_tcp
        if len(sample.joint_position) == 6:
            self.joints = sample.joint_position
            if not self._started:
                self._check_mounting()
        elif not self._started:
            self.joints = nearest_joint_position(self.kinematics, self.flange, self.joints)
        else:
            self._follow()
        self._started = True
        robot_base = self._robot_base.rotation
        turning = rotate(robot_base, sample.angular_velocity_base_tip)
        arm = subtract(self.tcp.position, tip.position)
        self.twist = (add(rotate(robot_base, sample.velocity_base_tip), cross(turning, arm)), turning)
        self._jacobian = self.kinematics.jacobian(self.joints)
        lever = subtract(self.flange.position, self.tcp.position)
        at_flange = add(self.twist[0], cross(turning, lever))
        self.joint_speeds = tuple(self._solve(np.array(at_flange + turning)).tolist())
        index = self.mounting.sensor
        wrench = state.wrenches[index].wrench if index < len(state.wrenches) else ()
        fx, fy, fz, mx, my, mz = wrench if len(wrench) == 6 else NO_WRENCH
        self.sensed = (fx, fy, fz, mx, my, mz)

    def joints_of(self, pose_base_tcp: Pose, near: Joints) -> Joints:
        """Return the joint angles that hold the TCP at a pose, nearest to others [rad].

        Raises:
            InvalidValueError: If there are none.
        """
        flange = pose_base_tcp @ self.pose_flange_tcp.inverse()
        return nearest_joint_position(self.kinematics, flange, near)

    def tcp_of(self, joints: Joints) -> Pose:
        """Return the pose of the TCP in the robot base at joint angles [rad]."""
        return self.kinematics.pose(joints) @ self.pose_flange_tcp

    def twist_of(self, joint_speeds: Joints) -> Twist:
        """Return the twist of the TCP at joint speeds [rad/s], at its present pose."""
        vx, vy, vz, wx, wy, wz = (self._jacobian @ np.array(joint_speeds)).tolist()
        turning = (wx, wy, wz)
        lever = subtract(self.tcp.position, self.flange.position)
        return add((vx, vy, vz), cross(turning, lever)), turning

    def tip_velocity(self, twist: Twist) -> Twist:
        """Return the twist of the plant's tip at a twist of the TCP, in the plant's base axes."""
        tip = self.flange @ self.mounting.pose_flange_tip
        lever = subtract(tip.position, self.tcp.position)
        base = self.mounting.pose_base_robot.rotation
        return rotate(base, add(twist[0], cross(twist[1], lever))), rotate(base, twist[1])

    def set_tcp(self, pose_flange_tcp: Pose) -> None:
        """Set the TCP on the flange."""
        self.pose_flange_tcp = pose_flange_tcp
        self.tcp = self.flange @ pose_flange_tcp

    def torques(self, force: Vector, torque: Vector) -> Joints:
        """Return the joint torques [N m] that hold a wrench on the TCP."""
        unit_twists = [self.twist_of(tuple(float(i == j) for j in range(6))) for i in range(6)]
        columns = np.array([velocity + turning for velocity, turning in unit_twists])
        return tuple((-columns @ np.array(force + torque)).tolist())

    def _check_mounting(self) -> None:
        """Check that the plant's joints hold its tip where the plant has it."""
        shift, turn = difference(self.flange, self.kinematics.pose(self.joints))
        if max(norm(shift), norm(turn)) > MAX_MOUNTING_ERROR:
            raise InvalidValueError(
                f"the plant's joints hold its tip {norm(shift):.4f} m and {norm(turn):.4f} rad away from where it "
                f"says it is: must be within {MAX_MOUNTING_ERROR:g}; give the mounting the plant's arm, "
                "pose_base_robot and pose_flange_tip"
            )

    def _follow(self) -> None:
        """Let the joints follow the flange, at a limited speed and within their ranges."""
        before, error = self.joints, 0.0
        for _ in range(_MOST_STEPS):
            shift, turn = difference(self.flange, self.kinematics.pose(self.joints))
            error = max(norm(shift), norm(turn))
            if error < _ACCURACY:
                break
            self._jacobian = self.kinematics.jacobian(self.joints)
            step = self._solve(np.array(shift + turn)).tolist()
            self.joints = tuple(
                max(limit.lower, q - _LONGEST_STEP, min(limit.upper, q + _LONGEST_STEP, now + dq))
                for q, now, dq, limit in zip(before, self.joints, step, self.mounting.arm.limits, strict=True)
            )
        # the error before the last step: above rounding only where the arm cannot follow
        self.out_of_reach = error > MAX_FOLLOWING_ERROR

    def _solve(self, flange: FloatArray) -> FloatArray:
        """Return the joint motion of a motion of the flange: damped least squares."""
        j = self._jacobian
        square = j @ j.T
        square.flat[::7] += _DAMPING**2
        result: FloatArray = j.T @ np.linalg.solve(square, flange)
        return result


class Tool:
    """Load on the flange, and zero of the force/torque sensor.

    Attributes:
        mass: Mass of the load, as a client sets it [kg].
        center: Centre of mass of the load, flange frame [m].
    """

    def __init__(self) -> None:
        """Begin without a load."""
        self.mass = 0.0
        self.center: Vector = (0.0, 0.0, 0.0)
        self._zero = NO_WRENCH

    def zero(self, arm: Arm) -> None:
        """Take the present load for zero, in the sensor's frame: the zero turns with it."""
        self._zero = self._compensated(arm)

    def felt(self, arm: Arm) -> tuple[Vector, Vector]:
        """Return force on the tool [N] and torque about the TCP [N m], axes of the robot base."""
        fx, fy, fz, mx, my, mz = (a - b for a, b in zip(self._compensated(arm), self._zero, strict=True))
        tip = arm.flange @ arm.mounting.pose_flange_tip
        force, torque = rotate(tip.rotation, (fx, fy, fz)), rotate(tip.rotation, (mx, my, mz))
        return force, subtract(torque, cross(subtract(arm.tcp.position, tip.position), force))

    def _compensated(self, arm: Arm) -> Wrench:
        """Return the sensor's wrench without the weight of the load, sensor frame."""
        fx, fy, fz, mx, my, mz = arm.sensed
        if self.mass == 0.0:
            return fx, fy, fz, mx, my, mz
        tip = arm.flange @ arm.mounting.pose_flange_tip
        weight = rotate_back(tip.rotation, (0.0, 0.0, -self.mass * GRAVITY))
        on_flange = rotate(arm.flange.rotation, self.center)
        lever = rotate_back(tip.rotation, subtract(on_flange, subtract(tip.position, arm.flange.position)))
        moment = cross(lever, weight)
        return (
            fx - weight[0],
            fy - weight[1],
            fz - weight[2],
            mx - moment[0],
            my - moment[1],
            mz - moment[2],
        )


def pose_of(numbers: tuple[float, ...]) -> Pose:
    """Return a pose from x, y, z [m] and a rotation vector [rad]."""
    x, y, z, rx, ry, rz = numbers
    return Pose((x, y, z), rotation_from_rotvec((rx, ry, rz)))


def numbers_of(pose: Pose) -> tuple[float, ...]:
    """Return x, y, z [m] and the rotation vector [rad] of a pose."""
    return (*pose.position, *rotvec_from_rotation(pose.rotation))


def difference(target: Pose, actual: Pose) -> tuple[Vector, Vector]:
    """Return the translation [m] and rotation vector [rad] from one pose to another, in their common frame."""
    return (
        subtract(target.position, actual.position),
        rotvec_from_rotation(times(target.rotation, transposed(actual.rotation))),
    )


def turned(twist: Twist, frame: Pose) -> Twist:
    """Return a twist given in the axes of a frame in those of the robot base."""
    return rotate(frame.rotation, twist[0]), rotate(frame.rotation, twist[1])


def turned_back(twist: Twist, frame: Pose) -> Twist:
    """Return a twist given in the axes of the robot base in those of a frame."""
    return rotate_back(frame.rotation, twist[0]), rotate_back(frame.rotation, twist[1])


def scaled(factor: float, twist: Twist) -> Twist:
    """Return a multiple of a twist."""
    return scale(factor, twist[0]), scale(factor, twist[1])
