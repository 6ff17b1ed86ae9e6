"""What ur_rtde 1.6.5 does wrong and must not come to light here: each look returns what is wrong, or nothing."""

import contextlib
import os
import re
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from itertools import pairwise
from statistics import median
from time import monotonic, sleep

from palpate.hw.devices import DeviceError
from palpate.hw.ur.rtde import REGISTER
from palpate.runtime.real_time import RealTime
from palpate.spatial import ZERO
from wire.cell import ARM, Cell

LONGEST_STALL = 0.25
"""[s] of our own threads while the library connects and lets go; by itself it stops them for 0.5 s."""

SLOW = 300.0
"""Commands per second that the library's own waiting turns into 333 [1/s]."""


def commands_sent(cell: Cell) -> set[int]:
    """Do all that the arm can do; return the ids of the commands that the controller was sent."""
    arm, sent = cell.arm, set[int]()

    def heard() -> None:
        for line in cell.emulator.control.log(ARM):
            sent.update(int(number) for number in re.findall(r"inputs input_int_register_0=\((-?\d+)", line))

    _lift(cell)
    arm.stop()
    heard()
    arm.tare()
    heard()
    arm.close()
    heard()
    arm.start()
    heard()
    return sent


def never_sent(*ids: int) -> Callable[[Cell], str]:
    """Return a look: these commands are none of those that the arm sends, whatever it does."""

    def look(cell: Cell) -> str:
        sent = commands_sent(cell)
        if not {8, 10, 15, 29, 35} <= sent:
            return f"only {sorted(sent)} were sent: that is not all that it can do"
        return f"sent {sorted(sent & set(ids))}" if sent & set(ids) else ""

    return look


def upper_registers_unused(cell: Cell) -> str:
    """No register from 24 on is written, but for the echoed one, and commands are followed (row 8)."""
    commands_sent(cell)
    lines = " ".join(cell.emulator.control.log(ARM))
    written = re.findall(r"(input_(?:int|double)_register_(\d+))=", lines)
    used = {int(i) for name, i in written if name != REGISTER}
    upper = sorted(i for i in used if i >= 24)
    return f"registers {upper} were written" if upper or not used else ""


def outputs_untouched(cell: Cell) -> str:
    """No analog output is written (row 9)."""
    commands_sent(cell)
    written = [line for line in cell.emulator.control.log(ARM) if "analog" in line]
    return written[0] if written else ""


def states_are_of_one_cycle(cell: Cell) -> str:
    """Position and time stamp belong together: at constant velocity, one is a line over the other (row 11)."""
    _lift(cell)
    speed, points = 0.05, []
    end = monotonic() + 1.2
    while monotonic() < end:
        cell.arm.move((speed, 0.0, 0.0), ZERO)
        state = cell.arm.state()
        if monotonic() > end - 1.0:
            points.append((state.controller_time, state.tool_pose[0], state.tool_velocity[0]))
        sleep(2e-4)
    cell.arm.stop()
    # where the arm did go at that speed: a state of two cycles is off by the way of one, 0.1 mm
    steady = [(t, x) for t, x, v in points if abs(v - speed) < 1e-6]
    off = [abs(b[1] - a[1] - speed * (b[0] - a[0])) for a, b in pairwise(steady)]
    if len(steady) < 100:
        return f"only {len(steady)} states"
    return f"{sum(o > 1e-6 for o in off)} of {len(off)} states are torn" if max(off) > 1e-6 else ""


def threads_run_on(cell: Cell) -> str:
    """Our own threads are not stopped while the library connects and lets go (row 13)."""
    going, longest = True, 0.0

    def tick() -> None:
        nonlocal longest
        last = monotonic()
        while going:
            sleep(1e-3)
            now = monotonic()
            longest, last = max(longest, now - last), now

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        cell.arm.close()
        cell.arm.start()
    finally:
        going = False
        thread.join()
    return f"stopped for {1e3 * longest:.0f} ms" if longest > LONGEST_STALL else ""


def pace_is_kept(cell: Cell) -> str:
    """Commands at 300 Hz come at 300 Hz: periods are no whole milliseconds (row 14)."""
    _lift(cell)
    pace, woken = RealTime(1.0 / SLOW), list[float]()
    pace.start()
    for i in range(300):
        pace.wait()
        woken.append(monotonic())
        cell.arm.move((1e-4 * (i % 2), 0.0, 1e-6 * i), ZERO)
    pace.stop()
    cell.arm.stop()
    # the median: a machine that stands still leaves some out
    rate = 1.0 / median(b - a for a, b in pairwise(woken))
    return "" if abs(rate - SLOW) < 0.02 * SLOW else f"{rate:.1f} commands a second"


