"""What pressing has found before a regulation, and its text in the log."""

from dataclasses import dataclass
from typing import Self

from palpate.controllers.gains import ForceGain
from palpate.controllers.identification import Identification
from palpate.errors import check_positive


@dataclass(frozen=True, slots=True)
class Identified:
    """What of an identification force control goes by.

    Attributes:
        contact_stiffness: K of the contact alone [N/m].
        series_stiffness: Of contact and servo [N/m].
        delay: T [s].
        damping_time: c / K of the contact [s].
        force_gain: [m/s/N].
        phase_margin_deg: As measured at that gain [degrees].
    """

    contact_stiffness: float
    series_stiffness: float
    delay: float
    damping_time: float
    force_gain: float
    phase_margin_deg: float

    def __post_init__(self) -> None:
        check_positive(self, contact_stiffness="N/m", series_stiffness="N/m", delay="s", force_gain="m/s/N")

    @classmethod
    def of(cls, found: Identification) -> Self:
        """Return what force control goes by."""
        gain, stiffness = found.gain, found.stiffness.value
        return cls(stiffness, gain.stiffness, gain.delay, found.damping_time, gain.gain, found.phase_margin_deg)

    @property
    def gain(self) -> ForceGain:
        """Of force control, with its margins."""
        return ForceGain(self.force_gain, self.series_stiffness, self.delay)
