"""One RTDE client: its recipes, its stream."""

import math
import struct
from collections.abc import Collection, MutableMapping

from palpate.errors import InvalidValueError
from palpate.hw.emulators.ur.faults import ControllerFault
from palpate.hw.emulators.ur.framing import PackageReader, PackageType, package, text_message
from palpate.hw.emulators.ur.recipes import IN_USE, NOT_FOUND, Recipe, recipe, requested_names
from palpate.hw.emulators.ur.robot import EmulatedController
from palpate.hw.emulators.ur.variables import INPUTS, outputs_of

PROTOCOL = 2
"""Version of the protocol; its predecessor has no rates and is not emulated."""

_YES, _NO = b"\x01", b"\x00"
_INFO = 3

Owners = MutableMapping[str, "RtdeSession"]
"""Who may write each input that anybody has asked for."""


class RtdeSession:
    """What one connection has agreed on; bytes in, bytes out.

    Attributes:
        dropped: Packages that were not understood, and were ignored.
    """

    def __init__(self, robot: EmulatedController, owners: Owners, faults: Collection[ControllerFault]) -> None:
        """Begin with nothing agreed on.

        Args:
            robot: The controller.
            owners: Of inputs, shared by all connections.
            faults: That are on now; shared.
        """
        self._robot, self._owners, self._faults = robot, owners, faults
        self._types = outputs_of(robot.version)
        self._reader = PackageReader()
        self._inputs: list[Recipe] = []
        self._output: Recipe | None = None
        self._outputs = 0
        self._every, self._cycle = 1, 0
        self._streaming = False
        self.dropped = 0

    def feed(self, data: bytes) -> bytes:
        """Take bytes of the client and return the replies to them.

        Raises:
            FramingError: They cannot be read on: the connection is of no use any more.
        """
        replies = bytearray()
        for kind, payload in self._reader.feed(data):
            try:
                reply = self._reply(kind, payload)
            except InvalidValueError as error:
                self.dropped += 1
                self._robot.note("dropped", kind=kind, why=error)
                continue
            if reply:
                if ControllerFault.STRAY_TEXT in self._faults:
                    replies += package(PackageType.TEXT, text_message("stray text", "emulator", _INFO))
                replies += reply
        return bytes(replies)

    def stream(self) -> bytes:
        """Return the data package of this cycle; empty if there is none."""
        if not self._streaming or self._output is None or ControllerFault.STALL_STREAM in self._faults:
            return b""
        self._cycle += 1
        if self._cycle % self._every:
            return b""
        payload = self._output.pack(self._robot.outputs)
        if ControllerFault.SHORT_DATA in self._faults:
            payload = payload[:-1]
        return package(PackageType.DATA, payload)

    def close(self) -> None:
        """Let go of the inputs."""
        for name in [name for name, owner in self._owners.items() if owner is self]:
            del self._owners[name]

    def _reply(self, kind: int, payload: bytes) -> bytes:
        match kind:
            case PackageType.DATA:
                self._write(payload)
                return b""
            case PackageType.VERSION:
                (version,) = _numbers(">H", payload)
                accepted = version == PROTOCOL and ControllerFault.REFUSE_VERSION not in self._faults
                return package(PackageType.VERSION, _YES if accepted else _NO)
            case PackageType.CONTROLLER_VERSION:
                _numbers("", payload)
                own = self._robot.version
                parts = struct.pack(">4I", own.major, own.minor, own.bugfix, own.build)
                return package(PackageType.CONTROLLER_VERSION, parts)
            case PackageType.OUTPUTS:
                return package(PackageType.OUTPUTS, self._set_output(payload))
            case PackageType.INPUTS:
                return package(PackageType.INPUTS, self._add_input(payload))
            case PackageType.START:
                _numbers("", payload)
                self._streaming = self._output is not None and ControllerFault.REJECT_START not in self._faults
                return package(PackageType.START, _YES if self._streaming else _NO)
            case PackageType.PAUSE:
                _numbers("", payload)
                self._streaming = False
                return package(PackageType.PAUSE, _YES)
            case _:
                raise InvalidValueError(f"package of type {kind}: not one that a client sends")

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
        self._outputs = self._outputs % 255 + 1
        self._output = recipe(self._outputs, names, self._types)
        self._every, self._cycle = max(1, round(self._robot.version.rate / frequency)), 0
        return bytes((self._outputs,)) + ",".join(kinds).encode()

    def _add_input(self, payload: bytes) -> bytes:
        """Take another input recipe, if all its variables are free; the reply has its number and types."""
        names = requested_names(payload)
        kinds = [self._input_type(name) for name in names]
        if NOT_FOUND in kinds or IN_USE in kinds or len(self._inputs) == 255:
            return _NO + ",".join(kinds).encode()
        self._inputs.append(recipe(len(self._inputs) + 1, names, INPUTS))
        for name in names:
            self._owners[name] = self
        return bytes((len(self._inputs),)) + ",".join(kinds).encode()

    def _input_type(self, name: str) -> str:
        if name not in INPUTS:
            return NOT_FOUND
        return INPUTS[name].title if self._owners.get(name, self) is self else IN_USE

    def _write(self, payload: bytes) -> None:
        number = payload[0] if payload else 0
        if not 1 <= number <= len(self._inputs):
            raise InvalidValueError(f"data for input recipe {number}: there are {len(self._inputs)}")
        self._robot.write(self._inputs[number - 1].unpack(payload))


def _numbers(layout: str, payload: bytes) -> tuple[int, ...]:
    if len(payload) != struct.calcsize(layout):
        raise InvalidValueError(f"payload of {len(payload)} bytes: must be {struct.calcsize(layout)}")
    return struct.unpack(layout, payload)
