"""What pressing has found before a regulation, and its text in the log."""

from dataclasses import asdict, dataclass
from typing import Self

from palpate.controllers.gains import ForceGain
from palpate.controllers.identification import Identification
from palpate.errors import InvalidValueError, positive
from palpate.strict_decode import decode, read_mapping
from palpate.yaml_text import yaml_text

IDENTIFIED_TEXT = "identified.yaml"
"""Under this name a log keeps it."""


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
        for name, unit in (
            ("contact_stiffness", "N/m"),
            ("series_stiffness", "N/m"),
            ("delay", "s"),
            ("force_gain", "m/s/N"),
        ):
            positive(name, getattr(self, name), unit)

    @classmethod
    def of(cls, found: Identification) -> Self:
        """Return what force control goes by."""
        gain, stiffness = found.gain, found.stiffness.value
        return cls(stiffness, gain.stiffness, gain.delay, found.damping_time, gain.gain, found.phase_margin_deg)

    @property
    def gain(self) -> ForceGain:
        """Of force control, with its margins."""
        return ForceGain(self.force_gain, self.series_stiffness, self.delay)

    @property
    def text(self) -> str:
        """As YAML; `read_identified` gives back the very same."""
        return yaml_text(asdict(self))


def read_identified(text: str) -> Identified:
    """Return what `Identified.text` wrote.

    Raises:
        InvalidValueError: A key is misspelt, or a value is wrong.
    """
    try:
        return decode(read_mapping(text, "what was identified"), Identified, text)
    except InvalidValueError as error:
        raise InvalidValueError(f"{IDENTIFIED_TEXT}: {error}") from None
