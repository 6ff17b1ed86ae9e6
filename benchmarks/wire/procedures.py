"""How a fault is tried on a robot on the wire: what is done, what is looked at, how it comes back."""

import os
import re
import signal
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic, sleep

import psutil

from palpate.errors import InvalidValueError
from palpate.hw.devices import DeviceError
from wire.cell import PERIOD, Cell, Truth

Act = Callable[[Cell], object]
LONGEST = 3.0
"""[s] until what must be noticed while the robot runs counts as not noticed."""

REST_WITHIN = 2.0
"""[s] for the arm to come to rest: the longest watchdog's time, and what a busy machine takes."""

STILL_PRESSES = 0.9
"""Share of a servo's current that must be left: one unit of 81."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one try.

    Attributes:
        noticed: After which time it was [s]; infinity if it was not.
        safe: Whether the safe state was come to, as the emulator measures it.
        said: The message; empty if there is none to be.
        back: How long it took to work again [s]; infinity if it does not.
        trouble: What else was not as it must be; empty.
    """

    noticed: float
    safe: bool
    said: str
    back: float
    trouble: str = ""


@dataclass(frozen=True, slots=True)
class Switch:
    """An `Act`: sets a fault of an emulated device."""

    device: str
    fault: str
    value: float = 1.0

    def __call__(self, cell: Cell) -> None:
        """Do it."""
        cell.fault(self.device, self.fault, self.value)

    def __str__(self) -> str:
        """For the table."""
        return f"{self.fault} = {self.value:g}"


def nothing(cell: Cell) -> None:
    """Nothing to be done."""


def recover_arm(cell: Cell) -> None:
    """arm.recover()"""
    cell.arm.recover()


def start_hand(cell: Cell) -> None:
    """hand.start()"""
    cell.hand.start()


def read_on(cell: Cell) -> None:
    """The next read()."""
    sleep(0.02)


def kill_client(cell: Cell) -> None:
    """kill -9 of the process that talks to the arm"""
    os.kill(cell.arm.process_id, signal.SIGKILL)


def crash_client(cell: Cell) -> None:
    """SIGSEGV in it"""
    os.kill(cell.arm.process_id, signal.SIGSEGV)


def hang_client(cell: Cell) -> None:
    """SIGSTOP of it"""
    os.kill(cell.arm.process_id, signal.SIGSTOP)


def kill_emulator(cell: Cell) -> None:
    """kill -9 of the emulator: all devices at once"""
    cell.emulator.kill()


def replace_emulator(cell: Cell) -> None:
    """Switch everything on again."""
    cell.replace_emulator()


def reboot_servo(cell: Cell) -> None:
    """hand.reboot(2), start()"""
    cell.hand.close()
    cell.servos.reboot(2)
    cell.hand.start()


def recover_all(cell: Cell) -> None:
    """arm.recover(), hand.start()"""
    cell.arm.recover()
    cell.hand.start()


def every_servo_presses(cell: Cell, before: Truth) -> str:
    """Say which servo has let go."""
    now = cell.truth().currents
    let_go = [i + 1 for i, (a, b) in enumerate(zip(before.currents, now, strict=True)) if b < STILL_PRESSES * a]
    return f"servos {let_go} press no more" if let_go else ""


def the_other_servo_presses(cell: Cell, before: Truth) -> str:
    """Say whether servo 1 has let go; servo 2 is the one that is ill."""
    return "servo 1 has let go" if cell.truth().currents[0] < STILL_PRESSES * before.currents[0] else ""


def uploads(cell: Cell) -> int:
    """Return how many scripts the controller has got."""
    return sum("uploaded" in line for line in cell.emulator.control.log("ur"))


@dataclass(frozen=True, slots=True)
class Lost:
    """A robot in contact is disturbed: the loop is told, the arm rests, the hand presses; then it comes back.

    Attributes:
        spoil: What goes wrong.
        mend: What somebody then puts right, or `nothing`.
        recover: What the program does to come back.
        presses: What of the hand must go on.
        client_ends: Whether the client process must be gone before ur_rtde begins its storm of reconnections.
    """

    spoil: Act
    recover: Act
    mend: Act = nothing
    presses: Callable[[Cell, Truth], str] = every_servo_presses
    client_ends: bool = False

    def __call__(self, cell: Cell) -> Outcome:
        """Try it once."""
        before = cell.truth()
        scripts, client = uploads(cell), cell.arm.process_id
        cell.pace.start()
        begun = monotonic()
        self.spoil(cell)
        noticed, said = _told(cell, begun)
        safe = cell.rests(REST_WITHIN)
        trouble = self.presses(cell, before)
        if self.client_ends:
            trouble = trouble or _storm(cell, client, scripts)
        self.mend(cell)
        return Outcome(noticed, safe, said, cell.up(lambda: self.recover(cell)), trouble)


