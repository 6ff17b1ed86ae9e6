"""`palpate robot`: lists the robots that come with palpate, and shows and checks robot files."""

import sys
from collections.abc import Iterator

import msgspec

from palpate.commands.command_result import CommandResult
from palpate.commands.devices.config import RobotCheckConfig, RobotListConfig, RobotShowConfig
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


def run_list(config: RobotListConfig) -> CommandResult:
    """Print the name and the first line of every robot that comes with palpate."""
    robots = {name: load_robot(name).file for name in shipped_robots()}
    widest = max(map(len, robots))
    shown = tuple(f"{name:<{widest}}  {file.name}" for name, file in robots.items())
    rows = [
        {"name": name, "about": file.name, "kind": name_of_kind(file.backend)} for name, file in robots.items()
    ]
    return CommandResult(facts={"robots": rows}, shown=shown)


def run_show(config: RobotShowConfig) -> CommandResult:
    """Print a robot file or one of its sensor files; a simulated sensor without a file is printed as one.

    Raises:
        InvalidValueError: If there is no such robot, no such finger, or something in the files is wrong.
    """
    robot, i = load_named_robot(config.robot), config.sensor
    if i is None:
        text = robot.texts[ROBOT_TEXT]
    elif i >= len(robot.file.fingers):
        raise InvalidValueError(f"sensor = {i}: the last finger is {len(robot.file.fingers) - 1}")
    elif robot.sensors[i] is not None:
        text = robot.texts[SENSOR_TEXT.format(i)]
    else:
        sensor = _sensor_file(robot, i)
        if sensor is None:
            raise InvalidValueError(f"sensor = {i}: this finger has no sensor file; its sensor has no flaws")
        text = sensor_text(sensor)
    sys.stdout.write(text)
    return CommandResult(facts={"robot" if i is None else "sensor": read_yaml(text)})


def run_check(config: RobotCheckConfig) -> CommandResult:
    """Print every value of a robot file as palpate reads it.

    Raises:
        InvalidValueError: If there is no such robot, or something in its files is wrong.
    """
    robot, path = load_named_robot(config.robot), robot_path(config.robot)
    try:
        largest_force = check(robot)
    except InvalidValueError as error:
        raise InvalidValueError(f"{path}: {error}") from None
    written = {place for place, _ in _leaves(read_yaml(robot.texts[ROBOT_TEXT]))}
    rows = []
    for place, value in _leaves(as_written(robot.file)):
        *above, key = place
        name = shown_path((*above, without_unit(key) if isinstance(key, str) else key))
        text = "not limited" if value == () else f"{_shown(value)} {unit_of(str(key))}".rstrip()
        rows.append((name, text, "" if place in written else "default"))
    names, values = (max(len(row[column]) for row in rows) for column in (0, 1))
    lines = [f"  {name:<{names}}  {value:<{values}}  {note}".rstrip() for name, value, note in rows]
    sensors = [_sensor_file(robot, i) for i in range(len(robot.sensors))]
    lines += [
        f"  sensor of finger {i}: {sensor.model}, number {sensor.serial_number}, up to "
        f"{_shown(sensor.force_range)} N and {_shown(sensor.moment_range)} N m"
        for i, sensor in enumerate(sensors)
        if sensor is not None
    ]
    if largest_force is not None:
        lines.append(f"  largest force at these limits: {largest_force}")
    remarks, risk = robot.file.backend.remarks(robot), _unchecked_sensors(robot)
    lines += [f"  {remark}" for remark in remarks]
    outcome = "All in order."
    return CommandResult(
        outcome=outcome,
        shown=(str(path), *lines, *([risk] if risk else []), outcome),
        facts={
            "file": path,
            "robot": as_written(robot.file),
            "defaults": [name for name, _, note in rows if note],
            "largest_force_N": None if largest_force is None else largest_force.force,
            "remarks": remarks,
            "risk": risk,
            "sensors": [None if sensor is None else msgspec.to_builtins(sensor) for sensor in sensors],
        },
    )


def _unchecked_sensors(robot: Robot) -> str:
    """Return the risk of sensors that no second force measurement checks; "" if the arm measures force, too.

    A CB3 arm, which measures none, is compared with a model of its servos (`palpate.runtime.servo_following`).
    """
    if robot.file.backend.has_hand(robot):
        reason = "the force of each finger is measured by its own sensor alone"
    elif not robot.file.backend.measures_force:
        reason = "no arm measures the force as well"
    elif any(finger.sensor_device is not None and finger.sensor_device.in_arm for finger in robot.file.fingers):
        return (
            "The arm's sensor is the fingertip's sensor, too: beside it only how far the arm gives way shows a "
            "push; see that its stiffness_N_per_m, response_s and lag_s are as pressing finds them (--identify)."
        )
    else:
        return ""
    return (
        f"No second channel: {reason}; a sensor that shows too little is trusted, and the robot may press harder "
        "than limits.force_N."
    )


def _sensor_file(robot: Robot, i: int) -> SensorFile | None:
    """Return the sensor file of finger i, or a description of its simulated sensor; None if it has no flaws."""
    entry = robot.file.fingers[i]
    return robot.sensors[i] or described(entry, model_of_finger(entry), robot.file.period)


def _leaves(value: object, path: tuple[Key, ...] = ()) -> Iterator[tuple[tuple[Key, ...], object]]:
    """Yield every value that is no mapping, with its path; a list of numbers is one value."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _leaves(item, (*path, key))
    elif isinstance(value, list | tuple) and any(isinstance(item, dict) for item in value):
        for i, item in enumerate(value):
            yield from _leaves(item, (*path, i))
    else:
        yield path, tuple(value) if isinstance(value, list) else value


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(map(_shown, value))
    return f"{value:.12g}" if isinstance(value, float) else str(value)
