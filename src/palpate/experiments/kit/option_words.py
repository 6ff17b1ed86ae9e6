"""Options of experiments as people read them in reports: yes or no, one or several numbers."""

from collections.abc import Sequence


def option_words(value: object) -> str:
    """Return a value of an option without its unit."""
    if _is_left_out(value):
        return "left out"
    if isinstance(value, bool):
        return "yes" if value else "no"
    each = value if isinstance(value, Sequence) and not isinstance(value, str) else (value,)
    return " x ".join(f"{one:g}" if isinstance(one, float) else str(one) for one in each)


def has_unit(value: object) -> bool:
    """Return whether a value of an option is one or several numbers, which may have a unit."""
    return not (_is_left_out(value) or isinstance(value, str | bool))


def _is_left_out(value: object) -> bool:
    return value is None or value == ()
