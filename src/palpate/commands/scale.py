"""Unit prefixes that make numbers easy to read: 0.00023 m as 230 µm."""

from dataclasses import dataclass

SMALLER = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))
"""Factor and prefix, the unit itself first."""

FROM: dict[str, float] = {"m": 1.0, "m/s": 1.0, "N": 0.1, "s": 0.1, "rad": 0.1, "N m": 0.1}
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
    if unit not in FROM or largest <= 0.0:
        return Scale(1.0, unit)
    for factor, prefix in SMALLER:
        if factor * largest >= (FROM[unit] if factor == 1.0 else 1.0):
            return Scale(factor, prefix + unit)
    return Scale(*_last(unit))


def _last(unit: str) -> tuple[float, str]:
    factor, prefix = SMALLER[-1]
    return factor, prefix + unit
