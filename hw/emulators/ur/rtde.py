"""RTDE of the emulated controller: packages, variables, recipes, and the session of one client.

A package is a uint16 total size, a uint8 type, and a payload; everything is big-endian.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) guide", as far as ur_rtde 1.6.5 uses it.
"""

import math
import struct
from collections.abc import Collection, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from itertools import chain
from typing import NamedTuple

from palpate.errors import InvalidValueError
from palpate.hw.emulators.connection import HangUpError
from palpate.hw.emulators.ur.controller import INPUTS, EmulatedController, Values, VariableType, outputs_of

HEADER = struct.Struct(">HB")

LARGEST_PACKAGE = 4096
"""Bytes of a package that a controller accepts: twice the 2048 bytes of names that a recipe may have."""

MOST_BYTES_OF_NAMES = 2048
"""Limit of one request, by the maker's guide."""

NOT_FOUND = "NOT_FOUND"
IN_USE = "IN_USE"

PROTOCOL = 2
"""Version of the protocol; its predecessor has no rates and is not emulated."""

LONGEST_INTERVAL = 1e9
"""Cycles between two data packages: any lower rate counts as this one."""

_YES, _NO = b"\x01", b"\x00"
_INFO = 3


class ControllerFault(StrEnum):
    """Faults of an emulated controller. Value 1 switches a fault on and 0 off, unless stated otherwise.

    Attributes:
        DROP_FIN: At once: closes all RTDE connections in good order.
        DROP_RST: At once: breaks all RTDE connections off with a reset.
        STALL_STREAM: Sends no data packages; connections stay.
        LATE_START: Delay of wall time after which an uploaded script starts [s].
        REJECT_START: Rejects requests to start the stream.
        REFUSE_VERSION: Accepts no version of the RTDE protocol.
        WITHHOLD_GREETING: The dashboard sends no greeting.
        LOCAL_CONTROL: The dashboard reports that the robot is not in remote control.
        STRAY_TEXT: Sends a text message before the next reply of each connection.
        SHORT_DATA: Sends data packages that are one byte too short.
        PROTECTIVE_STOP: At once, 1: the controller stops the arm; 0: unlocked by hand.
        E_STOP: At once, 1: the button is pressed; 0: released, with the power still off.
        KILL_PROGRAM: At once: the program ends where it stands.
    """

    DROP_FIN = "drop_fin"
    DROP_RST = "drop_rst"
    STALL_STREAM = "stall_stream"
    LATE_START = "late_start"
    REJECT_START = "reject_start"
    REFUSE_VERSION = "refuse_version"
    WITHHOLD_GREETING = "withhold_greeting"
    LOCAL_CONTROL = "local_control"
    STRAY_TEXT = "stray_text"
    SHORT_DATA = "short_data"
    PROTECTIVE_STOP = "protective_stop"
    E_STOP = "e_stop"
    KILL_PROGRAM = "kill_program"


class PackageType(IntEnum):
    """Purpose of a package: the ASCII code of a letter."""

    VERSION = ord("V")
    CONTROLLER_VERSION = ord("v")
    TEXT = ord("M")
    DATA = ord("U")
    OUTPUTS = ord("O")
    INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


class FramingError(HangUpError):
    """A size that no package can have: the rest of the stream cannot be read."""


def package(kind: PackageType, payload: bytes) -> bytes:
    """Return a package with its header."""
    return HEADER.pack(HEADER.size + len(payload), kind) + payload


def text_message(message: str, source: str, level: int) -> bytes:
    """Return the payload of a text message; level 0 exception, 1 error, 2 warning, 3 info."""
    text, by = message.encode()[:255], source.encode()[:255]
    return bytes((len(text),)) + text + bytes((len(by),)) + by + bytes((level,))


