"""Marks of an exploration in figures: each event with a colour and a symbol of its own."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from palpate.controllers.paths import PathEvent
from palpate.errors import FloatArray
from palpate.reporting.marks import Symbol
from palpate.reporting.solids import Spots
from palpate.runtime.palette import SIDE_BY_SIDE, Colour
from palpate.spatial import Vector

COLOURS = SIDE_BY_SIDE[2:]
"""Neither that of what was felt nor that of the truth."""

SYMBOLS = (Symbol.DOT, Symbol.SQUARE, Symbol.DIAMOND, Symbol.PLUS, Symbol.CROSS)
"""There are others, but not in space."""

SIZE = 8.0
"""[px]"""


class Marked(Protocol):
    """A place with an event."""

    @property
    def event(self) -> str:
        """What happened, in a word."""
        ...

    @property
    def position(self) -> Vector:
        """Where, base frame [m]."""
        ...


def places_by_event(marks: Sequence[Marked]) -> Mapping[str, FloatArray]:
    """Return where each event was, in the order in which they came first, shapes (n, 3) [m]."""
    found: dict[str, list[Vector]] = {}
    for mark in marks:
        found.setdefault(str(mark.event), []).append(mark.position)
    return {event: np.array(places) for event, places in found.items()}


def look_of(event: str) -> tuple[Colour, Symbol]:
    """Return the colour and the symbol of an event, alike in all figures."""
    number = list(PathEvent).index(PathEvent(event))
    return COLOURS[number % len(COLOURS)], SYMBOLS[number % len(SYMBOLS)]


def event_spots(marks: Sequence[Marked]) -> tuple[Spots, ...]:
    """Return the marks in space, named by their events."""
    return tuple(
        Spots(places, event, *_drawn(event), texts=(event,) * len(places))
        for event, places in places_by_event(marks).items()
    )


def _drawn(event: str) -> tuple[Colour, float, Symbol]:
    colour, symbol = look_of(event)
    return colour, SIZE, symbol
