"""Uncertainty of a grasp, in the units of its scaled rows, and the reserve that follows."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.robust.fixed_forces import probability_within_limits
from palpate.grasp.robust.reserve import reserve_kernel, spare_kernel
from palpate.grasp.robust.uncertainty import GraspUncertainty
from palpate.grasp.solvers.dual_newton import MU, E

__all__ = ["Design", "ScaledErrors"]

LEVELS = 8
"""Of failures, between those asked for and a half, at which a probability is looked for, the surest first."""

HALVINGS = 3
"""Between the level that will do and the one that did not."""

SEARCHES = 8
"""For the likeliest failure at each of these."""


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """What one round takes for granted in the next.

    Attributes:
        friction: mu, shape (n,).
        taken: e, scaled, shape (n,).
        constant: Share kept back of each limit besides, shape (n,) [N].
        lengths: e of the likeliest failure, scaled, shape (n,).
        reserve: All that is kept back of mu and e as believed, shape (n,) [N].
        deviations: Standard deviations that this is.
    """

    friction: FloatArray
    taken: FloatArray
    constant: FloatArray
    lengths: FloatArray
    reserve: FloatArray
    deviations: float

    @classmethod
    def first(cls, rows: FloatArray, share: float) -> "Design":
        """Return a start that takes a share of mu for granted."""
        nothing, lengths = np.zeros(len(rows)), rows[:, E].copy()
        return cls(share * rows[:, MU], lengths, nothing, lengths, nothing, 0.0)

    def towards(self, other: "Design", share: float) -> "Design":
        """Interpolate between the two, at a share from 0 to 1."""
        if share == 1.0:
            return other
        return Design(
            self.friction + share * (other.friction - self.friction),
            self.taken + share * (other.taken - self.taken),
            self.constant + share * (other.constant - self.constant),
            self.lengths + share * (other.lengths - self.lengths),
            other.reserve,
            other.deviations,
        )


class ScaledErrors:
    """Covariances in the units of a scaled grasp."""

    def __init__(self, scaled: ScaledGrasp, uncertainty: GraspUncertainty, probability: float) -> None:
        """Take a grasp, what is not known of it, and the probability wanted.

        Raises:
            InvalidValueError: A probability out of range, another number of contacts, or a mu that may be 0.
        """
        if not 0.5 <= probability < 1.0:
            raise InvalidValueError(
                f"probability = {probability!r}: must lie between 0.5 and 1, of holding; 0.99 is usual"
            )
        self._failures, self._deviations = 1.0 - probability, float(ndtri(probability))
        self._uncertainty = uncertainty
        self.update(scaled, uncertainty)

    @property
    def probability(self) -> float:
        """Of holding, as asked for."""
        return 1.0 - self._failures

    def update(self, scaled: ScaledGrasp, uncertainty: GraspUncertainty | None = None) -> None:
        """Take contacts that have moved, and what is not known of them now; None for the same as before."""
        of = self._uncertainty if uncertainty is None else uncertainty
        if len(of) != len(scaled.rows):
            raise InvalidValueError(
                f"uncertainty is of {len(of)} contacts, the grasp has {len(scaled.rows)}: must be the same"
            )
        spread_of_mu = np.sqrt(np.diag(of.friction))
        left = scaled.rows[:, MU] - self._deviations * spread_of_mu
        if not (left > 0.0).all():
            i = int(np.argmin(left))
            raise InvalidValueError(
                f"friction of contact {i}: mu = {scaled.rows[i, MU]:g} with a standard deviation of "
                f"{spread_of_mu[i]:g} may be 0 at a probability of {self.probability:g}: measure mu "
                f"better, or ask for less"
            )
        x, y, z = scaled.center.tolist()
        moment = np.eye(6)
        moment[3:, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        moment[3:] /= scaled.length
        square = 1.0 / scaled.length**2
        self._uncertainty, self._rows = of, scaled.rows
        # fresh arrays all of them: those of an uncertainty are read-only, for which numba would compile anew
        self._covariances = (
            np.array(of.friction),
            of.spin_length * square,
            of.position * square,
            np.array(of.normal),
            moment @ of.load @ moment.T,
        )

    def design(self, forces: FloatArray, lengths: FloatArray, searches: int) -> Design:
        """Return what is to be kept back under forces.

        Args:
            forces: (f_n, f_t1, f_t2, tau over the unit of length), shape (n, 4) [N].
            lengths: Guess of the likeliest failure's e, scaled, shape (n,).
            searches: For that, at most.
        """
        return self._design(forces, lengths, searches, self._failures)

    def spare(self, forces: FloatArray, taken: Design, wanted: Design) -> tuple[float, float]:
        """Return how far forces are from what they want, over the largest normal force.

        Args:
            forces: As in `design`.
            taken: For granted by them.
            wanted: By them.

        Returns:
            What margins exceed the reserve by, where least; by how much those limits would be relaxed that hold
            forces back, where most.
        """
        before, after = (
            (taken.friction, taken.taken, taken.constant),
            (wanted.friction, wanted.taken, wanted.constant),
        )
        spare, slack = spare_kernel(self._rows, forces, *before, *after, wanted.reserve)
        largest = float(forces[:, 0].max())
        return (spare / largest, slack / largest) if largest > 0.0 else (0.0, 0.0)

    def probability_of(self, forces: FloatArray, lengths: FloatArray, lacking: float) -> float:
        """Return with which probability forces hold that redistribute, from 0.5 to what was asked for; 0 if less.

        Args:
            forces: As in `design`.
            lengths: As in `design`.
            lacking: What a reserve may lack, over the largest normal force.
        """
        few, many = math.log(self._failures), math.log(0.5)
        fails = few
        for step in range(1, LEVELS + 1):
            level = few + (many - few) * step / LEVELS
            design = self._design(forces, lengths, SEARCHES, math.exp(level))
            if self.spare(forces, design, design)[0] >= -lacking:
                break
            fails = level
        else:
            return 0.0
        for _ in range(HALVINGS):
            middle = 0.5 * (fails + level)
            design = self._design(forces, design.lengths, SEARCHES, math.exp(middle))
            if self.spare(forces, design, design)[0] >= -lacking:
                level = middle
            else:
                fails = middle
        return 1.0 - math.exp(level)

    def probability_fixed(self, forces: FloatArray) -> float:
        """Return a lower bound of the probability that forces, as they are, are within all limits.

        Args:
            forces: As in `design`.
        """
        cov_mu, cov_e = self._covariances[:2]
        return probability_within_limits(forces, self._rows[:, MU], self._rows[:, E], cov_mu, cov_e)

    def _design(self, forces: FloatArray, lengths: FloatArray, searches: int, failures: float) -> Design:
        return Design(*reserve_kernel(self._rows, forces, lengths, *self._covariances, failures, searches))
