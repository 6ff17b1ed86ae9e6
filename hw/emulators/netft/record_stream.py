"""The stream of records: when each is due, what it counts, and what happens to it in transit."""

import math
from collections.abc import Callable

from palpate.hw.emulators.netft.faults import ActiveFaults
from palpate.hw.netft.rdt import RECORD

MODULUS = 1 << 32

LATEST = 0.5
"""Behind its deadlines, after which the stream leaves out the records that it could not send [s]: an emulator that
was stopped for longer goes on as a box does whose cable was out."""

_INT_MIN, _INT_MAX = -(1 << 31), (1 << 31) - 1


class RecordStream:
    """Deadlines are absolute: start + k / rate. Several records are sent at once if the loop comes late."""

    def __init__(
        self, send: Callable[[bytes], None], faults: ActiveFaults, rate: float, internal_rate: float, now: float
    ) -> None:
        """Stand still.

        Args:
            send: Puts a datagram on the wire.
            faults: Looked at for every record.
            rate: Of records [1/s].
            internal_rate: Of the box's sampling, which ft_sequence counts [1/s].
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
        """Take what the next records say."""
        self._values = (status, *(min(max(c, _INT_MIN), _INT_MAX) for c in counts))

    def skip(self, records: int) -> None:
        """Lose the next ones, as if all of them had been sent at once."""
        self._sequence += records
        self._first_sample += round(records * self._internal_rate / self._rate)
        self._switched_on -= records / self._rate

    def count_anew(self, now: float) -> None:
        """Begin both counters anew, as a box that was switched off."""
        self._switched_on, self._sequence = now, 0
        self._first_sample = -self._samples()

    def due(self) -> float:
        """Return when the next record is due [s]."""
        return self._began + (self._slot + 1) / self._rate if self._running else math.inf

    def send_due(self, now: float, most: int) -> None:
        """Send what is due, at most `most` records."""
        if now - self.due() > LATEST:
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
        """Return how often the box has sampled since the stream began: at least once per record."""
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
