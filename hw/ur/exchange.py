"""What arm and client process put into the memory that they share."""

import mmap
import os
from dataclasses import dataclass
from enum import IntEnum

from palpate.hw.ur.problems import Problem
from palpate.hw.ur.shared_row import SharedRow, size_of

Six = tuple[float, float, float, float, float, float]


class MotionCommand(IntEnum):
    """What a command asks for, and what its numbers are."""

    NONE = 0
    """To stand still, held by the controller."""
    VELOCITY = 1
    """Velocity and angular velocity of the tool, base frame [m/s, rad/s]."""
    JOINTS = 2
    """Joint goals [rad]."""
    POSE = 3
    """Position [m] and rotation vector [rad] of the tool, base frame."""
    FORCE = 4
    """Task frame as a pose, selection, wrench, limits: 6 each."""


class ClientPhase(IntEnum):
    """How far the client process is."""

    STARTING = 0
    LISTENING = 1
    """It receives states; nothing commands the arm yet."""
    READY = 2
    """The arm follows commands."""
    LEAVING = 3
    """It lets go of the arm, and ends."""


COMMAND_NUMBERS = 24
_COMMAND_WIDTH = 3 + COMMAND_NUMBERS


@dataclass(frozen=True, slots=True)
class UrState:
    """The controller's state in one of its cycles.

    Attributes:
        time: When it was sampled at the earliest, as a round trip proves, `time.monotonic` [s].
        seen: When the client process saw it [s].
        controller_time: Its own time stamp [s].
        runtime_state: 2: its program runs.
        robot_mode: 7: powered, brakes released.
        safety_mode: 1: normal.
        safety_bits: See `SafetyBit`.
        speed_scaling: Factor on the speed by which it really moves.
        speed_slider: Where the slider stands.
        joint_position: [rad].
        joint_velocity: [rad/s].
        tool_pose: Position of the tip frame [m] and rotation vector [rad], base frame.
        tool_velocity: Of the tip frame [m/s, rad/s], base frame.
        tool_wrench: Load on the tool, weight of the payload taken off, axes of the base, about the TCP [N, N m].
        raw_wrench: Of the sensor in the flange, as it is [N, N m]; not a number where the controller has none.
        acceleration: Of the accelerometer in the flange, its axes [m/s^2].
        lost: States that were skipped since the connection was made.
    """

    time: float
    seen: float
    controller_time: float
    runtime_state: int
    robot_mode: int
    safety_mode: int
    safety_bits: int
    speed_scaling: float
    speed_slider: float
    joint_position: Six
    joint_velocity: Six
    tool_pose: Six
    tool_velocity: Six
    tool_wrench: Six
    raw_wrench: Six
    acceleration: tuple[float, float, float]
    lost: int


_STATE_WIDTH = 9 + 6 * 6 + 3 + 1
_STATUS_WIDTH = 6


@dataclass(frozen=True, slots=True)
class Order:
    """What the arm asks of the client process, once per period.

    Attributes:
        number: Counts commands, from 1.
        time: When it was given [s].
        motion: Kind.
        values: Its numbers, `COMMAND_NUMBERS` of them.
    """

    number: int
    time: float
    motion: MotionCommand
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Status:
    """How the client process is.

    Attributes:
        beat: When it went round last [s].
        sampled: When the newest state was sampled [s].
        phase: How far it is.
        problem: Why the arm does not go on; stays until `recover`.
        followed: Number of the command that was sent last.
        lapses: How often it stopped the arm because commands stayed away.
    """

    beat: float
    sampled: float
    phase: ClientPhase
    problem: Problem
    followed: int
    lapses: int


class Exchange:
    """The memory: commands go down, states and status come up. It has no name and leaves nothing behind.

    It is a file in memory (memfd) whose descriptor the child inherits: named shared memory would outlive a killed
    process, or be taken away by a killed child's tracker.
    """

    def __init__(self, file: int) -> None:
        """Map it.

        Args:
            file: Descriptor of `new_memory`; stays the caller's.
        """
        self._memory = mmap.mmap(file, _TOTAL)
        self._command = SharedRow(self._memory, 0, _COMMAND_WIDTH)
        self._state = SharedRow(self._memory, size_of(_COMMAND_WIDTH), _STATE_WIDTH)
        self._status = SharedRow(self._memory, size_of(_COMMAND_WIDTH) + size_of(_STATE_WIDTH), _STATUS_WIDTH)

    def write_command(self, command: Order) -> None:
        """Give a command."""
        self._command.write((command.number, command.time, command.motion, *command.values))

    def command(self) -> Order | None:
        """Return the newest command; None if there never was one."""
        row = self._command.read()
        return None if row is None else Order(int(row[0]), row[1], MotionCommand(int(row[2])), row[3:])

    def write_state(self, s: UrState) -> None:
        """Publish a state."""
        self._state.write(
            (
                s.time,
                s.seen,
                s.controller_time,
                s.runtime_state,
                s.robot_mode,
                s.safety_mode,
                s.safety_bits,
                s.speed_scaling,
                s.speed_slider,
                *s.joint_position,
                *s.joint_velocity,
                *s.tool_pose,
                *s.tool_velocity,
                *s.tool_wrench,
                *s.raw_wrench,
                *s.acceleration,
                s.lost,
            )
        )

    def state(self) -> UrState | None:
        """Return the newest state; None if there never was one."""
        row = self._state.read()
        if row is None:
            return None
        return UrState(
            row[0],
            row[1],
            row[2],
            int(row[3]),
            int(row[4]),
            int(row[5]),
            int(row[6]),
            row[7],
            row[8],
            (row[9], row[10], row[11], row[12], row[13], row[14]),
            (row[15], row[16], row[17], row[18], row[19], row[20]),
            (row[21], row[22], row[23], row[24], row[25], row[26]),
            (row[27], row[28], row[29], row[30], row[31], row[32]),
            (row[33], row[34], row[35], row[36], row[37], row[38]),
            (row[39], row[40], row[41], row[42], row[43], row[44]),
            (row[45], row[46], row[47]),
            int(row[48]),
        )

    def write_status(self, status: Status) -> None:
        """Publish how the client process is."""
        self._status.write(
            (status.beat, status.sampled, status.phase, status.problem, status.followed, status.lapses)
        )

    def status(self) -> Status | None:
        """Return how the client process is; None before its first word."""
        row = self._status.read()
        if row is None:
            return None
        return Status(row[0], row[1], ClientPhase(int(row[2])), Problem(int(row[3])), int(row[4]), int(row[5]))

    def close(self) -> None:
        """Unmap it; may be called more than once."""
        for row in (self._command, self._state, self._status):
            row.close()
        self._memory.close()


_TOTAL = size_of(_COMMAND_WIDTH) + size_of(_STATE_WIDTH) + size_of(_STATUS_WIDTH)


def new_memory() -> int:
    """Return the descriptor of a new memory, all zeros; Linux."""
    file = os.memfd_create("palpate-ur")
    os.ftruncate(file, _TOTAL)
    return file
