"""The controller itself: variables, power, safety, the program, and the motion; one cycle after the other."""

import math
from collections import deque
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from palpate.errors import InvalidValueError
from palpate.hw.emulators.server import PlantState
from palpate.hw.emulators.ur.arm import STILL, Arm, ArmMounting, Tool, Twist, numbers_of
from palpate.hw.emulators.ur.motion import ArmMotion, Braking, Compliance, Rest
from palpate.spatial import norm

Program = Generator[None, None, None]
"""Running program: one `yield` is one controller cycle."""

Values = tuple[float, ...]
"""Value of a variable: one number or several."""

MAJOR_VERSIONS = (3, 5, 10)
"""CB3, e-Series, PolyScope X."""

REGISTERS = 48
"""Registers of each kind; the upper half belongs to external clients, the lower to programs and field buses."""

STOPPING = 10.0
"""Deceleration when a program ends [m/s^2, rad/s^2]: that of ur_rtde's own stops."""

MAX_SPEED, MAX_TURNING = 5.0, 20.0
"""[m/s, rad/s] of the TCP above which the safety system stops the arm: 5 m/s is the widest limit of an e-Series;
that of turning is assumed."""

VOLTAGE_SPAN = 10.0
"""[V] of an analog output."""

MIN_CURRENT, CURRENT_SPAN = 4.0, 16.0
"""[mA] of an analog output: 4 to 20 mA."""

LOGGED = 2000
"""Lines of the log that are kept, of inputs and of everything else."""

WRITTEN = "inputs"
"""Log entry of new values of inputs: a stream of them does not push out the rest of the log."""

HISTORY = 500
"""Cycles of which joint positions are kept: one second [A]."""

_DIGITAL = (("standard", 0), ("configurable", 8), ("tool", 16))
"""Offset of each kind in `actual_digital_output_bits`."""

_POWER_ON, _PROGRAM_RUNNING = 1 << 0, 1 << 1
"""Bits of `robot_status_bits`."""

_Entry = tuple[float, str, dict[str, object]]


class ControllerVersion(NamedTuple):
    """Software version of a UR controller: major is 3 for CB3, 5 for e-Series, 10 for PolyScope X."""

    major: int = 5
    minor: int = 14
    bugfix: int = 0
    build: int = 1

    @property
    def rate(self) -> float:
        """Controller cycles per second: 125 of a CB3, 500 of all later ones."""
        return 125.0 if self.major < 5 else 500.0

    @property
    def has_dashboard(self) -> bool:
        """Whether there is a dashboard server; PolyScope X has none."""
        return self.major < 10

    def __str__(self) -> str:
        return ".".join(map(str, self))


@dataclass(frozen=True, slots=True)
class VariableType:
    """Type of a variable: its name in recipes, its `struct` code, and how many numbers it has."""

    title: str
    code: str
    count: int = 1


DOUBLE, INT32, UINT32 = VariableType("DOUBLE", "d"), VariableType("INT32", "i"), VariableType("UINT32", "I")
UINT64, UINT8 = VariableType("UINT64", "Q"), VariableType("UINT8", "B")
VECTOR3D, VECTOR6D = VariableType("VECTOR3D", "3d", 3), VariableType("VECTOR6D", "6d", 6)
VECTOR6INT32 = VariableType("VECTOR6INT32", "6i", 6)

_OUTPUTS = {
    DOUBLE: "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum "
    "actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1 "
    "standard_analog_output0 standard_analog_output1",
    VECTOR6D: "target_q target_qd target_qdd target_current target_moment actual_q actual_qd "
    "actual_current joint_control_output actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose "
    "target_TCP_speed joint_temperatures actual_joint_voltage",
    VECTOR3D: "actual_tool_accelerometer",
    VECTOR6INT32: "joint_mode",
    INT32: "robot_mode safety_mode",
    UINT32: "runtime_state robot_status_bits safety_status_bits",
    UINT64: "actual_digital_input_bits actual_digital_output_bits",
}

_SINCE = (
    ("payload", DOUBLE, (3, 11, 0), (5, 5, 1)),
    ("payload_cog", VECTOR3D, (3, 11, 0), (5, 5, 1)),
    ("payload_inertia", VECTOR6D, (3, 15, 0), (5, 11, 0)),
    ("ft_raw_wrench", VECTOR6D, None, (5, 9, 0)),
    ("actual_current_as_torque", VECTOR6D, None, (5, 23, 0)),
)
"""Later additions, with their first release for a CB3 (None: never) and for later controllers."""

