"""A robot on the wire, to be spoilt: an arm that holds a force, a hand that presses, a sensor at the tip.

All devices are emulated in one process around one plant; the clients are those of real robots, over real sockets
and terminals, together in a rig. What is true is asked of the emulator, never of the clients.
"""

import math
import shutil
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from time import monotonic, sleep
from typing import Self

from harness.campaign import raise_priority

from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.registers import XL330
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtServer
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.serial_ft import BotaServer
from palpate.hw.emulators.simple_plant import ElasticPlane, ElasticWall, SimplePlant, SimpleServo, SimpleTip
from palpate.hw.emulators.ur import UrServer
from palpate.hw.ft_stream import StreamedSensor, StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings
from palpate.hw.rig import FingerSensor, PolledHand, Rig, RigSettings
from palpate.hw.serial_ft import Bota, SerialSensor
from palpate.hw.ur import UrArm, UrSettings
from palpate.runtime.data import Command, Sample
from palpate.runtime.real_time import RealTime
from palpate.sim.hand.finger import SlideFinger

PERIOD = 0.002
"""Of the control loop [s]: the cycle of an e-Series controller."""

HEIGHT = 0.4879
"""Of the emulated tip at the start [m]."""

FORCE = 4.0
"""That the arm holds against the plane [N]."""

GAIN = 0.005
"""Of the loop that holds it [m/s per N]: with the plane's 2000 N/m it settles in 0.1 s."""

UPWARDS, DOWNWARDS = 0.02, 0.005
"""With which the tip goes off the plane and onto it at most [m/s]: while the loop stands still, on a busy machine
for as long as the longest watchdog waits (1 s), it presses by 10 N more, and the sensor has 17."""

DRAWN_BACK_FOR = 0.2
"""How long the tip goes off the plane if the sensor is out of its range all the same [s]: by 8 N."""

SLIDING = 0.01
"""With which the tip goes to and fro along the plane [m/s]."""

GRIP = (1.0, 1.0)
"""[N]"""

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
"""Of a Nano17 [N, N m]."""


@dataclass(frozen=True, slots=True)
class Patience:
    """How long clients wait for what does not come [s]: defaults of the devices, but for the arm.

    Attributes:
        arm: For a state; twice the default: a busy machine stands still for 20 ms, and 50 are asked for.
        sensor: For a record.
        hand: For an exchange.
        oldest: Age of a sample that the rig believes; the devices' own limits come first.
        arm_watchdog: Of the arm; above what a busy machine takes away, so that what is noticed is the fault.
        hand_watchdog: Of the servos; likewise.
    """

    arm: float = 0.04
    sensor: float = 0.04
    hand: float = 0.03
    oldest: float = 0.1
    arm_watchdog: float = 0.5
    hand_watchdog: float = 0.4


PATIENT = Patience(arm=0.8, sensor=0.8, hand=0.6, oldest=3.0, arm_watchdog=1.0, hand_watchdog=2.5)
"""Patience of cells where no time is judged: a busy machine may stand still. The arm's client process gives up
after 1 s, a servo waits 2.54 s at most, and a device's own report comes before the age that the rig allows."""

BOX, BOTA, HAND, ARM = "F/T box 0", "Bota sensor 0", "dynamixel", "ur"
"""Names of the emulated devices."""

_AT_REST = 1e-4
"""[m/s]"""


@dataclass(frozen=True, slots=True)
class Emulated:
    """What runs in the emulator's process.

    Attributes:
        address: Of arm and sensor, on the loopback net.
        folder: For links to terminals.
        unlock_delay: See `UrServer`.
    """

    address: str
    folder: Path
    unlock_delay: float = 0.1

    def __call__(self) -> Host:
        """Return a host that listens."""
        raise_priority()  # as punctual as real devices
        servos = tuple(SimpleServo(wall=ElasticWall(0.02)) for _ in GRIP)
        plant = SimplePlant(SimpleTip(plane=ElasticPlane(HEIGHT - 0.001)), servos)
        arm = UrServer(self.address, name=ARM, unlock_delay=self.unlock_delay)
        ids = range(1, len(GRIP) + 1)
        hand = DynamixelBus([EmulatedServo(XL330, i) for i in ids], link=self.folder / "hand", name=HAND)
        sensors = (NetFtServer(BoxSettings(self.address)), BotaServer(link=self.folder / "bota"))
        return Host(plant, [arm, hand, *sensors])


def box_client(address: str, folder: Path, stream: StreamSettings) -> StreamedSensor:
    return NetFt(address, NetFtSettings(stream))


def bota_client(address: str, folder: Path, stream: StreamSettings) -> StreamedSensor:
    return SerialSensor(str(folder / "bota"), Bota(51), stream)


class Tip(Enum):
    """Which of the sensors the loop closes over; both are at the tip."""

    BOX = (box_client,)
    BOTA = (bota_client,)

    def client(self, address: str, folder: Path, stream: StreamSettings) -> StreamedSensor:
        made: Callable[[str, Path, StreamSettings], StreamedSensor] = self.value[0]
        return made(address, folder, stream)


@dataclass(frozen=True, slots=True)
class Truth:
    """What the emulator measures.

    Attributes:
        position: Of the tip [m].
        speed: Of the tip [m/s].
        force: On the tip [N].
        currents: Of the servos [A].
    """

    position: tuple[float, ...]
    speed: float
    force: float
    currents: tuple[float, ...]


