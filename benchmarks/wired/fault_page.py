"""The fault campaign as a page of the documents."""

import os
import re
from collections.abc import Sequence

import numpy as np

from wired.fault_table import NOTICED
from wired.procedures import Borne, Lost, NotStarted, PowerLost, Refused
from wired.tried import Tried

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

Made by `python benchmarks/wire_faults.py --tries {tries} --page docs/wire-faults.md`. It says nothing about how a
real controller behaves: [what was proven, and what was not](robots.md#what-was-proven-and-what-was-not).

| fault | noticed, median / worst ms | the robot then | what is said | brought back by | within s |
|---|---|---|---|---|---|
"""


def page(rows: Sequence[Tried], tries: int) -> str:
    """Return the page, Markdown."""
    text = INTRODUCTION.format(rows=len(rows), tries=tries, cores=os.cpu_count(), load=os.getloadavg()[0])
    return text + "".join(_row(row) for row in rows)


def _row(row: Tried) -> str:
    case = row.case
    noticed = "does not come to light"
    if isinstance(case.procedure, Lost | PowerLost | Borne | NotStarted | Refused):
        times = [1e3 * one.noticed for one in row.outcomes]
        noticed = f"{np.median(times):.0f} / {max(times):.0f}"
    if case.within > NOTICED:
        noticed += f" ({case.why})"
    said = FOLDER.sub("", row.outcomes[-1].said)
    back = float(np.median([one.back for one in row.outcomes]))
    words = (case.name, noticed, str(case.safe), said, case.back, f"{back:.2f}" if back > 0.0 else "")
    return "| " + " | ".join(word.replace("|", "\\|") for word in words) + " |\n"
