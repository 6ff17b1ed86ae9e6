"""Quantities that guards watch, and the condition that one stays at or below a limit."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import hypot

from palpate.runtime.data import Observation
from palpate.runtime.supervision.bounds import Bound, Measure
from palpate.runtime.supervision.conditions import broken_by_bounds
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.runtime.supervision.observed_row import RowLayout, row_of


@dataclass(frozen=True, slots=True)
class Largest:
    """The largest size of some numbers, or of some vectors, of an observation's row; 0 if there is none.

    Attributes:
        places: Return where they stand.
        vectors: Whether three numbers are one.
        where: Return for each the place of a number that is 0 if it does not count; None: all count.
    """

    places: Callable[[RowLayout], Iterable[int]]
    vectors: bool = True
    where: Callable[[RowLayout], Iterable[int]] | None = None

    def __call__(self, now: Observation) -> float:
        """Return it."""
        row, largest = row_of(now, None), 0.0
        for place, where in self._each(row.layout):
            if where is None or row.values[where] != 0.0:
                size = hypot(*row.values[place : place + (3 if self.vectors else 1)].tolist())
                if not size <= largest:  # what is no number comes through
                    largest = size
        return largest

    def at_most(
        self, limit: float, layout: RowLayout, told: Callable[[Observation, Observation | None], Violation]
    ) -> tuple[Bound[Observation], ...]:
        """Return the bounds that say that it is at most a limit."""
        measure = Measure.LENGTH if self.vectors else Measure.NUMBER
        return tuple(
            Bound(place, told, -limit, limit, measure=measure, where=where) for place, where in self._each(layout)
        )

    def _each(self, layout: RowLayout) -> list[tuple[int, int | None]]:
        places = list(self.places(layout))
        return list(zip(places, self.where(layout) if self.where else [None] * len(places), strict=True))


@dataclass(frozen=True, slots=True)
class MonitoredQuantity:
    """A number with a name.

    Attributes:
        name: For people.
        unit: Of the number.
        of: Takes it from an observation; not finite counts as out of bounds. `Largest` is watched compiled.
        cause: What has to be seen to where it is out of bounds.
        remark: What an observation that is out of bounds shows besides; begins with a separator, or is empty.
    """

    name: str
    unit: str
    of: Callable[[Observation], float]
    cause: Cause = Cause.OTHER
    remark: Callable[[Observation], str] = lambda _: ""


@dataclass(frozen=True, slots=True)
class AtMost:
    """A measure stays at or below a limit."""

    measure: MonitoredQuantity
    limit: float

    def bounds(self, layout: RowLayout) -> tuple[Bound[Observation], ...] | None:
        """See `Bounded`; None for a quantity that only Python can take."""
        of = self.measure.of
        return of.at_most(self.limit, layout, self._told) if isinstance(of, Largest) else None

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        if isinstance(self.measure.of, Largest):
            return broken_by_bounds(self, now, before)
        return None if self.measure.of(now) <= self.limit else self._told(now, before)

    def _told(self, now: Observation, before: Observation | None) -> Violation:
        value, unit, remark = self.measure.of(now), self.measure.unit, self.measure.remark(now)
        limit = f"{self.limit:g} {unit}{remark}"
        return Violation(self.measure.name, f"{value:.4g} {unit}", limit, self.measure.cause)
