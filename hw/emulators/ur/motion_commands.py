"""Commands that move the arm.

Real-time commands are done in one go, again in every cycle in which the register holds them; the others are
generators that come back when they are over, one `yield` per cycle.
"""

from collections.abc import Callable

from palpate.errors import InvalidValueError
from palpate.hw.emulators.ur.arm import Joints, Twist, difference, pose_of
from palpate.hw.emulators.ur.force_mode import Compliance
from palpate.hw.emulators.ur.motions import (
    ArmMotion,
    Braking,
    JointMove,
    JointServo,
    JointSpeed,
    LinearMove,
    PoseServo,
    ToolSpeed,
)
from palpate.hw.emulators.ur.robot import STOPPING, Program
from palpate.hw.emulators.ur.script import PathStep, Script
from palpate.kinematics.pose import Pose
from palpate.spatial import norm

LEAST_LOOKAHEAD = 0.03
"""[s]: the least that URScript's servoj takes."""

NEARBY = 0.05
"""[m, rad] around the TCP within which servo targets are taken without looking for joints, which costs a third of
a cycle: streams stay within it, and where the arm does not reach, it stops anyway."""

LEAST = 1e-3
"""Speed and acceleration below which a motion would never end [m/s, m/s^2 and so on]."""


def twist_from(numbers: tuple[float, ...]) -> Twist:
    """Return a twist from its six numbers."""
    vx, vy, vz, wx, wy, wz = numbers
    return (vx, vy, vz), (wx, wy, wz)


def speed_tool(script: Script) -> None:
    """SpeedL: a thread keeps at it."""
    registers = script.registers
    target, acceleration = twist_from(registers.doubles(0)), max(LEAST, registers.double(6))
    steer(script, target, acceleration)


def steer(script: Script, target: Twist, acceleration: float) -> None:
    """Let the TCP go over to a twist."""
    robot = script.robot
    motion = robot.motion
    if isinstance(motion, ToolSpeed):
        motion.target, motion.acceleration = target, acceleration
    else:
        robot.motion = ToolSpeed(robot.twist, target, acceleration)


def speed_joints(script: Script) -> None:
    """SpeedJ: a thread keeps at it."""
    robot, registers = script.robot, script.registers
    target, acceleration = registers.doubles(0), max(LEAST, registers.double(6))
    motion = robot.motion
    if isinstance(motion, JointSpeed):
        motion.target, motion.acceleration = target, acceleration
    else:
        robot.motion = JointSpeed(robot.arm.joint_speeds, target, acceleration)


def servo_joints(script: Script) -> None:
    """ServoJ: a thread keeps at it."""
    registers = script.registers
    script.robot.motion = JointServo(registers.doubles(0), max(LEAST_LOOKAHEAD, registers.double(9)))


def servo_tool(script: Script) -> None:
    """ServoL: a thread keeps at it. As in the script, a pose out of reach ends the program."""
    robot, registers = script.robot, script.registers
    target, lookahead = pose_of(registers.doubles(0)), max(LEAST_LOOKAHEAD, registers.double(9))
    motion = robot.motion
    if isinstance(motion, PoseServo) and motion.target == target:
        return
    distance, turn = difference(target, robot.arm.tcp)
    if max(norm(distance), norm(turn)) > NEARBY:
        robot.arm.joints_of(target, robot.arm.joints)
    robot.motion = PoseServo(target, lookahead)


def force_mode(script: Script) -> None:
    """ForceMode: stays until it is stopped. All types as type 2: the frame is taken as it is."""
    robot, registers = script.robot, script.registers
    robot.compliance = Compliance(
        frame=pose_of(registers.doubles(0)),
        selected=tuple(registers.integer(2 + axis) != 0 for axis in range(6)),
        wrench=registers.doubles(6),
        limits=registers.doubles(12),
        scaling=script.scaling,
    )


def force_mode_stop(script: Script) -> Program:
    """End force mode; the script then brings the arm to rest."""
    script.robot.compliance = None
    yield from brake(script, STOPPING)


def stop_motion(script: Script) -> Program:
    """SpeedStop, servoStop: with the deceleration of register 0."""
    yield from brake(script, script.registers.double(0))


def stop_move(script: Script) -> Program:
    """StopL, stopJ: end an asynchronous motion."""
    registers = script.registers
    script.end_operation()
    deceleration = max(LEAST, registers.double(0))
    if registers.integer(1):
        script.robot.motion = Braking(script.robot.twist, deceleration)
    else:
        yield from brake(script, deceleration)


def brake(script: Script, deceleration: float) -> Program:
    """Bring the arm to rest with a deceleration [m/s^2, rad/s^2]."""
    robot = script.robot
    robot.motion = Braking(robot.twist, max(LEAST, deceleration))
    yield from until_finished(script, robot.motion)


def until_finished(script: Script, motion: ArmMotion) -> Program:
    """Wait until a motion is over, or another has taken its place."""
    yield
    while not motion.finished and script.robot.motion is motion:
        yield


def _move(make: Callable[[Script], PathStep]) -> Callable[[Script], Program]:
    def run(script: Script) -> Program:
        motion = begin(script, make(script))
        return _perhaps_later(script, until_finished(script, motion))

    return run


def _perhaps_later(script: Script, work: Program) -> Program:
    """Do some work, in a thread if the client has asked for that."""
    if script.registers.integer(1):
        script.begin_operation(work)
    else:
        yield from work


def _from_registers(joint_space: bool, is_pose: bool) -> Callable[[Script], PathStep]:
    def make(script: Script) -> PathStep:
        registers = script.registers
        return PathStep(joint_space, is_pose, registers.doubles(0), registers.double(6), registers.double(7), 0)

    return make


move_joints = _move(_from_registers(joint_space=True, is_pose=False))
move_joints_to_pose = _move(_from_registers(joint_space=True, is_pose=True))
move_tool = _move(_from_registers(joint_space=False, is_pose=True))
move_tool_to_joints = _move(_from_registers(joint_space=False, is_pose=False))


def begin(script: Script, step: PathStep) -> ArmMotion:
    """Start a move and return it; a target out of reach is a protective stop, as on a robot."""
    robot = script.robot
    arm = robot.arm
    speed, acceleration = max(LEAST, step.speed), max(LEAST, step.acceleration)
    try:
        joints = arm.joints_of(pose_of(step.target), arm.joints) if step.is_pose else _allowed(script, step.target)
    except InvalidValueError as error:
        robot.protective_stop(f"cannot move there: {error}")
        return robot.motion
    if step.joint_space:
        robot.motion = JointMove(arm.joints, joints, speed, acceleration)
    else:
        target: Pose = pose_of(step.target) if step.is_pose else arm.tcp_of(joints)
        robot.motion = LinearMove(arm.tcp, target, speed, acceleration)
    return robot.motion


def move_path(script: Script) -> Program:
    """Follow the path that came with the script; blends are not emulated: each waypoint is a short stop."""
    return _perhaps_later(script, _follow(script))


def _follow(script: Script) -> Program:
    for step in script.path:
        script.registers.progress(step.progress)
        yield from until_finished(script, begin(script, step))
    script.registers.finish_operation()


def _allowed(script: Script, joints: Joints) -> Joints:
    return script.robot.arm.mounting.arm.joint_position("joints", joints)
