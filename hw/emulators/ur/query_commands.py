"""Commands that ask the controller something, or set something in it."""

import math

from palpate.errors import InvalidValueError
from palpate.hw.emulators.ur.arm import numbers_of, pose_of
from palpate.hw.emulators.ur.robot import Program
from palpate.hw.emulators.ur.script import Script
from palpate.kinematics.pose import Pose
from palpate.spatial import norm

STEADY = 1e-4
"""[m/s, rad/s] below which the arm is steady."""


def zero_sensor(script: Script) -> Program:
    """ZeroFtSensor."""
    script.robot.tool.zero(script.robot.arm)
    yield


def set_payload(script: Script) -> Program:
    """SetPayload; a centre of mass of zeros leaves the present one, as the script does."""
    _load(script)
    yield


def set_target_payload(script: Script) -> Program:
    """SetTargetPayload, with inertia."""
    _load(script)
    script.robot.tool.inertia = script.registers.doubles(4)
    yield


def _load(script: Script) -> None:
    registers, tool = script.registers, script.robot.tool
    mass, x, y, z = registers.doubles(0, 4)
    if not 0.0 <= mass < math.inf:
        raise InvalidValueError(f"payload of {mass!r} kg: must be 0 or above")
    tool.mass = mass
    if (x, y, z) != (0.0, 0.0, 0.0):
        tool.center = (x, y, z)


def set_gravity(script: Script) -> Program:
    """SetGravity."""
    x, y, z = script.registers.doubles(0, 3)
    script.robot.tool.gravity = (x, y, z)
    yield


def set_tcp(script: Script) -> Program:
    """SetTcp: all poses are of the new TCP from now on."""
    script.robot.arm.set_tcp(pose_of(script.registers.doubles(0)))
    yield


def tcp_offset(script: Script) -> Program:
    """GetTCPOffset."""
    script.registers.reply_doubles(numbers_of(script.robot.arm.pose_flange_tcp))
    yield


def flange_pose(script: Script) -> None:
    """GetActualToolFlangePose."""
    script.registers.reply_doubles(numbers_of(script.robot.arm.flange))


def step_time(script: Script) -> None:
    """GetStepTime."""
    script.registers.reply_doubles((script.robot.period,))


def joint_history(script: Script) -> None:
    """GetActualJointPositionsHistory."""
    history, steps = script.robot.history, script.registers.integer(1)
    if not 0 <= steps < len(history):
        raise InvalidValueError(f"{steps} steps of history: must be 0 to {len(history) - 1}")
    script.registers.reply_doubles(history[-1 - steps])


def target_waypoint(script: Script) -> Program:
    """GetTargetWaypoint: of the move, or where the TCP is."""
    target = getattr(script.robot.motion, "target", None)
    script.registers.reply_doubles(numbers_of(target if isinstance(target, Pose) else script.robot.arm.tcp))
    yield


def inverse_near(script: Script) -> Program:
    """GetInverseKinematics near some joints; without a solution the program ends with an error."""
    script.registers.reply_doubles(_inverse(script, near=script.registers.doubles(6)))
    yield


def inverse(script: Script) -> Program:
    """GetInverseKinematics near the present joints."""
    script.registers.reply_doubles(_inverse(script, near=script.robot.arm.joints))
    yield


def has_inverse_near(script: Script) -> Program:
    """GetInverseKinematicsHasSolution near some joints."""
    script.registers.reply_integer(int(_solvable(script, script.registers.doubles(6))))
    yield


def has_inverse(script: Script) -> Program:
    """GetInverseKinematicsHasSolution near the present joints; also: is the pose within the safety limits."""
    script.registers.reply_integer(int(_solvable(script, script.robot.arm.joints)))
    yield


def joints_allowed(script: Script) -> Program:
    """IsJointsWithinSafetyLimits: of the joints' ranges; no planes or tool limits are emulated."""
    limits = script.robot.arm.mounting.arm.limits
    angles = script.registers.doubles(0)
    script.registers.reply_integer(int(all(x.lower <= q <= x.upper for q, x in zip(angles, limits, strict=True))))
    yield


def _inverse(script: Script, near: tuple[float, ...]) -> tuple[float, ...]:
    return script.robot.arm.joints_of(pose_of(script.registers.doubles(0)), near)


def _solvable(script: Script, near: tuple[float, ...]) -> bool:
    try:
        _inverse(script, near)
    except InvalidValueError:
        return False
    return True


def forward(script: Script) -> Program:
    """GetForwardKinematics of where the arm is."""
    script.registers.reply_doubles(numbers_of(script.robot.arm.tcp))
    yield


def forward_of(script: Script) -> Program:
    """GetForwardKinematics of joints and a TCP, which are whatever the registers hold."""
    registers = script.registers
    script.registers.reply_doubles(
        numbers_of(script.robot.arm.tcp_of(registers.doubles(0), pose_of(registers.doubles(6))))
    )
    yield


def combined(script: Script) -> Program:
    """PoseTrans."""
    registers = script.registers
    registers.reply_doubles(numbers_of(pose_of(registers.doubles(0)) @ pose_of(registers.doubles(6))))
    yield


def steady(script: Script) -> Program:
    """IsSteady."""
    velocity, turning = script.robot.arm.twist
    script.registers.reply_integer(int(max(norm(velocity), norm(turning)) < STEADY))
    yield


def set_watchdog(script: Script) -> Program:
    """SetWatchdog on the register of the command."""
    robot = script.robot
    robot.watchdog.watch(script.registers.command_name, script.registers.double(0), robot.time)
    yield


def trigger_protective_stop(script: Script) -> Program:
    """TriggerProtectiveStop."""
    script.robot.protective_stop("asked for by a client")
    yield


def joint_torques(script: Script) -> None:
    """GetJointTorques: what the wrench on the tool asks of the joints."""
    robot = script.robot
    script.registers.reply_doubles(robot.arm.torques(*robot.tool.felt(robot.arm)))


def jacobian(script: Script) -> None:
    """GetJacobian of the TCP, column by column."""
    columns = script.robot.arm.tcp_jacobian().T
    script.registers.reply_doubles(columns.flatten().tolist())


def gain_scaling(script: Script) -> Program:
    """ForceModeSetGainScaling."""
    script.scaling = min(2.0, max(0.0, script.registers.double(0)))
    yield


def accepted(script: Script) -> Program:
    """Do nothing: what has no effect on anything emulated here."""
    yield


def not_emulated(script: Script) -> None:
    """Return zeros: the dynamics are not emulated."""
    script.registers.reply_doubles((0.0,) * 36)
