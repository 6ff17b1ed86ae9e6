"""Units of numbers that people read, and their SI units for programs."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

UNITS: Mapping[str, tuple[str, float]] = {
    "": ("", 1.0),
    "times": ("", 1.0),
    "%": ("share", 0.01),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "µm": ("m", 1e-6),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "µs": ("s", 1e-6),
    "Hz": ("hz", 1.0),
    "N": ("n", 1.0),
    "mN": ("n", 1e-3),
    "N m": ("n_m", 1.0),
    "mN m": ("n_m", 1e-3),
    "kg": ("kg", 1.0),
    "rad": ("rad", 1.0),
    "degrees": ("rad", math.pi / 180.0),
    "1/m": ("per_m", 1.0),
    "m/s": ("m_per_s", 1.0),
    "mm/s": ("m_per_s", 1e-3),
    "µm/s": ("m_per_s", 1e-6),
    "rad/s": ("rad_per_s", 1.0),
    "degrees/s": ("rad_per_s", math.pi / 180.0),
    "N/s": ("n_per_s", 1.0),
    "N/m": ("n_per_m", 1.0),
    "kN/m": ("n_per_m", 1e3),
    "m/s/N": ("m_per_s_per_n", 1.0),
    "mm/s/N": ("m_per_s_per_n", 1e-3),
    "mN/min": ("n_per_s", 1e-3 / 60.0),
}
"""Units of reports: suffix of a key in JSON, and factor to the SI unit; a percentage becomes a ratio."""

_PERCENTILE = re.compile(r"\b(\d+) %")


def quantity_key(words: str, unit: str = "") -> str:
    """Return the key of a quantity in JSON: its words joined by underscores, then its SI unit."""
    plain = _PERCENTILE.sub(r"p\1", words.lower())
    parts = [re.sub(r"[^a-z0-9]+", "_", plain).strip("_"), UNITS[unit][0] if unit in UNITS else ""]
    return "_".join(part for part in parts if part)


PREFIXES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))
"""Factor and prefix, the unit itself first."""

SMALLEST_SHOWN: dict[str, float] = {"m": 1.0, "m/s": 1.0, "N": 0.1, "s": 0.1, "rad": 0.1, "N m": 0.1}
"""Units that take prefixes, and the smallest number shown without one."""


@dataclass(frozen=True, slots=True)
class Scale:
    """Factor and unit by which numbers are shown.

    Attributes:
        factor: Multiplies the number in SI units.
        unit: Unit of the product.
    """

    factor: float
    unit: str


def scale_of(unit: str, largest: float) -> Scale:
    """Return the scale for numbers of up to a largest magnitude."""
    if unit == "N/m" and largest >= 1e3:
        return Scale(1e-3, "kN/m")
    if unit == "m^2" and largest < 1.0:
        return Scale(1e4, "cm²")
    if unit not in SMALLEST_SHOWN or largest <= 0.0:
        return Scale(1.0, unit)
    least = SMALLEST_SHOWN[unit]
    fitting = (each for each in PREFIXES if each[0] * largest >= (least if each[0] == 1.0 else 1.0))
    factor, prefix = next(fitting, PREFIXES[-1])
    return Scale(factor, prefix + unit)
