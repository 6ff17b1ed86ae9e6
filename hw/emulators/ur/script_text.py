"""What a URScript program's text shows without interpreting it."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from palpate.hw.emulators.ur.script import PathStep
from palpate.hw.emulators.ur.variables import REGISTERS

LARGEST = 1_000_000
"""Letters of a program that are kept while its end is awaited."""

_BEGINS = re.compile(r"^(?:def|sec) +(\w+)\(\) *:\s*$")
_CONTROL = "RTDE Control Script Loaded"
_PATH_MARK = "# inject move path"
_OFFSET = {"int": "# int register offset", "double": "# float register offset"}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_MOVE = re.compile(
    rf"\b(move[jlp])\((p?)\[((?:{_NUMBER}\s*,?\s*)+)\]\s*,\s*a=({_NUMBER})\s*,\s*v=({_NUMBER})\s*,\s*r=({_NUMBER})\)"
)
_PROGRESS = re.compile(r"\bsignal_async_progress\((\d+)\)")
_WRITE = re.compile(rf"^\s*write_output_(integer|float)_register\(([\d\s+]+),\s*({_NUMBER})\s*\)\s*$")
_SLEEP = re.compile(rf"^\s*sleep\(({_NUMBER})\)\s*$")


class ProgramKind(Enum):
    """What an uploaded program is to the emulator."""

    CONTROL = "control"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class Statement:
    """A line of another program that is understood.

    Attributes:
        register: Output register that is written, as RTDE names it; empty for a sleep.
        value: That is written, or how long it sleeps [s].
    """

    register: str
    value: float


@dataclass(frozen=True, slots=True)
class UploadedProgram:
    """What a program's text shows.

    Attributes:
        name: Behind its `def`.
        kind: Whether it is ur_rtde's control script.
        secondary: Whether it runs beside the present program.
        int_offset: Of the registers of a control script.
        double_offset: The same for doubles.
        path: Injected into a control script.
        statements: Of any other program.
    """

    name: str
    kind: ProgramKind
    secondary: bool
    int_offset: int = 0
    double_offset: int = 0
    path: tuple[PathStep, ...] = ()
    statements: tuple[Statement, ...] = ()


class ProgramReader:
    """Puts programs together from text that arrives in any pieces."""

    def __init__(self) -> None:
        """Begin between programs."""
        self._rest = b""
        self._lines: list[str] = []
        self._letters = 0

    def feed(self, data: bytes) -> Iterator[UploadedProgram]:
        """Yield each program that is complete with these bytes; lines outside of any are ignored."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LARGEST:
            self._rest = b""
        for raw in lines:
            line = raw.decode(errors="replace").rstrip("\r")
            if not self._lines:
                if _BEGINS.match(line):
                    self._lines.append(line)
                continue
            self._lines.append(line)
            self._letters += len(line)
            if line.rstrip() == "end":
                yield understood(self._lines)
            elif self._letters <= LARGEST:
                continue
            self._lines, self._letters = [], 0


def understood(lines: list[str]) -> UploadedProgram:
    """Return what the lines of one program say."""
    first = _BEGINS.match(lines[0])
    name = first.group(1) if first else ""
    secondary = lines[0].startswith("sec")
    if any(_CONTROL in line for line in lines):
        return UploadedProgram(
            name,
            ProgramKind.CONTROL,
            secondary,
            _offset(lines, "int"),
            _offset(lines, "double"),
            tuple(_path(lines)),
        )
    return UploadedProgram(name, ProgramKind.OTHER, secondary, statements=tuple(_statements(lines)))


def _offset(lines: list[str], kind: str) -> int:
    for mark, number in pairwise(lines):
        if _OFFSET[kind] in mark:
            # ur_rtde puts the number after the comment's newline: `x = # int register offset` / `0    global ...`
            found = re.match(r"(\d+)", number)
            return min(int(found.group(1)), REGISTERS - 1) if found else 0
    return 0


def _path(lines: list[str]) -> Iterator[PathStep]:
    start = next((i for i, line in enumerate(lines) if _PATH_MARK in line), len(lines))
    progress = 0
    for line in lines[start + 1 :]:
        progress_line, move = _PROGRESS.search(line), _MOVE.search(line)
        if progress_line:
            progress = int(progress_line.group(1))
        elif move:
            command, pose, numbers, acceleration, speed, _ = move.groups()
            target = tuple(float(n) for n in re.findall(_NUMBER, numbers))
            if len(target) == 6:
                yield PathStep(command == "movej", bool(pose), target, float(speed), float(acceleration), progress)
        elif line.strip():
            return


def _statements(lines: list[str]) -> Iterator[Statement]:
    for line in lines:
        write, sleep = _WRITE.match(line), _SLEEP.match(line)
        if write:
            kind, register, value = write.groups()
            number = sum(int(part) for part in register.split("+") if part.strip())
            title = "int" if kind == "integer" else "double"
            if number < REGISTERS:
                yield Statement(f"output_{title}_register_{number}", float(value))
        elif sleep:
            yield Statement("", float(sleep.group(1)))
