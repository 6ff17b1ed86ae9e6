"""What RTDE calls its variables, and of which type each is.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) guide", tables of robot controller outputs and inputs, as
far as ur_rtde 1.6.5 uses them.
"""

from enum import Enum

from palpate.hw.emulators.ur.version import ControllerVersion

REGISTERS = 48
"""Of each kind; the upper half belongs to external clients, the lower to programs and field buses."""

Values = tuple[float, ...]
"""Of a variable: one number or several."""


class VariableType(Enum):
    """Types of variables: the name in recipes, what `struct` calls one, and how many numbers it has."""

    DOUBLE = ("DOUBLE", "d", 1)
    VECTOR3D = ("VECTOR3D", "3d", 3)
    VECTOR6D = ("VECTOR6D", "6d", 6)
    VECTOR6INT32 = ("VECTOR6INT32", "6i", 6)
    INT32 = ("INT32", "i", 1)
    UINT32 = ("UINT32", "I", 1)
    UINT64 = ("UINT64", "Q", 1)
    UINT8 = ("UINT8", "B", 1)

    def __init__(self, title: str, code: str, count: int) -> None:
        self.title = title
        self.code = code
        self.count = count


_OUTPUTS = {
    VariableType.DOUBLE: "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum "
    "actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1 "
    "standard_analog_output0 standard_analog_output1",
    VariableType.VECTOR6D: "target_q target_qd target_qdd target_current target_moment actual_q actual_qd "
    "actual_current joint_control_output actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose "
    "target_TCP_speed joint_temperatures actual_joint_voltage",
    VariableType.VECTOR3D: "actual_tool_accelerometer",
    VariableType.VECTOR6INT32: "joint_mode",
    VariableType.INT32: "robot_mode safety_mode",
    VariableType.UINT32: "runtime_state robot_status_bits safety_status_bits",
    VariableType.UINT64: "actual_digital_input_bits actual_digital_output_bits",
}

_SINCE = (
    ("payload", VariableType.DOUBLE, (3, 11, 0), (5, 5, 1)),
    ("payload_cog", VariableType.VECTOR3D, (3, 11, 0), (5, 5, 1)),
    ("payload_inertia", VariableType.VECTOR6D, (3, 15, 0), (5, 11, 0)),
    ("ft_raw_wrench", VariableType.VECTOR6D, None, (5, 9, 0)),
    ("actual_current_as_torque", VariableType.VECTOR6D, None, (5, 23, 0)),
)
"""Later additions, and since which release of a CB3 (None: never) and of later controllers."""

INPUTS: dict[str, VariableType] = {
    "external_force_torque": VariableType.VECTOR6D,
    "speed_slider_mask": VariableType.UINT32,
    "speed_slider_fraction": VariableType.DOUBLE,
    "standard_analog_output_0": VariableType.DOUBLE,
    "standard_analog_output_1": VariableType.DOUBLE,
    **dict.fromkeys(
        (
            "standard_digital_output_mask",
            "standard_digital_output",
            "configurable_digital_output_mask",
            "configurable_digital_output",
            "tool_digital_output_mask",
            "tool_digital_output",
            "standard_analog_output_mask",
            "standard_analog_output_type",
        ),
        VariableType.UINT8,
    ),
    **{f"input_int_register_{i}": VariableType.INT32 for i in range(REGISTERS)},
    **{f"input_double_register_{i}": VariableType.DOUBLE for i in range(REGISTERS)},
}


def outputs_of(version: ControllerVersion) -> dict[str, VariableType]:
    """Return the outputs of a controller and their types."""
    types = {name: kind for kind, names in _OUTPUTS.items() for name in names.split()}
    types |= {f"output_int_register_{i}": VariableType.INT32 for i in range(REGISTERS)}
    types |= {f"output_double_register_{i}": VariableType.DOUBLE for i in range(REGISTERS)}
    types |= {name: kind for name, kind in INPUTS.items() if "_register_" in name}
    here = (version.major, version.minor, version.bugfix)
    for name, kind, old, new in _SINCE:
        since = old if version.major < 5 else new
        if since is not None and here >= since:
            types[name] = kind
    return types


def nothing(types: dict[str, VariableType]) -> dict[str, Values]:
    """Return the value zero of each variable."""
    return {name: (0.0,) * kind.count if "d" in kind.code else (0,) * kind.count for name, kind in types.items()}
