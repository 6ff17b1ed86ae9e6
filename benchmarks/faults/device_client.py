"""The back end of `watchdog_device`: real packets, real time."""

import contextlib
import socket
import time

from faults.watchdog_device import COMMAND, STATE
from palpate.runtime.data import ArmSample, Command, Phase, Sample, WrenchSample
from palpate.runtime.real_time import RealTime
from palpate.spatial import IDENTITY

PERIOD = 2e-3
"""[s]"""
FIRST_REPLY = 30.0
"""How long it may take [s]."""
PUSH = (0.1, 0.0, 2.0, 0.0, 0.0, 0.0)


class DeviceBackend:
    """Sends a command, waits for the end of the period, and takes the last reply that has come.

    The device's clock is its own: what it says is moved by what it differed by at the start.
    """

    def __init__(self, port: int) -> None:
        self.period = PERIOD
        self.pacer = RealTime(PERIOD)
        self._number = 0
        self._link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._link.connect(("127.0.0.1", port))

    def start(self) -> Sample:
        self._send(Command())
        self._link.settimeout(FIRST_REPLY)
        self._state = STATE.unpack(self._link.recv(256))
        self._link.setblocking(False)
        self._began = time.monotonic()
        self._offset = self._began - self._state[0]
        return self._sample()

    def step(self, command: Command) -> Sample:
        self._send(command)
        self.pacer.wait()
        with contextlib.suppress(BlockingIOError):
            while True:
                self._state = STATE.unpack(self._link.recv(256))
        return self._sample()

    def close(self) -> None:
        """Say once more that it is to stand still, if anybody listens."""
        with contextlib.suppress(OSError):
            self._send(Command())
        self._link.close()

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close()

    def _send(self, command: Command) -> None:
        self._number += 1
        self._link.send(COMMAND.pack(self._number, *command.velocity_base_tip))

    def _sample(self) -> Sample:
        now = time.monotonic()
        stamp, *rest = self._state
        taken = min(stamp + self._offset, now)  # the first reply was delayed
        arm = ArmSample(taken, tuple(rest[:3]), IDENTITY, tuple(rest[3:]))
        return Sample(now, arm, (WrenchSample(taken, PUSH, (0.0, 0.0, 9.81)),))


class Sweep:
    """Moves to and fro for ever, 2 mm at 20 mm/s."""

    def start(self, first) -> None:
        self._first = first.time

    def step(self, now) -> Command:
        forth = int((now.time - self._first) / 0.1) % 2 == 0
        return Command((0.02 if forth else -0.02, 0.0, 0.0), Phase.SCAN)
