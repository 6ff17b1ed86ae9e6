"""Bounds on numbers of a row, checked by the hundred in one compiled pass, and told in words where one is broken.

A `Bound` is the rule and its words: whoever watches a row of numbers declares bounds, and nothing else.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from math import hypot, inf
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from palpate.compiling import machine_code, njit
from palpate.errors import FloatArray
from palpate.runtime.supervision.finding import Violation

Subject = TypeVar("Subject")
"""What a row is made of: an observation or a command."""


class Measure(IntEnum):
    """What is taken of a row."""

    NUMBER = 0
    """A number, or its difference from another one."""
    LENGTH = 1
    """Of three numbers, or of their difference from three others."""
    ROTATION_ERROR = 2
    """How far nine numbers are from the rows of a right-handed, orthonormal matrix."""


@dataclass(frozen=True, slots=True)
class Bound(Generic[Subject]):
    """A measure of a row is a number from `low` to `high`: what is none is out of bounds.

    Attributes:
        place: Of the number, or the first of several.
        told: Returns what is wrong, from what the row is made of and from the last of these (None at first).
        low: Smallest value allowed.
        high: Largest value allowed.
        minus: Place of what is subtracted, if it is a difference. Where it stands in the row before, the bound
            holds as long as there is none.
        measure: What is taken.
        where: Place of a number that is 0 where the bound does not apply; None: it always does.
    """

    place: int
    told: Callable[[Subject, Subject | None], Violation]
    low: float = -inf
    high: float = inf
    minus: int | None = None
    measure: Measure = Measure.NUMBER
    where: int | None = None


_LENGTH, _ROTATION_ERROR = int(Measure.LENGTH), int(Measure.ROTATION_ERROR)


@njit(error_model="numpy", cache=True)
def first_broken(
    places: npt.NDArray[np.int16], limits: FloatArray, row: FloatArray, known: bool, start: int, stop: int
) -> int:
    """Return which of the bounds from `start` to `stop` is the first that does not hold; -1 if all do.

    Args:
        places: Of each bound: measure, place, minus, where; -1 for None; shape (n, 4).
        limits: Of each bound: low, high; shape (n, 2).
        row: With the one before behind it, shape (2 m,).
        known: Whether there is one before.
        start: Of the range,
        stop: and its end.
    """
    size = len(row) // 2
    for n in range(start, stop):
        measure, a, b, where = places[n, 0], places[n, 1], places[n, 2], places[n, 3]
        if (b >= size and not known) or (where >= 0 and row[where] == 0.0):
            continue
        if measure == _ROTATION_ERROR:
            value = rotation_error(row[a : a + 9])
        elif measure == _LENGTH:
            x, y, z = row[a], row[a + 1], row[a + 2]
            if b >= 0:
                x, y, z = x - row[b], y - row[b + 1], z - row[b + 2]
            value = hypot(hypot(x, y), z)
        else:
            value = row[a] - row[b] if b >= 0 else row[a]
        if not limits[n, 0] <= value <= limits[n, 1]:
            return n
    return -1


@njit(error_model="numpy")
def rotation_error(r: FloatArray) -> float:
    """Return how far nine numbers are from the rows of a rotation."""
    a0, a1, a2, b0, b1, b2, c0, c1, c2 = r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
    error = abs(a0 * a0 + a1 * a1 + a2 * a2 - 1.0)
    for each in (
        abs(b0 * b0 + b1 * b1 + b2 * b2 - 1.0),
        abs(a0 * b0 + a1 * b1 + a2 * b2),
        abs(a1 * b2 - a2 * b1 - c0),
        abs(a2 * b0 - a0 * b2 - c1),
        abs(a0 * b1 - a1 * b0 - c2),
    ):
        if not each <= error:  # what is no number comes through
            error = each
    return float(error)


class BoundChecks(Generic[Subject]):
    """The bounds of several conditions, one after the other, compiled.

    Attributes:
        places: See `first_broken`,
        limits: likewise.
    """

    def __init__(self, groups: Sequence[Sequence[Bound[Subject]]]) -> None:
        """Take each condition's bounds; one that declares none has an empty group."""
        self._all = tuple(bound for group in groups for bound in group)
        ends = np.cumsum([0, *map(len, groups)]).tolist()
        self._ranges = tuple(pairwise(ends))
        rows = [(each.measure, each.place, _place(each.minus), _place(each.where)) for each in self._all]
        self.places: npt.NDArray[np.int16] = np.array(rows, np.int16).reshape(-1, 4)
        limits = [(each.low, each.high) for each in self._all]
        self.limits: FloatArray = np.array(limits, float).reshape(-1, 2)
        self._first = first_broken_in()

    def broken(
        self, group: int, row: FloatArray, now: Subject, before: Subject | None, known: bool
    ) -> Violation | None:
        """Return what is wrong with the first broken bound of a condition, if any is.

        Args:
            group: Which condition.
            row: See `first_broken`.
            now: What the row is made of,
            before: and the row before it.
            known: Whether there is a row before.
        """
        n = self._first(self.places, self.limits, row, known, *self._ranges[group])
        return None if n < 0 else self._all[n].told(now, before)


def first_broken_in() -> Any:
    """Return `first_broken`, compiled."""
    return machine_code(first_broken, np.empty((1, 4), np.int16), np.empty((1, 2)), np.empty(2), True, 0, 0)


def _place(place: int | None) -> int:
    return -1 if place is None else place
