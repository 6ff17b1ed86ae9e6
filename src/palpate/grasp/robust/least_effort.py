"""The least grip that holds with a chosen probability, when friction, spin length, places, normals and load err.

Of each limit |u_i| <= mu_i f_i a part is kept in reserve, beta standard deviations of its margin (`sharing`), with
beta such that all margins together stay above zero with the probability asked for (`joint_probability`). Margins
are straightened where it matters: 1 / e at the e of the failure that is likeliest, not at its mean (a design
point: Hasofer & Lind 1974). What grows with a contact's own force (its mu and e) is taken off these, the rest off
the limit, and the grasp is solved again; two to ten rounds settle it.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.problem.cone_check import check_cones
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.robust.scaled_errors import Design, ScaledErrors
from palpate.grasp.robust.uncertainty import GraspUncertainty
from palpate.grasp.solvers.least_effort import Outcome, least_violation
from palpate.grasp.solvers.reserved_effort import ReservedEffort

__all__ = ["RobustForces", "RobustLeastEffort"]

RESERVE_TOLERANCE = 1e-3
"""What a reserve may lack, over the largest normal force."""

OVER = 5e-3
"""What may be left to gain, likewise."""

SEARCHES = 12
"""For the likeliest failure of given forces, at most."""

MIN_ROUNDS = 3
"""So many suffice in a round that others follow."""

ROUNDS = 9
"""That choose mu and e anew: most grasps settle within. Where contacts come to bear and cease to by turns, or push
each other's share of friction to and fro, more of them do not help."""

WHOLE = 5
"""The first round that goes only half of the distance to what is wanted."""

SQUEEZES = 8
"""Rounds that only press harder, after these."""

FIRST_SQUEEZE, LAST_SQUEEZE = 1.5, 0.5
"""The first lowers mu by so many times what lacks of it; none lowers it by more than a half."""

IN_ALL = 16
"""Rounds from all starts together: this bounds the time."""

CUTS = 6
"""Halvings of a step beyond what any grip can keep back, after which it counts as the end: within 2 %."""

STARTS = (1.0, 0.6)
"""Shares of mu that the first round takes for granted, one after the other: a grip that holds barely says little
about one that holds well."""


@dataclass(frozen=True, slots=True, eq=False)
class RobustForces:
    """Forces that hold with a chosen probability, or the safest that were found.

    To hold has two meanings, and both probabilities are told. Under commanded normal forces, on an object that may
    creep by micrometres, friction redistributes: that is what is asked for and planned by. Where all forces are
    commanded they stay. `sample_holding` counts both, by drawing.

    Attributes:
        forces: On the object, as in `GraspForces`, shape (n, 4) [N, N, N, N m].
        reserve: Share of each friction limit that is kept back, with mu and e as believed, shape (n,) [N]; what
            ought to be, if not solved.
        deviations: By how many standard deviations margins lie above zero, if solved.
        probability_redistributing: With which normal forces as planned hold, where friction may redistribute: some
            tangential forces and spin torques within the true limits balance the true load. A lower bound, to
            first order: the one asked for if solved; else that of these forces, 0 if below one half.
        probability_fixed: With which the forces hold exactly as planned, every contact within its own true limit.
            A lower bound: exact for one contact, first order in how several err together; 0 where forces do not
            balance the load. Errors of places, normals and load do not enter: forces that do not change cannot
            answer them.
        outcome: `Outcome.SOLVED`; INFEASIBLE if no grip within the forces allowed was found to hold with the
            probability asked for, UNDECIDED if none was within the rounds allowed. In both cases forces are
            those of the rounds that lack least of the reserve, and balance the load; of a load that is not held
            even if all is as believed, those that leave least of it.
        rounds: Solutions it took.
    """

    forces: FloatArray
    reserve: FloatArray
    deviations: float
    probability_redistributing: float
    probability_fixed: float
    outcome: Outcome
    rounds: int


@dataclass(frozen=True, slots=True, eq=False)
class _Round:
    """Forces of one round, what they took for granted, and what they ought to have kept back.

    Attributes:
        forces: As in `RobustForces`.
        scaled: The same with torques over the unit of length.
        taken: That led to them.
        wanted: By them.
        spare: Least margin beyond the reserve wanted, over the largest normal force.
        slack: By how much limits that hold forces back would be relaxed in the next round, at most, likewise.
    """

    forces: FloatArray
    scaled: FloatArray
    taken: Design
    wanted: Design
    spare: float
    slack: float

    @property
    def keeps(self) -> bool:
        """Whether it keeps the reserve that it wants."""
        return self.spare >= -RESERVE_TOLERANCE

    @property
    def settled(self) -> bool:
        """Whether it keeps little more."""
        return self.keeps and self.slack <= OVER


