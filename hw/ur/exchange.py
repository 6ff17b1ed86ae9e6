"""Messages between the arm and its client process.

Commands, states and status travel in shared memory, which neither side waits for. Tasks that take time and their
replies travel in a pipe.
"""

import mmap
import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from enum import IntEnum, StrEnum
from typing import Any

from palpate.hw.ur.problems import Problem
from palpate.hw.ur.rtde import Version

_SLOTS = 4
_TRIES = 8
_BYTES = 8

Six = tuple[float, float, float, float, float, float]

COMMAND_NUMBERS = 6
"""Velocity and angular velocity of the tool, base frame [m/s, rad/s]."""


class SharedRow:
    """Row of numbers in memory shared by two processes: one writes, the other reads, neither waits.

    There are four slots in turn. The writer puts a row with its number and a checksum of both into the next slot,
    then publishes the number of the newest row. The reader copies the slot of that number and checks the copy.
    Whatever order the processor's stores become visible in, a copy that is not one whole row has another number,
    or passes its checksum by a chance of 2^-32.

    Attributes:
        size: Bytes that a row of this width takes.
    """

    def __init__(self, memory: mmap.mmap, offset: int, width: int) -> None:
        """Use a part of the memory, which must begin as zeros.

        Args:
            memory: Shared memory.
            offset: Start of the row in the memory, a multiple of 8 [bytes].
            width: Numbers per row.
        """
        self.size = size_of(width)
        self._row, self._checksum = struct.Struct(f"=q{width}d"), struct.Struct("=Q")
        self._slot = self._row.size + self._checksum.size
        self._memory, self._first = memory, offset + _BYTES
        self._newest = memoryview(memory)[offset : offset + _BYTES].cast("q")
        self._count = self._newest[0]

    def write(self, values: Sequence[float]) -> None:
        """Publish a row in place of the last one."""
        self._count = count = self._count + 1
        row = self._row.pack(count, *values)
        place = self._place(count)
        self._memory[place : place + self._slot] = row + self._checksum.pack(zlib.crc32(row))
        self._newest[0] = count

    def read(self) -> tuple[float, ...] | None:
        """Return the newest row; None if there is none yet, or if the writer interfered with every try."""
        for _ in range(_TRIES):
            count = self._newest[0]
            if not count:
                return None
            place = self._place(count)
            copy = self._memory[place : place + self._slot]
            row = self._row.unpack_from(copy)
            (checksum,) = self._checksum.unpack_from(copy, self._row.size)
            if row[0] == count and checksum == zlib.crc32(copy[: self._row.size]):
                return row[1:]
        return None

    def close(self) -> None:
        """Release the memory, so that it can be closed."""
        self._newest.release()

    def _place(self, count: int) -> int:
        return self._first + count % _SLOTS * self._slot


def size_of(width: int) -> int:
    """Return the bytes that a row of `width` numbers takes."""
    return _BYTES + _SLOTS * (width + 2) * _BYTES


class ClientPhase(IntEnum):
    """Progress of the client process."""

    STARTING = 0
    LISTENING = 1
    """The process receives states; nothing commands the arm yet."""
    READY = 2
    """The arm follows commands."""
    LEAVING = 3
    """The process releases the arm and ends."""


@dataclass(frozen=True, slots=True)
class UrState:
    """State of the controller in one of its cycles; `READINGS` says where each value comes from.

    Attributes:
        time: Earliest time at which it was sampled, as a round trip proves, `time.monotonic` [s].
        seen: Time at which the client process saw it [s].
        controller_time: Time stamp of the controller [s].
        joint_position: Joint angles [rad].
        joint_velocity: Joint speeds [rad/s].
        tool_pose: Position of the tip frame [m] and rotation vector [rad], base frame.
        tool_velocity: Velocity of the tip frame [m/s, rad/s], base frame.
        tool_wrench: Load on the tool without the weight of the payload, axes of the base, about the TCP [N, N m].
        runtime_state: State of the program; 2: it runs.
        robot_mode: State of the power; 7: powered, brakes released.
        safety_bits: See `SafetyBit`.
        speed_scaling: Factor by which the actual speed is scaled.
        speed_slider: Position of the pendant's slider, 0 to 1.
        lost: States that were skipped since the connection was made.
    """

    time: float
    seen: float
    controller_time: float
    joint_position: Six
    joint_velocity: Six
    tool_pose: Six
    tool_velocity: Six
    tool_wrench: Six
    runtime_state: int
    robot_mode: int
    safety_bits: int
    speed_scaling: float
    speed_slider: float
    lost: int


READINGS: Mapping[str, tuple[str, str]] = {
    "joint_position": ("actual_q", "getActualQ"),
    "joint_velocity": ("actual_qd", "getActualQd"),
    "tool_pose": ("actual_TCP_pose", "getActualTCPPose"),
    "tool_velocity": ("actual_TCP_speed", "getActualTCPSpeed"),
    "tool_wrench": ("actual_TCP_force", "getActualTCPForce"),
    "runtime_state": ("runtime_state", "getRuntimeState"),
    "robot_mode": ("robot_mode", "getRobotMode"),
    "safety_bits": ("safety_status_bits", "getSafetyStatusBits"),
    "speed_scaling": ("speed_scaling", "getSpeedScaling"),
    "speed_slider": ("target_speed_fraction", "getTargetSpeedFraction"),
}
"""RTDE variable and getter of the client library for the fields of `UrState` from `joint_position` on."""

