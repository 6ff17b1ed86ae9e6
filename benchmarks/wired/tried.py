"""What came of a row of the fault campaign."""

from dataclasses import dataclass

from wired.fault_table import Case
from wired.procedures import Outcome


@dataclass(frozen=True, slots=True)
class Tried:
    """A row's outcomes.

    Attributes:
        case: The row.
        outcomes: One per try.
        problems: What was not as the row says; empty if all was.
        disturbed: Tries that ended with another device's error, and were repeated.
    """

    case: Case
    outcomes: tuple[Outcome, ...]
    problems: tuple[str, ...]
    disturbed: int
