"""What a picture shows, for tests that know which panel and which mark they look at."""

from typing import Any


def panels(picture: Any) -> tuple[Any, ...]:
    """Its panels, whatever each of them is."""
    return picture.panels


def marks(panel: Any, *kinds: type) -> list[Any]:
    """The marks of a panel that are of some kinds; all of them if none is given."""
    return [mark for mark in panel.marks if not kinds or isinstance(mark, kinds)]
