"""Programs of the emulated controller: what their text shows, and the registers of ur_rtde's control script.

URScript is not interpreted. The control script is recognised, with the path that a client injects into it. Writes
to output registers and sleeps of other programs are carried out.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from palpate.errors import InvalidValueError
from palpate.hw.emulators.ur.controller import REGISTERS, EmulatedController, Program

READY, DONE = 1, 2
"""In output int register 0: waiting for a command, done with one."""

LARGEST_NUMBER = 1e6
"""Limit of any number in a command, whatever its unit."""

LARGEST_PROGRAM = 1_000_000
"""Letters of a program that are kept while its end is awaited."""

_RUNNING = 1 << 15
_COUNTS = 128

_BEGINS = re.compile(r"^(?:def|sec) +(\w+)\(\) *:\s*$")
_CONTROL = "RTDE Control Script Loaded"
_PATH_MARK = "# inject move path"
_INT_OFFSET, _DOUBLE_OFFSET = "# int register offset", "# float register offset"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_MOVE = re.compile(
    rf"\b(move[jlp])\((p?)\[((?:{_NUMBER}\s*,?\s*)+)\]\s*,\s*a=({_NUMBER})\s*,\s*v=({_NUMBER})\s*,\s*r=({_NUMBER})\)"
)
_PROGRESS = re.compile(r"\bsignal_async_progress\((\d+)\)")
_WRITE = re.compile(rf"^\s*write_output_(integer|float)_register\(([\d\s+]+),\s*({_NUMBER})\s*\)\s*$")
_SLEEP = re.compile(rf"^\s*sleep\(({_NUMBER})\)\s*$")


@dataclass(frozen=True, slots=True)
class PathStep:
    """Waypoint of a path.

    Attributes:
        joint_space: Whether the joints move together (movej), or the TCP straight.
        is_pose: Whether the target is a pose of the TCP, or joint angles.
        target: x, y, z [m] and a rotation vector [rad], or angles [rad].
        speed: [m/s, or rad/s of the leading axis].
        acceleration: [m/s^2, or rad/s^2].
        progress: Value reported when it begins.
    """

    joint_space: bool
    is_pose: bool
    target: tuple[float, ...]
    speed: float
    acceleration: float
    progress: int


@dataclass(frozen=True, slots=True)
class UploadedProgram:
    """Text of a program.

    Attributes:
        name: Name behind its `def`.
        lines: Lines of the program.
    """

    name: str
    lines: tuple[str, ...]

    @property
    def is_control(self) -> bool:
        """Whether it is ur_rtde's control script."""
        return any(_CONTROL in line for line in self.lines)

    @property
    def int_offset(self) -> int:
        """First int register of a control script."""
        return self._offset(_INT_OFFSET)

    @property
    def double_offset(self) -> int:
        """First double register of a control script."""
        return self._offset(_DOUBLE_OFFSET)

    def path(self) -> Iterator[PathStep]:
        """Yield the waypoints injected into a control script."""
        start = next((i for i, line in enumerate(self.lines) if _PATH_MARK in line), len(self.lines))
        progress = 0
        for line in self.lines[start + 1 :]:
            progress_line, move = _PROGRESS.search(line), _MOVE.search(line)
            if progress_line:
                progress = int(progress_line.group(1))
            elif move:
                command, pose, numbers, acceleration, speed, _ = move.groups()
                target = tuple(float(n) for n in re.findall(_NUMBER, numbers))
                if len(target) == 6:
                    yield PathStep(
                        command == "movej", bool(pose), target, float(speed), float(acceleration), progress
                    )
            elif line.strip():
                return

    def run(self, robot: EmulatedController) -> Program:
        """Carry out a program that is not the control script: one cycle per register write, and its sleeps."""
        for line in self.lines:
            write, sleep = _WRITE.match(line), _SLEEP.match(line)
            if write:
                kind, register, text = write.groups()
                number = sum(int(part) for part in register.split("+") if part.strip())
                value = float(text)
                if number < REGISTERS and kind == "integer":
                    whole = max(-(2**31), min(2**31 - 1, round(value)))
                    robot.outputs[f"output_int_register_{number}"] = (whole,)
                elif number < REGISTERS:
                    robot.outputs[f"output_double_register_{number}"] = (value,)
                yield
            elif sleep:
                begun = robot.time
                while robot.time - begun < float(sleep.group(1)):
                    yield

    def _offset(self, comment: str) -> int:
        for mark, number in pairwise(self.lines):
            if comment in mark:
                # ur_rtde puts the number after the newline: `x = # int register offset` / `0    global ...`
                found = re.match(r"(\d+)", number)
                return min(int(found.group(1)), REGISTERS - 1) if found else 0
        return 0


