"""A regulation as text, for its log: the configuration, and what pressing has found before."""

from dataclasses import dataclass, fields
from pathlib import Path

from palpate.controllers.gains import ForceGain
from palpate.controllers.identification import Identification
from palpate.errors import InvalidValueError, positive
from palpate.experiments.kit.owned_options import foreign_options
from palpate.experiments.regulate.config import CHOICES, RegulateConfig
from palpate.strict_decode import decode, read_mapping
from palpate.yaml_text import yaml_text

REGULATION_TEXT = "regulation.yaml"
"""Under this name a log keeps the configuration,"""

IDENTIFIED_TEXT = "identified.yaml"
"""under this what pressing has found,"""

MOTION_TEXT = "motion.csv"
"""and under this the table of velocities."""


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

    @property
    def gain(self) -> ForceGain:
        """Of force control, with its margins."""
        return ForceGain(self.force_gain, self.series_stiffness, self.delay)


def identified(found: Identification) -> Identified:
    """Return what force control goes by."""
    gain = found.gain
    return Identified(
        found.stiffness.value, gain.stiffness, gain.delay, found.damping_time, gain.gain, found.phase_margin_deg
    )


def regulation_text(config: RegulateConfig) -> str:
    """Return a configuration as YAML, every value written out; `read_regulation` gives back the very same."""
    return yaml_text({field.name: _plain(getattr(config, field.name)) for field in fields(config)})


def read_regulation(text: str) -> RegulateConfig:
    """Return the configuration that `regulation_text` wrote.

    What belongs to other surfaces, profiles and motions than those of the run is passed over: older logs may
    hold such values, which did nothing.

    Raises:
        InvalidValueError: A key is misspelt, a value of the wrong type, or they cannot be together.
    """
    values = read_mapping(text, "a regulation")
    foreign = foreign_options(values, CHOICES)
    return decode({name: value for name, value in values.items() if name not in foreign}, RegulateConfig, text)


def identified_text(found: Identified) -> str:
    """Return it as YAML; `read_identified` gives back the very same."""
    return yaml_text({field.name: getattr(found, field.name) for field in fields(found)})


def read_identified(text: str) -> Identified:
    """Return what `identified_text` wrote.

    Raises:
        InvalidValueError: As in `read_regulation`.
    """
    try:
        return decode(read_mapping(text, "what was identified"), Identified, text)
    except InvalidValueError as error:
        raise InvalidValueError(f"{IDENTIFIED_TEXT}: {error}") from None


def _plain(value: object) -> object:
    return str(value) if isinstance(value, Path) else value
