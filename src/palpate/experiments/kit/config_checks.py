"""Checks of options that several experiments share; imports nothing heavy."""

import math

from palpate.errors import InvalidValueError, positive

LARGEST_LENGTH = 2.0
"""Of object, fingertip and raster [m]: robots reach 1 m in each direction; a larger number is in another unit."""

LONGEST_PERIOD = 8e-3
"""Slowest control [s]: from 125 Hz on a stage explores as well as at 1 kHz; slower, it lands hard."""

LARGEST_SEED = 2**63 - 1
"""Largest whole number that a configuration file keeps exactly."""

LARGEST_FRICTION = 10.0
"""Of what is simulated: as far as friction files and libraries reach."""

LARGEST_SPIN_LENGTH = 0.1
"""Of what is simulated [m]."""


def check_within(name: str, value: float, within: tuple[float, float], unit: str, remark: str = "") -> None:
    """Refuse a number outside its bounds.

    Args:
        name: Name of the option.
        value: Number to check.
        within: Smallest and largest allowed number; the smallest may be -infinity, the largest infinity.
        unit: Unit of both.
        remark: End of the message, after the bounds.

    Raises:
        InvalidValueError: If the number lies outside.
    """
    if within[0] <= value <= within[1]:
        return
    number, least, most = (f"{each:g}" if isinstance(each, float) else str(each) for each in (value, *within))
    bounds = f"from {least} to {most}"
    if within[0] == -math.inf:
        bounds = f"at most {most}"
    elif within[1] == math.inf:
        bounds = f"at least {least}"
    given, allowed = f"{name} = {number} {unit}".rstrip(), f"must be {bounds} {unit}".rstrip()
    raise InvalidValueError(f"{given}: {allowed}{remark}")


def check_length(name: str, length: float, largest: float = LARGEST_LENGTH) -> None:
    """Refuse a length that is none, or that is in another unit: all are in metres, as the largest is.

    Raises:
        InvalidValueError: It is such a length.
    """
    if positive(name, length, "m") > largest:
        hint = f"; for {length:g} mm give {length / 1e3:g}" if length <= 1e3 * largest else ""
        raise InvalidValueError(f"{name} = {length:g} m: must be at most {largest:g} m{hint}")


def spaced(numbers: tuple[float, ...]) -> str:
    """Return numbers as people type them."""
    return " ".join(f"{number:g}" for number in numbers)


def speed_hint(speed: float, fastest: float) -> str:
    """Return what else a speed [m/s] that is above the fastest may have been: one in mm/s, if that could be."""
    return f"; for {speed:g} mm/s give {speed / 1e3:g}" if 1.0 <= speed <= 1e3 * fastest else ""


def check_size(thing: str, size: tuple[float, ...], example: tuple[float, ...]) -> None:
    """Refuse what is no size of a simulated object: as many lengths [m] as its example has, or none.

    Raises:
        InvalidValueError: Another number of lengths, or one that cannot be.
    """
    if len(size) not in (0, len(example)):
        raise InvalidValueError(
            f"size: {len(size)} numbers; a {thing} takes {len(example)} [m], for example {spaced(example)}"
        )
    for length in size:
        check_length("size", length)


def check_tip(name: str, tip: tuple[float, ...]) -> None:
    """Refuse what is no size of a fingertip: a radius, three semi-axes [m], or nothing (the robot file gives it).

    Raises:
        InvalidValueError: It is none of these.
    """
    if len(tip) not in (0, 1, 3):
        raise InvalidValueError(
            f"{name} = {spaced(tip)}: give one number (radius of a sphere) or three (semi-axes) [m]"
        )
    for length in tip:
        check_length(name, length)


def check_seed(name: str, seed: int) -> None:
    """Refuse a seed that no random generator or no file takes.

    Raises:
        InvalidValueError: It is such a seed.
    """
    if not 0 <= seed <= LARGEST_SEED:
        raise InvalidValueError(f"{name} = {seed}: must be a whole number from 0 to {LARGEST_SEED}")


def check_period(name: str, period: float) -> None:
    """Refuse a control period [s] that is too long for touch.

    Raises:
        InvalidValueError: It is too long, or not above 0.
    """
    if positive(name, period, "s") > LONGEST_PERIOD:
        raise InvalidValueError(f"{name} = {period:g} s: must be at most {LONGEST_PERIOD:g} s")


def check_friction(name: str, friction: float) -> None:
    """Refuse a friction coefficient that no surface has, or that is in per cent.

    Raises:
        InvalidValueError: It is such a coefficient.
    """
    if positive(name, friction, "") > LARGEST_FRICTION:
        hint = f"; for {friction:g} % give {friction / 100.0:g}" if friction <= 100.0 * LARGEST_FRICTION else ""
        raise InvalidValueError(f"{name} = {friction:g}: must be at most {LARGEST_FRICTION:g}{hint}")


def check_spin_length(name: str, spin_length: float) -> None:
    """Refuse a spin length [m] that no contact has, or that is in millimetres.

    Raises:
        InvalidValueError: It is such a length.
    """
    check_length(name, spin_length, LARGEST_SPIN_LENGTH)