class ProgramReader:
    """Client of the script port (a `Talk`): programs from text that arrives in any pieces."""

    admitted = True

    def __init__(self, upload: Callable[[UploadedProgram, float], None]) -> None:
        """Begin between programs.

        Args:
            upload: Takes each program that is complete, at a time [s].
        """
        self._upload = upload
        self._rest = b""
        self._lines: list[str] = []
        self._letters = 0

    def feed(self, data: bytes, now: float) -> bytes:
        """Take text; lines outside of any program are ignored."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LARGEST_PROGRAM:
            self._rest = b""
        for raw in lines:
            line = raw.decode(errors="replace").rstrip("\r")
            if not self._lines and not _BEGINS.match(line):
                continue
            self._lines.append(line)
            self._letters += len(line)
            complete = line.rstrip() == "end"
            if complete:
                first = _BEGINS.match(self._lines[0])
                self._upload(UploadedProgram(first.group(1) if first else "", tuple(self._lines)), now)
            if complete or self._letters > LARGEST_PROGRAM:
                self._lines, self._letters = [], 0
        return b""

    def close(self) -> None:
        """See `Talk`."""


class Registers:
    """Registers of a control script, which may live in the upper half.

    Attributes:
        command_name: Input that has the command's id.
    """

    def __init__(self, robot: EmulatedController, int_offset: int = 0, double_offset: int = 0) -> None:
        """Use the registers of a controller from the offsets on."""
        self._inputs, self._outputs = robot.inputs, robot.outputs
        self._int, self._double = int_offset, double_offset
        self.command_name = f"input_int_register_{int_offset}"
        self._operation, self._writes = 0, 0

    @property
    def command(self) -> int:
        """Id of the command."""
        return self.integer(0)

    def integer(self, register: int) -> int:
        """Return an input."""
        number = min(self._int + register, REGISTERS - 1)
        return int(self._inputs[f"input_int_register_{number}"][0])

    def double(self, register: int) -> float:
        """Return an input.

        Raises:
            InvalidValueError: If no command has such a number.
        """
        return self.doubles(register, 1)[0]

    def doubles(self, first: int, count: int = 6) -> tuple[float, ...]:
        """Return successive inputs.

        Raises:
            InvalidValueError: If no command has such numbers.
        """
        begin = self._double + first
        names = [f"input_double_register_{i}" for i in range(begin, min(begin + count, REGISTERS))]
        values = tuple(self._inputs[name][0] for name in names)
        if len(values) == count and all(abs(value) <= LARGEST_NUMBER for value in values):
            return values
        raise InvalidValueError(
            f"double registers from {first} = {values}: each must be within +-{LARGEST_NUMBER:g}"
        )

    def reply(self, register: int, value: int) -> None:
        """Write an integer: READY or DONE into register 0, results into register 1."""
        if self._int + register < REGISTERS:
            self._outputs[f"output_int_register_{self._int + register}"] = (value,)

    def reply_doubles(self, values: Sequence[float]) -> None:
        """Write a result of several numbers."""
        for register, value in zip(range(self._double, REGISTERS), values, strict=False):
            self._outputs[f"output_double_register_{register}"] = (float(value),)

    def begin_operation(self) -> None:
        """Report that an asynchronous operation has begun."""
        self._operation = (self._operation + 1) % _COUNTS
        self.progress(0)

    def progress(self, value: int) -> None:
        """Report the progress of the operation."""
        self._report(_RUNNING | value & (_RUNNING - 1))

    def finish_operation(self) -> None:
        """Report that no operation is running."""
        self._report(0)

    def _report(self, low: int) -> None:
        self._writes = (self._writes + 1) % _COUNTS
        self.reply(2, low | self._writes << 16 | self._operation << 24)


@dataclass(slots=True, eq=False)
class Script:
    """State of a running control script.

    Attributes:
        robot: The controller.
        registers: Registers of the script.
        path: Path of `movePath`, injected when the script was uploaded.
        operation: Asynchronous command that is running; None for none.
        detecting: Direction in which contacts are detected; None: no detection.
    """

    robot: EmulatedController
    registers: Registers
    path: tuple[PathStep, ...] = ()
    operation: Program | None = None
    detecting: tuple[float, ...] | None = None

    def begin_operation(self, work: Program) -> None:
        """Leave some work running while the next commands come."""
        self.registers.begin_operation()
        self.operation = work

    def end_operation(self) -> None:
        """Leave nothing running."""
        if self.operation is not None:
            self.operation = None
            self.registers.finish_operation()

    def go_on(self) -> None:
        """Do one cycle of the operation."""
        if self.operation is not None:
            try:
                next(self.operation)
            except StopIteration:
                self.end_operation()