class Cell:
    """A started robot and its emulator, as long as a `with` block lasts."""

    def __init__(self, address: str, tip: Tip = Tip.BOX, patience: Patience | None = None) -> None:
        """Start nothing yet.

        Args:
            address: Of the loopback net, that nobody else uses.
            tip: Which sensor.
            patience: Of the clients; None: the devices' defaults.
        """
        self.patience = patience = patience or Patience()
        self.address, self.tip = address, tip
        self.folder = Path(tempfile.mkdtemp(prefix="palpate-wire-"))
        self.factory = Emulated(address, self.folder)
        self.emulator = EmulatorProcess(self.factory)
        self.arm = UrArm(address, UrSettings(watchdog=patience.arm_watchdog, stale_after=patience.arm))
        servos = tuple(ServoCalibration(i + 1) for i in range(len(GRIP)))
        settings = HandSettings(
            servos,
            SlideFinger(pinion=0.02),
            opening=0.04,
            tip_along=0.012,
            watchdog=patience.hand_watchdog,
            silence=patience.hand,
        )
        self.servos = DynamixelHand(str(self.folder / "hand"), settings)
        self.hand = PolledHand(self.servos, PERIOD)
        # asked again after it has been given up: what passes unseen cannot be counted
        stream = StreamSettings(NOISE, silent_after=patience.sensor, ask_again_after=patience.sensor + 0.06)
        self.sensor = tip.client(address, self.folder, stream)
        self.pace = RealTime(PERIOD)
        self.rig = Rig(
            self.pace,
            RigSettings(PERIOD, patience.oldest),
            arm=self.arm,
            hand=self.hand,
            fingers=(FingerSensor(self.sensor),),
        )
        self.sample: Sample | None = None
        self.steps = 0
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        self._stack.callback(shutil.rmtree, self.folder, ignore_errors=True)
        self._stack.callback(self.pace.stop)
        self._stack.push(lambda *raised: self.emulator.__exit__(*raised))
        try:
            self.emulator.__enter__()
            self._stack.callback(self.rig.close)
            self.up(lambda: self.rig.start())
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def replace_emulator(self) -> None:
        """Start another one in the place of one that was killed."""
        self.emulator.__exit__(None, None, None)
        self.emulator = EmulatorProcess(self.factory)
        self.emulator.__enter__()

    def step(self) -> Sample:
        """Hold the force for one period more, going to and fro, and press."""
        sample = self.sample
        down = 0.0
        if sample is not None:
            # the tool hangs: its z axis points down, and what it presses on pushes it along -z
            down = max(-UPWARDS, min(DOWNWARDS, GAIN * (FORCE + sample.wrenches[0].wrench[2])))
        aside = SLIDING if self.steps // 250 % 2 else -SLIDING
        self.steps += 1
        self.sample = None  # what is older than a fault is not to be used after it
        self.sample = self.rig.step(Command((aside, 0.0, -down), grip_force=GRIP))
        return self.sample

    def run(self, seconds: float) -> None:
        """Go on for a while.

        Raises:
            DeviceError: See `Rig.step`.
        """
        self.pace.start()
        for _ in range(round(seconds / PERIOD)):
            self.step()

    def up(self, recover: Callable[[], object], within: float = 20.0) -> float:
        """Recover and go on for 20 periods, again until both work; return how long that took [s].

        A machine that stands still for longer than devices wait makes a second try necessary, not a failure.

        Raises:
            DeviceError: It does not come back within so many seconds; what it said last.
        """
        begun = monotonic()
        while True:
            try:
                recover()
                took = monotonic() - begun
                self.run(20 * PERIOD)
            except DeviceError:
                if monotonic() - begun > within:
                    raise
                sleep(0.02)
            else:
                return took

    def everything_up(self, within: float = 20.0) -> None:
        """Bring up whatever is down, by any means that a program has.

        Raises:
            DeviceError: Not within so many seconds.
        """
        self.up(self._revive, within)
        deadline = monotonic() + 5.0
        while not self.in_contact() and monotonic() < deadline:
            self.up(self._revive, within)  # a stall of this machine may have pressed the sensor out of its range

    def _revive(self) -> None:
        """See which of the devices does not answer, and recover that."""
        try:
            self.arm.read()
        except DeviceError:
            self.arm.recover()
        try:
            self.hand.read()
        except DeviceError:
            self.hand.start()
        try:
            loaded = not self.sensor.read().healthy
        except DeviceError:
            sleep(0.15)  # it asks again by itself
        else:
            if loaded:
                self._draw_back()

    def _draw_back(self) -> None:
        """Take the load off a sensor out of its range, as its message says: a rig does not step with it."""
        self.arm.move((0.0, 0.0, UPWARDS), (0.0, 0.0, 0.0))
        sleep(DRAWN_BACK_FOR)
        self.arm.stop()

    def in_contact(self) -> bool:
        """Whether arm and hand both press, as the emulator sees it."""
        truth = self.truth()
        return abs(truth.force - FORCE) < 0.5 * FORCE and min(truth.currents) > 0.01

    def fault(self, device: str, fault: str, value: float = 1.0) -> None:
        """Switch a fault of the emulator's."""
        self.emulator.control.fault(device, fault, value)

    def truth(self) -> Truth:
        """Ask the emulator."""
        state = self.emulator.control.state()
        position, velocity, wrenches, servos = (
            state[name] for name in ("position", "velocity", "wrenches", "servos")
        )
        if not all(isinstance(its, list) for its in (position, velocity, wrenches, servos)):
            raise TypeError(f"the emulator tells {state}")
        return Truth(
            tuple(position),  # type: ignore[arg-type]
            math.hypot(*velocity),  # type: ignore[misc]
            math.hypot(*wrenches[0][:3]),  # type: ignore[index]
            tuple(abs(servo[2]) for servo in servos),  # type: ignore[union-attr]
        )

    def rests(self, within: float) -> bool:
        """Wait until the arm is at rest; return whether it came to it in time."""
        deadline = monotonic() + within
        while self.truth().speed > _AT_REST:
            if monotonic() > deadline:
                return False
            sleep(2e-3)
        return True
