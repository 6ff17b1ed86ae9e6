"""A bus of emulated servos behind a terminal: a server for the host's loop, pure Python and without waiting."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from palpate.errors import InvalidValueError
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.registers import HardwareError
from palpate.hw.emulators.dynamixel.faults import BusFault, LineFaults, fault_named
from palpate.hw.emulators.dynamixel.receiver import PacketReceiver
from palpate.hw.emulators.dynamixel.requests import Servos, replies
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.server import PlantState, ServoGoal
from palpate.hw.emulators.terminal import Terminal

PIECE_TIME = 1e-3
"""Between the pieces of a torn reply [s]: a frame of USB."""

BABBLE_TIME = 1e-3
"""Between bursts of a bus that babbles [s]."""


class DynamixelBus:
    """Servos on one pair of wires: a `ServoServer`. Servo i of the plant is the i-th that was given."""

    def __init__(
        self, servos: Sequence[EmulatedServo], *, link: Path | None = None, seed: int = 0, name: str = "dynamixel"
    ) -> None:
        """Open a terminal and listen on it.

        Args:
            servos: Each with an id of its own.
            link: Where a link to the terminal shall stand, which a newly plugged one takes over.
            seed: Of the faults that are drawn.
            name: For messages and faults.

        Raises:
            InvalidValueError: Two servos have one id.
        """
        ids = [servo.servo_id for servo in servos]
        if len(set(ids)) != len(ids):
            raise InvalidValueError(f"servo ids {ids}: each must have its own")
        self._name, self._servos, self._link = name, tuple(servos), link
        self._terminal: Terminal | None = Terminal(link)
        self._address = self._terminal.path
        self._receiver = PacketReceiver()
        self._line = LineFaults(np.random.default_rng(seed))
        self._silent: set[int] = set()
        self._queue: list[tuple[float, bytes]] = []
        self._babbled = -math.inf
        self._now = -math.inf
        self._done: list[str] = []

    @property
    def name(self) -> str:
        """See `Server`."""
        return self._name

    @property
    def address(self) -> str:
        """See `Server`: path of the terminal, or of the link to it."""
        return self._address

    @property
    def rejected(self) -> int:
        """How many packets came with a wrong checksum, or torn."""
        return self._receiver.rejected

    @property
    def harmed(self) -> int:
        """How many replies were distorted."""
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
            for reply in replies(request, self._hearing(rate, now), now):
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
            InvalidValueError: The plant has fewer servos than the bus.
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
        """See `Server`; `BusFault` says what there is.

        Raises:
            InvalidValueError: No such fault, or a number that it cannot have.
        """
        kind = fault_named(fault)
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
        done = f"{self._name}: {kind} = {value:g}"
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

    def _hearing(self, rate: int | None, now: float) -> Servos:
        heard = (
            servo
            for servo in self._servos
            if servo.servo_id not in self._silent and not servo.deaf(now) and rate in (None, servo.baud_rate)
        )
        return {servo.servo_id: servo for servo in sorted(heard, key=lambda servo: servo.servo_id)}

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
            self._address = self._terminal.path
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