@dataclass(frozen=True, slots=True)
class PowerLost:
    """As `Lost`, but nobody is left who could measure anything: the arm's brakes fall."""

    def __call__(self, cell: Cell) -> Outcome:
        """Try it once."""
        cell.pace.start()
        begun = monotonic()
        kill_emulator(cell)
        noticed, said = _told(cell, begun)
        replace_emulator(cell)
        return Outcome(noticed, True, said, cell.up(lambda: recover_all(cell)))


@dataclass(frozen=True, slots=True)
class Borne:
    """A disturbance that costs records, not the robot: it is counted, and the loop goes on.

    Attributes:
        spoil: What goes wrong.
        count: Of what was lost; it must grow.
        mend: What ends it.
    """

    spoil: Act
    count: Callable[[Cell], int]
    mend: Act = nothing

    def __call__(self, cell: Cell) -> Outcome:
        """Try it once; a loop that is stopped all the same is trouble."""
        cell.pace.start()
        before, truth = self.count(cell), cell.truth()
        cell.run(2 * PERIOD)
        begun = monotonic()
        self.spoil(cell)
        noticed, trouble = float("inf"), ""
        try:
            while monotonic() - begun < 0.4:
                cell.step()
                if noticed == float("inf") and self.count(cell) > before:
                    noticed = monotonic() - begun
        except DeviceError as error:
            trouble = f"stopped: {error}"
        self.mend(cell)
        trouble = trouble or every_servo_presses(cell, truth)
        return Outcome(noticed, bool(trouble) or cell.in_contact(), "", 0.0, trouble)


@dataclass(frozen=True, slots=True)
class NotStarted:
    """An arm that must not be started: told, nothing left behind; mended, it starts.

    Attributes:
        spoil: What is wrong before.
        mend: What puts it right.
    """

    spoil: Act
    mend: Act

    def __call__(self, cell: Cell) -> Outcome:
        """Try it once."""
        cell.arm.close()
        self.spoil(cell)
        children = _children()
        begun = monotonic()
        try:
            cell.arm.start()
        except DeviceError as error:
            noticed, said = monotonic() - begun, str(error)
        else:
            noticed, said = float("inf"), "it started"
        safe, left = cell.rests(0.1), _children() - children
        self.mend(cell)
        return Outcome(noticed, safe, said, cell.up(cell.arm.start), f"left {left}" if left else "")


@dataclass(frozen=True, slots=True)
class Refused:
    """A call with values that cannot be: refused before anything is sent; the robot goes on.

    Attributes:
        call: The call.
    """

    call: Act

    def __call__(self, cell: Cell) -> Outcome:
        """Try it once."""
        cell.run(0.05)
        begun = monotonic()
        try:
            self.call(cell)
        except InvalidValueError as error:
            noticed, said = monotonic() - begun, str(error)
        else:
            noticed, said = float("inf"), "it was taken"
        cell.run(0.05)
        return Outcome(noticed, cell.in_contact(), said, 0.0)


@dataclass(frozen=True, slots=True)
class Avoided:
    """A fault of a library that must not come to light: something is done, and nothing is wrong with it.

    Attributes:
        look: Does it, and says what is wrong; empty if nothing is.
    """

    look: Callable[[Cell], str]

    def __call__(self, cell: Cell) -> Outcome:
        """Try it once."""
        trouble = self.look(cell)
        cell.everything_up()
        return Outcome(0.0, cell.in_contact(), "", 0.0, trouble)


Procedure = Lost | PowerLost | Borne | NotStarted | Refused | Avoided


def _told(cell: Cell, begun: float) -> tuple[float, str]:
    """Run until the loop is told; return after which time [s], and what."""
    while monotonic() - begun < LONGEST:
        try:
            cell.step()
        except DeviceError as error:
            return monotonic() - begun, str(error)
    return float("inf"), "nothing"


def _storm(cell: Cell, client: int, scripts: int) -> str:
    """Wait for longer than ur_rtde does before it reconnects; say whether it did."""
    deadline = monotonic() + 3.0
    while psutil.pid_exists(client) and psutil.Process(client).status() != psutil.STATUS_ZOMBIE:
        if monotonic() > deadline:
            return "its client process goes on"
        sleep(0.01)
    more = uploads(cell) - scripts
    return f"{more} scripts were uploaded meanwhile" if more > 1 else ""


def _children() -> set[int]:
    return {child.pid for child in psutil.Process().children(recursive=True)}


def matches(wanted: str, said: str) -> bool:
    """Whether a message says what it must."""
    return re.search(wanted, said) is not None
