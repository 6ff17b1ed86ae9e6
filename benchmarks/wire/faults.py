"""Fault campaign: every row of `wire.fault_table` on a robot on the wire, several times.

An emulated UR arm in contact, a Net F/T box or a Bota sensor and a Dynamixel hand that presses run in one
emulator process; real client libraries over real sockets and terminals form one rig at 500 Hz. Required: no
crash, a defined safe state, detection within 50 ms unless the protocol forbids it, a message that names the
device and the remedy, recovery without a restart. Times count from before the fault is requested. The median is
judged: the worst depends on this computer. The campaign takes three minutes, ten on a busy machine.
"""

import argparse
import os
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from harness.campaign import Listing, load, raise_priority

from palpate.hw.devices import DeviceError
from wire.cell import PATIENT, Cell, Patience
from wire.fault_table import CASES, NOTICED, Case, Safe
from wire.procedures import Borne, Lost, NotStarted, Outcome, PowerLost, Refused, matches

ADDRESS = "127.0.42.2"

SHOWN = 92
"""Letters of a message in the table."""


FOLDER = re.compile(r"[^\s']*/palpate-wire-\w+/")
"""Of emulated terminals: another one each time."""

INTRODUCTION = """# Faults on the wire

What a rig of a UR arm, a Dynamixel hand and a force/torque sensor does when something goes wrong: {rows} faults,
each injected {tries} times into emulated devices, with the makers' own client libraries over real sockets and
terminals, while the arm holds 4 N against a surface and slides along it, and the hand presses with 1 N per finger.
In every row the program goes on, the robot comes to the state named there (as the emulator measures it, not as the
client says), and what is said names the device and what to do.

Times are from when the fault is asked for to when the control loop (500 Hz) knows of it, median and worst, on
{cores} shared cores (load {load:.1f}); 50 ms are allowed, more where the row says why. "No. 1" to "no. 18" are
known faults of ur_rtde 1.6.5 itself.

Made by `python benchmarks/wire faults --tries {tries} --page docs/wire-faults.md`. It says nothing about how a
real controller behaves: [what was proven, and what was not](robots.md#what-was-proven-and-what-was-not).

| fault | noticed, median / worst ms | the robot then | what is said | brought back by | within s |
|---|---|---|---|---|---|
"""

REPEATED = 3
"""Times that a try may be disturbed by something else and repeated: another device's data came too late, since the
machine stood still."""


@dataclass(frozen=True, slots=True)
class Tried:
    """Outcomes of a row.

    Attributes:
        case: The row.
        outcomes: One outcome per try.
        problems: Differences from the row; empty if there are none.
        disturbed: Number of tries that ended with the error of another device and were repeated.
    """

    case: Case
    outcomes: tuple[Outcome, ...]
    problems: tuple[str, ...]
    disturbed: int

    @property
    def noticed(self) -> list[float]:
        """Times to detect the fault [ms]; infinite without an outcome."""
        return [1e3 * one.noticed for one in self.outcomes] or [float("inf")]

    def words(self, digits: int) -> tuple[str, str, str, str, str]:
        """Return name, time to detect, safe state, message and recovery time."""
        noticed = "does not come to light"
        if isinstance(self.case.procedure, Lost | PowerLost | Borne | NotStarted | Refused):
            noticed = f"{np.median(self.noticed):.{digits}f} / {max(self.noticed):.{digits}f}"
        if self.case.within > NOTICED:
            noticed += f" ({self.case.why})"
        said = self.outcomes[-1].said if self.outcomes else ""
        back = np.median([one.back for one in self.outcomes]) if self.outcomes else float("inf")
        return self.case.name, noticed, str(self.case.safe), said, f"{back:.2f}"