_INPUT_NAMES = {
    VECTOR6D: ["external_force_torque"],
    UINT32: ["speed_slider_mask"],
    DOUBLE: ["speed_slider_fraction", "standard_analog_output_0", "standard_analog_output_1"],
    UINT8: [f"{kind}_digital_output{end}" for kind, _ in _DIGITAL for end in ("_mask", "")]
    + ["standard_analog_output_mask", "standard_analog_output_type"],
}

_REGISTERS = {
    f"{kind}_register_{i}": DOUBLE if kind == "double" else INT32
    for kind in ("int", "double")
    for i in range(REGISTERS)
}

INPUTS: dict[str, VariableType] = {name: kind for kind, names in _INPUT_NAMES.items() for name in names} | {
    f"input_{name}": kind for name, kind in _REGISTERS.items()
}

_STEADY: dict[str, Values] = {
    "joint_mode": (253,) * 6,
    "joint_temperatures": (30.0,) * 6,
    "actual_joint_voltage": (48.0,) * 6,
    "actual_main_voltage": (48.0,),
    "actual_robot_voltage": (48.0,),
    "actual_robot_current": (0.5,),
    "actual_tool_accelerometer": (0.0, 0.0, 9.82),
}
"""Constant outputs: plausible readings of a healthy robot. Joint mode 253 is RUNNING."""


def outputs_of(version: ControllerVersion) -> dict[str, VariableType]:
    """Return the outputs of a controller and their types."""
    types = {name: kind for kind, names in _OUTPUTS.items() for name in names.split()}
    types |= {f"{way}put_{name}": kind for way in ("out", "in") for name, kind in _REGISTERS.items()}
    for name, kind, old, new in _SINCE:
        since = old if version.major < 5 else new
        if since is not None and version[:3] >= since:
            types[name] = kind
    return types


def _zeros(types: Mapping[str, VariableType]) -> dict[str, Values]:
    return {name: (0.0,) * kind.count if "d" in kind.code else (0,) * kind.count for name, kind in types.items()}


class RuntimeState(IntEnum):
    """State of the program; ur_rtde takes PLAYING for running and STOPPED for stopped, nothing else."""

    STOPPED = 1
    PLAYING = 2
    PAUSED = 4


class RobotMode(IntEnum):
    """State of the arm's power."""

    POWER_OFF = 3
    IDLE = 5
    RUNNING = 7


class SafetyMode(IntEnum):
    """State of the safety system, as far as emulated."""

    NORMAL = 1
    PROTECTIVE_STOP = 3
    ROBOT_EMERGENCY_STOP = 7


_SAFETY_BITS = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | 1 << 10,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | 1 << 7 | 1 << 10,
}
"""`safety_status_bits`: normal; protective stop; robot emergency stop, emergency stop; stopped."""