def nothing_is_printed(cell: Cell) -> str:
    """Neither at its work nor at its death does the library write to our terminal (row 15)."""
    with _outputs() as said:
        os.kill(cell.arm.process_id, signal.SIGSEGV)
        with contextlib.suppress(DeviceError):
            while True:
                cell.arm.read()
                sleep(1e-3)
        cell.arm.recover()
    return f"it said {said[0][:60]!r}" if said[0] else ""


def commands_are_not_overwritten(cell: Cell) -> str:
    """A velocity that is followed at once by something else is executed, and the other is, too (row 18)."""
    _lift(cell)
    arm, missed = cell.arm, 0
    for i in range(10):
        before = cell.truth().position[0]
        arm.move((0.05 if i % 2 else -0.05, 0.0, 0.0), ZERO)
        _wait_until_followed(cell)
        arm.tare()
        cell.rests(1.0)
        missed += abs(cell.truth().position[0] - before) < 1e-6
    return f"{missed} of 10 were not executed" if missed else ""


def recovery_does_not_hang(cell: Cell) -> str:
    """recover() while still connected, where the library's reconnect hangs (row 3)."""
    begun = monotonic()
    cell.arm.recover()
    took = monotonic() - begun
    return f"it took {took:.1f} s" if took > 5.0 else ""


def a_second_client_is_refused(cell: Cell) -> str:
    """Another program on the same arm: told, and the first goes on (row 12)."""
    from palpate.hw.ur import UrArm, UrSettings

    second = UrArm(cell.address, UrSettings(start_within=8.0))
    try:
        second.start()
    except DeviceError as error:
        trouble = "" if cell.address in str(error) else str(error)
    else:
        trouble = "it started"
    finally:
        second.close()
    return trouble


def short_states_tell_the_truth(cell: Cell) -> str:
    """States that lack their last byte: ur_rtde 1.6.5 takes them unseen; all but the last value must be right.

    That byte is the least of a torque of the raw wrench: one part in 2^45 of it.
    """
    cell.fault(ARM, "short_data")
    try:
        cell.run(0.2)
        cell.arm.stop()
        cell.rests(1.0)
        sleep(0.05)
        told, truth = cell.arm.state(), cell.truth()
    finally:
        cell.fault(ARM, "short_data", 0.0)
    off = max(abs(a - b) for a, b in zip(told.tool_pose, truth.position, strict=False))
    return f"the arm says {off:g} m beside where it is" if off > 1e-6 else ""


def a_silent_loop_stops_the_arm(cell: Cell) -> str:
    """This program stands still: the client process brings the arm to rest after the watchdog's time."""
    cell.run(0.1)
    sleep(0.5)
    return "" if cell.rests(1.0) else f"it goes on with {cell.truth().speed:g} m/s"


def _wait_until_followed(cell: Cell) -> None:
    """Wait until the client process has sent the last command: one that it has not is rightly dropped."""
    arm, deadline = cell.arm, monotonic() + 1.0
    while monotonic() < deadline:
        status = arm._client and arm._client.exchange.status()
        if status and status.followed >= arm._number:
            return
        sleep(1e-4)


def _lift(cell: Cell) -> None:
    """Off the plane, 3 mm."""
    start = cell.arm.read().position_base_tip
    wanted = max(0.0, 0.4879 + 0.003 - start[2])
    _repeat(wanted / 0.02, lambda: cell.arm.move((0.0, 0.0, 0.02), ZERO))
    cell.arm.stop()


def _repeat(seconds: float, act: Callable[[], object]) -> None:
    end = monotonic() + seconds
    while monotonic() < end:
        act()
        sleep(2e-3)


@contextlib.contextmanager
def _outputs() -> Iterator[list[bytes]]:
    """Take what goes to the terminal meanwhile, by whomever; it is in the list afterwards."""
    said = [b""]
    with tempfile.TemporaryFile() as file:
        kept = [os.dup(1), os.dup(2)]
        try:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
            yield said
        finally:
            for one, descriptor in zip(kept, (1, 2), strict=True):
                os.dup2(one, descriptor)
                os.close(one)
            file.seek(0)
            said[0] = file.read()
