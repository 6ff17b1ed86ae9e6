"""A finding of `palpate doctor`: a value of a device, what it should be, and the remedy."""

from dataclasses import dataclass
from enum import StrEnum


class DoctorVerdict(StrEnum):
    """What a value means."""

    GOOD = "good"
    NOTE = "note"
    """Worth knowing, nothing that keeps it from running."""
    BAD = "BAD"


@dataclass(frozen=True, slots=True)
class DoctorFinding:
    """One line of a doctor's table.

    Attributes:
        device: Whose it is.
        what: That was looked at.
        value: A number, or words.
        unit: Of the number.
        wanted: What it should be, in words; empty if anything is well.
        verdict: What it means.
        fix: What to do about it; empty if there is nothing to do.
    """

    device: str
    what: str
    value: float | str
    unit: str = ""
    wanted: str = ""
    verdict: DoctorVerdict = DoctorVerdict.GOOD
    fix: str = ""


def judged(
    device: str,
    what: str,
    value: float | str,
    unit: str,
    wanted: str,
    good: bool,
    fix: str,
    otherwise: DoctorVerdict = DoctorVerdict.BAD,
) -> DoctorFinding:
    """Return a finding that is good, or `otherwise` with what to do."""
    if good:
        return DoctorFinding(device, what, value, unit, wanted)
    return DoctorFinding(device, what, value, unit, wanted, otherwise, fix)
