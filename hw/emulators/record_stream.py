"""Stream of records of an emulated F/T box: deadlines, counters, and faults in transit."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from palpate.hw.netft.rdt import RECORD

MODULUS = 1 << 32

MAX_LATENESS = 0.5
"""Lateness from which the stream leaves out the records that it could not send [s]: an emulator that was stopped
for longer goes on as a box does whose cable was out."""

_INT_MIN, _INT_MAX = -(1 << 31), (1 << 31) - 1


class NetFtFault(StrEnum):
    """Fault of a sensor on Ethernet; the meaning of its value is in brackets. 0 ends a lasting one."""

    SILENT = "silent"
    """Sends neither records nor replies (1: on)."""
    OUT_OF_RANGE = "out_of_range"
    """Status bits of an overload, readings at the end of the range (1: on)."""
    STATUS = "status"
    """Any status word (the word)."""
    GAP = "gap"
    """Once, records that are never sent; the counters of both kinds jump (how many)."""
    RESTARTED = "restarted"
    """Once, both counters restart while the stream goes on."""
    REBOOTED = "rebooted"
    """Once, counters restart and the stream has no destination any more."""
    DROPPED = "dropped"
    """Every k-th record is lost (k)."""
    REORDERED = "reordered"
    """Every k-th record comes after the next one (k >= 2)."""
    REPEATED = "repeated"
    """Every k-th record is sent twice (k)."""
    WRONG_LENGTH = "wrong_length"
    """Every k-th record is cut short by a byte, or has one more, in turn (k)."""


@dataclass(slots=True)
class ActiveFaults:
    """Faults that last; 0: off."""

    silent: bool = False
    out_of_range: bool = False
    status: int = 0
    dropped: int = 0
    reordered: int = 0
    repeated: int = 0
    wrong_length: int = 0

    @property
    def disturbs(self) -> bool:
        """Whether datagrams must be looked at one by one."""
        return bool(self.dropped or self.reordered or self.repeated or self.wrong_length)


class RecordStream:
    """Deadlines are absolute: start + k / rate. Several records are sent at once if the loop comes late."""

    def __init__(
        self, send: Callable[[bytes], None], faults: ActiveFaults, rate: float, internal_rate: float, now: float
    ) -> None:
        """Begin without a stream.

        Args:
            send: Puts a datagram on the wire.
            faults: Faults for every record.
            rate: Rate of records [1/s].
            internal_rate: Rate of the box's sampling, which ft_sequence counts [1/s].
            now: When the box was switched on [s].
        """
        self._send, self._faults = send, faults
        self._rate = rate
        self._internal_rate = internal_rate
        self._switched_on = now
        self._began = 0.0
        self._slot = 0  # deadlines since then
        self._first_sample = 0
        self._sequence = 0
        self._left = math.inf
        self._per_datagram = 1
        self._running = False
        self._waiting = bytearray()
        self._held_back = b""
        self._values: tuple[int, ...] = (0,) * 7
        self._longer = False
        self.sent = 0

    def start(self, now: float, records: int, per_datagram: int) -> None:
        """Begin with rdt_sequence 1; 0 records: without end."""
        self._set_beginning(now)
        self._sequence = 0
        self._left = records if records else math.inf
        self._per_datagram = per_datagram
        self._waiting.clear()
        self._held_back = b""
        self._running = True

    def stop(self) -> None:
        """Send no more."""
        self._running = False

    def set_rate(self, rate: float, now: float) -> None:
        """Go on with another rate [1/s]."""
        self._set_beginning(now)
        self._rate = rate

    def show(self, status: int, counts: tuple[int, ...]) -> None:
        """Set status and counts of the next records."""
        self._values = (status, *(min(max(c, _INT_MIN), _INT_MAX) for c in counts))

    def skip(self, records: int) -> None:
        """Lose the next records; both counters advance by them."""
        self._sequence += records
        self._first_sample += round(records * self._internal_rate / self._rate)
        self._switched_on -= records / self._rate

    def count_anew(self, now: float) -> None:
        """Restart both counters, as after switching on."""
        self._switched_on, self._sequence = now, 0
        self._first_sample = -self._samples()

    def due(self) -> float:
        """Return when the next record is due [s]."""
        return self._began + (self._slot + 1) / self._rate if self._running else math.inf

    def send_due(self, now: float, most: int) -> None:
        """Send the records that are due, at most `most`."""
        if now - self.due() > MAX_LATENESS:
            skipped = int((now - self.due()) * self._rate)
            self._slot += skipped
            self._sequence += skipped
        for _ in range(most):
            due = self.due()
            if due > now:
                return
            self._slot += 1
            self._sequence += 1
            sample = (self._first_sample + self._samples()) % MODULUS
            record = RECORD.pack(self._sequence % MODULUS, sample, *self._values)
            if not self._faults.silent:
                if self._per_datagram > 1:
                    self._gather(record)
                elif self._faults.disturbs or self._held_back:
                    self._disturb(record)
                else:
                    self.sent += 1
                    self._send(record)
            self._left -= 1
            if self._left <= 0:
                self._end()
                return

    def _set_beginning(self, now: float) -> None:
        self._began, self._slot = now, 0
        self._first_sample = int((now - self._switched_on) * self._internal_rate)

    def _samples(self) -> int:
        """Return the number of samples since the stream began: at least one per record."""
        return round(self._slot * self._internal_rate / self._rate)

    def _end(self) -> None:
        if self._waiting:
            self._send(bytes(self._waiting))
        self._running = False

    def _gather(self, record: bytes) -> None:
        self._waiting += record
        self.sent += 1
        if len(self._waiting) >= self._per_datagram * RECORD.size:
            self._send(bytes(self._waiting))
            self._waiting.clear()

    def _disturb(self, record: bytes) -> None:
        faults, k = self._faults, self._sequence
        if faults.dropped and k % faults.dropped == 0:
            return
        self.sent += 1
        if faults.wrong_length and k % faults.wrong_length == 0:
            self._longer = not self._longer
            record = record + b"\0" if self._longer else record[:-1]
        if faults.reordered and k % faults.reordered == 0 and not self._held_back:
            self._held_back = record
            return
        self._send(record)
        if faults.repeated and k % faults.repeated == 0:
            self._send(record)
        if self._held_back:
            self._send(self._held_back)
            self._held_back = b""