_COLUMNS = tuple((each.name, 6 if each.type == Six else 1, each.type is int) for each in fields(UrState))
_COMMAND_WIDTH = 3 + COMMAND_NUMBERS
_STATE_WIDTH = sum(count for _, count, _ in _COLUMNS)
_STATUS_WIDTH = 6


@dataclass(frozen=True, slots=True)
class Order:
    """Command of the arm, once per period.

    Attributes:
        number: Number of the command, from 1.
        time: When it was given [s].
        moves: Whether the arm is to move; if not, the controller holds it at rest.
        twist: Velocity and angular velocity of the tool, base frame [m/s, rad/s].
    """

    number: int
    time: float
    moves: bool
    twist: tuple[float, ...] = (0.0,) * COMMAND_NUMBERS


@dataclass(frozen=True, slots=True)
class Status:
    """Condition of the client process.

    Attributes:
        beat: Time of its last round [s].
        sampled: Time at which the newest state was sampled [s].
        phase: Progress of the process.
        problem: Why the arm does not go on; stays until `recover`.
        followed: Number of the command that was sent last.
        lapses: How often it stopped the arm for want of commands.
    """

    beat: float
    sampled: float
    phase: ClientPhase
    problem: Problem
    followed: int
    lapses: int


class Exchange:
    """Shared memory: commands in one direction, states and status in the other. It leaves nothing behind.

    The memory is a file (memfd) whose descriptor the child inherits: named shared memory would outlive a killed
    process, or be removed by the tracker of a killed child.
    """

    def __init__(self, file: int) -> None:
        """Map the descriptor of `new_memory`, which stays the caller's."""
        self._memory = mmap.mmap(file, _TOTAL)
        self._command = SharedRow(self._memory, 0, _COMMAND_WIDTH)
        self._state = SharedRow(self._memory, size_of(_COMMAND_WIDTH), _STATE_WIDTH)
        self._status = SharedRow(self._memory, size_of(_COMMAND_WIDTH) + size_of(_STATE_WIDTH), _STATUS_WIDTH)

    def write_command(self, command: Order) -> None:
        """Publish a command."""
        self._command.write((command.number, command.time, command.moves, *command.twist))

    def command(self) -> Order | None:
        """Return the newest command; None if there is none yet."""
        row = self._command.read()
        return None if row is None else Order(int(row[0]), row[1], bool(row[2]), row[3:])

    def write_state(self, state: UrState) -> None:
        """Publish a state."""
        row: list[float] = []
        for name, count, _ in _COLUMNS:
            value = getattr(state, name)
            row.extend(value if count > 1 else (value,))
        self._state.write(row)

    def state(self) -> UrState | None:
        """Return the newest state; None if there is none yet."""
        row = self._state.read()
        if row is None:
            return None
        values: list[Any] = []
        at = 0
        for _, count, whole in _COLUMNS:
            number = int(row[at]) if whole else row[at]
            values.append(row[at : at + count] if count > 1 else number)
            at += count
        return UrState(*values)

    def write_status(self, status: Status) -> None:
        """Publish the condition of the client process."""
        self._status.write(
            (status.beat, status.sampled, status.phase, status.problem, status.followed, status.lapses)
        )

    def status(self) -> Status | None:
        """Return the condition of the client process; None if it has not published any yet."""
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


class UrTask(StrEnum):
    """Task of the client process that takes time."""

    BRING_UP = "bring up"
    RECOVER = "recover"
    REST = "rest"
    TARE = "tare"
    LEAVE = "leave"


@dataclass(frozen=True, slots=True)
class Opening:
    """First message to the client process; plain numbers, so that the process starts in a tenth of the time.

    Attributes:
        address: Host name or IP address of the controller.
        version: Software version of the controller.
        library: Name of the module that makes connections.
        memory: Descriptor of the shared memory.
        tool: Tip frame on the flange: position [m] and rotation vector [rad].
        payload: Mass [kg] and centre of gravity [m]; empty: unchanged.
        speed_slider: Setting of the pendant's slider; None: unchanged.
        acceleration: See `UrSettings`, here and below.
        deceleration: [m/s^2].
        watchdog: [s].
        stale_after: [s].
    """

    address: str
    version: Version
    library: str
    memory: int
    tool: tuple[float, ...]
    payload: tuple[float, ...]
    speed_slider: float | None
    acceleration: float
    deceleration: float
    watchdog: float
    stale_after: float


@dataclass(frozen=True, slots=True)
class UrRequest:
    """Request for a task.

    Attributes:
        task: Task to be done.
        number: Number of the request: a reply that was abandoned, after Ctrl-C, is not taken for the next one's.
    """

    task: UrTask
    number: int = 0


@dataclass(frozen=True, slots=True)
class UrReply:
    """Outcome of a request.

    Attributes:
        number: Number of the request.
        problem: Failure of the task; empty if it succeeded.
        remedy: Remedy for the failure.
    """

    number: int
    problem: str = ""
    remedy: str = ""
