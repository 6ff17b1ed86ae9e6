"""Numbers in robot files that can be: what is far out of range is in another unit."""

from palpate.errors import InvalidValueError


def within(key: str, value: float, least: float, most: float, unit: str) -> None:
    """Refuse a number out of range, or none.

    Raises:
        InvalidValueError: It is.
    """
    if not least <= value <= most:
        raise InvalidValueError(f"{key} = {value!r}: must be from {least:g} to {most:g} {unit}; another unit?")


def at_most(key: str, value: float, most: float, unit: str) -> None:
    """Refuse what is larger in size than anything sensible, or not a number.

    Raises:
        InvalidValueError: It is.
    """
    if not abs(value) <= most:
        raise InvalidValueError(f"{key} = {value!r}: must be at most {most:g} {unit} in size; another unit?")