class RobustLeastEffort:
    """Least effort with a reserve, warm from one load to the next."""

    def __init__(
        self,
        grasp: GraspContacts,
        uncertainty: GraspUncertainty,
        probability: float = 0.99,
        effort_weight: float = 0.01,
    ) -> None:
        """Take a grasp whose limits are cones.

        Args:
            grasp: Without actuator limits.
            uncertainty: Of it and of the load.
            probability: Of holding with all contacts together, 0.5 to 1, where friction may redistribute.
            effort_weight: eps of least effort.

        Raises:
            InvalidValueError: A probability out of range, another number of contacts, a mu that may be 0, or
                actuator limits, which the reserve does not know.
        """
        check_cones(grasp, "a reserve is")
        self._weight = effort_weight
        self._scaled = ScaledGrasp.of(grasp)
        self._errors = ScaledErrors(self._scaled, uncertainty, probability)
        self._solver = ReservedEffort(effort_weight)
        self._start: Design | None = None

    def update(self, grasp: GraspContacts, uncertainty: GraspUncertainty | None = None) -> None:
        """Take contacts that have moved, come or gone, and what is not known of them now.

        While their number stays the next solution starts warm.

        Args:
            grasp: As at first.
            uncertainty: Of as many contacts; None for the same as before.

        Raises:
            InvalidValueError: As at first; then everything is as it was.
        """
        check_cones(grasp, "a reserve is")
        scaled = ScaledGrasp.of(grasp)
        self._errors.update(scaled, uncertainty)
        if len(grasp) != len(self._scaled.rows):
            self._start = None
        self._scaled = scaled

    def solve(self, wrench: FloatArray) -> RobustForces:
        """Return the least grip that holds a load with the probability chosen.

        Args:
            wrench: What else acts on the object, about its origin, as expected, shape (6,) [N, N m].
        """
        self._wrench, self._done = wrench, 0
        starts = [Design.first(self._scaled.rows, share) for share in STARTS]
        if self._start is not None:
            starts.insert(0, self._start)
        best: _Round | None = None
        outcome = Outcome.INFEASIBLE
        for start in starts:
            found, ended = self._settle(start)
            if found is None:
                continue
            if not found.keeps and ended == Outcome.UNDECIDED:
                found, ended = self._squeeze(found)
            best, outcome = _better(best, found), ended
            if best.settled or ended == Outcome.INFEASIBLE or self._done >= IN_ALL:
                break
        if best is None:
            return self._not_held(wrench)
        self._start = best.taken
        wanted, errors = best.wanted, self._errors
        if best.keeps:
            outcome, probability = Outcome.SOLVED, errors.probability
        else:
            probability = errors.probability_of(best.scaled, wanted.lengths, RESERVE_TOLERANCE)
        fixed = errors.probability_fixed(best.scaled)
        return RobustForces(
            best.forces, wanted.reserve, wanted.deviations, probability, fixed, outcome, self._done
        )

    def _settle(self, found: Design) -> tuple[_Round | None, Outcome]:
        """Return the least grip that keeps its reserve, or what lacks least, of some rounds from a start."""
        best: _Round | None = None
        held: _Round | None = None
        rounds, cuts = 0, 0
        while rounds < ROUNDS and self._done < IN_ALL:
            outcome, now = self._round(found)
            if now is None:
                cuts += 1
                if held is None or cuts > CUTS:
                    return best, outcome
                found = held.taken.towards(found, 0.5)  # it was too much at once
                continue
            rounds += 1
            best = _better(best, now)
            if now.settled:
                return now, Outcome.SOLVED
            held, found = now, now.taken.towards(now.wanted, 1.0 if rounds < WHOLE else 0.5)
        return best, Outcome.UNDECIDED

    def _squeeze(self, start: _Round) -> tuple[_Round, Outcome]:
        """Return what keeps its reserve by a lower mu of all contacts, or what lacks least."""
        best, outcome, taken = start, Outcome.UNDECIDED, replace(start.taken, lengths=start.wanted.lengths)
        low, high, lacks, has = 0.0, LAST_SQUEEZE, start.spare, math.nan
        share = -FIRST_SQUEEZE * lacks / float(taken.friction.min())
        for _ in range(min(SQUEEZES, IN_ALL - self._done)):
            share = share if low < share < high else 0.5 * (low + high)
            found, now = self._round(replace(taken, friction=(1.0 - share) * taken.friction))
            if now is None:
                outcome, high, has = found, share, math.nan
                share = 0.5 * (low + high)
                continue
            best = _better(best, now)
            if now.keeps:
                if now.spare <= OVER:
                    break
                high, has = share, now.spare
            else:
                low, lacks = share, now.spare
            # the straight line through both ends, to the middle of what will do
            share = 2.0 * share if math.isnan(has) else low + (high - low) * (0.5 * OVER - lacks) / (has - lacks)
        return best, outcome

    def _round(self, found: Design) -> tuple[Outcome, _Round | None]:
        """Return how one solution ended, and what it wants kept back."""
        self._done += 1
        if not (found.friction > 0.0).all():
            return Outcome.INFEASIBLE, None
        forces = np.empty((len(self._scaled.rows), 4))
        limits = self._scaled.keeping(found.friction, found.taken, found.constant)
        outcome = self._solver.solve(limits, self._wrench, forces)
        if outcome != Outcome.SOLVED:
            return outcome, None
        scaled = forces / [1.0, 1.0, 1.0, self._scaled.length]
        wanted = self._errors.design(scaled, found.lengths, MIN_ROUNDS)
        spare, slack = self._errors.spare(scaled, found, wanted)
        if spare >= -RESERVE_TOLERANCE:  # it may do: now search the likeliest failure to the end
            wanted = self._errors.design(scaled, wanted.lengths, SEARCHES)
            spare, slack = self._errors.spare(scaled, found, wanted)
        return outcome, _Round(forces, scaled, replace(found, lengths=wanted.lengths), wanted, spare, slack)

    def _not_held(self, wrench: FloatArray) -> RobustForces:
        """Return what leaves least of a load that is not held even if all is as believed."""
        load, size = self._scaled.load(wrench)
        forces = self._scaled.forces(least_violation(self._scaled.sized(size), load, self._weight)[0], size)
        nothing = np.zeros(len(forces))
        self._start = None
        return RobustForces(forces, nothing, 0.0, 0.0, 0.0, Outcome.INFEASIBLE, self._done)


def _better(best: _Round | None, now: _Round) -> _Round:
    """Return the lesser grip of what keeps its reserve, else what lacks less."""
    if best is None or (now.keeps and not best.keeps):
        return now
    if now.keeps:
        return now if now.forces[:, 0].sum() < best.forces[:, 0].sum() else best
    return now if not best.keeps and now.spare > best.spare else best
