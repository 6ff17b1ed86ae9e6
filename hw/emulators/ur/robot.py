"""The controller itself: power, safety, the program, what moves the arm; one cycle after the other."""

import math
from collections import deque
from collections.abc import Generator, Mapping

from palpate.errors import InvalidValueError
from palpate.hw.emulators.plant import PlantState
from palpate.hw.emulators.ur.arm import STILL, Arm, ArmMounting, Twist, numbers_of
from palpate.hw.emulators.ur.channels import Channels
from palpate.hw.emulators.ur.force_mode import Compliance
from palpate.hw.emulators.ur.motions import ArmMotion, Braking, Rest
from palpate.hw.emulators.ur.status import (
    JOINT_RUNNING,
    POWER_ON,
    PROGRAM_RUNNING,
    RobotMode,
    RuntimeState,
    SafetyMode,
)
from palpate.hw.emulators.ur.tool import Tool
from palpate.hw.emulators.ur.variables import INPUTS, Values, nothing, outputs_of
from palpate.hw.emulators.ur.version import ControllerVersion
from palpate.hw.emulators.ur.watchdog import Watchdog
from palpate.spatial import norm

Program = Generator[None, None, None]
"""What runs: one `yield` is one controller cycle."""

STOPPING = 10.0
"""[m/s^2, rad/s^2] with which the arm comes to rest when a program ends: that of ur_rtde's own stops."""

FASTEST, FASTEST_TURN = 5.0, 20.0
"""[m/s, rad/s] of the TCP above which the safety system stops the arm: 5 m/s is the widest limit of an e-Series;
that of turning is made up."""

LOGGED = 2000
"""Lines of the log that are kept, of what clients wrote and of everything else."""

WRITTEN = "inputs"
"""What the log calls new values of inputs: a stream of them does not push out the rest of the log."""

_Entry = tuple[float, str, dict[str, object]]

HISTORY = 500
"""Cycles of which joint positions are remembered: one second [A]."""