class EmulatedController:
    """State that the three servers of a controller share.

    Attributes:
        version: Version of the software.
        period: Duration of a cycle [s].
        arm: Arm as measured.
        tool: Load and sensor.
        inputs: Inputs of RTDE, as last written.
        outputs: Outputs of RTDE.
        speed: Speed slider, fraction of full speed.
        motion: Motion of the arm.
        compliance: Compliant axes; None for none.
        mode: State of the power.
        safety: State of the safety system.
        runtime: State of the program.
        time: Controller's clock [s].
        history: Joint positions of the last cycles, newest last.
        twist: Twist of the TCP that is commanded to the plant.
        dropped: Packages of clients that were not understood, and were ignored.
    """

    def __init__(self, version: ControllerVersion, mounting: ArmMounting, unlock_delay: float) -> None:
        """Power on, at rest, without a program.

        Args:
            version: Version of the software.
            mounting: Mounting of the arm.
            unlock_delay: Time for which a protective stop cannot be unlocked [s].

        Raises:
            InvalidValueError: If there is no such version.
        """
        if version.major not in MAJOR_VERSIONS or not all(0 <= part < 2**32 for part in version):
            raise InvalidValueError(
                f"controller version {version}: major must be 3, 5 or 10, the others 0 or above"
            )
        self.version, self.period = version, 1.0 / version.rate
        self.arm, self.tool = Arm(mounting), Tool()
        self.inputs, self.outputs = _zeros(INPUTS), _zeros(outputs_of(version)) | _STEADY
        self.speed = 1.0
        self._digital, self._analog = 0, [0.0, 0.0]
        self.motion: ArmMotion = Rest()
        self.compliance: Compliance | None = None
        self.mode, self.safety, self.runtime = RobotMode.RUNNING, SafetyMode.NORMAL, RuntimeState.STOPPED
        self._watched, self._watchdog, self._fed = "", math.inf, 0.0
        self.time, self.dropped = 0.0, 0
        self.history: deque[tuple[float, ...]] = deque(maxlen=HISTORY)
        self._events: deque[_Entry] = deque(maxlen=LOGGED)
        self._written: deque[_Entry] = deque(maxlen=LOGGED)
        self.twist: Twist = STILL
        self._program: Program | None = None
        self._unlock_delay, self._stopped_at = unlock_delay, -math.inf
        self._cycled_at = 0.0

    def measure(self, state: PlantState) -> None:
        """Take the measurements of a cycle."""
        self.time = state.time
        reached = not self.arm.out_of_reach
        self.arm.measure(state)
        if reached and self.arm.out_of_reach:
            # once: after unlocking, the tip may be moved back
            self.protective_stop("the arm does not reach there")
        self.history.append(self.arm.joints)
        arm, tool, out = self.arm, self.tool, self.outputs
        force, torque = tool.felt(arm)
        playing = self.runtime is RuntimeState.PLAYING
        powered = 0 if self.mode is RobotMode.POWER_OFF else _POWER_ON
        pose, twist = numbers_of(arm.tcp), (*arm.twist[0], *arm.twist[1])
        measured: dict[str, Values] = {
            "timestamp": (state.time,),
            "actual_q": arm.joints,
            "target_q": arm.joints,
            "actual_qd": arm.joint_speeds,
            "target_qd": arm.joint_speeds,
            "actual_TCP_pose": pose,
            "target_TCP_pose": pose,
            "actual_TCP_speed": twist,
            "target_TCP_speed": (*self.twist[0], *self.twist[1]),
            "actual_TCP_force": (*force, *torque),
            "robot_mode": (self.mode,),
            "safety_mode": (self.safety,),
            "safety_status_bits": (_SAFETY_BITS[self.safety],),
            "robot_status_bits": (powered | (_PROGRAM_RUNNING if playing else 0),),
            "runtime_state": (self.runtime,),
            "speed_scaling": (self.speed if playing else 0.0,),
            "target_speed_fraction": (self.speed,),
            "actual_digital_output_bits": (self._digital,),
            "standard_analog_output0": (self._analog[0],),
            "standard_analog_output1": (self._analog[1],),
            # a recipe has them only if the version does
            "payload": (tool.mass,),
            "payload_cog": tool.center,
            "ft_raw_wrench": arm.sensed,
        }
        out.update(measured)

    def cycle(self) -> None:
        """Run program and motion for one cycle; then `twist` is the command to the plant."""
        elapsed, self._cycled_at = self.time - self._cycled_at, self.time
        if self.mode is not RobotMode.RUNNING or self.safety is not SafetyMode.NORMAL:
            self.twist = STILL
            return
        if self.runtime is RuntimeState.PLAYING:
            if self.time - self._fed > self._watchdog:
                self.end_program("watchdog")
            else:
                self._run()
        twist = self.motion.twist(self.arm, elapsed, self.speed)
        if self.compliance is not None:
            twist = self.compliance.overlaid(twist, *self.tool.felt(self.arm))
        if norm(twist[0]) <= MAX_SPEED and norm(twist[1]) <= MAX_TURNING:
            self.twist = twist
        else:
            self.protective_stop(f"tool faster than {MAX_SPEED:g} m/s or {MAX_TURNING:g} rad/s")

    def write(self, values: Mapping[str, Values]) -> None:
        """Take inputs from a client; they stay until they are overwritten."""
        if any(self.inputs[name] != value for name, value in values.items()):
            # streams repeat themselves; the log does not
            self.note(WRITTEN, **values)
        self.inputs.update(values)
        # registers are sent back with the next state
        self.outputs.update({name: value for name, value in values.items() if name in self.outputs})
        self._switch_outputs(values)
        fraction = self.inputs["speed_slider_fraction"][0]
        if self.inputs["speed_slider_mask"][0] and 0.0 <= fraction <= 1.0:
            self.speed = fraction
        if self._watched in values:
            self._fed = self.time

    def watch(self, name: str, frequency: float) -> None:
        """Set the watchdog: an input must be written at a frequency [Hz]; 0 for never."""
        self._watched, self._fed = name, self.time
        self._watchdog = 1.0 / frequency if frequency > 0.0 else math.inf

    def start_program(self, program: Program, title: str) -> bool:
        """Run a program in place of the present one, from the next cycle on; return whether that is possible."""
        if self.mode is not RobotMode.RUNNING or self.safety is not SafetyMode.NORMAL:
            self.note("refused", program=title)
            return False
        self.end_program("replaced")
        self._program, self.runtime = program, RuntimeState.PLAYING
        self.note("program", title=title)
        return True

    def end_program(self, why: str) -> None:
        """End the program, if there is one; the arm comes to rest."""
        if self.runtime is not RuntimeState.STOPPED:
            self.note("ended", why=why)
        if self._program is not None:
            self._program.close()
        self._program, self.runtime = None, RuntimeState.STOPPED
        self._watchdog = math.inf
        self.compliance = None
        if not isinstance(self.motion, Rest):
            self.motion = Braking(self.twist, STOPPING)

    def pause(self) -> bool:
        """Pause the program; return whether there is one."""
        if self.runtime is RuntimeState.PLAYING:
            self.runtime, self.motion = RuntimeState.PAUSED, Braking(self.twist, STOPPING)
        return self.runtime is RuntimeState.PAUSED

    def protective_stop(self, why: str) -> None:
        """Stop the arm where it is; the program is paused and cannot be resumed."""
        if self.safety is SafetyMode.NORMAL:
            self.note("protective stop", why=why)
            self.safety, self._stopped_at = SafetyMode.PROTECTIVE_STOP, self.time
            if self.runtime is RuntimeState.PLAYING:
                self.runtime = RuntimeState.PAUSED
            self.motion, self.compliance, self.twist = Rest(), None, STILL

    def unlock(self, *, by_hand: bool = False) -> bool:
        """Unlock a protective stop; return whether that is allowed already."""
        if not by_hand and self.time - self._stopped_at < self._unlock_delay:
            return False
        if self.safety is SafetyMode.PROTECTIVE_STOP:
            self.note("unlocked")
            self.safety = SafetyMode.NORMAL
        return True

    def press_emergency_stop(self, pressed: bool) -> None:
        """Press the button, or release it; the power stays off until it is switched on."""
        if pressed:
            self.note("emergency stop")
            self.end_program("emergency stop")
            self.motion, self.twist = Rest(), STILL
            self.safety, self.mode = SafetyMode.ROBOT_EMERGENCY_STOP, RobotMode.POWER_OFF
        elif self.safety is SafetyMode.ROBOT_EMERGENCY_STOP:
            self.safety = SafetyMode.NORMAL

    def switch(self, mode: RobotMode) -> None:
        """Switch power and brakes; off ends the program, and an emergency stop keeps the power off."""
        already_on = mode is RobotMode.IDLE and self.mode is RobotMode.RUNNING
        if self.safety is SafetyMode.ROBOT_EMERGENCY_STOP or mode is self.mode or already_on:
            return
        if mode is not RobotMode.RUNNING:
            self.end_program("power")
            self.motion, self.twist = Rest(), STILL
        self.mode = mode

    def note(self, what: str, **details: object) -> None:
        """Write a line into the log."""
        (self._written if what == WRITTEN else self._events).append((self.time, what, details))

    def drop(self, what: str, **details: object) -> None:
        """Count a package that was not understood, and log it."""
        self.dropped += 1
        self.note(what, **details)

    def lines(self) -> list[str]:
        """Return the log, oldest first."""
        entries = sorted([*self._events, *self._written], key=lambda entry: entry[0])
        return [
            f"{time:.3f} {what} " + " ".join(f"{name}={value}" for name, value in details.items())
            for time, what, details in entries
        ]

    def _switch_outputs(self, values: Mapping[str, Values]) -> None:
        """Switch the digital and analog outputs whose bits are set in their masks."""
        for kind, first in _DIGITAL:
            mask = int(values.get(f"{kind}_digital_output_mask", (0,))[0]) << first
            bits = int(values.get(f"{kind}_digital_output", (0,))[0]) << first
            self._digital = (self._digital & ~mask) | (bits & mask)
        mask = int(values.get("standard_analog_output_mask", (0,))[0])
        voltages = int(values.get("standard_analog_output_type", (0,))[0])
        for i in range(2):
            if mask >> i & 1:
                share = min(1.0, max(0.0, values.get(f"standard_analog_output_{i}", (0.0,))[0]))
                voltage = voltages >> i & 1
                self._analog[i] = share * VOLTAGE_SPAN if voltage else MIN_CURRENT + share * CURRENT_SPAN

    def _run(self) -> None:
        if self._program is None:
            return
        try:
            next(self._program)
        except StopIteration:
            self._program = None
            self.end_program("over")
        except InvalidValueError as error:
            # a runtime error of URScript ends its program
            self._program = None
            self.end_program(f"error: {error}")
