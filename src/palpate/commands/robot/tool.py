"""`palpate robot`: the robots that there are, and what palpate makes of a robot file."""

import sys
from collections.abc import Iterator

import msgspec

from palpate.commands.command_result import CommandResult
from palpate.commands.robot.config import RobotCheckConfig, RobotListConfig, RobotShowConfig
from palpate.errors import InvalidValueError
from palpate.nearest_name import unit_of, without_unit
from palpate.open_kinds import as_written, name_of_kind
from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.in_scene import check
from palpate.robots.known_sensor import described
from palpate.robots.robot import ROBOT_TEXT, SENSOR_TEXT, Robot, load_robot, robot_path, shipped_robots
from palpate.robots.values import load_named_robot
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sensing.ft.sensor_writer import sensor_text
from palpate.strict_refusal import shown_path
from palpate.strict_yaml import Key, read_yaml

RISK = "a sensor that shows too little is believed, and the robot may press harder than limits.force_N"


def unchecked_sensors(robot: Robot) -> str:
    """Return in one sentence what is risked, and why; empty where the arm itself measures the force as well.

    An arm that turns out to measure none, a CB3, is compared with a model of its servos
    (`palpate.runtime.servo_following`).
    """
    if robot.file.backend.has_hand(robot):
        why = "the force of each finger is measured by its own sensor alone"
    elif not robot.file.backend.measures_force:
        why = "no arm measures the force as well"
    elif any(finger.sensor_device is not None and finger.sensor_device.in_arm for finger in robot.file.fingers):
        return (
            "The arm's sensor is the fingertip's sensor, too: beside it only how far the arm gives way shows a "
            "push; see that its stiffness_N_per_m, response_s and lag_s are as pressing finds them (--identify)."
        )
    else:
        return ""
    return f"No second channel: {why}; {RISK}."


def run_list(config: RobotListConfig) -> CommandResult:
    """Print the name and the first line of every robot that comes with palpate."""
    robots = {name: load_robot(name).file for name in shipped_robots()}
    widest = max(map(len, robots))
    for name, file in robots.items():
        sys.stdout.write(f"{name:<{widest}}  {file.name}\n")
    kinds = {name: name_of_kind(file.backend) for name, file in robots.items()}
    return CommandResult(
        facts={"robots": [{"name": n, "about": robots[n].name, "kind": kinds[n]} for n in robots]}
    )


def run_show(config: RobotShowConfig) -> CommandResult:
    """Print a robot file, or one of its sensor files, as it is; without one, what is known of a simulated sensor.

    Raises:
        InvalidValueError: There is no such robot, no such finger, or something in the files is wrong.
    """
    robot = load_named_robot(config.robot)
    if config.sensor is None:
        return _shown_file("robot", robot.texts[ROBOT_TEXT])
    if config.sensor >= len(robot.file.fingers):
        raise InvalidValueError(f"sensor = {config.sensor}: the last finger is {len(robot.file.fingers) - 1}")
    if robot.sensors[config.sensor] is not None:
        return _shown_file("sensor", robot.texts[SENSOR_TEXT.format(config.sensor)])
    sensor = _described(robot, config.sensor)
    if sensor is None:
        raise InvalidValueError(
            f"sensor = {config.sensor}: this finger has no sensor file; its sensor has no flaws"
        )
    return _shown_file("sensor", sensor_text(sensor))


def _shown_file(what: str, text: str) -> CommandResult:
    """Print a file as it is, and return its text."""
    sys.stdout.write(text)
    return CommandResult(facts={what: read_yaml(text)})


def run_check(config: RobotCheckConfig) -> CommandResult:
    """Print what palpate understood.

    Raises:
        InvalidValueError: There is no such robot, or something in its files is wrong.
    """
    robot = load_named_robot(config.robot)
    try:
        pressed = check(robot)
    except InvalidValueError as error:
        raise InvalidValueError(f"{robot_path(config.robot)}: {error}") from None
    written = {path for path, _ in _leaves(read_yaml(robot.texts[ROBOT_TEXT]))}
    rows = [
        (shown_path((*path[:-1], _bare(path[-1]))), _with_unit(value, path), path in written)
        for path, value in _leaves(as_written(robot.file))
    ]
    left, middle = max(len(row[0]) for row in rows), max(len(row[1]) for row in rows)
    sys.stdout.write(f"{robot_path(config.robot)}\n")
    for name, value, given in rows:
        note = "" if given else "default"
        sys.stdout.write(f"  {name:<{left}}  {value:<{middle}}  {note}".rstrip() + "\n")
    for i, file in enumerate(robot.sensors):
        sensor = file or _described(robot, i)
        if sensor is not None:
            sys.stdout.write(f"  sensor of finger {i}: {_sensor_line(sensor)}\n")
    if pressed is not None:
        sys.stdout.write(f"  largest force at these limits: {pressed}\n")
    remarks = robot.file.backend.remarks(robot)
    for remark in remarks:
        sys.stdout.write(f"  {remark}\n")
    risk = unchecked_sensors(robot)
    if risk:
        sys.stdout.write(f"{risk}\n")
    sys.stdout.write("All in order.\n")
    sensors = [file or _described(robot, i) for i, file in enumerate(robot.sensors)]
    return CommandResult(
        outcome="All in order.",
        facts={
            "file": robot_path(config.robot),
            "robot": as_written(robot.file),
            "defaults": [name for name, _, given in rows if not given],
            "largest_force_N": None if pressed is None else pressed.force,
            "remarks": remarks,
            "risk": risk,
            "sensors": [None if sensor is None else msgspec.to_builtins(sensor) for sensor in sensors],
        },
    )


def _described(robot: Robot, finger: int) -> SensorFile | None:
    """What is known of the simulated sensor of a finger without a sensor file."""
    entry = robot.file.fingers[finger]
    return described(entry, model_of_finger(entry), robot.file.period)


def _leaves(value: object, path: tuple[Key, ...] = ()) -> Iterator[tuple[tuple[Key, ...], object]]:
    """Every value that is no mapping, with its path; a list of numbers is one value."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _leaves(item, (*path, key))
    elif isinstance(value, list | tuple) and any(isinstance(item, dict) for item in value):
        for i, item in enumerate(value):
            yield from _leaves(item, (*path, i))
    else:
        yield path, tuple(value) if isinstance(value, list) else value


def _bare(key: Key) -> Key:
    return without_unit(key) if isinstance(key, str) else key


def _with_unit(value: object, path: tuple[Key, ...]) -> str:
    return "not limited" if value == () else f"{_shown(value)} {unit_of(str(path[-1]))}".rstrip()


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(map(_shown, value))
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def _sensor_line(sensor: SensorFile) -> str:
    forces = " ".join(f"{x:g}" for x in sensor.force_range)
    moments = " ".join(f"{x:g}" for x in sensor.moment_range)
    return f"{sensor.model}, number {sensor.serial_number}, up to {forces} N and {moments} N m"
