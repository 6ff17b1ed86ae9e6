"""Robot on the wire for a long time with random faults: no leaks, and every fault is accounted for.

A loop at 500 Hz holds a force with an emulated UR arm, a Net F/T box and a Dynamixel hand, through the real
client libraries. Faults of `wire.fault_table` are drawn at random; each must be detected, reported by its
device, and passed. Clients wait longer than usual, so that a stall of a busy machine is not taken for a fault.
Memory, file descriptors, threads and processes of this process and the emulator's are counted.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from time import monotonic

import numpy as np
import psutil
from harness.campaign import Listing, load, raise_priority

from palpate.hw.devices import DeviceError
from wire.cell import PATIENT, PERIOD, Cell, Tip
from wire.fault_table import CASES, Case
from wire.procedures import Borne, Lost, matches

ADDRESS = "127.0.41.2"
UP_WITHIN = 120.0
"""[s] for everything to be up again after a fault; a machine that is too busy for longer ends the soak."""

LOOKED_AT = 10.0
"""[s] between two looks at memory and files."""

MEAN_PAUSE = 4.0
"""[s] Mean time between two faults."""

MEMORY_GROWTH = 2.0
"""[MB] of either process between the second and the last fifth of a run, that counts as no leak: less than what
allocators give and take."""

DRAWN = tuple(
    case
    for case in CASES
    if case.tip is Tip.BOX
    and isinstance(case.procedure, Lost | Borne)
    and case.name != "script starts late, 1.5 s"
)
"""Faults of a robot that runs. A script that starts late is a fault of the next start, and stays on."""


@dataclass(frozen=True, slots=True)
class Look:
    """What processes hold at a time.

    Attributes:
        time: Since the beginning [s].
        memory: Of this process, and of the emulator's, resident [MB].
        files: Descriptors of either.
        threads: Of either.
        processes: Below this one.
    """

    time: float
    memory: tuple[float, float]
    files: tuple[int, int]
    threads: tuple[int, int]
    processes: int


@dataclass(slots=True)
class Account:
    """What has happened.

    Attributes:
        injected: How often each fault was.
        noticed: Times to notice each, where it is to be [s].
        wrong: What was not as its row says.
        stalls: Errors that nobody has injected: the machine's, or a leak of reason.
        looks: At memory and files, with all devices up.
    """

    injected: Counter[str] = field(default_factory=Counter)
    noticed: dict[str, list[float]] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)
    stalls: list[str] = field(default_factory=list)
    looks: list[Look] = field(default_factory=list)
    steps: int = 0

    def growth(self) -> tuple[float, float]:
        """Return by how much memory grew from the second fifth to the last [MB]."""
        memory = np.array([look.memory for look in self.looks])
        fifth = max(1, len(memory) // 5)
        early, late = memory[fifth : 2 * fifth + 1].mean(axis=0), memory[-fifth:].mean(axis=0)
        return float(late[0] - early[0]), float(late[1] - early[1])

    def leaks(self) -> list[str]:
        """Return what there is more of at the end than after the first fifth."""
        early, last = self.looks[len(self.looks) // 5], self.looks[-1]
        found = []
        for name in ("files", "threads", "processes"):
            before, now = getattr(early, name), getattr(last, name)
            if now != before:
                found.append(f"{name}: {before} at {early.time:.0f} s, {now} at {last.time:.0f} s")
        for whose, grown in zip(("this process", "emulator"), self.growth(), strict=True):
            if grown > MEMORY_GROWTH:
                found.append(f"memory of the {whose}: {grown:+.1f} MB")
        return found


def look(begun: float, cell: Cell) -> Look:
    """Return what is held."""
    own = psutil.Process()
    children = own.children(recursive=True)
    # the emulator's has the most memory of all children: the client of the arm imports next to nothing
    emulator = max((c for c in children if c.pid != cell.arm.process_id), key=lambda c: c.memory_info().rss)
    both = (own, emulator)
    return Look(
        monotonic() - begun,
        tuple(p.memory_info().rss / 1e6 for p in both),  # type: ignore[arg-type]
        tuple(p.num_fds() for p in both),  # type: ignore[arg-type]
        tuple(p.num_threads() for p in both),  # type: ignore[arg-type]
        len(children),
    )


def soak(cell: Cell, account: Account, seconds: float, every: float, seed: int) -> None:
    """Run a started robot for so long, with a fault about every so many seconds; the account is filled."""
    draw = np.random.default_rng(seed)
    begun = looked = monotonic()
    next_fault = begun + 1.0
    account.looks.append(look(begun, cell))
    cell.pace.start()
    while monotonic() - begun < seconds:
        try:
            cell.step()
            account.steps += 1
        except DeviceError as error:
            account.stalls.append(f"at {monotonic() - begun:.1f} s: {error}")
            cell.everything_up(UP_WITHIN)
            cell.pace.start()
        if monotonic() > next_fault:
            case = DRAWN[int(draw.integers(len(DRAWN)))]
            _try(cell, case, account)
            next_fault = monotonic() + float(draw.exponential(every))
            cell.pace.start()
        if monotonic() - looked > min(LOOKED_AT, seconds / 20):
            looked = monotonic()
            account.looks.append(look(begun, cell))
            cell.pace.start()
    cell.everything_up(UP_WITHIN)
    account.looks.append(look(begun, cell))


def _try(cell: Cell, case: Case, account: Account) -> None:
    account.injected[case.name] += 1
    try:
        outcome = case.procedure(cell)
    except DeviceError as error:
        account.wrong.append(f"{case.name}: {error}")
        cell.everything_up(UP_WITHIN)
        return
    if case.says:
        account.noticed.setdefault(case.name, []).append(outcome.noticed)
    problems = []
    if outcome.noticed == float("inf"):
        problems.append("not noticed")
    if not outcome.safe:
        problems.append("not safe")
    if outcome.trouble:
        problems.append(outcome.trouble)
    if case.says and not matches(case.says, outcome.said):
        problems.append(f"said {outcome.said!r}")
    if problems:
        account.wrong.append(f"{case.name}: {', '.join(problems)}")
    cell.everything_up(UP_WITHIN)


def accounts(account: Account) -> Listing:
    """Return faults, growth and errors."""
    rows = []
    for name, times in sorted(account.injected.items()):
        noticed = account.noticed.get(name)
        shown = f"{1e3 * float(np.median(noticed)):.0f} / {1e3 * max(noticed):.0f}" if noticed else "counted"
        rows.append((name, times, shown))
    first, last = account.looks[len(account.looks) // 5], account.looks[-1]
    grown = account.growth()
    notes = (
        f"{account.steps} periods of {1e3 * PERIOD:g} ms, {account.injected.total()} faults, {load()}",
        f"memory {first.memory[0]:.1f} + {first.memory[1]:.1f} MB at {first.time:.0f} s, "
        f"{last.memory[0]:.1f} + {last.memory[1]:.1f} MB at the end; growth {grown[0]:+.2f} + {grown[1]:+.2f} MB",
        f"files {first.files} -> {last.files}, threads {first.threads} -> {last.threads}, "
        f"processes {first.processes} -> {last.processes}",
        f"leaks: {account.leaks() or 'none'}",
        f"faults that differ from their rows: {len(account.wrong)}",
        *account.wrong,
        f"errors that were not injected: {len(account.stalls)}",
        *account.stalls,
    )
    title = f"{last.time / 60:.1f} minutes of soak"
    return Listing(title, ("fault", "times", "noticed ms, median / worst"), rows, notes=notes)


def soaked(options: argparse.Namespace) -> Iterator[Listing]:
    """Soak for `--minutes`; an error that ends the soak follows its account."""
    raise_priority()
    resource_tracker.ensure_running()  # a process of multiprocessing's own, which would come with the first other
    before = {child.pid for child in psutil.Process().children(recursive=True)}
    account = Account()
    try:
        with Cell(ADDRESS, patience=PATIENT) as cell:
            soak(cell, account, 60.0 * options.minutes, MEAN_PAUSE, seed=9)
    finally:
        if account.looks:
            yield accounts(account)
    left = {child.pid for child in psutil.Process().children(recursive=True)} - before
    yield Listing("processes left", ("number",), [(len(left),)])


PARTS = {"soak": soaked}