class PackageReader:
    """Cuts a stream of bytes into packages."""

    def __init__(self) -> None:
        """Begin between two packages."""
        self._rest = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """Return type and payload of each package that is complete with these bytes.

        Raises:
            FramingError: If a size is below that of a header or above `LARGEST_PACKAGE`.
        """
        rest = self._rest
        rest += data
        packages: list[tuple[int, bytes]] = []
        start = 0
        while len(rest) - start >= HEADER.size:
            size, kind = HEADER.unpack_from(rest, start)
            if not HEADER.size <= size <= LARGEST_PACKAGE:
                raise FramingError(f"RTDE package of {size} bytes: must be {HEADER.size} to {LARGEST_PACKAGE}")
            if len(rest) - start < size:
                break
            packages.append((kind, bytes(rest[start + HEADER.size : start + size])))
            start += size
        del rest[:start]
        return packages


class Recipe(NamedTuple):
    """Content of a data package: a recipe id, then variables.

    Attributes:
        names: Names of the variables.
        counts: Numbers of each.
        layout: Layout of the whole payload, the id included.
    """

    names: tuple[str, ...]
    counts: tuple[int, ...]
    layout: struct.Struct

    def pack(self, number: int, values: Mapping[str, Values]) -> bytes:
        """Return the payload of the present values."""
        return self.layout.pack(number, *chain.from_iterable([values[name] for name in self.names]))

    def unpack(self, payload: bytes) -> dict[str, Values]:
        """Return the values of a payload.

        Raises:
            InvalidValueError: If its length is not that of the recipe.
        """
        if len(payload) != self.layout.size:
            raise InvalidValueError(f"data package of {len(payload)} bytes: must be {self.layout.size}")
        _, *numbers = self.layout.unpack(payload)
        values: dict[str, Values] = {}
        at = 0
        for name, count in zip(self.names, self.counts, strict=True):
            values[name] = tuple(numbers[at : at + count])
            at += count
        return values


def recipe(names: Sequence[str], types: Mapping[str, VariableType]) -> Recipe:
    """Return a recipe of variables that all exist."""
    kinds = [types[name] for name in names]
    layout = struct.Struct(">B" + "".join(kind.code for kind in kinds))
    return Recipe(tuple(names), tuple(kind.count for kind in kinds), layout)


def requested_names(payload: bytes) -> tuple[str, ...]:
    """Return the names of a request, without the empty last one that ur_rtde's trailing comma makes.

    Raises:
        InvalidValueError: If they are not ASCII, too long, or absent.
    """
    if len(payload) > MOST_BYTES_OF_NAMES:
        raise InvalidValueError(f"{len(payload)} bytes of names: must be at most {MOST_BYTES_OF_NAMES}")
    try:
        names = payload.decode("ascii").split(",")
    except UnicodeDecodeError:
        raise InvalidValueError("names of variables that are not ASCII") from None
    if not names[-1]:
        names.pop()
    if not names:
        raise InvalidValueError("a recipe without a variable: name one at least")
    return tuple(names)


@dataclass(slots=True, eq=False)
class _Stream:
    """Output of a session: recipe with its number, and every how many cycles it is sent."""

    recipe: Recipe
    number: int
    every: int
    cycle: int = 0
    running: bool = False


