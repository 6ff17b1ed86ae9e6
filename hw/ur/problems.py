"""Problems of an arm, with their messages and remedies."""

from enum import IntEnum, IntFlag

from palpate.hw.devices import DeviceError, WireError


class SafetyBit(IntFlag):
    """Bits of the controller's safety_status_bits (maker's RTDE guide)."""

    NORMAL = 1 << 0
    REDUCED = 1 << 1
    PROTECTIVE_STOP = 1 << 2
    RECOVERY = 1 << 3
    SAFEGUARD_STOP = 1 << 4
    SYSTEM_EMERGENCY_STOP = 1 << 5
    ROBOT_EMERGENCY_STOP = 1 << 6
    EMERGENCY_STOP = 1 << 7
    VIOLATION = 1 << 8
    FAULT = 1 << 9
    STOPPED = 1 << 10


EMERGENCY = SafetyBit.SYSTEM_EMERGENCY_STOP | SafetyBit.ROBOT_EMERGENCY_STOP | SafetyBit.EMERGENCY_STOP

SAFE = SafetyBit.NORMAL | SafetyBit.REDUCED | SafetyBit.RECOVERY
"""One of these is set while there is no problem."""

RUNNING = 7
"""robot_mode: powered, brakes released (maker's RTDE guide)."""

IDLE = 5
"""robot_mode: powered, brakes on."""

PLAYING = 2
"""runtime_state: a program runs; anything else does not execute commands."""


class Problem(IntEnum):
    """Why an arm must not go on."""

    NONE = 0
    SILENT = 1
    RECEIVE_LOST = 2
    CONTROL_LOST = 3
    PROGRAM_STOPPED = 4
    PROTECTIVE_STOP = 5
    EMERGENCY_STOP = 6
    SAFEGUARD_STOP = 7
    SAFETY_FAULT = 8
    NOT_POWERED = 9
    REFUSED = 10
    RESTARTED = 11
    FAILED = 12
    RUBBISH = 13
    SAFETY_UNKNOWN = 14


FATAL = frozenset({Problem.RECEIVE_LOST, Problem.CONTROL_LOST, Problem.RESTARTED, Problem.RUBBISH, Problem.FAILED})
"""Problems after which the client process ends; a new one is needed."""

_LOOK = "see that controller and network are up, then `palpate recover`"

WORDS: dict[Problem, tuple[str, str]] = {
    Problem.SILENT: ("the controller sends no state any more", _LOOK),
    Problem.RECEIVE_LOST: ("the connection on which it sends its state was lost", _LOOK),
    Problem.CONTROL_LOST: ("the connection that commands it was lost", _LOOK),
    Problem.PROGRAM_STOPPED: (
        "its program was stopped: at the pendant, by the watchdog for want of commands, or by an error of its own",
        "look at the pendant's log, then `palpate recover`",
    ),
    Problem.PROTECTIVE_STOP: (
        "it is in protective stop",
        "clear whatever it ran into, then `palpate recover`",
    ),
    Problem.EMERGENCY_STOP: (
        "its emergency stop is pressed",
        "make the cell safe, release it, then `palpate recover`",
    ),
    Problem.SAFEGUARD_STOP: (
        "it is in safeguard stop",
        "close the safeguard and reset it, then `palpate recover`",
    ),
    Problem.SAFETY_FAULT: (
        "its safety system reports a violation or a fault",
        "look at the pendant, restart the safety system there, then `palpate recover`",
    ),
    Problem.SAFETY_UNKNOWN: (
        "its safety status is no mode: safety_status_bits has none of 1 (normal), 2 (reduced) and 8 (recovery)",
        "look at the pendant, and check that controller and ur_rtde fit together, then `palpate recover`",
    ),
    Problem.NOT_POWERED: (
        "it is not powered, or its brakes are on",
        "`palpate recover` powers it and releases the brakes",
    ),
    Problem.REFUSED: ("it refused a command", "look at the pendant's log, then `palpate recover`"),
    Problem.RESTARTED: ("its clock went back: the controller was started anew", "`palpate recover`"),
    Problem.RUBBISH: ("it sends states that cannot be", "check versions and network, then `palpate recover`"),
    Problem.FAILED: (
        "the process that talks to it failed",
        "`palpate recover`; if it recurs, report its last output",
    ),
}
"""Problem and remedy of each."""


def safety_problem(robot_mode: int, safety_bits: int) -> Problem:
    """Return the problem that the controller's safety system reports, the gravest first."""
    if safety_bits & EMERGENCY:
        return Problem.EMERGENCY_STOP
    if safety_bits & (SafetyBit.VIOLATION | SafetyBit.FAULT):
        return Problem.SAFETY_FAULT
    if safety_bits & SafetyBit.PROTECTIVE_STOP:
        return Problem.PROTECTIVE_STOP
    if safety_bits & (SafetyBit.SAFEGUARD_STOP | SafetyBit.STOPPED):
        return Problem.SAFEGUARD_STOP
    if robot_mode != RUNNING:
        return Problem.NOT_POWERED
    return Problem.NONE if safety_bits & SAFE else Problem.SAFETY_UNKNOWN


class UrRefusal(Exception):  # noqa: N818 -- it becomes a DeviceError in the arm's process
    """The client process cannot carry out a request; its reply carries the reason."""

    def __init__(self, problem: str, remedy: str) -> None:
        """Take the problem and its remedy."""
        super().__init__(f"{problem}; {remedy}")
        self.problem, self.remedy = problem, remedy


WIRE = frozenset({Problem.SILENT, Problem.RECEIVE_LOST, Problem.CONTROL_LOST, Problem.RUBBISH})
"""Problems of cable and network."""


def device_error(device: str, problem: Problem) -> DeviceError:
    """Return the error to raise for a problem of a device."""
    return (WireError if problem in WIRE else DeviceError)(device, *WORDS[problem])


def refusal(problem: Problem) -> UrRefusal:
    """Return the refusal for a problem."""
    return UrRefusal(*WORDS[problem])
