"""The least grip that holds with a chosen probability, when friction, spin length, places, normals and load err.

Of each limit |u_i| <= mu_i f_i a part is kept in reserve, beta standard deviations of its margin (`sharing`), with
beta such that all margins together stay above zero with the probability asked for (`joint_probability`). Margins
are straightened where it matters: 1 / e at the e of the failure that is likeliest, not at its mean (a design
point: Hasofer & Lind 1974). What grows with a contact's own force (its mu and e) is taken off these, the rest off
the limit, and the grasp is solved again; two to ten rounds settle it.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp.contacts import GraspContacts
from palpate.grasp.dual_newton import MU, E
from palpate.grasp.least_effort import LeastEffort, Outcome
from palpate.grasp.reserve import reserve_kernel, size_of
from palpate.grasp.scaled import ScaledGrasp
from palpate.grasp.uncertainty import GraspUncertainty

__all__ = ["RobustForces", "RobustLeastEffort", "reserve_for"]

SETTLED = 5e-3
"""Largest change of a normal force, over the largest, at which rounds end."""

KEPT = 1e-3
"""What a reserve may lack, over the largest normal force."""

MORE = 0.01
"""Share by which each late round keeps back more than is wanted, so that slow ones end."""

SEARCHES = 24
"""For the likeliest failure of given forces; rounds share theirs."""

ROUNDS = 16
"""At most."""

STARTS = (1.0, 0.6)
"""Shares of mu that the first round takes for granted, one after the other: a grip that holds barely says little
about one that holds well."""

DAMPED = 4
"""So many rounds after this one change what is kept back by a half, the next by a third, ..."""


@dataclass(frozen=True, slots=True, eq=False)
class RobustForces:
    """Forces that hold with a chosen probability.

    Attributes:
        forces: On the object, as in `GraspForces`, shape (n, 4) [N, N, N, N m].
        reserve: Share of each friction limit that is kept back, with mu and e as believed, shape (n,) [N].
        deviations: By how many standard deviations margins lie above zero.
        outcome: `Outcome.SOLVED`; INFEASIBLE if no grip holds with that probability, UNDECIDED if none was found.
            Then forces are of the last round and promise nothing.
        rounds: Solutions it took.
    """

    forces: FloatArray
    reserve: FloatArray
    deviations: float
    outcome: Outcome
    rounds: int


@dataclass(frozen=True, slots=True, eq=False)
class _Design:
    """What one round takes for granted in the next: mu, e, a share kept back, and the likeliest failure's e."""

    friction: FloatArray
    taken: FloatArray
    constant: FloatArray
    lengths: FloatArray
    reserve: FloatArray
    deviations: float


def _between(a: _Design, b: _Design, share: float) -> _Design:
    def mixed(first: FloatArray, second: FloatArray) -> FloatArray:
        return first + share * (second - first)

    return _Design(
        mixed(a.friction, b.friction),
        mixed(a.taken, b.taken),
        mixed(a.constant, b.constant),
        mixed(a.lengths, b.lengths),
        b.reserve,
        b.deviations,
    )


def _first(rows: FloatArray, share: float) -> _Design:
    nothing = np.zeros(len(rows))
    return _Design(share * rows[:, MU], rows[:, E], nothing, rows[:, E], nothing, 0.0)


