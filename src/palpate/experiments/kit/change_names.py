"""Which live parameters there are to change, checked before anything heavy is imported."""

from collections.abc import Sequence

from palpate.errors import InvalidValueError, not_negative
from palpate.nearest_name import nearest

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
