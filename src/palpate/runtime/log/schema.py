"""Schemas as ROS 2 message definitions (encoding `ros2msg`), units in the comments.

Dependencies follow after a line of 80 "=" and a line "MSG: package/Type", as `ros2 bag` and Foxglove have it
(https://mcap.dev/spec/registry#ros2msg). palpate's own types are the same for every robot, whatever joints and
fingers it has: `examples/ros2/palpate_msgs` holds them for colcon.
"""

from collections.abc import Iterable, Mapping

from palpate.runtime.log.fields import FINGER, HAND, PACKAGE, TRUTH, Codes, LogField, LogGroup, period_groups
from palpate.runtime.log.layout import Layout

PERIOD, PARAMETER = f"{PACKAGE}/Period", f"{PACKAGE}/Parameter"
EVENT = "rcl_interfaces/Log"

_SEPARATOR = "=" * 80
_EVERYTHING = Layout(joints=1, hand_joints=1, channels=(1,), grips=1, finger_velocities=1, tip_force=True)
"""A robot of which nothing is absent: its messages have every field there may be."""

PLAIN_TYPES = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    EVENT: """# What happened besides the periods: trips, endings, notes. Fields as in rcl_interfaces/msg/Log.
byte DEBUG=10
byte INFO=20
byte WARN=30
byte ERROR=40
byte FATAL=50
builtin_interfaces/Time stamp
uint8 level
string name  # who says so
string msg
string file  # not used
string function  # exact time on the back end's clock [s], 17 digits
uint32 line  # not used
""",
}
"""Types of others, as far as palpate's own messages need them."""

PARAMETER_DEFINITION = """# A live parameter was given a new value to go to.
builtin_interfaces/Time stamp
float64 time  # [s] of the first period that it acts in, on the back end's clock
float64 value  # in the parameter's own unit
string name
"""


def own_types(codes: Codes, truth: tuple[str, ...] = ()) -> Mapping[str, str]:
    """Return the definition of each of palpate's own types by name.

    Args:
        codes: Names of phases, statuses and measures, which become constants.
        truth: Names of the numbers of the truth in this run, for a comment.
    """
    lines = [
        "# One control period. SI; base and sensor coordinates as each line says.",
        "builtin_interfaces/Time stamp",
    ]
    found: dict[str, str] = {}
    for group in period_groups(_EVERYTHING, codes):
        if group.name:
            lines.append(_member(group))
            found[group.type_name] = "".join(f"{line}\n" for line in _definitions(group.fields))
        else:
            lines += _definitions(group.fields)
    names = f": {', '.join(truth)}" if truth else "; empty on a robot"
    lines.append(f"float64[] {TRUTH}  # as the simulation knows it{names}")
    return {PERIOD: "".join(f"{line}\n" for line in lines), **found, PARAMETER: PARAMETER_DEFINITION}


def schema(name: str, types: Mapping[str, str]) -> str:
    """Return the definition of a type, and behind it those of all that it consists of.

    Args:
        name: As package/Type.
        types: Definition of each type by name.
    """
    needed = [name]
    for each in needed:
        needed += [part for part in dict.fromkeys(_parts(types[each])) if part in types and part not in needed]
    others = (f"{_SEPARATOR}\nMSG: {part}\n{types[part]}" for part in needed[1:])
    return types[name] + "".join(others)


def full_name(name: str) -> str:
    """Return package/msg/Type for package/Type."""
    package, _, kind = name.partition("/")
    return f"{package}/msg/{kind}"


def _parts(definition: str) -> Iterable[str]:
    for line in definition.splitlines():
        yield line.split(" ", 1)[0].partition("[")[0]


def _member(group: LogGroup) -> str:
    if group.type_name == FINGER:
        return f"{FINGER}[] fingers"
    if group.name == HAND:
        return f"{group.type_name}[] {HAND}  # none or one"
    return f"{group.type_name} {group.name}"


def _definitions(fields: tuple[LogField, ...]) -> list[str]:
    lines = []
    for quantity in fields:
        lines += [f"uint8 {quantity.name.upper()}_{name}={value}" for value, name in enumerate(quantity.codes)]
        length = "[]" if quantity.varies else f"[{quantity.count}]" if quantity.is_array else ""
        units = ", ".join(dict.fromkeys(unit for unit in quantity.units if unit))
        unit = f"[{units}] " if units else ""
        few = "" if quantity.is_array or not quantity.varies else ", or none"
        lines.append(f"{quantity.ros_type}{length} {quantity.name}  # {unit}{quantity.comment}{few}")
    return lines
