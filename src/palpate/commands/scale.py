"""Units in which numbers are easy to read: 0.00023 m as 230 µm."""

from dataclasses import dataclass

SMALLER = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))
"""Factor and prefix, the unit itself first."""

FROM: dict[str, float] = {"m": 1.0, "m/s": 1.0, "N": 0.1, "s": 0.1, "rad": 0.1, "N m": 0.1}
"""Units that take prefixes, and from which number on none."""


@dataclass(frozen=True, slots=True)
class Scale:
    """How to show numbers of an SI unit.

    Attributes:
        factor: To multiply them by.
        unit: That they have then.
    """

    factor: float
    unit: str


def scale_of(unit: str, largest: float) -> Scale:
    """Return how to show numbers up to a largest size."""
    if unit == "N/m" and largest >= 1e3:
        return Scale(1e-3, "kN/m")
    if unit not in FROM or largest <= 0.0:
        return Scale(1.0, unit)
    for factor, prefix in SMALLER:
        if factor * largest >= (FROM[unit] if factor == 1.0 else 1.0):
            return Scale(factor, prefix + unit)
    return Scale(*_last(unit))


def _last(unit: str) -> tuple[float, str]:
    factor, prefix = SMALLER[-1]
    return factor, prefix + unit
