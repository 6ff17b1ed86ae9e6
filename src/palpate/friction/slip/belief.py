"""Bayesian belief about mu and e, updated by holding and by slip.

A grid over the logarithms of mu and of mu c, the torque borne per normal force (at 1 N): what is wanted of it are
cautious quantiles of just these two. The prior is normal in log mu and log c, as from a touch, or wide. Then

- a load that is held bounds friction from below: P(held) = Phi(-log r / s), r its load ratio, s the deviation of
  one observation. Holding the same for a thousand periods is no new evidence: of all loads held only the most
  telling counts, node by node.
- a slip is a point of the surface: log r is normal about 0 with s, or, if it was a false alarm, something inside.

A slip under a load that the belief says is borne with certainty means that the surface has changed (it is wet
now), or was a false alarm. The cautious response to both is the first: what was believed counts no more, and a
wide prior takes its place before the slip is taken in. So friction is never believed in for what it has been; the
price of a false alarm is a firmer grip. Upwards, it exceeds the value measured by touch by three of its deviations
at most.
"""

import math

import numpy as np
from scipy.special import log_ndtr

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface

NODES = 61
"""Per axis. What an observation says is averaged over the cell of each node, so that none falls between two."""
BELOW = 16
"""Of them, how many are below the prior."""
REACH = 3.0
"""How far the grid reaches upwards, in standard deviations of the prior."""
MIN_REACH = math.log(4.0)
"""Downwards it reaches to a quarter at least: a dry surface that gets wet."""
CHANGED = 0.5
"""Standard deviation of the logarithms once the surface has turned out to be another."""
DIRECTIONS = 8
"""Between pull and twist, for each of which the hardest load held is remembered."""
FALSE_ALARM = 0.02
"""Share of detected slips that are false alarms: then friction is anything from there up."""
INCREDIBLE = 0.01
"""Share of the belief that says a slip was possible, below which the surface is taken to be another."""


