"""The control script of ur_rtde 1.6.5 as a state machine: one command after the other, from the registers.

Its URScript is not interpreted; the meaning of a command id is the library's own convention. Emulated are the
commands that palpate's client sends, and those of ur_rtde's examples and tests: moves, speeds, servoing joints,
force mode, contacts, jogging, tool and payload, watchdog. Any other command ends the program with an error.

Real-time commands are repeated in every cycle in which the register holds them; the others are done once, and may
be generators that end when the command is over, one `yield` per cycle.
"""

from collections.abc import Callable, Mapping

from palpate.errors import InvalidValueError
from palpate.hw.emulators.ur.arm import Twist, numbers_of, pose_of, turned
from palpate.hw.emulators.ur.controller import STOPPING, EmulatedController, Program
from palpate.hw.emulators.ur.motion import (
    ArmMotion,
    Braking,
    Compliance,
    JointMove,
    JointServo,
    JointSpeed,
    LinearMove,
    Rest,
    ToolSpeed,
)
from palpate.hw.emulators.ur.script import DONE, READY, PathStep, Registers, Script, UploadedProgram
from palpate.kinematics.pose import Pose
from palpate.spatial import dot, norm

STOP = 255
"""Command that ends the script."""

MIN_LOOKAHEAD = 0.03
"""[s]: the least that URScript's servoj takes."""

MIN_RATE = 1e-3
"""Speed and acceleration below which a motion would never end [m/s, m/s^2 and so on]."""

CONTACT_FORCE = 5.0
"""[N] that counts as a contact. The real controller's threshold is not published [A]."""

MAX_STEADY_SPEED = 1e-4
"""[m/s, rad/s] below which the arm is steady."""


def program_of(uploaded: UploadedProgram, robot: EmulatedController) -> Program:
    """Return the execution of an uploaded program, one `yield` per cycle."""
    if uploaded.is_control:
        registers = Registers(robot, uploaded.int_offset, uploaded.double_offset)
        return control_script(Script(robot, registers, tuple(uploaded.path())))
    return uploaded.run(robot)


def loaded_program() -> Program:
    """Return a program that does nothing until it is stopped: one loaded from the controller's disk."""
    while True:
        yield


def control_script(script: Script) -> Program:
    """Run until asked to stop."""
    registers = script.registers
    registers.finish_operation()
    done = False
    while True:
        script.go_on()
        command = registers.command
        if command == STOP:
            return
        if command == 0:
            registers.reply(0, READY)
            done = False
        elif command in REAL_TIME:
            REAL_TIME[command](script)
            registers.reply(0, READY)
        elif command not in BLOCKING:
            raise InvalidValueError(f"command {command} is not emulated")
        elif not done:
            for _ in BLOCKING[command](script) or (None,):
                script.go_on()
                yield
            registers.reply(0, DONE)
            done = True
        yield


def _twist(numbers: tuple[float, ...]) -> Twist:
    vx, vy, vz, wx, wy, wz = numbers
    return (vx, vy, vz), (wx, wy, wz)


# Speeds, servoing, force mode


def _speed_tool(script: Script) -> None:
    registers = script.registers
    _steer(script, _twist(registers.doubles(0)), registers.double(6))


def _steer(script: Script, target: Twist, acceleration: float) -> None:
    """Let the TCP change to a twist."""
    robot, acceleration = script.robot, max(MIN_RATE, acceleration)
    motion = robot.motion
    if isinstance(motion, ToolSpeed):
        motion.target, motion.acceleration = target, acceleration
    else:
        robot.motion = ToolSpeed(robot.twist, target, acceleration)


def _speed_joints(script: Script) -> None:
    robot, registers = script.robot, script.registers
    target, acceleration = registers.doubles(0), max(MIN_RATE, registers.double(6))
    motion = robot.motion
    if isinstance(motion, JointSpeed):
        motion.target, motion.acceleration = target, acceleration
    else:
        robot.motion = JointSpeed(robot.arm.joint_speeds, target, acceleration)


def _servo_joints(script: Script) -> None:
    registers = script.registers
    script.robot.motion = JointServo(registers.doubles(0), max(MIN_LOOKAHEAD, registers.double(9)))


