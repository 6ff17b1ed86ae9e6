"""The guards and comparisons of a run: one compiled pass per period, and words only where it finds something."""

import struct
from collections.abc import Sequence
from functools import partial

from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.supervision.bounds import BoundChecks
from palpate.runtime.supervision.command_watch import CommandWatch
from palpate.runtime.supervision.comparisons import (
    DIRECTIONS,
    FORCES,
    UNCLEAR,
    comparison_finding,
    compiled_comparisons,
    fresh_memory,
)
from palpate.runtime.supervision.conditions import Bounded
from palpate.runtime.supervision.finding import Violation
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.supervision.observed_row import ObservedRow, RowLayout

_APPROACH = Phase.APPROACH


class GuardWatch:
    """Takes the observations of a run, and the commands that led to them.

    Attributes:
        others: Indices of guards whose conditions declare no bounds: they are asked one by one.
        approach: What is remembered of the approach, see `palpate.runtime.supervision.direction_check`.
        seen: The row of what was looked at last, see `palpate.runtime.supervision.observed_row`.
    """

    def __init__(self, guards: Sequence[Guard], force: float) -> None:
        """Begin with nothing seen.

        Args:
            guards: In order.
            force: Limit of the contact force [N].
        """
        self._conditions = tuple(guard.condition for guard in guards)
        self._memory = fresh_memory(force)
        self.approach = self._memory[DIRECTIONS:FORCES]
        self._known = False
        self._lay_out(ObservedRow(RowLayout(0, 0, -1)))

    def _lay_out(self, row: ObservedRow) -> None:
        layout = row.layout
        self._row, self.seen, self._take, self._finger = row, row.values, row.take, layout.finger(0)
        declared = [each.bounds(layout) if isinstance(each, Bounded) else None for each in self._conditions]
        self.others = tuple(i for i, bounds in enumerate(declared) if bounds is None)
        self._bounds = BoundChecks([bounds or () for bounds in declared])
        judged, compared = compiled_comparisons()
        self._judge = partial(judged, self._bounds.places, self._bounds.limits, self.seen)
        self._compare = partial(compared, self.seen)

    def look(self, now: Observation) -> None:
        """Write an observation to the row."""
        try:
            self._take(now)
        except (ValueError, struct.error):  # joints, fingers or a hand came or went
            row = ObservedRow(RowLayout.of(now))
            row.take(now)
            row.follow(self._row)
            self._lay_out(row)

    def judge(self, now: Observation, last: CommandWatch) -> int:
        """Return 0 if all bounds and comparisons hold, `UNCLEAR` if a bound does not, or else see `compare`."""
        self.look(now)
        approach = last.last.phase is _APPROACH
        found: int = self._judge(self._known, self._finger, approach, last.velocities, self._memory)
        if found != UNCLEAR:
            self._known = True
        return found

    def compare(self, last: CommandWatch) -> int:
        """Return which comparison fails of what was looked at, 0 if none does; it is the last one from then on."""
        approach = last.last.phase is _APPROACH
        found: int = self._compare(self._known, self._finger, approach, last.velocities, self._memory)
        self._known = True
        return found

    def keep(self) -> None:
        """Make what was looked at the last one, without comparing."""
        self._row.keep()
        self._known = True

    def broken(self, guard: int, now: Observation, before: Observation | None) -> Violation | None:
        """Return what a guard finds wrong with what was looked at, if anything."""
        if guard in self.others:
            return self._conditions[guard].broken(now, before)
        return self._bounds.broken(guard, self.seen, now, before, self._known)

    def finding(self, now: Observation, last: Command) -> Violation:
        """Return what is wrong where a comparison has failed; `last` is the command that led here."""
        return comparison_finding(self._memory, now, last)
