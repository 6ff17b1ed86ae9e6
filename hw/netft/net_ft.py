"""An ATI Net F/T box, or what speaks as it does, by UDP."""

import contextlib
import ctypes
import errno
import math
import os
import select
import socket
from collections.abc import Sequence
from time import monotonic

from palpate.hw.devices import WireError
from palpate.hw.ft_stream.link import StreamCounts, StreamReading
from palpate.hw.ft_stream.streamed_sensor import StreamedSensor
from palpate.hw.ft_stream.succession import MODULUS, Step, Succession
from palpate.hw.netft.calibration import ask_calibration
from palpate.hw.netft.rdt import HEADER, RECORD, REQUEST, RdtCommand
from palpate.hw.netft.settings import NetFtSettings, Scales
from palpate.hw.round_trip_clock import RoundTrip, RoundTripClock

NOTHING = -1
"""Instead of a size: none has come."""


class Datagrams:
    """Receives datagrams of a connected UDP socket without letting another thread have Python in between.

    Every call of a Python socket gives the interpreter away and must win it back: beside a thread that computes it
    waits for the switch interval each time, 5 ms outside the control loop. With one such call per record, 1400 of
    the 7000 records that a box sends in a second are read, and the readings grow older without end. Here one call
    waits; the datagrams that have arrived by then are taken by calls of the system's `recv` that keep the
    interpreter (`ctypes.PyDLL`), a microsecond each (`python benchmarks/wire` measures it).
    """

    def __init__(self, wire: socket.socket, longest: int) -> None:
        """Take a connected socket.

        Args:
            wire: Becomes non-blocking.
            longest: That fits [bytes]; the rest of longer ones is lost.
        """
        wire.setblocking(False)
        self._wire = wire
        self._poll = select.poll()
        self._poll.register(wire, select.POLLIN)
        self.data = bytearray(longest)
        self._memory = (ctypes.c_char * longest).from_buffer(self.data)
        # not at import: Windows has none, and who only simulates needs none
        self._recv = ctypes.PyDLL(None, use_errno=True).recv
        self._recv.argtypes = (ctypes.c_int, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
        self._recv.restype = ctypes.c_ssize_t

    def wait(self, patience: float) -> bool:
        """Return whether there is one, or an error to be had, within so long [s]."""
        return bool(self._poll.poll(1e3 * patience))

    def take(self) -> int:
        """Put the next one into `data`, at once; return its size, or `NOTHING`.

        Raises:
            OSError: Nobody listens there (`ConnectionRefusedError`), or there is no route to it.
        """
        size = self._recv(self._wire.fileno(), self._memory, len(self.data), socket.MSG_DONTWAIT)
        if size >= 0:
            return int(size)
        number = ctypes.get_errno()
        if number in (errno.EAGAIN, errno.EINTR):
            return NOTHING
        raise OSError(number, os.strerror(number))


BUFFER = 1 << 22
"""Asked of the socket [bytes]; the system may grant less. A full one drops the newest, so that it must hold what
comes while nobody reads: a datagram of 36 bytes takes some 800 there, 4 MiB last for 0.7 s at 7000 Hz."""

WAIT = 0.01
"""For a record [s]; in between the reading thread looks whether it is to end, or to ask again."""

MOST_AT_ONCE = 64
"""Records taken before the reading thread looks up again: 9 ms of the fastest box, some 0.2 ms of work."""

FASTEST = 20_000.0
"""Rate that no box reaches [1/s]: 7000 (Net F/T), 8000 (Axia)."""


ECHO_PERIOD = 0.1
"""[s] from request to request while it streams. Each makes the box count its records from 1 again: what follows
was sampled after it was sent."""

LOST = 1.0
"""[s] without an echo, after which a request is taken for lost and repeated. The next echo is dated by the first
of them, as it may be the reply to either."""

OURS = 0.5
"""Since the last datagram [s], within which the stream counts as this client's."""


class RdtLink:
    """The socket, and what of its datagrams is believed."""

    def __init__(self, address: str, settings: NetFtSettings) -> None:
        """Take where the box is; nothing is opened."""
        self._address = address
        self._settings = settings
        self._socket: socket.socket | None = None
        self._scales = Scales(1.0, 1.0)
        self._counts = StreamCounts()
        self._succession = Succession((FASTEST, FASTEST), self._counts)
        self._heard = -math.inf
        self._datagrams: Datagrams | None = None
        self._clock = RoundTripClock()
        self._asked: float | None = None  # when the first request was sent whose echo has not come yet
        self._requested = -math.inf
        self._begun = self._sequence = self._sample = self._samples = 0
        self._per_record = 1.0  # samples

    @property
    def name(self) -> str:
        """For messages."""
        return f"F/T sensor at {self._address}"

    @property
    def counts(self) -> StreamCounts:
        """What became of the datagrams."""
        return self._counts

    def open(self) -> None:
        """Ask for the calibration, then open the socket.

        Raises:
            DeviceError: As `ask_calibration`, or there is no route to the address.
        """
        self.close()
        settings = self._settings
        self._scales = settings.scales or self._calibration()
        self._counts = StreamCounts()
        self._succession = Succession((FASTEST, FASTEST), self._counts)
        wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
            wire.connect((self._address, settings.rdt_port))
        except OSError as error:
            wire.close()
            raise WireError(
                self.name, error.strerror or str(error), "check its address and this computer's network"
            ) from None
        self._clock = RoundTripClock()
        self._asked, self._requested = None, -math.inf
        self._begun = self._sequence = self._sample = self._samples = 0
        self._per_record = 1.0  # samples
        self._socket = wire
        self._datagrams = Datagrams(wire, RECORD.size + 1)  # one byte more: what is longer shows

    def request(self) -> None:
        """Ask for one record per datagram, without end; the box forgets whom it sent them to before.

        Raises:
            OSError: There is no route to it.
        """
        wire = self._wire()
        self._counts.requests += 1
        try:
            for first in self._settings.first:
                wire.send(REQUEST.pack(HEADER, first.command, first.value))
            self._ask_for_stream(wire)
        except ConnectionRefusedError:
            raise self._nobody() from None

    def receive(self) -> Sequence[StreamReading]:
        """Return the records that are there; wait for the first one, for up to `WAIT`.

        Raises:
            OSError: Nobody listens there, or there is no route to it.
        """
        wire, datagrams = self._wire(), self._datagrams
        if datagrams is None or not datagrams.wait(WAIT):
            return ()
        records = []
        try:
            if monotonic() - self._requested > (ECHO_PERIOD if self._asked is None else LOST):
                self._ask_for_stream(wire)
            for _ in range(MOST_AT_ONCE):
                size = datagrams.take()
                if size == NOTHING:
                    break
                record = self._judged(size, datagrams.data, monotonic())
                if record is not None:
                    records.append(record)
        except ConnectionRefusedError:
            raise self._nobody() from None
        return records

    def _judged(self, size: int, data: bytearray, arrival: float) -> StreamReading | None:
        """Return what a datagram tells, if it is believed."""
        self._heard = arrival
        if size != RECORD.size:
            self._counts.refused += 1
            return None
        sequence, sample, status, fx, fy, fz, tx, ty, tz = RECORD.unpack_from(data)
        begun = self._begun
        passed = (sample - self._sample) % MODULUS
        again = sequence <= self._sequence and 0 < passed < MODULUS // 2  # each request makes it count anew
        if again:  # counted from the last record on, and from those that a pause of the box left out
            paused = max(int(passed / self._per_record) - 1 - sequence, 0)
            begun = (begun + self._sequence + paused) % MODULUS
        step, advance = self._succession.judge(((begun + sequence) % MODULUS, sample), arrival)
        if step is Step.NEXT:
            if not again:  # how many were lost as the box began to count anew nobody knows
                self._counts.lost += advance - 1
                self._per_record = passed / advance
        elif step is Step.ANEW:
            # whatever comes first to a new socket was sampled after the first request
            again, passed = not self._counts.restarts, 0
            self._clock.restart()
            self._requested = -math.inf
        else:
            return None
        self._begun, self._sequence, self._sample = begun, sequence, sample
        self._samples += passed
        asked = self._asked
        if again and asked is not None:
            self._asked = None
            self._clock.prove((RoundTrip(self._samples, asked, arrival),))
        force, moment = self._scales.force, self._scales.moment
        wrench = (force * fx, force * fy, force * fz, moment * tx, moment * ty, moment * tz)
        time = self._clock.stamp(self._samples, arrival) if self._clock.paced else -math.inf
        return StreamReading(arrival, time, wrench, status)

    def problem(self, status: int) -> str:
        """Return what a status word says is wrong; empty if the reading is good."""
        return self._settings.status_words.problem(status) if status else ""

    def close(self) -> None:
        """Ask the box to stop, unless its stream goes to somebody else by now, and close the socket."""
        wire, self._socket, self._datagrams = self._socket, None, None
        if wire is not None:
            if monotonic() - self._heard < OURS:
                with contextlib.suppress(OSError):
                    wire.send(REQUEST.pack(HEADER, RdtCommand.STOP, 0))
            wire.close()

    def _ask_for_stream(self, wire: socket.socket) -> None:
        """Ask for records without end, counted from 1."""
        self._requested = now = monotonic()
        if self._asked is None:
            self._asked = now
        wire.send(REQUEST.pack(HEADER, RdtCommand.STREAM, 0))

    def _nobody(self) -> ConnectionRefusedError:
        return ConnectionRefusedError(f"nobody listens on UDP port {self._settings.rdt_port}: is it switched on?")

    def _wire(self) -> socket.socket:
        if self._socket is None:
            raise OSError("is closed")
        return self._socket

    def _calibration(self) -> Scales:
        settings = self._settings
        asked = ask_calibration(self.name, self._address, settings.calibration_port, settings.patience)
        return asked.scales


class NetFt(StreamedSensor):
    """A `SensorDevice` on Ethernet: ATI Net F/T and Axia; with `onrobot_settings` an OnRobot HEX."""

    def __init__(self, address: str, settings: NetFtSettings) -> None:
        """Take the box's IP address; nothing is opened before `start`."""
        super().__init__(RdtLink(address, settings), settings.stream)
