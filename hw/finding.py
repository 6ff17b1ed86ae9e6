"""A finding on a device: a value, what it should be, and the remedy."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable


class FindingVerdict(StrEnum):
    """What a value means."""

    GOOD = "good"
    NOTE = "note"
    """Worth knowing, nothing that keeps it from running."""
    BAD = "BAD"


@dataclass(frozen=True, slots=True)
class DeviceFinding:
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
    verdict: FindingVerdict = FindingVerdict.GOOD
    fix: str = ""


@dataclass(frozen=True, slots=True)
class DeviceUse:
    """How a device was used while it was watched.

    Attributes:
        period: Control period of the robot [s].
        exchanges: How many samples it has given.
        rate: Of them [1/s].
    """

    period: float
    exchanges: int
    rate: float


@runtime_checkable
class SelfExamining(Protocol):
    """A device that reports more of itself than its samples. Optional."""

    def findings(self, use: DeviceUse) -> Iterable[DeviceFinding]:
        """Return the findings on a device that has been started: versions, power, temperatures, what was lost.

        Raises:
            DeviceError: It is lost meanwhile.
        """
        ...


def judged(
    device: str,
    what: str,
    value: float | str,
    unit: str,
    wanted: str,
    good: bool,
    fix: str,
    otherwise: FindingVerdict = FindingVerdict.BAD,
) -> DeviceFinding:
    """Return a finding that is good, or `otherwise` with what to do."""
    if good:
        return DeviceFinding(device, what, value, unit, wanted)
    return DeviceFinding(device, what, value, unit, wanted, otherwise, fix)
