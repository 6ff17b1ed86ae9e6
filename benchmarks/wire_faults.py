"""The fault campaign: every row of `wired.fault_table` on a robot on the wire, several times, as a table.

    python benchmarks/wire_faults.py [--tries 3] [--only WORDS] [--page FILE]

An emulated UR arm in contact, a Net F/T box or a Bota sensor, a Dynamixel hand that presses, in one emulator's
process; the real client libraries over real sockets and terminals, in one rig at 500 Hz. Asked for (issue 9): no
crash, a defined safe state, noticed within 50 ms unless the protocol forbids it, a message that names the device
and the remedy, recovery without a restart. Times count from before the fault is asked for. The median is judged:
the worst is the machine's, too. It takes three minutes, on a busy
machine ten.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from wired.cell import PATIENT, Cell, Patience
from wired.fault_page import page
from wired.fault_table import CASES, NOTICED, Case, Safe
from wired.procedures import Borne, Lost, NotStarted, Outcome, PowerLost, Refused, matches
from wired.tried import Tried

from palpate.hw.devices import DeviceError

ADDRESS = "127.0.42.2"

SHOWN = 92
"""Letters of a message in the table."""


REPEATED = 3
"""Times that a try may be disturbed by something else and repeated: another device's data came too late, since the
machine stood still."""


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


def shown(rows: Sequence[Tried]) -> Table:
    """Return the table."""
    table = Table("fault", "noticed ms, median / worst", "safe state", "message", "back by", "s", "")
    for row in rows:
        times = [1e3 * one.noticed for one in row.outcomes] or [float("inf")]
        case, kind = row.case, type(row.case.procedure)
        noticed = "does not come to light"
        if kind in (Lost, PowerLost, Borne, NotStarted, Refused):
            noticed = f"{np.median(times):.1f} / {max(times):.1f}"
        if case.within > NOTICED:
            noticed += f" ({case.why})"
        said = row.outcomes[-1].said if row.outcomes else ""
        back = np.median([one.back for one in row.outcomes]) if row.outcomes else float("inf")
        verdict = "; ".join(row.problems) or "ok"
        short = said if len(said) <= SHOWN else said[: SHOWN - 3] + "..."
        table.add_row(case.name, noticed, case.safe, short, case.back, f"{back:.2f}", verdict)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description="Try every fault of a robot on the wire.")
    parser.add_argument("--tries", type=int, default=3)
    parser.add_argument("--only", default="", help="rows whose names have these words in them")
    parser.add_argument("--page", type=Path, help="write the table to a page of the documents, Markdown")
    options = parser.parse_args()
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, -20)
    cases = [case for case in CASES if options.only in case.name]
    rows = campaign(ADDRESS, cases, options.tries)
    console = Console(width=220)
    console.print(shown(rows))
    if options.page is not None:
        options.page.write_text(page(rows, options.tries))
    disturbed = sum(row.disturbed for row in rows)
    failed = [row for row in rows if row.problems]
    console.print(
        f"{len(rows)} rows, {len(rows) - len(failed)} as they must be; {options.tries} tries each, {disturbed} "
        f"more were disturbed by this machine's stalls; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