class _Errors:
    """Covariances in the units of a scaled grasp."""

    def __init__(self, scaled: ScaledGrasp, uncertainty: GraspUncertainty, probability: float) -> None:
        if not 0.5 <= probability < 1.0:
            raise InvalidValueError(
                f"probability = {probability!r}: must lie between 0.5 and 1, of holding; 0.99 is usual"
            )
        if len(uncertainty) != len(scaled.rows):
            raise InvalidValueError(
                f"uncertainty is of {len(uncertainty)} contacts, the grasp has {len(scaled.rows)}: must be "
                "the same"
            )
        spread_of_mu = np.sqrt(np.diag(uncertainty.friction))
        left = scaled.rows[:, MU] - float(ndtri(probability)) * spread_of_mu
        if not (left > 0.0).all():
            i = int(np.argmin(left))
            raise InvalidValueError(
                f"friction of contact {i}: mu = {scaled.rows[i, MU]:g} with a standard deviation of "
                f"{spread_of_mu[i]:g} may be 0 at a probability of {probability:g}: measure mu "
                f"better, or ask for less"
            )
        self.failures = 1.0 - probability
        self._uncertainty = uncertainty
        self.update(scaled)

    def update(self, scaled: ScaledGrasp) -> None:
        """Take contacts that have moved."""
        x, y, z = scaled.center.tolist()
        moment = np.eye(6)
        moment[3:, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        moment[3:] /= scaled.length
        square, of = 1.0 / scaled.length**2, self._uncertainty
        self._rows = scaled.rows
        self._covariances = (
            np.array(of.friction),
            of.spin_length * square,
            of.position * square,
            np.array(of.normal),
            moment @ of.load @ moment.T,
        )

    def design(self, forces: FloatArray, lengths: FloatArray, searches: int) -> _Design:
        """Return what is to be kept back under forces.

        Args:
            forces: (f_n, f_t1, f_t2, tau over the unit of length), shape (n, 4) [N].
            lengths: Guess of the likeliest failure's e, scaled, shape (n,).
            searches: For that, at most.
        """
        return _Design(*reserve_kernel(self._rows, forces, lengths, *self._covariances, self.failures, searches))


def reserve_for(
    grasp: GraspContacts, uncertainty: GraspUncertainty, forces: FloatArray, probability: float
) -> FloatArray:
    """Return what each contact is to keep back under given forces, shape (n,) [N]: |u_i| <= mu_i f_i - reserve.

    For any objective: solve, keep that back (`ScaledGrasp.of`), solve again. It grows with the grip.

    Args:
        grasp: Whose limits are cones.
        uncertainty: Of it and of the load.
        forces: That hold the load, shape (n, 4) [N, N, N, N m].
        probability: Of holding with all contacts together, 0.5 to 1.

    Raises:
        InvalidValueError: A probability out of range, another number of contacts, or a mu that may be 0.
    """
    _check_cones(grasp)
    scaled = ScaledGrasp.of(grasp)
    errors = _Errors(scaled, uncertainty, probability)
    row_forces = forces / [1.0, 1.0, 1.0, scaled.length]
    return errors.design(row_forces, scaled.rows[:, E], SEARCHES).reserve


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
            probability: Of holding with all contacts together, 0.5 to 1.
            effort_weight: eps of least effort.

        Raises:
            InvalidValueError: As `reserve_for`; or actuator limits, which the reserve does not know.
        """
        _check_cones(grasp)
        self._scaled = ScaledGrasp.of(grasp)
        self._errors = _Errors(self._scaled, uncertainty, probability)
        self._solver = LeastEffort(self._scaled, effort_weight)
        self._start: _Design | None = None

    def update(self, grasp: GraspContacts) -> None:
        """Take the same contacts, moved."""
        _check_cones(grasp)
        self._scaled = ScaledGrasp.of(grasp)
        self._errors.update(self._scaled)

    def solve(self, wrench: FloatArray) -> RobustForces:
        """Return the least grip that holds a load with the probability chosen.

        Args:
            wrench: What else acts on the object, about its origin, as expected, shape (6,) [N, N m].
        """
        rows = self._scaled.rows
        answer = None
        if self._start is not None:
            answer = self._rounds(wrench, self._start)
        for share in STARTS:
            if answer is None or answer.outcome != Outcome.SOLVED:
                answer = self._rounds(wrench, _first(rows, share))
        assert answer is not None
        return answer

    def _rounds(self, wrench: FloatArray, found: _Design) -> RobustForces:
        unit, n = np.array([1.0, 1.0, 1.0, self._scaled.length]), len(self._scaled.rows)
        forces, before = np.zeros((n, 4)), np.zeros(n)
        held: _Design | None = None
        kept: RobustForces | None = None
        outcome, rounds = Outcome.UNDECIDED, 0
        for rounds in range(1, ROUNDS + 1):
            outcome = Outcome.INFEASIBLE
            if (found.friction > 0.0).all():
                self._solver.update(self._scaled.keeping(found.friction, found.taken, found.constant))
                outcome = Outcome(self._solver.solve(wrench, forces)[0])
            if outcome != Outcome.SOLVED:
                if held is None:
                    break
                found = _between(held, found, 0.5)  # it was too much at once
                continue
            f, scaled = forces[:, 0], forces / unit
            settled = bool(np.abs(f - before).max() <= SETTLED * f.max())
            # the likeliest failure is searched while the grip is: to its end only where it counts
            searches = SEARCHES if settled or rounds > DAMPED else 3
            held, wanted = found, self._errors.design(scaled, found.lengths, searches)
            if searches == SEARCHES and self._keeps(scaled, wanted):
                if kept is None or f.sum() < kept.forces[:, 0].sum():
                    kept = RobustForces(forces.copy(), wanted.reserve, wanted.deviations, outcome, rounds)
                    self._start = replace(held, lengths=wanted.lengths)
                if settled:
                    return kept
            before = f.copy()
            # contacts that come to bear and cease to by turns need smaller and smaller steps
            found = _between(found, wanted, 1.0 / max(1, rounds - DAMPED))
            found = replace(found, constant=found.constant * (1.0 + MORE * max(0, rounds - DAMPED)))
        if kept is not None:
            return kept
        if outcome == Outcome.SOLVED:
            outcome = Outcome.UNDECIDED
        self._start = None
        return RobustForces(forces, found.reserve, found.deviations, outcome, rounds)

    def _keeps(self, forces: FloatArray, design: _Design) -> bool:
        """Whether every limit keeps back what is wanted of it."""
        margin = self._scaled.rows[:, MU] * forces[:, 0] - size_of(forces, self._scaled.rows[:, E])
        return bool((margin >= design.reserve - KEPT * forces[:, 0].max()).all())


def _check_cones(grasp: GraspContacts) -> None:
    if not grasp.is_convex:
        raise InvalidValueError(
            "load_exponent and norm_exponent: a reserve is known for cones only; give e at the force expected, "
            "with load_exponent = 0 and norm_exponent = 2"
        )
    if grasp.actuator_map is not None:
        raise InvalidValueError("actuator_map: a reserve of friction does not know actuators; leave them out here")
