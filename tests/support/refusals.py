"""Tables of refusals: what is called, and what its refusal says."""

from collections.abc import Callable

import pytest

from palpate.errors import InvalidValueError


def check_refusals(*rows: tuple[str, Callable[[], object]]) -> None:
    """Check that each call raises an `InvalidValueError` whose message matches the pattern before it."""
    for message, call in rows:
        with pytest.raises(InvalidValueError, match=message):
            call()
