"""A number and its interval in as many digits as the interval is worth."""

import math

MOST_DECIMALS = 6


def value_words(value: float, lower: float, upper: float) -> str:
    """Return the value to two digits of its interval's half width; four significant ones if it has none.

    A value that is nothing but noise then reads 0.0001, not 9.461e-05.
    """
    return f"{value:.{_decimals(value, lower, upper)}f}"


def interval_words(value: float, lower: float, upper: float) -> str:
    """Return the interval, in the value's digits."""
    digits = _decimals(value, lower, upper)
    end = f"to {upper:.{digits}f}" if math.isfinite(upper) else "upwards"
    return f"95 %: {lower:.{digits}f} {end}"


def _decimals(value: float, lower: float, upper: float) -> int:
    half = 0.5 * (upper - lower)
    if math.isfinite(half) and half > 0.0:
        wanted = 1 - math.floor(math.log10(half))
    elif value != 0.0:
        wanted = 3 - math.floor(math.log10(abs(value)))
    else:
        wanted = 1
    return min(max(wanted, 0), MOST_DECIMALS)
