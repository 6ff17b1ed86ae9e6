"""A sensor that streams: a thread reads it to the newest record, the loop takes that at once."""

import contextlib
import math
import threading
from dataclasses import dataclass
from time import monotonic, sleep

from palpate.errors import InvalidValueError, check_positive
from palpate.hw.devices import DeviceError, SensorReading, WireError
from palpate.hw.ft_stream.link import Link, StreamCounts, StreamReading
from palpate.sensing.ft.arrays import positive_entries
from palpate.sensing.ft.bias import MIN_READINGS, average_bias
from palpate.spatial import Wrench

TARE_TIME = 0.25
"""Least time over which a tare averages [s]: a dozen periods of mains hum, and some of an arm that swings."""

_STALE_RETRIES = 2
"""Times to look again, a millisecond apart, before a sensor is called silent: after a stall of the whole machine
it may be the loop that runs first, and what the sensor sent meanwhile has not been read yet."""

_JOIN = 6.0
"""Longest to wait for the reading thread at the end [s]: it is never away for longer than a dialogue takes. A
Bota's has 1.5 s to boot in, then four requests and replies of 0.5 s each."""


@dataclass(frozen=True, slots=True)
class StreamSettings:
    """How a stream is watched.

    Attributes:
        noise: Standard deviation of one reading at rest, as the sensor file has it [N, N m, or raw]: what a tare
            tells rest from motion by.
        silent_after: Time without a record after which `read` refuses [s]; at least three periods of the sensor.
        ask_again_after: Time without a record after which the device is asked to stream again, and between two
            requests [s].
        start_within: Longest that a start may take from the request to a steady stream [s].
    """

    noise: Wrench
    silent_after: float = 0.04
    ask_again_after: float = 0.1
    start_within: float = 4.0

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            InvalidValueError: A value that is not above 0.
        """
        positive_entries("noise", self.noise, 6, "N, N m")
        check_positive(self, silent_after="s", ask_again_after="s", start_within="s")


class StreamedSensor:
    """A `SensorDevice` over any link. `start`, `tare` and `close` are called by one thread, `read` by any."""

    def __init__(self, link: Link, settings: StreamSettings) -> None:
        """Take the wire and how it is watched; nothing is opened before `start`."""
        self._link = link
        self._settings = settings
        self._thread: threading.Thread | None = None
        self._ending = threading.Event()
        self._newest: StreamReading | None = None
        self._undated = -math.inf  # arrival of the newest record that nothing dates
        self._offset: tuple[float, ...] = (0.0,) * 6
        self._at_rest: list[StreamReading] | None = None
        self._trouble = ""
        self._died = False

    @property
    def name(self) -> str:
        """For messages."""
        return self._link.name

    @property
    def counts(self) -> StreamCounts:
        """What became of all that arrived; it goes on changing."""
        return self._link.counts

    @property
    def problem(self) -> str:
        """What the newest record says is wrong with it, and what to do; empty if it is good."""
        newest = self._newest
        return "" if newest is None else self._link.problem(newest.status)

    def start(self) -> None:
        """Connect, ask for the stream, wait until it is steady and its clock is known. Forget an earlier tare.

        Raises:
            DeviceError: It cannot be reached, does not stream, or not steadily.
        """
        self.close()
        ending = self._ending = threading.Event()
        self._newest, self._undated, self._trouble, self._died = None, -math.inf, "", False
        self._offset = (0.0,) * 6
        try:
            self._link.open()
            self._thread = threading.Thread(
                target=self._read_on, args=(ending,), name=f"reads {self.name}", daemon=True
            )
            self._thread.start()
            self._wait_for_steady_stream()
        except BaseException:
            self.close()
            raise

    def read(self) -> SensorReading:
        """Return the newest record, at once unless it is too old.

        Raises:
            DeviceError: There has been none for too long.
        """
        record = self._fresh()
        wrench = tuple([value - zero for value, zero in zip(record.wrench, self._offset, strict=True)])
        return SensorReading(record.time, wrench, not self._link.problem(record.status), self._link.counts.lost)

    def tare(self) -> None:
        """Take the mean of the next readings for zero, `MIN_READINGS` of them or `TARE_TIME`.

        Raises:
            DeviceError: It is silent or unhealthy, or the readings moved; the zero stays as it was.
        """
        self.read()
        rows: list[StreamReading] = []
        self._at_rest = rows
        begin = monotonic()
        try:
            while len(rows) < MIN_READINGS or monotonic() - begin < TARE_TIME:
                self._ending.wait(0.01)
                self.read()
        finally:
            self._at_rest = None
        taken = rows[:]
        for row in taken:
            if problem := self._link.problem(row.status):
                raise DeviceError(self.name, f"cannot be tared: {problem}", "tare again when it is healthy")
        try:
            self._offset = average_bias([row.wrench for row in taken], noise=self._settings.noise).mean
        except InvalidValueError as moved:
            raise DeviceError(
                self.name, f"cannot be tared: {moved}", "or its noise is larger than the settings say"
            ) from None

    def close(self) -> None:
        """Stop the stream and the thread; any number of times, at any time."""
        self._ending.set()
        thread, self._thread = self._thread, None
        if thread is not None and thread is not threading.current_thread():
            thread.join(_JOIN)
        self._newest = None
        self._link.close()

    def _fresh(self) -> StreamReading:
        """Return the newest record that is dated, if it came a short while ago."""
        silence = math.inf
        for glance in range(_STALE_RETRIES + 1):
            newest = self._newest
            if newest is None:
                raise self._silence("not a record so far")
            silence = monotonic() - newest.arrival
            if silence <= self._settings.silent_after:
                return newest
            if glance < _STALE_RETRIES and not self._died:
                sleep(1e-3)
        if monotonic() - self._undated <= self._settings.silent_after:
            raise DeviceError(
                self.name,
                "it has begun anew; nothing proves yet how old its records are",
                "read again a little later",
            )
        raise self._silence(f"silent for {1e3 * silence:.0f} ms")

    def _silence(self, since: str) -> DeviceError:
        if self._thread is None:
            return DeviceError(self.name, "is not started", "call start() first")
        if self._died:
            return DeviceError(self.name, f"its reading thread has ended: {self._trouble}", "start it again")
        if self._trouble:
            return WireError(
                self.name, f"{since}: {self._trouble}", "check its power and cable; asked again meanwhile"
            )
        counts = self._link.counts
        if counts.refused and not counts.records:
            return WireError(
                self.name,
                f"{since}; {counts.refused} pieces of what arrived were none of its records",
                "check that it is of this make, its settings, and that a serial adapter passes bytes on at once",
            )
        return WireError(
            self.name, since, "check power and cable, and that no other program reads it; asked again meanwhile"
        )

    def _wait_for_steady_stream(self) -> None:
        deadline = monotonic() + self._settings.start_within
        while monotonic() < deadline and not self._died:
            if self._newest is not None:
                with contextlib.suppress(DeviceError):  # this computer may have stood still just now
                    self.read()
                    return
            self._ending.wait(0.005)
        raise self._silence(f"no steady stream within {self._settings.start_within:g} s")

    def _read_on(self, ending: threading.Event) -> None:
        """Read until asked to end; `read` raises whatever goes wrong."""
        silent, heard, asked = True, 0.0, -float("inf")
        link, again = self._link, self._settings.ask_again_after
        try:
            while not ending.is_set():
                try:
                    now = monotonic()
                    if silent and now - asked > again:
                        asked = now
                        link.request()
                        silent, heard = False, monotonic()
                    # the wire is looked at after the clock: this computer may have slept, not the device
                    now = monotonic()
                    records = link.receive()
                except OSError as error:
                    self._trouble = error.strerror or str(error)
                    silent = True
                    ending.wait(0.01)
                    continue
                for record in records:
                    self._take(record)
                if records:
                    silent, heard = False, records[-1].arrival
                    self._trouble = ""
                elif now - heard > again:
                    silent = True
        except Exception as error:
            self._trouble, self._died = f"{type(error).__name__}: {error}", True

    def _take(self, record: StreamReading) -> None:
        if record.time == -math.inf:  # what was dated goes on growing old
            self._undated = record.arrival
            return
        self._newest = record
        rows = self._at_rest
        if rows is not None:
            rows.append(record)
