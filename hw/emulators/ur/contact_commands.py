"""Commands that feel for contact, jog, and let the arm be led by hand."""

from palpate.hw.emulators.ur.arm import pose_of, turned
from palpate.hw.emulators.ur.force_mode import FREE_SPEED, Compliance
from palpate.hw.emulators.ur.motion_commands import LEAST, brake, steer, twist_from
from palpate.hw.emulators.ur.motions import Rest
from palpate.hw.emulators.ur.robot import Program
from palpate.hw.emulators.ur.script import Script
from palpate.kinematics.pose import Pose
from palpate.spatial import dot, norm

TOUCH = 5.0
"""[N] that counts as a contact. The real controller's threshold is not published [A]."""


def touching(script: Script) -> None:
    """ToolContact: cycles since a contact in a direction; 0 for none."""
    script.registers.reply_integer(int(_touches(script, script.registers.doubles(0))))


def move_until_contact(script: Script) -> Program:
    """MoveUntilContact: go with a twist until something pushes back, then stop."""
    registers = script.registers
    twist, direction = twist_from(registers.doubles(0)), registers.doubles(6)
    if direction[:3] == (0.0, 0.0, 0.0):
        direction = twist[0] + (0.0, 0.0, 0.0)
    steer(script, twist, max(LEAST, registers.double(12)))
    yield
    while not _touches(script, direction):
        yield
    yield from brake(script, 3.0)  # m/s^2: what the script gives stopl


def contact_detection(script: Script) -> Program:
    """StartContactDetection."""
    script.detecting = script.registers.doubles(0)
    yield


def contact_detection_off(script: Script) -> Program:
    """StopContactDetection; replies as reading does."""
    script.registers.reply_integer(_detected(script))
    script.detecting = None
    yield


def contact_detected(script: Script) -> Program:
    """ReadContactDetection."""
    script.registers.reply_integer(_detected(script))
    yield


def _detected(script: Script) -> int:
    return int(script.detecting is not None and _touches(script, script.detecting))


def _touches(script: Script, direction: tuple[float, ...]) -> bool:
    """Whether something pushes the tool back against a direction, or in any if it is zero."""
    robot = script.robot
    force, _ = robot.tool.felt(robot.arm)
    x, y, z = direction[:3]
    length = norm((x, y, z))
    return norm(force) > TOUCH if length == 0.0 else -dot(force, (x, y, z)) > TOUCH * length


def jog(script: Script) -> Program:
    """JogStart: a steady twist in the base's axes (0), the tool's (1) or a frame (2)."""
    registers = script.registers
    twist, feature = twist_from(registers.doubles(0)), round(registers.double(6))
    if feature == 1:
        twist = turned(twist, script.robot.arm.tcp)
    elif feature == 2:
        twist = turned(twist, pose_of(registers.doubles(8)))
    steer(script, twist, max(LEAST, registers.double(7)))
    yield


def jog_stop(script: Script) -> Program:
    """JogStop."""
    yield from brake(script, 1.2)  # m/s^2: what the script gives stopl


def freedrive(script: Script) -> Program:
    """FreedriveMode: some axes are compliant to any push."""
    registers = script.registers
    _give_way(script, pose_of(registers.doubles(0)), tuple(registers.integer(1 + axis) != 0 for axis in range(6)))
    yield


def teach_mode(script: Script) -> Program:
    """TeachMode: all axes are compliant."""
    _give_way(script, Pose(), (True,) * 6)
    yield


def _give_way(script: Script, frame: Pose, axes: tuple[bool, ...]) -> None:
    script.robot.motion = Rest()
    script.robot.compliance = Compliance(frame, axes, (0.0,) * 6, FREE_SPEED)


def freedrive_off(script: Script) -> Program:
    """EndFreedriveMode, endTeachMode."""
    script.robot.compliance = None
    yield


def freedrive_status(script: Script) -> Program:
    """GetFreedriveStatus: 1 while some axes are compliant, 0 while none do."""
    script.registers.reply_integer(int(script.robot.compliance is not None))
    yield
