"""Bus of emulated servos behind a terminal, and the faults of its line."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import numpy as np

from palpate.errors import InvalidValueError
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.registers import HardwareError
from palpate.hw.emulators.dynamixel.protocol import PacketReceiver, Servos, replies
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.server import PlantState, ServoGoal, fault_named
from palpate.hw.emulators.terminal import Terminal

PIECE_TIME = 1e-3
"""Between the pieces of a torn reply [s]: a frame of USB."""

BABBLE_TIME = 1e-3
"""Between bursts of a bus that babbles [s]."""


class BusFault(StrEnum):
    """Faults of a bus, with the meaning of their numbers.

    SILENT: the servo of this id neither receives nor replies; -1 ends it.
    MUTE: no servo replies (1), or all do again (0): a broken wire back.
    WRONG_CHECKSUM: this share of replies has an inverted bit.
    LATE: every reply is delayed [s].
    LOST_BYTES: this share of replies lacks a byte.
    NOISE: this share of replies follows random bytes.
    PIECES: replies come in pieces of this many bytes, 1 ms apart; 0 ends it.
    BABBLE: this many random bytes per second all the time.
    OVERLOAD: the servo of this id reports an overload, and shuts down if it is set to.
    BROWN_OUT: the servo of this id loses its power for a moment.
    TEMPERATURE: all servos have this temperature [degrees C].
    VOLTAGE: all servos have this supply [V].
    UNPLUGGED: the terminal is removed (1), or there is a new one behind the same link (0).
    """

    SILENT = "silent"
    MUTE = "mute"
    WRONG_CHECKSUM = "wrong_checksum"
    LATE = "late"
    LOST_BYTES = "lost_bytes"
    NOISE = "noise"
    PIECES = "pieces"
    BABBLE = "babble"
    OVERLOAD = "overload"
    BROWN_OUT = "brown_out"
    TEMPERATURE = "temperature"
    VOLTAGE = "voltage"
    UNPLUGGED = "unplugged"


SHARE_FAULTS = (BusFault.WRONG_CHECKSUM, BusFault.LOST_BYTES, BusFault.NOISE)
"""Faults whose number is a share of all replies."""


@dataclass(slots=True, eq=False)
class LineFaults:
    """Faults of the wire back.

    Attributes:
        random: Generator of the faults that are drawn.
        values: Number of each fault that is switched on.
        harmed: Number of distorted replies.
    """

    random: np.random.Generator
    values: dict[BusFault, float] = field(default_factory=dict)
    harmed: int = 0

    def set(self, fault: BusFault, value: float) -> None:
        """Switch a fault on or off.

        Raises:
            InvalidValueError: If a share is above 1, or a number below 0.
        """
        if fault in SHARE_FAULTS and not 0.0 <= value <= 1.0:
            raise InvalidValueError(f"{fault} = {value:g}: must be a share of the replies, from 0 to 1")
        if not 0.0 <= value < float("inf"):
            raise InvalidValueError(f"{fault} = {value:g}: must be finite, 0 or above; 0 switches it off")
        self.values[fault] = value

    def distorted(self, reply: bytes) -> bytes:
        """Return a reply after the wire."""
        draw, result = self.random, reply
        if self._happens(BusFault.WRONG_CHECKSUM):
            at = int(draw.integers(4, len(result)))  # behind the header: the checksum must find it
            result = result[:at] + bytes([result[at] ^ (1 << int(draw.integers(8)))]) + result[at + 1 :]
        if self._happens(BusFault.LOST_BYTES):
            at = int(draw.integers(len(result)))
            result = result[:at] + result[at + 1 :]
        if self._happens(BusFault.NOISE):
            result = draw.bytes(int(draw.integers(1, 20))) + result
        self.harmed += result != reply
        return result

    def _happens(self, fault: BusFault) -> bool:
        share = self.values.get(fault, 0.0)
        return share > 0.0 and self.random.random() < share


class DynamixelBus:
    """Servos on one pair of wires (a `ServoServer`). Servo i of the plant is the i-th that was given.

    Attributes:
        name: Name for messages and faults.
        address: Path of the terminal, or of the link to it.
    """

    def __init__(
        self, servos: Sequence[EmulatedServo], *, link: Path | None = None, seed: int = 0, name: str = "dynamixel"
    ) -> None:
        """Open a terminal and listen on it.

        Args:
            servos: Servos, each with an id of its own.
            link: Link to the terminal, which a newly plugged one takes over.
            seed: Seed of the faults that are drawn.
            name: Name for messages and faults.

        Raises:
            InvalidValueError: If two servos have one id.
        """
        ids = [servo.servo_id for servo in servos]
        if len(set(ids)) != len(ids):
            raise InvalidValueError(f"servo ids {ids}: each must have its own")
        self.name, self._servos, self._link = name, tuple(servos), link
        self._terminal: Terminal | None = Terminal(link)
        self.address = self._terminal.path
        self._receiver = PacketReceiver()
        self._line = LineFaults(np.random.default_rng(seed))
        self._silent: set[int] = set()
        self._queue: list[tuple[float, bytes]] = []
        self._babbled = -math.inf
        self._now = -math.inf
        self._done: list[str] = []

    @property
    def rejected(self) -> int:
        """Number of packets with a wrong checksum, or torn."""
        return self._receiver.rejected

    @property
    def harmed(self) -> int:
        """Number of distorted replies."""
        return self._line.harmed

    def files(self) -> Sequence[int]:
        """See `Server`."""
        return () if self._terminal is None else (self._terminal.master,)

    def receive(self, file: int, now: float) -> None:
        """See `Server`."""
        terminal, self._now = self._terminal, now
        if terminal is None or file != terminal.master:
            return
        data = terminal.read()
        if not data:
            return
        rate = terminal.baud_rate()
        for request in self._receiver.feed(data, now):
            for reply in replies(request, self._receiving(rate, now), now):
                if not self._line.values.get(BusFault.MUTE):
                    self._send(reply, now)

    def due(self) -> float:
        """See `Server`."""
        soonest = min((servo.watchdog_due() for servo in self._servos), default=math.inf)
        if self._queue:
            soonest = min(soonest, self._queue[0][0])
        if self._line.values.get(BusFault.BABBLE) and self._terminal is not None:
            soonest = min(soonest, self._babbled + BABBLE_TIME)
        return soonest

    def tick(self, now: float) -> None:
        """See `Server`."""
        self._now = now
        for servo in self._servos:
            servo.tick(now)
        while self._queue and self._queue[0][0] <= now:
            self._out(self._queue.pop(0)[1])
        babble = self._line.values.get(BusFault.BABBLE, 0.0)
        if babble and now >= self._babbled + BABBLE_TIME:
            self._babbled = now
            self._out(self._line.random.bytes(max(1, round(babble * BABBLE_TIME))))

    def take(self, state: PlantState) -> None:
        """See `Server`.

        Raises:
            InvalidValueError: If the plant has fewer servos than the bus.
        """
        if len(state.servos) < len(self._servos):
            raise InvalidValueError(
                f"the plant has {len(state.servos)} servos, the bus {len(self._servos)}: give the plant more"
            )
        for servo, its in zip(self._servos, state.servos, strict=False):
            servo.take(its)

    def goals(self) -> tuple[ServoGoal, ...]:
        """See `ServoServer`."""
        return tuple(servo.goal() for servo in self._servos)

    def inject(self, fault: str, value: float) -> str:
        """Switch a `BusFault`.

        Raises:
            InvalidValueError: If there is no such fault, or its number is impossible.
        """
        kind = fault_named(BusFault, fault)
        match kind:
            case BusFault.SILENT:
                self._silent = set() if value < 0 else self._silent | {self._servo(value).servo_id}
            case BusFault.OVERLOAD:
                self._servo(value).fail(HardwareError.OVERLOAD)
            case BusFault.BROWN_OUT:
                self._servo(value).reboot(self._now)
            case BusFault.TEMPERATURE:
                self._measure(reg.PRESENT_TEMPERATURE, value)
            case BusFault.VOLTAGE:
                self._measure(reg.PRESENT_VOLTAGE, 10.0 * value)
            case BusFault.UNPLUGGED:
                self._plug(plugged=not value)
            case _:
                self._line.set(kind, value)
        done = f"{self.name}: {kind} = {value:g}"
        self._done.append(done)
        return done

    def status(self) -> Mapping[str, object]:
        """See `Monitored`: how many packets and replies were damaged, and the main items of the control tables."""
        items = {
            "torque": reg.TORQUE_ENABLE,
            "error": reg.HARDWARE_ERROR_STATUS,
            "goal_current": reg.GOAL_CURRENT,
            "goal_position": reg.GOAL_POSITION,
            "position": reg.PRESENT_POSITION,
        }
        servos = {
            str(servo.servo_id): {name: servo.table.get(item) for name, item in items.items()}
            for servo in self._servos
        }
        return {"rejected": self.rejected, "harmed": self.harmed, "servos": servos}

    def lines(self) -> list[str]:
        """See `Monitored`: the faults that were switched."""
        return list(self._done)

    def close(self) -> None:
        """See `Server`."""
        self._plug(plugged=False)

    def _receiving(self, rate: int | None, now: float) -> Servos:
        receiving = (
            servo
            for servo in self._servos
            if servo.servo_id not in self._silent and not servo.starting(now) and rate in (None, servo.baud_rate)
        )
        return {servo.servo_id: servo for servo in sorted(receiving, key=lambda servo: servo.servo_id)}

    def _servo(self, servo_id: float) -> EmulatedServo:
        for servo in self._servos:
            if servo.servo_id == servo_id:
                return servo
        ids = ", ".join(str(servo.servo_id) for servo in self._servos)
        raise InvalidValueError(f"servo id = {servo_id:g}: must be one of {ids}")

    def _measure(self, item: reg.Register, value: float) -> None:
        if not 0.0 <= value < 256.0:
            raise InvalidValueError(f"{value:g}: must be from 0 to 255 in the register's unit")
        for servo in self._servos:
            servo.table.put(item, round(value))

    def _plug(self, *, plugged: bool) -> None:
        self._queue.clear()
        if not plugged and self._terminal is not None:
            self._terminal.close()
            self._terminal = None
        elif plugged and self._terminal is None:
            self._terminal = Terminal(self._link)
            self.address = self._terminal.path
            self._receiver = PacketReceiver()

    def _send(self, reply: bytes, now: float) -> None:
        values = self._line.values
        distorted, at = self._line.distorted(reply), now + values.get(BusFault.LATE, 0.0)
        size = int(values.get(BusFault.PIECES, 0.0)) or len(distorted)
        if self._queue:
            at = max(at, self._queue[-1][0])
        if at <= now and size >= len(distorted):
            self._out(distorted)
            return
        for i in range(0, len(distorted), size):
            self._queue.append((at, distorted[i : i + size]))
            at += PIECE_TIME

    def _out(self, data: bytes) -> None:
        if self._terminal is not None:
            self._terminal.write(data)
