"""Schemas as ROS 2 message definitions (encoding `ros2msg`), units in the comments.

Dependencies follow after a line of 80 "=" and a line "MSG: package/Type", as `ros2 bag` and Foxglove have it
(https://mcap.dev/spec/registry#ros2msg).
"""

from palpate.runtime.log.fields import LogField, LogGroup, walk

PERIOD_TYPE = "palpate/msg/Period"
EVENT_TYPE = "rcl_interfaces/msg/Log"
PARAMETER_TYPE = "palpate/msg/Parameter"

_SEPARATOR = "=" * 80

_TIME = """MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""

_VECTOR = """MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""

_WRENCH = """MSG: geometry_msgs/Wrench
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque
"""

EVENT_SCHEMA = f"""# What happened besides the periods: trips, endings, notes. Fields as in rcl_interfaces/msg/Log.
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
{_SEPARATOR}
{_TIME}"""

PARAMETER_SCHEMA = f"""# A live parameter was given a new value to go to.
builtin_interfaces/Time stamp
float64 time  # [s] of the first period that it acts in, on the back end's clock
float64 value  # in the parameter's own unit
string name
{_SEPARATOR}
{_TIME}"""


def period_schema(groups: tuple[LogGroup, ...]) -> str:
    """Return the definition of one period's message."""
    lines = [
        "# One control period. SI; base and sensor coordinates as each line says.",
        "builtin_interfaces/Time stamp",
    ]
    parts = []
    for group in groups:
        if group.name:
            lines.append(f"{group.type_name} {group.name}")
            parts.append("\n".join([f"MSG: {group.type_name}", *_definitions(group.fields)]) + "\n")
        else:
            lines += _definitions(group.fields)
    used = {quantity.ros_type for _, quantity in walk(groups)}
    parts += [_TIME, _VECTOR]
    if "geometry_msgs/Wrench" in used:
        parts.append(_WRENCH)
    return f"{_SEPARATOR}\n".join(["\n".join(lines) + "\n", *parts])


def _definitions(fields: tuple[LogField, ...]) -> list[str]:
    lines = []
    for quantity in fields:
        lines += [f"uint8 {quantity.name.upper()}_{name}={value}" for value, name in enumerate(quantity.codes)]
        length = f"[{quantity.count}]" if quantity.is_array else ""
        units = ", ".join(dict.fromkeys(unit for unit in quantity.units if unit))
        unit = f"[{units}] " if units else ""
        lines.append(f"{quantity.ros_type}{length} {quantity.name}  # {unit}{quantity.comment}")
    return lines