def tried(cell: Cell, case: Case, tries: int) -> Tried:
    """Try a row several times, each from a robot in contact; a patient one notices that much later."""
    outcomes, problems, disturbed = list[Outcome](), list[str](), 0
    while len(outcomes) + len(problems) < tries:
        try:
            cell.everything_up()
            outcome = case.procedure(cell)
        except DeviceError as error:
            problems.append(f"does not come back: {error}")
            continue
        if disturbed < REPEATED * tries and case.says and _device(cell, case) not in outcome.said:
            disturbed += 1
        else:
            outcomes.append(outcome)
    noticed = float(np.median([one.noticed for one in outcomes])) if outcomes else float("inf")
    allowed = case.within + cell.patience.oldest - Patience().oldest
    if not noticed <= allowed:
        problems.append(f"noticed after {1e3 * noticed:.0f} ms, allowed {1e3 * allowed:.0f} ms")
    if not all(one.safe for one in outcomes):
        problems.append("the safe state was not come to")
    if case.says:
        device = _device(cell, case)
        for one in outcomes:
            if not matches(case.says, one.said) or device not in one.said:
                problems.append(f"said {one.said!r}")
                break
    trouble = [one.trouble for one in outcomes if one.trouble]
    return Tried(case, tuple(outcomes), (*problems, *trouble[:1]), disturbed)


def campaign(address: str, cases: Sequence[Case], tries: int) -> list[Tried]:
    """Try rows on one robot for each sensor and patience."""
    found = {}
    kinds = {(case.tip, patience_for(case)) for case in cases}
    for tip, patience in sorted(kinds, key=repr):
        with Cell(address, tip, patience) as cell:
            for case in cases:
                if (case.tip, patience_for(case)) == (tip, patience):
                    found[case.name] = tried(cell, case, tries)
                    print(
                        f"{case.name}: {'; '.join(found[case.name].problems) or 'ok'}", file=sys.stderr, flush=True
                    )
    return [found[case.name] for case in cases]


def patience_for(case: Case) -> Patience:
    """Return how long clients wait: short where it is about the time to notice what does not come."""
    return Patience() if isinstance(case.procedure, Lost | PowerLost) else PATIENT


def _device(cell: Cell, case: Case) -> str:
    """Return the name that a message must have in it; a refused value names itself instead."""
    if isinstance(case.procedure, Refused):
        return ""
    if case.safe is Safe.OFF:  # whichever is noticed first
        return " at "
    names = (cell.arm.name, cell.hand.name, cell.sensor.name)
    ours = {"start()": names[1], "recover": names[0], "arm.start()": names[0], "the next read()": names[2]}
    return next(
        (ours[key] for key in ("arm.start()", "recover", "start()", "the next read()") if key in case.back), ""
    )


HEADS = ("fault", "noticed ms, median / worst", "safe state", "message", "back by", "s", "")


def listed(rows: Sequence[Tried]) -> Listing:
    """Return the table for the terminal."""
    cells = []
    for row in rows:
        name, noticed, safe, said, back = row.words(1)
        short = said if len(said) <= SHOWN else said[: SHOWN - 3] + "..."
        cells.append((name, noticed, safe, short, row.case.back, back, "; ".join(row.problems) or "ok"))
    failed, disturbed = sum(bool(row.problems) for row in rows), sum(row.disturbed for row in rows)
    note = (
        f"{len(rows)} rows, {len(rows) - failed} right; {disturbed} more tries were disturbed by stalls; {load()}"
    )
    return Listing("faults on the wire", HEADS, cells, not failed, (note,))


def page(rows: Sequence[Tried], tries: int) -> str:
    """Return the page of the documents, Markdown."""
    text = INTRODUCTION.format(rows=len(rows), tries=tries, cores=os.cpu_count(), load=os.getloadavg()[0])
    for row in rows:
        name, noticed, safe, said, back = row.words(0)
        words = (name, noticed, safe, FOLDER.sub("", said), row.case.back, back if float(back) > 0.0 else "")
        text += "| " + " | ".join(word.replace("|", "\\|") for word in words) + " |\n"
    return text


def faults(options: argparse.Namespace) -> Iterator[Listing]:
    """Try every row; write the page, if one is given."""
    raise_priority()
    tries = options.tries or 3
    rows = campaign(ADDRESS, CASES, tries)
    if options.page is not None:
        options.page.write_text(page(rows, tries))
    yield listed(rows)


PARTS = {"faults": faults}