class EmulatedController:
    """All that the three servers of a controller share.

    Attributes:
        version: Of the software.
        period: Of a cycle [s].
        arm: As measured.
        tool: Load and sensor.
        inputs: Of RTDE, as last written by anybody.
        outputs: Of RTDE.
        channels: Digital and analog outputs, speed slider.
        motion: What the arm is doing.
        compliance: Which axes are compliant; None for none.
        mode: Of the power.
        safety: Of the safety system.
        runtime: Of the program.
        watchdog: That a client may set.
        time: Of the controller [s].
        history: Joint positions of the last cycles, newest last.
        twist: Of the TCP that is asked of the plant.
    """

    def __init__(self, version: ControllerVersion, mounting: ArmMounting, unlock_delay: float) -> None:
        """Power on, at rest, no program.

        Args:
            version: Of the software.
            mounting: How the arm stands.
            unlock_delay: How long a protective stop cannot be unlocked [s].
        """
        self.version, self.period = version, 1.0 / version.rate
        self.arm, self.tool, self.channels = Arm(mounting), Tool(), Channels()
        self.inputs, self.outputs = nothing(INPUTS), nothing(outputs_of(version))
        self.outputs |= _steady(self.outputs)
        self.motion: ArmMotion = Rest()
        self.compliance: Compliance | None = None
        self.mode, self.safety, self.runtime = RobotMode.RUNNING, SafetyMode.NORMAL, RuntimeState.STOPPED
        self.watchdog = Watchdog()
        self.time = 0.0
        self.history: deque[tuple[float, ...]] = deque(maxlen=HISTORY)
        self._events: deque[_Entry] = deque(maxlen=LOGGED)
        self._written: deque[_Entry] = deque(maxlen=LOGGED)
        self.twist: Twist = STILL
        self._program: Program | None = None
        self._unlock_delay, self._stopped_at = unlock_delay, -math.inf
        self._cycled_at = 0.0

    def measure(self, state: PlantState) -> None:
        """Take what the plant is like, and fill the outputs."""
        self.time = state.time
        reached = not self.arm.out_of_reach
        self.arm.measure(state)
        if reached and self.arm.out_of_reach:
            # once: when unlocked, it may be taken back
            self.protective_stop("the arm does not reach there")
        self.history.append(self.arm.joints)
        arm, tool, out = self.arm, self.tool, self.outputs
        force, torque = tool.felt(arm)
        playing = self.runtime is RuntimeState.PLAYING
        out["timestamp"] = (state.time,)
        out["actual_q"] = out["target_q"] = arm.joints
        out["actual_qd"] = out["target_qd"] = arm.joint_speeds
        out["actual_TCP_pose"] = out["target_TCP_pose"] = numbers_of(arm.tcp)
        out["actual_TCP_speed"] = (*arm.twist[0], *arm.twist[1])
        out["target_TCP_speed"] = (*self.twist[0], *self.twist[1])
        out["actual_TCP_force"] = (*force, *torque)
        out["robot_mode"], out["safety_mode"] = (self.mode,), (self.safety,)
        out["safety_status_bits"] = (self.safety.bits,)
        powered = POWER_ON if self.mode is not RobotMode.POWER_OFF else 0
        out["robot_status_bits"] = (powered | (PROGRAM_RUNNING if playing else 0),)
        out["runtime_state"] = (self.runtime,)
        out["speed_scaling"] = (self.channels.speed if playing else 0.0,)
        out["target_speed_fraction"] = (self.channels.speed,)
        out["actual_digital_output_bits"] = (self.channels.digital,)
        out["standard_analog_output0"], out["standard_analog_output1"] = ((a,) for a in self.channels.analog)
        if "payload" in out:
            out["payload"], out["payload_cog"] = (tool.mass,), tool.center
        if "payload_inertia" in out:
            out["payload_inertia"] = tool.inertia
        if "ft_raw_wrench" in out:
            out["ft_raw_wrench"] = arm.sensed

    def cycle(self) -> None:
        """Run the program and the motion for one cycle; the twist for the plant is in `twist` then."""
        elapsed, self._cycled_at = self.time - self._cycled_at, self.time
        self.channels.speed_from(self.inputs)
        if self.mode is not RobotMode.RUNNING or self.safety is not SafetyMode.NORMAL:
            self.twist = STILL
            return
        if self.runtime is RuntimeState.PLAYING:
            if self.watchdog.expired(self.time):
                self.end_program("watchdog")
            else:
                self._run()
        twist = self.motion.twist(self.arm, elapsed, self.channels.speed)
        if self.compliance is not None:
            twist = self.compliance.overlaid(twist, *self.tool.felt(self.arm))
        if norm(twist[0]) <= FASTEST and norm(twist[1]) <= FASTEST_TURN:
            self.twist = twist
        else:
            self.protective_stop(f"tool faster than {FASTEST:g} m/s or {FASTEST_TURN:g} rad/s")

    def write(self, values: Mapping[str, Values]) -> None:
        """Take inputs from a client; they stay until somebody overwrites them."""
        if any(self.inputs[name] != value for name, value in values.items()):
            # streams repeat themselves; the log does not
            self.note(WRITTEN, **values)
        self.inputs.update(values)
        # registers are sent back with the next state
        self.outputs.update({name: value for name, value in values.items() if name in self.outputs})
        self.channels.write(values)
        self.watchdog.see(values, self.time)

    def start_program(self, program: Program, title: str) -> bool:
        """Run a program in the place of the present one, from the next cycle on; return whether it may."""
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
        self.watchdog.off()
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
        """Press the button, or pull it out again; power stays off until somebody switches it on."""
        if pressed:
            self.note("emergency stop")
            self.end_program("emergency stop")
            self.motion, self.twist = Rest(), STILL
            self.safety, self.mode = SafetyMode.ROBOT_EMERGENCY_STOP, RobotMode.POWER_OFF
        elif self.safety is SafetyMode.ROBOT_EMERGENCY_STOP:
            self.safety = SafetyMode.NORMAL

    def switch(self, mode: RobotMode) -> None:
        """Switch power and brakes; off ends the program, and an emergency stop lets nothing come on."""
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

    def lines(self) -> list[str]:
        """Return the log, oldest first."""
        entries = sorted([*self._events, *self._written], key=lambda entry: entry[0])
        return [
            f"{time:.3f} {what} " + " ".join(f"{name}={value}" for name, value in details.items())
            for time, what, details in entries
        ]

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


def _steady(outputs: Mapping[str, Values]) -> dict[str, Values]:
    """What does not change: plausible readings of a healthy robot."""
    readings: dict[str, Values] = {
        "joint_mode": (JOINT_RUNNING,) * 6,
        "joint_temperatures": (30.0,) * 6,
        "actual_joint_voltage": (48.0,) * 6,
        "actual_main_voltage": (48.0,),
        "actual_robot_voltage": (48.0,),
        "actual_robot_current": (0.5,),
        "actual_tool_accelerometer": (0.0, 0.0, 9.82),
    }
    return {name: value for name, value in readings.items() if name in outputs}
