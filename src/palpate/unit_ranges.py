"""What numbers of a unit can be: beyond, they are in another unit, or no quantity that a robot meets."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from palpate.errors import InvalidValueError, shown


@dataclass(frozen=True, slots=True)
class UnitRange:
    """The sizes that a number may have, its sign aside; 0 is one.

    Attributes:
        least: Smallest but 0.
        most: Largest.
    """

    least: float
    most: float


RANGES: Mapping[str, UnitRange] = {
    "": UnitRange(1e-9, 1e9),  # ratios and counts
    "m": UnitRange(1e-9, 1e3),  # an atom's width below, a hall above
    "rad": UnitRange(1e-9, 1e3),  # 160 turns
    "s": UnitRange(1e-7, 1e7),  # four months
    "Hz": UnitRange(1e-6, 1e6),
    "1/s": UnitRange(1e-6, 1e6),
    "N": UnitRange(1e-9, 1e5),  # AFM tips to presses
    "N m": UnitRange(1e-12, 1e5),
    "N/m": UnitRange(1e-3, 1e9),  # a hair; steel on steel, over a square millimetre
    "N/s": UnitRange(1e-9, 1e6),
    "N/min": UnitRange(1e-9, 1e6),
    "m/s": UnitRange(1e-9, 1e2),
    "m/s^2": UnitRange(1e-3, 1e3),
    "s/m": UnitRange(1e-6, 1e6),
    "kg": UnitRange(1e-6, 1e3),
}
"""Of every unit that an option has;"""

OTHER = UnitRange(1e-12, 1e12)
"""of one that is not listed: raw readings of 32 bits, an experiment's own."""


def check_unit_range(name: str, value: float, unit: str) -> float:
    """Return a number as a float, if it can be one of its unit.

    Args:
        name: Of the option.
        value: Of it.
        unit: Of it.

    Raises:
        InvalidValueError: It is not finite, or beyond its unit's range.
    """
    allowed = RANGES.get(unit, OTHER)
    try:
        number = float(value)
    except OverflowError:  # an integer of hundreds of digits
        number = math.inf
    if number == 0.0 or allowed.least <= abs(number) <= allowed.most:
        return number
    if math.isnan(number):
        wanted = "must be a number"
    else:
        wanted = f"must be 0 or from {allowed.least:g} to {allowed.most:g} {unit}".rstrip() + " in size"
    raise InvalidValueError(f"{name} = {shown(value)} {unit}".rstrip() + f": {wanted}; is it in another unit?")
