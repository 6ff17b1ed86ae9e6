"""The fault campaign of `benchmarks/wire faults`: every row on a robot on the wire, real clients, real sockets.

The arm holds a force and slides, the hand presses; then a fault is injected for real. What is safe is asked of the
emulator. A dozen rows run fast, all of them with the slow tests. Clients are patient here, since tests share their
machine, and no time is judged: times to notice are the benchmark's. Everything listens on loopback addresses and
terminals only.
"""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Never

import numpy as np
import psutil
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))

from wire.cell import ARM, BOX, GRIP, PATIENT, Cell, Tip
from wire.fault_table import CASES, NOTICED, Case, Safe
from wire.faults import listed, tried
from wire.procedures import Borne, Lost, Procedure, Refused, Switch, nothing, read_on, recover_arm
from wire.soak import Account, Look, soak

from palpate.hw.devices import DeviceError
from palpate.runtime.data import Command
from support.ur_wire_sessions import own_address
from support.waiting import WITHIN

ATTEMPTS = 3
"""How often a row is tried until all is as it says: a busy machine alone may end a try with another error."""

QUICK = {
    "no. 2: states stay away",
    "no. 5: velocity of two numbers",
    "velocity above the limit",
    "protective stop",
    "client process killed",
    "a servo is silent",
    "every checksum wrong",
    "adapter unplugged",
    "F/T box silent",
    "F/T out of range",
    "gap of 5 records",
    "records twice",
}

ROWS = [pytest.param(case, marks=() if case.name in QUICK else pytest.mark.slow, id=case.name) for case in CASES]


class Cells(ExitStack):
    """Robots that have been started so far, one for each sensor."""

    def __init__(self) -> None:
        super().__init__()
        self._started: dict[Tip, Cell] = {}

    def of(self, tip: Tip) -> Cell:
        if tip not in self._started:
            cell = Cell(own_address(20 + len(self._started)), tip, PATIENT)
            self._started[tip] = self.enter_context(cell)
        return self._started[tip]


SOME_TIME = 1e9
"""[s] within which a fault may be noticed: what never is has infinity."""


@pytest.fixture(scope="module", autouse=True)
def waits_long() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name in ("LONGEST", "REST_WITHIN"):
            patch.setattr(f"wire.procedures.{name}", WITHIN)
        yield


@pytest.fixture(scope="module")
def cells() -> Iterator[Cells]:
    with Cells() as started:
        yield started


@pytest.mark.slow
@pytest.mark.parametrize("case", ROWS)
def test_a_fault_is_detected_reported_safe_and_passes(cells: Cells, case: Case) -> None:
    cell = cells.of(case.tip)
    seen = []
    for _ in range(ATTEMPTS):
        row = tried(cell, replace(case, within=SOME_TIME), 1)
        if not row.problems:
            return
        seen.append(row.problems)
    pytest.fail(f"{case.name}: {seen}")


def test_the_table_has_what_was_asked_for() -> None:
    names = [case.name for case in CASES]
    assert len(CASES) >= 40
    assert len(set(names)) == len(names)
    assert {int(found) for name in names for found in re.findall(r"^no\. (\d+):", name)} == set(range(1, 19))
    assert {case.name for case in CASES} >= QUICK
    assert all(case.why for case in CASES if case.within > NOTICED)
    assert all(case.says for case in CASES if case.safe is not Safe.GOES_ON)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("procedure", "says", "problem"),
    [
        (Lost(nothing, recover_arm), "", "noticed after inf"),
        (Lost(Switch(BOX, "out_of_range"), read_on, Switch(BOX, "out_of_range", 0.0)), "sunshine", "said"),
        (Borne(nothing, lambda cell: cell.sensor.counts.lost), "", "noticed after inf"),
        (Refused(nothing), "", "noticed after inf"),
        (Lost(Switch(ARM, "protective_stop"), nothing), "", "does not come back"),
    ],
    ids=["nothing happens", "another message", "nothing is counted", "nothing is refused", "not recovered"],
)
def test_the_campaign_sees_what_is_not_as_it_must_be(
    cells: Cells, procedure: Procedure, says: str, problem: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wire.procedures.LONGEST", 1.5)
    cell = cells.of(Tip.BOX)
    if problem == "does not come back":
        up = cell.up
        monkeypatch.setattr(cell, "up", lambda recover, within=0.3: up(recover, within))
    made_up = Case("made up", procedure, Safe.RESTS, says, "the next read()")
    for _ in range(ATTEMPTS):
        row = tried(cell, made_up, 1)
        if any(problem in one for one in row.problems):
            break
    else:
        pytest.fail(f"not seen: {row.problems}")
    assert "made up" in listed([row]).rows[0]
    monkeypatch.undo()
    cell.everything_up()


@pytest.mark.slow
def test_hours_are_accounted_for_in_seconds() -> None:
    """A soak: all that was injected was detected, reported and passed, and nothing is held that was not before."""
    children, files = len(psutil.Process().children(recursive=True)), len(os.listdir("/proc/self/fd"))
    account = Account()
    with Cell(own_address(30), patience=PATIENT) as cell:
        for seed in range(3, 13):  # on a busy machine four seconds may be over before much has happened
            soak(cell, account, 4.0, 0.3, seed)
            if account.steps > 100:
                break
    assert account.wrong == []
    assert account.injected.total() >= 1
    assert account.steps > 100
    assert not [leak for leak in account.leaks() if not leak.startswith("memory")]
    assert len(psutil.Process().children(recursive=True)) <= children + 1  # the tracker of multiprocessing
    assert len(os.listdir("/proc/self/fd")) <= files + 1  # the pipe to it


def press_on(cell: Cell) -> Never:
    while True:
        cell.rig.step(Command((0.0, 0.0, -0.02), grip_force=GRIP))


@pytest.mark.slow
def test_a_sensor_that_is_pressed_out_of_its_range_is_relieved_and_goes_on(cells: Cells) -> None:
    """As by a loop that stood still while the tip went down."""
    cell, said = cells.of(Tip.BOX), []
    while not any("take the load off" in each for each in said):
        assert len(said) < ATTEMPTS, said
        cell.pace.start()
        with pytest.raises(DeviceError) as error:
            press_on(cell)
        said.append(str(error.value))
        cell.everything_up()
    assert cell.in_contact()


def looks(files: np.ndarray, memory: np.ndarray) -> list[Look]:
    return [
        Look(10.0 * i, (100.0 + m, 200.0), (int(f), 20), (5, 3), 3)
        for i, (f, m) in enumerate(zip(files, memory, strict=True))
    ]


def test_a_leak_is_seen() -> None:
    still, n = np.zeros(50), np.arange(50)
    assert Account(looks=looks(still + 20, still)).leaks() == []
    assert "files" in Account(looks=looks(20 + n // 10, still)).leaks()[0]
    assert "memory" in Account(looks=looks(still + 20, 0.1 * n)).leaks()[0]
    # memory that is taken once is none
    assert Account(looks=looks(still + 20, 30.0 * (n > 5))).leaks() == []
