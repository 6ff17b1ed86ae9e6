"""An emulated UR controller served by a thread of the test, and packages that nearly follow its protocol."""

import random
import struct
import threading
from typing import Any

from palpate.hw.emulators.control import EmulatorControl
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.emulators.ur import ControllerFault, UrServer
from palpate.hw.emulators.ur.commands import BLOCKING, REAL_TIME, STOP
from palpate.hw.emulators.ur.controller import INPUTS
from palpate.hw.emulators.ur.rtde import HEADER, PackageType
from support.waiting import WITHIN, until


class ServedUr:
    """A controller on loopback sockets, with its control channel.

    Attributes:
        control: Control channel of the emulator.
    """

    def __init__(self, address: str, period: float = 0.002) -> None:
        """Start the controller at an address, on a plant with a step of `period` [s]."""
        self._host = Host(SimplePlant(period=period), [UrServer(address, unlock_delay=0.5)])
        self._thread = threading.Thread(target=self._host.run)
        self._thread.start()
        self.control = EmulatorControl(self._host.control_address)

    def __enter__(self) -> "ServedUr":
        return self

    def __exit__(self, *_: object) -> None:
        self.control.close()
        self._host.stop()
        self._thread.join(WITHIN)
        assert not self._thread.is_alive()

    def fault(self, fault: ControllerFault, value: float = 1.0) -> str:
        return self.control.fault("ur", fault, value)

    def becomes(self, **expected: object) -> None:
        """Wait until the status has these values."""

        def reached() -> bool:
            devices: Any = self.control.state()["devices"]
            return all(devices["ur"][name] == value for name, value in expected.items())

        until(reached)


NAMES = (*list(INPUTS)[:40], "timestamp", "actual_q", "x", "", "\xff")
HARMLESS = (0.0, 0.4, -0.2, 0.1, 0.01)
WILD = (*HARMLESS, float("nan"), float("inf"), -1e300, 1e300, 1e5)


def nearly_right_package(random_: random.Random) -> bytes:
    """Return a package with random payload, names or commands; a few have a flipped bit or are noise."""
    kind = random_.choice([*list(PackageType), 0, 255])
    payload = random_.randbytes(random_.choice((0, 1, 2, 5, 9, 13, 16, 69)))
    match random_.randrange(3):
        case 0:
            names = random_.choices(
                [*list(INPUTS)[:40], "timestamp", "actual_q", "x", "", "\xff"], k=random_.randrange(1, 5)
            )
            payload = random_.randbytes(random_.choice((0, 8))) + ",".join(names).encode("latin-1")
        case 1:
            doubles = random_.choices(HARMLESS if random_.random() < 0.9 else WILD, k=8)
            command = random_.choice((0, random_.choice((*REAL_TIME, *BLOCKING, -1, 79, STOP))))
            payload = struct.pack(">Bi8d", random_.randrange(4), command, *doubles)
            kind = PackageType.DATA
    data = bytearray(HEADER.pack(HEADER.size + len(payload), kind) + payload)
    damage = random_.random()
    if damage < 0.05:
        data[random_.randrange(len(data))] ^= 1 << random_.randrange(8)
    return random_.randbytes(60) if damage > 0.99 else bytes(data)