def _force_mode(script: Script) -> None:
    """Make axes compliant until force mode is stopped. All types act as type 2: the frame is taken as it is."""
    robot, registers = script.robot, script.registers
    robot.compliance = Compliance(
        frame=pose_of(registers.doubles(0)),
        selected=tuple(registers.integer(2 + axis) != 0 for axis in range(6)),
        wrench=registers.doubles(6),
        limits=registers.doubles(12),
    )


def _force_mode_stop(script: Script) -> Program:
    script.robot.compliance = None
    return _brake(script, STOPPING)


# Stops and moves


def _stop(script: Script) -> Program:
    """Stop speeds and servoing, with the deceleration of register 0."""
    return _brake(script, script.registers.double(0))


def _stop_move(script: Script) -> Program | None:
    """End an asynchronous move (stopL, stopJ)."""
    registers = script.registers
    script.end_operation()
    deceleration = max(MIN_RATE, registers.double(0))
    if not registers.integer(1):
        return _brake(script, deceleration)
    script.robot.motion = Braking(script.robot.twist, deceleration)
    return None


def _brake(script: Script, deceleration: float) -> Program:
    """Bring the arm to rest with a deceleration [m/s^2, rad/s^2]."""
    robot = script.robot
    robot.motion = Braking(robot.twist, max(MIN_RATE, deceleration))
    return _until_finished(script, robot.motion)


def _until_finished(script: Script, motion: ArmMotion) -> Program:
    """Wait until a motion is over, or another has taken its place."""
    yield
    while not motion.finished and script.robot.motion is motion:
        yield


def _move(*, joint_space: bool, is_pose: bool) -> Callable[[Script], Program | None]:
    def run(script: Script) -> Program | None:
        registers = script.registers
        step = PathStep(joint_space, is_pose, registers.doubles(0), registers.double(6), registers.double(7), 0)
        return _perhaps_later(script, _until_finished(script, _begin(script, step)))

    return run


def _move_path(script: Script) -> Program | None:
    """Follow the path that came with the script; blends are not emulated: each waypoint is a short stop."""

    def follow() -> Program:
        for step in script.path:
            script.registers.progress(step.progress)
            yield from _until_finished(script, _begin(script, step))
        script.registers.finish_operation()

    return _perhaps_later(script, follow())


def _perhaps_later(script: Script, work: Program) -> Program | None:
    """Do some work, as an operation if the client asked for that."""
    if not script.registers.integer(1):
        return work
    script.begin_operation(work)
    return None


def _begin(script: Script, step: PathStep) -> ArmMotion:
    """Start a move and return it; a target out of reach is a protective stop, as on a robot."""
    robot = script.robot
    arm = robot.arm
    speed, acceleration = max(MIN_RATE, step.speed), max(MIN_RATE, step.acceleration)
    try:
        if step.is_pose:
            joints = arm.joints_of(pose_of(step.target), arm.joints)
        else:
            joints = arm.mounting.arm.joint_position("joints", step.target)
    except InvalidValueError as error:
        robot.protective_stop(f"cannot move there: {error}")
        return robot.motion
    if step.joint_space:
        robot.motion = JointMove(arm.joints, joints, speed, acceleration)
    else:
        target: Pose = pose_of(step.target) if step.is_pose else arm.tcp_of(joints)
        robot.motion = LinearMove(arm.tcp, target, speed, acceleration)
    return robot.motion


# Contacts and jogging


def _move_until_contact(script: Script) -> Program:
    """Move with a twist until something pushes back, then stop."""
    registers = script.registers
    twist, direction = _twist(registers.doubles(0)), registers.doubles(6)
    if direction[:3] == (0.0, 0.0, 0.0):
        direction = twist[0] + (0.0, 0.0, 0.0)
    _steer(script, twist, registers.double(12))
    yield
    while not _touches(script, direction):
        yield
    yield from _brake(script, 3.0)  # m/s^2: the script's own stopl


def _start_detection(script: Script) -> None:
    script.detecting = script.registers.doubles(0)


def _read_detection(script: Script) -> None:
    detected = script.detecting is not None and _touches(script, script.detecting)
    script.registers.reply(1, int(detected))


