"""Which live parameters there are to change, and how far; imports nothing heavy."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from palpate.errors import InvalidValueError, not_negative
from palpate.nearest_name import nearest

if TYPE_CHECKING:
    from palpate.runtime.live import LiveParameters

EXPLORED = ("force", "speed", "force_gain")
"""What may be changed while an exploration runs; its controller knows within which bounds."""


def check_change_names(changes: Sequence[tuple[float, str, float]], known: Sequence[str]) -> None:
    """Refuse changes at no time, or of what there is not.

    Args:
        changes: Seconds after the start, name, new value.
        known: Names of the live parameters.

    Raises:
        InvalidValueError: One is.
    """
    for time, name, _ in changes:
        not_negative(f"change of {name}", time, "s after the start")
        if name not in known:
            near = nearest(name, known)
            advice = f"did you mean {near}?" if near else f"known are {', '.join(known)}"
            raise InvalidValueError(f"change after {time:g} s: no live parameter is called {name!r}; {advice}")


def check_changes(changes: Sequence[tuple[float, str, float]], live: "LiveParameters") -> None:
    """Refuse changes (as in `check_change_names`) of live parameters that are out of their bounds.

    Raises:
        InvalidValueError: One is.
    """
    for time, name, value in changes:
        try:
            live.check(name, value)
        except InvalidValueError as error:
            raise InvalidValueError(f"change after {time:g} s: {error}") from None