class FrictionBelief:
    """Belief about one pair of surfaces. All contacts with the same object may feed the same belief."""

    def __init__(
        self,
        friction: float,
        spin_length: float,
        *,
        friction_deviation: float,
        spin_length_deviation: float,
        load_exponent: float = 0.0,
        norm_exponent: float = 2.0,
        observation_deviation: float = 0.03,
    ) -> None:
        """Begin with a prior.

        Args:
            friction: Median of mu.
            spin_length: Median of c [m], which is e at 1 N.
            friction_deviation: Standard deviation of log mu: 0.03 for 3 %.
            spin_length_deviation: Likewise of log c.
            load_exponent: gamma, taken as known.
            norm_exponent: p, taken as known; 1 is the cautious one.
            observation_deviation: s, of the log of the load ratio at a detected slip, static against kinetic
                included.

        Raises:
            InvalidValueError: One of them is out of range.
        """
        self._median = LimitSurface(friction, spin_length, load_exponent, norm_exponent)
        positive("friction_deviation", friction_deviation, "")
        positive("spin_length_deviation", spin_length_deviation, "")
        self._s = positive("observation_deviation", observation_deviation, "")
        self._log_mu = math.log(friction) + _axis(friction_deviation)
        self._log_torque = math.log(friction * spin_length) + _axis(
            math.hypot(friction_deviation, spin_length_deviation)
        )
        cells = np.gradient(self._log_mu)[:, None], np.gradient(self._log_torque)[None, :]
        self._cells = np.log(cells[0]) + np.log(cells[1])
        # of an observation and of where in its cell the truth lies: evenly, a twelfth of the square of its width
        self._width = np.sqrt(self._s**2 + (cells[0] ** 2 + cells[1] ** 2) / 12.0)
        self._log_likelihood = self._normal(friction_deviation, spin_length_deviation)
        self._held = np.zeros_like(self._log_likelihood)
        self._hardest = [0.0] * DIRECTIONS
        self._weights: FloatArray | None = None

    def held(self, load: ContactLoad) -> None:
        """Take note that a contact bore a load and did not slip. Cheap where it says nothing new."""
        force, torque, normal_force = load.tangential_length, abs(load.spin_torque), load.normal_force
        if not (math.isfinite(force + torque + normal_force) and normal_force > 0.0):
            return
        # quickly past what was borne before in about this direction: a finer step tells nothing
        median = self._median
        ratio = median.load_ratio(normal_force, force, torque)
        angle = math.atan2(torque, force * median.spin_length_at(normal_force))
        at = min(int(angle / (0.5 * math.pi) * DIRECTIONS), DIRECTIONS - 1)
        if ratio <= self._hardest[at] * (1.0 + 0.25 * self._s):
            return
        log_ratio = self._log_ratio(normal_force, force, torque)
        if log_ratio is None or float(log_ratio.min()) > 3.0 * self._s:
            return  # beyond all that friction may be: a contact that was misread, no strength
        self._hardest[at] = ratio
        np.minimum(self._held, log_ndtr(-log_ratio / self._width), out=self._held)
        self._weights = None

    def slipped(self, load: ContactLoad) -> None:
        """Take note that a contact slips under a load: as detected by `ExcitedSlip`, not by a margin."""
        force, torque, normal_force = load.tangential_length, abs(load.spin_torque), load.normal_force
        if not (math.isfinite(force + torque + normal_force) and normal_force > 0.0):
            return
        log_ratio = self._log_ratio(normal_force, force, torque)
        if log_ratio is None:
            return
        # friction at most 3 s above what this load shows
        if float(self._believed()[log_ratio >= -3.0 * self._s].sum()) < INCREDIBLE:
            self._log_likelihood = self._normal(CHANGED, CHANGED)
            self._held[:] = 0.0
            self._hardest = [0.0] * DIRECTIONS
        density = (1.0 - FALSE_ALARM) * np.exp(-0.5 * (log_ratio / self._width) ** 2) * self._s / self._width
        # a false alarm comes below the surface, anywhere within its capacity
        density += FALSE_ALARM * np.exp(-np.abs(np.minimum(log_ratio, 0.0))) * (log_ratio < 0.0)
        self._log_likelihood = self._log_likelihood + np.log(density + 1e-30)
        self._log_likelihood -= self._log_likelihood.max()
        self._weights = None

    def quantile(self, probability: float) -> LimitSurface:
        """Return the surface with that quantile of mu, and of what torque it bears, mu c.

        At 0.5 it is the best estimate, at 0.02 friction is larger with a probability of 98 %, in either direction.

        Args:
            probability: Above 0, below 1.

        Raises:
            InvalidValueError: It is not.
        """
        if not 0.0 < probability < 1.0:
            raise InvalidValueError(f"probability = {probability!r}: must lie between 0 and 1")
        weights = self._believed()
        friction = math.exp(_quantile(self._log_mu, weights.sum(axis=1), probability))
        torque = math.exp(_quantile(self._log_torque, weights.sum(axis=0), probability))
        median = self._median
        return LimitSurface(friction, torque / friction, median.load_exponent, median.norm_exponent)

    @property
    def friction_deviation(self) -> float:
        """Standard deviation of log mu now."""
        return _deviation(self._log_mu[:, None], self._believed())

    @property
    def spin_length_deviation(self) -> float:
        """Standard deviation of log c now."""
        return _deviation(self._log_torque[None, :] - self._log_mu[:, None], self._believed())

    def _normal(self, friction_deviation: float, spin_length_deviation: float) -> FloatArray:
        """Log of a prior about the median, shape (NODES, NODES)."""
        a = (self._log_mu - math.log(self._median.friction))[:, None]
        b = self._log_torque[None, :] - self._log_mu[:, None] - math.log(self._median.spin_length)
        # nodes are not even: each stands for its cell
        prior: FloatArray = (
            self._cells - 0.5 * (a / friction_deviation) ** 2 - 0.5 * (b / spin_length_deviation) ** 2
        )
        return prior

    def _believed(self) -> FloatArray:
        """Probability of each node, shape (NODES, NODES)."""
        if self._weights is None:
            both = self._log_likelihood + self._held
            weights: FloatArray = np.exp(both - both.max())
            weights /= weights.sum()
            self._weights = weights
            return weights
        return self._weights

    def _log_ratio(self, normal_force: float, force: float, torque: float) -> FloatArray | None:
        """Log of the load ratio on each node's surface, shape (NODES, NODES); None without load."""
        p, gamma = self._median.norm_exponent, self._median.load_exponent
        if force == 0.0 and torque == 0.0:
            return None
        pressed = math.log(normal_force)
        by_force = p * (_log(force) - pressed - self._log_mu)
        by_torque = p * (_log(torque) - (1.0 + gamma) * pressed - self._log_torque)
        # in logarithms throughout: the powers of a load that hardly presses overflow
        ratio: FloatArray = np.logaddexp(by_force[:, None], by_torque[None, :]) / p
        return ratio


def _log(value: float) -> float:
    """Logarithm of what is 0 or above."""
    return math.log(value) if value > 0.0 else -math.inf


def _axis(deviation: float) -> FloatArray:
    """Nodes about a median in the logarithm: close where the prior is, and down to a quarter of it."""
    middle = np.linspace(-REACH, REACH, NODES - BELOW) * deviation
    lowest = min(-MIN_REACH, middle[0] - math.log(2.0))
    below = np.linspace(lowest, middle[0], BELOW, endpoint=False)
    nodes: FloatArray = np.concatenate([below, middle])
    return nodes


def _quantile(values: FloatArray, weights: FloatArray, probability: float) -> float:
    """Quantile of sorted values, by linear interpolation of the cumulated weights at their middles."""
    total = np.cumsum(weights)
    return float(np.interp(probability, total - 0.5 * weights, values))


def _deviation(values: FloatArray, weights: FloatArray) -> float:
    """Standard deviation of values with weights that sum to 1."""
    mean = float((values * weights).sum())
    return math.sqrt(float(((values - mean) ** 2 * weights).sum()))
