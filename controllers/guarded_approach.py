"""Guarded approach: move until touch, let the force settle, and recover contact that is lost.

Contact lost before the force has settled is a bounce: the approach resumes. Contact lost after that is searched
for once, over a short distance; after a second loss it is gone. The controller decides on the velocities.
"""

import math
from enum import Enum

from palpate.runtime.data import Phase
from palpate.spatial import ZERO, Vector

DOWN: Vector = (0.0, 0.0, -1.0)
"""Approach direction in the base frame, if no other is given."""

MAX_BOUNCES = 20
"""Bound on the bounces of one approach; where the tip bounces more often, the surface moves too fast."""

LIFT_TIMEOUT = 2.0
"""A lift times out after this multiple of its nominal duration: wedged between two walls, the tip gets nowhere."""


class Loss(Enum):
    """Contact history of a guarded approach."""

    UNMADE = "never made"
    NEVER = "never lost"
    FOUND = "lost once and found again"
    MISSING = "nothing was there"
    GONE = "lost for good"
    BOUNCING = "never settled"

    @property
    def is_final(self) -> bool:
        """Whether the guarded approach has given up."""
        return self in GIVEN_UP


GIVEN_UP = (Loss.MISSING, Loss.GONE, Loss.BOUNCING)

APPROACH, SETTLE, SEEK = Phase.APPROACH, Phase.SETTLE, Phase.SEEK
"""Looked up once: that takes ten times as long as to compare them (Python 3.11)."""

SEARCHING = (APPROACH, SEEK)


class ContactEvent(Enum):
    """A transition of a guarded approach."""

    TOUCHED = "touched"
    BOUNCED = "contact lost before it settled"
    SETTLED = "settled"
    LOST = "settled contact lost"


class GuardedApproach:
    """State machine of APPROACH, SETTLE and SEEK; the controller enters all other phases.

    Attributes:
        phase: Current phase.
        since: When it was entered [s].
        origin: Tip position from which its travel is measured, base frame [m].
        settled: Whether the force has settled since the last touch.
        loss: Contact history since the approach began; once it is final, the controller ends the run or the leg.
        bounces: Number of bounces of this approach.
    """

    def __init__(
        self,
        settle_time: float,
        approach_distance: float,
        seek_distance: float = 0.0,
        contact_phase: Phase = Phase.SETTLE,
        most_bounces: float = MAX_BOUNCES,
    ) -> None:
        """Set the bounds.

        Args:
            settle_time: From touch to settled [s].
            approach_distance: Bound on the travel of an approach [m].
            seek_distance: Bound on the travel of a search [m].
            contact_phase: Phase, besides SETTLE, in which contact must not be lost.
            most_bounces: Bound on the number of bounces of an approach.
        """
        self._settle_time, self._most_bounces = settle_time, most_bounces
        self._approach_distance, self._seek_distance = approach_distance, seek_distance
        self._contact_phase = contact_phase
        self.start(0.0, ZERO)

    def start(self, time: float, position: Vector) -> None:
        """Begin a run with an approach from the tip position [m], base frame, at a time [s]."""
        self._start = position
        self.sense(time, position, touching=False)
        self.approach()

    def sense(self, time: float, position: Vector, touching: bool) -> None:
        """Take this period's time [s], tip position [m], base frame, and whether the tip touches."""
        self._time, self._position, self._touching = time, position, touching

    def approach(self) -> None:
        """Begin another approach, from the current position."""
        self.settled = self._established = False
        self.loss, self.bounces = Loss.UNMADE, 0
        self.enter(APPROACH)

    def enter(self, phase: Phase) -> None:
        """Enter a phase at the current time and position."""
        self.phase, self.since, self.origin = phase, self._time, self._position

    def renew(self) -> None:
        """Allow another search."""
        self.loss = Loss.NEVER

    @property
    def searching(self) -> bool:
        """Whether it looks for the surface: only then it counts how far it has gone."""
        return self.phase in SEARCHING

    @property
    def elapsed(self) -> float:
        """Time in the current phase [s]."""
        return self._time - self.since

    @property
    def travel(self) -> float:
        """Distance from `origin` [m]."""
        return math.dist(self._position, self.origin)

    def lifted(self, distance: float, speed: float) -> bool:
        """Return whether a lift over a distance [m] at a speed [m/s] is over, whatever a drifted sensor reads."""
        return lift_over(self.travel, self.elapsed, distance, speed)

    def step(self, travel: float | None = None) -> ContactEvent | None:
        """Make the transition that is due, if any.

        Args:
            travel: Of this approach or search [m]; distance from `origin` if not given. Counts while `searching`.
        """
        phase = self.phase
        if phase is self._contact_phase or phase is SETTLE:
            if not self._touching:
                return self._lose()
            if phase is SETTLE and not self.settled and self.elapsed > self._settle_time:
                self.settled = self._established = True
                return ContactEvent.SETTLED
        elif phase in SEARCHING:
            if self._touching:
                self.loss = Loss.NEVER if self.loss is Loss.UNMADE else self.loss
                self.enter(SETTLE)
                return ContactEvent.TOUCHED
            most = self._seek_distance if phase is SEEK else self._approach_distance
            if (self.travel if travel is None else travel) > most:
                self.loss = Loss.GONE if phase is SEEK else Loss.MISSING
        return None

    def _lose(self) -> ContactEvent:
        self.settled = False
        if not self._established:
            self.bounces += 1
            if self.bounces > self._most_bounces:
                self.loss = Loss.BOUNCING
            self.enter(APPROACH)
            self.origin = self._start  # the bound holds for all of the approach
            return ContactEvent.BOUNCED
        if self.loss is Loss.NEVER:
            self.loss = Loss.FOUND
            self.enter(SEEK)
        else:
            self.loss = Loss.GONE
        return ContactEvent.LOST


def lift_over(travel: float, elapsed: float, distance: float, speed: float) -> bool:
    """Return whether travel [m] and elapsed time [s] end a lift over a distance [m] at a speed [m/s]."""
    return travel > distance or elapsed > LIFT_TIMEOUT * distance / speed