def _stop_detection(script: Script) -> None:
    _read_detection(script)
    script.detecting = None


def _touches(script: Script, direction: tuple[float, ...]) -> bool:
    """Return whether something pushes the tool back against a direction, or in any if it is zero."""
    robot = script.robot
    force, _ = robot.tool.felt(robot.arm)
    x, y, z = direction[:3]
    length = norm((x, y, z))
    return norm(force) > CONTACT_FORCE if length == 0.0 else -dot(force, (x, y, z)) > CONTACT_FORCE * length


def _jog(script: Script) -> None:
    """Move with a steady twist in the base's axes (0), the tool's (1) or those of a frame (2)."""
    registers = script.registers
    twist, feature = _twist(registers.doubles(0)), round(registers.double(6))
    if feature == 1:
        twist = turned(twist, script.robot.arm.tcp)
    elif feature == 2:
        twist = turned(twist, pose_of(registers.doubles(8)))
    _steer(script, twist, registers.double(7))


def _jog_stop(script: Script) -> Program:
    return _brake(script, 1.2)  # m/s^2: the script's own stopl


# Settings and queries


def _zero_sensor(script: Script) -> None:
    script.robot.tool.zero(script.robot.arm)


def _set_payload(script: Script) -> None:
    """Set mass and centre of mass; a centre of zeros leaves the present one, as in the script."""
    tool = script.robot.tool
    mass, x, y, z = script.registers.doubles(0, 4)
    if mass < 0.0:
        raise InvalidValueError(f"payload of {mass!r} kg: must be 0 or above")
    tool.mass = mass
    if (x, y, z) != (0.0, 0.0, 0.0):
        tool.center = (x, y, z)


def _set_tcp(script: Script) -> None:
    robot = script.robot
    if isinstance(robot.motion, LinearMove):
        robot.motion = Rest()  # a move that still holds its target would take the new TCP there
    robot.arm.set_tcp(pose_of(script.registers.doubles(0)))


def _tcp_offset(script: Script) -> None:
    script.registers.reply_doubles(numbers_of(script.robot.arm.pose_flange_tcp))


def _joint_history(script: Script) -> None:
    history, steps = script.robot.history, script.registers.integer(1)
    if not 0 <= steps < len(history):
        raise InvalidValueError(f"{steps} steps of history: must be 0 to {len(history) - 1}")
    script.registers.reply_doubles(history[-1 - steps])


def _joint_torques(script: Script) -> None:
    robot = script.robot
    script.registers.reply_doubles(robot.arm.torques(*robot.tool.felt(robot.arm)))


def _steady(script: Script) -> None:
    velocity, turning = script.robot.arm.twist
    script.registers.reply(1, int(max(norm(velocity), norm(turning)) < MAX_STEADY_SPEED))


def _set_watchdog(script: Script) -> None:
    script.robot.watch(script.registers.command_name, script.registers.double(0))


def _protective_stop(script: Script) -> None:
    script.robot.protective_stop("asked for by a client")


REAL_TIME: Mapping[int, Callable[[Script], None]] = {
    6: _force_mode,
    9: _speed_joints,
    10: _speed_tool,
    11: _servo_joints,
    27: _joint_history,
    38: _joint_torques,
}
"""Commands that are repeated in every cycle in which the register holds them."""

BLOCKING: Mapping[int, Callable[[Script], Program | None]] = {
    1: _move(joint_space=True, is_pose=False),
    2: _move(joint_space=True, is_pose=True),
    3: _move(joint_space=False, is_pose=True),
    4: _move(joint_space=False, is_pose=False),
    7: _force_mode_stop,
    8: _zero_sensor,
    15: _stop,
    16: _stop,
    17: _set_payload,
    29: _set_tcp,
    31: _protective_stop,
    33: _stop_move,
    34: _stop_move,
    35: _set_watchdog,
    40: _tcp_offset,
    41: _jog,
    42: _jog_stop,
    45: _move_path,
    47: _steady,
    51: _move_until_contact,
    62: _start_detection,
    63: _stop_detection,
    64: _read_detection,
}
"""Commands that are done once; a program is done when it is over."""