class RtdeSession:
    """Agreement with one client: its recipes and its stream (a `Talk`).

    Attributes:
        admitted: See `Talk`.
    """

    admitted = True

    def __init__(
        self,
        robot: EmulatedController,
        owners: MutableMapping[str, "RtdeSession"],
        faults: Collection[ControllerFault],
    ) -> None:
        """Begin with nothing agreed on.

        Args:
            robot: The controller.
            owners: Session that may write each requested input; shared by all sessions.
            faults: Faults that are on now; shared.
        """
        self._robot, self._owners, self._faults = robot, owners, faults
        self._types = outputs_of(robot.version)
        self._reader = PackageReader()
        self._inputs: list[Recipe] = []
        self._stream: _Stream | None = None

    def feed(self, data: bytes, now: float = 0.0) -> bytes:
        """Take bytes of the client and return the replies to them.

        Raises:
            FramingError: If the rest of the stream cannot be read.
        """
        try:
            packages = self._reader.feed(data)
        except FramingError as error:
            self._robot.drop("unreadable", why=error)
            raise
        replies = bytearray()
        for kind, payload in packages:
            try:
                reply = self._reply(kind, payload)
            except InvalidValueError as error:
                self._robot.drop("dropped", kind=kind, why=error)
                continue
            if reply is not None:
                if ControllerFault.STRAY_TEXT in self._faults:
                    replies += package(PackageType.TEXT, text_message("stray text", "emulator", _INFO))
                replies += package(PackageType(kind), reply)
        return bytes(replies)

    def stream(self) -> bytes:
        """Return the data package of this cycle; empty if there is none."""
        stream = self._stream
        if stream is None or not stream.running or ControllerFault.STALL_STREAM in self._faults:
            return b""
        stream.cycle += 1
        if stream.cycle % stream.every:
            return b""
        payload = stream.recipe.pack(stream.number, self._robot.outputs)
        if ControllerFault.SHORT_DATA in self._faults:
            payload = payload[:-1]
        return package(PackageType.DATA, payload)

    def close(self) -> None:
        """Release the inputs."""
        for name in [name for name, owner in self._owners.items() if owner is self]:
            del self._owners[name]

    def _reply(self, kind: int, payload: bytes) -> bytes | None:
        match kind:
            case PackageType.DATA:
                number = payload[0] if payload else 0
                if not 1 <= number <= len(self._inputs):
                    raise InvalidValueError(f"data for input recipe {number}: there are {len(self._inputs)}")
                self._robot.write(self._inputs[number - 1].unpack(payload))
                return None
            case PackageType.VERSION:
                (version,) = _numbers(">H", payload)
                accepted = version == PROTOCOL and ControllerFault.REFUSE_VERSION not in self._faults
                return _YES if accepted else _NO
            case PackageType.CONTROLLER_VERSION:
                _numbers("", payload)
                return struct.pack(">4I", *self._robot.version)
            case PackageType.OUTPUTS:
                return self._set_output(payload)
            case PackageType.INPUTS:
                return self._add_input(payload)
            case PackageType.START | PackageType.PAUSE:
                _numbers("", payload)
                return self._switch(kind == PackageType.START)
            case _:
                raise InvalidValueError(f"package of type {kind}: not one that a client sends")

    def _switch(self, on: bool) -> bytes:
        """Start or pause the stream, and return whether that was done."""
        stream = self._stream
        running = on and stream is not None and ControllerFault.REJECT_START not in self._faults
        if stream is not None:
            stream.running = running
        return _YES if running or not on else _NO

    def _set_output(self, payload: bytes) -> bytes:
        """Take the recipe of the stream; the reply has its number and types."""
        if len(payload) < 8:
            raise InvalidValueError(f"output request of {len(payload)} bytes: must begin with 8 of a frequency")
        (frequency,) = struct.unpack(">d", payload[:8])
        if not (math.isfinite(frequency) and frequency > 0.0):
            raise InvalidValueError(f"output frequency = {frequency!r} Hz: must be above 0")
        names = requested_names(payload[8:])
        kinds = [self._types[name].title if name in self._types else NOT_FOUND for name in names]
        if NOT_FOUND in kinds:
            return _NO + ",".join(kinds).encode()
        before = self._stream
        number = 1 if before is None else before.number % 255 + 1
        every = max(1, round(min(self._robot.version.rate / frequency, LONGEST_INTERVAL)))
        running = before is not None and before.running
        self._stream = _Stream(recipe(names, self._types), number, every, running=running)
        return bytes((number,)) + ",".join(kinds).encode()

    def _add_input(self, payload: bytes) -> bytes:
        """Take another input recipe, if all its variables are free; the reply has its number and types."""
        names = requested_names(payload)
        kinds = [self._input_type(name) for name in names]
        if NOT_FOUND in kinds or IN_USE in kinds or len(self._inputs) == 255:
            return _NO + ",".join(kinds).encode()
        self._inputs.append(recipe(names, INPUTS))
        for name in names:
            self._owners[name] = self
        return bytes((len(self._inputs),)) + ",".join(kinds).encode()

    def _input_type(self, name: str) -> str:
        if name not in INPUTS:
            return NOT_FOUND
        return INPUTS[name].title if self._owners.get(name, self) is self else IN_USE


def _numbers(layout: str, payload: bytes) -> tuple[int, ...]:
    if len(payload) != struct.calcsize(layout):
        raise InvalidValueError(f"payload of {len(payload)} bytes: must be {struct.calcsize(layout)}")
    return struct.unpack(layout, payload)
