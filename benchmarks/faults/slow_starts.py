"""Serial devices that do not start: nothing, a byte now and then, or nonsense comes from their terminal."""

import os
import random
import select
import threading
import tty
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from time import monotonic

from faults.kind import Domain, Kind, Moment, Verdict, Workshop
from palpate.hw.devices import Device
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.hw.ft_stream import StreamSettings
from palpate.hw.serial_ft import Bota, Resense, SerialSensor
from palpate.sim.hand.finger import SlideFinger

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)

STARTS_WITHIN = 10.0
"""[s] that a start on a serial line may take: boot and requests 3.5, a steady stream 3, the end of a thread 2."""

Says = Callable[[bytes, random.Random], bytes]
"""Maps what was heard in a tick, and chance, to what is said."""

TICK = 0.02
"""[s]"""


def nothing(heard: bytes, chance: random.Random) -> bytes:
    """Say nothing."""
    return b""


def trickle(heard: bytes, chance: random.Random) -> bytes:
    """Say a byte per second."""
    return chance.randbytes(1) if chance.random() < TICK else b""


def nonsense(heard: bytes, chance: random.Random) -> bytes:
    """Say 10 000 random bytes per second."""
    return chance.randbytes(200)


def echo(heard: bytes, chance: random.Random) -> bytes:
    """Repeat what was heard, as a bus whose transmitter hears itself."""
    return heard


def echo_damaged(heard: bytes, chance: random.Random) -> bytes:
    """Repeat it with a byte that is another one."""
    data = bytearray(heard)
    if data:
        data[chance.randrange(len(data))] ^= chance.randrange(1, 256)
    return bytes(data)


class _Terminal:
    """A terminal whose other end says something, as long as a `with` block lasts."""

    def __init__(self, says: Says, seed: int) -> None:
        self._says, self._random, self._ending = says, random.Random(seed), threading.Event()
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._thread = threading.Thread(target=self._talk)

    def __enter__(self) -> str:
        self._thread.start()
        return os.ttyname(self._slave)

    def __exit__(self, *raised: object) -> None:
        self._ending.set()
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)

    def _talk(self) -> None:
        while not self._ending.wait(TICK):
            with suppress(BlockingIOError):
                heard = os.read(self._master, 4096) if select.select([self._master], [], [], 0.0)[0] else b""
                os.write(self._master, self._says(heard, self._random))


def hand(path: str) -> Device:
    """Return a hand of two servos on a terminal."""
    servos = (ServoCalibration(1), ServoCalibration(2))
    return DynamixelHand(path, HandSettings(servos, SlideFinger(pinion=0.02), opening=0.04, tip_along=0.012))


def bota(path: str) -> Device:
    """Return a Bota sensor on it."""
    return SerialSensor(path, Bota(51), StreamSettings(NOISE))


def resense(path: str) -> Device:
    """Return a Resense sensor on it."""
    return SerialSensor(path, Resense((50.0,) * 3, (1.0,) * 3), StreamSettings(NOISE))


@dataclass(frozen=True, slots=True)
class SlowStart:
    """A device is started on such a terminal: refused in time, by name.

    Attributes:
        device: Makes it for the path of a terminal.
        says: What comes from the terminal.
    """

    device: Callable[[str], Device]
    says: Says

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """See `Trial`."""
        threads = threading.active_count()
        with _Terminal(self.says, moment.seed) as path:
            device, begun, reported = self.device(path), monotonic(), "started"
            try:
                device.start()
            except OSError as error:
                reported = str(error)
            took = monotonic() - begun
            device.close()
        problems = []
        if took > STARTS_WITHIN:
            problems.append(f"took {took:.1f} s: a start has {STARTS_WITHIN:g} s")
        if path not in reported:
            problems.append(f"does not name {path}: {reported}")
        if threading.active_count() > threads:
            problems.append("a thread is left")
        return Verdict(f"{reported[:90]} ({took:.1f} s)", tuple(problems))


DEVICES = {"Dynamixel hand": hand, "Bota sensor": bota, "Resense sensor": resense}
LINES: dict[str, Says] = {
    "says nothing": nothing,
    "says a byte per second": trickle,
    "says nonsense": nonsense,
    "repeats what it hears": echo,
    "repeats it damaged": echo_damaged,
}

KINDS = tuple(
    Kind(f"start: {device}, whose line {line}", Domain.PROTOCOL, SlowStart(make, says))
    for device, make in DEVICES.items()
    for line, says in LINES.items()
)
"""All of them."""
