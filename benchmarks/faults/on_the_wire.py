"""The faults of `wire.fault_table` at random moments: an arm that holds a force, a hand, a sensor, emulated."""

from dataclasses import dataclass, replace

from wire.cell import PATIENT, Cell
from wire.fault_table import CASES, Case
from wire.faults import tried

from faults.cell import own_address
from faults.kind import Domain, Kind, Moment, Verdict, Workshop

SOME_TIME = 1e9
"""Largest time to detect a fault [s]: `benchmarks/wire faults` measures it."""

STROKE = 1.0
"""[s] of the motion to and fro, in which the fault comes at any time."""


@dataclass(frozen=True, slots=True)
class OnTheWire:
    """A row of that table.

    Attributes:
        case: The row.
    """

    case: Case

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """See `Trial`."""
        case = replace(self.case, within=SOME_TIME)
        cell = workshop.shared(Cell(own_address(), case.tip, PATIENT), case.tip)
        cell.everything_up()
        cell.up(lambda: cell.run(STROKE * moment.share))
        found = tried(cell, case, 1)
        said = found.outcomes[-1].said if found.outcomes else ""
        return Verdict(said[:90], found.problems)


KINDS = tuple(Kind(f"wire: {case.name}", Domain.PROTOCOL, OnTheWire(case)) for case in CASES)
"""All of them."""
