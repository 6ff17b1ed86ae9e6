"""Least squares whose zero drifts: the drift, jumps of it and bad poses are part of the model where the data ask.

The rows of the regression are poses in the order in which they were taken. Their noise is white, plus a zero that
walks at random (first differences are white) or bends at random (second differences are). The discrete cosine
transform diagonalises both (Strang 1999, SIAM Review 41: the DCT-II is the basis of differences with free ends),
so that generalised least squares is a weight for each frequency; frequency 0 is the constant zero, and drops out.
The ratio of drift to noise has the largest likelihood, but for its error. Which kind of drift: by BIC (Schwarz
1978), and none unless the evidence against it is strong. Bad poses and jumps are found one by one, worst first,
by exact F-tests.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.fft import dct, idct
from scipy.special import fdtrc

from palpate.errors import FloatArray

STRONG = 10.0
"""Difference of BIC from which evidence is very strong (Kass & Raftery 1995, J. Am. Statistical Association)."""

RARE = 1e-3
"""Probability, for all poses together, below which a pose is bad or the zero has jumped."""

FEWEST_FOR_DRIFT = 8
"""Poses. With fewer nothing in time can be tested."""

EVENTS = 1 / 6
"""Of the poses may be bad or jumps: more are no exceptions."""

SMALLEST_NOISE = 1e-2
"""Of the noise that was given: what is smaller is rounding, and nothing is read from it."""

ONE_SD = 1.0
"""Of -2 log likelihood: one standard deviation of the ratio of drift to noise."""

BLIND = 1e-9
"""Of its own length: a column with no more left beside the others says nothing."""


class ZeroDrift(StrEnum):
    """How the zero of a sensor moves from pose to pose."""

    NONE = "none"
    LINEAR = "linear"
    WALK = "random walk"
    SMOOTH = "smooth"


POWER = {ZeroDrift.NONE: 0, ZeroDrift.LINEAR: 0, ZeroDrift.WALK: 1, ZeroDrift.SMOOTH: 2}
"""Order of the differences that are white."""


POLYNOMIAL = {ZeroDrift.NONE: 0, ZeroDrift.LINEAR: 1, ZeroDrift.WALK: 0, ZeroDrift.SMOOTH: 2}
"""Degree of the polynomial in time beside it: cosines have no slope at their ends, what is smooth has two."""


@dataclass(frozen=True, slots=True, eq=False)
class Zero:
    """What moves the zero.

    Attributes:
        drift: Its kind.
        bad: Poses that are left out.
        jumps: Poses before which the zero jumped.
    """

    drift: ZeroDrift = ZeroDrift.NONE
    bad: tuple[int, ...] = ()
    jumps: tuple[int, ...] = ()

    @property
    def moves(self) -> bool:
        """Whether the zero is another one at another pose."""
        return self.drift is not ZeroDrift.NONE or bool(self.jumps)

    def columns(self, n: int) -> FloatArray:
        """Return what the zero is a sum of, beside a constant and what is random, shape (n, k)."""
        powers = range(1, 1 + POLYNOMIAL[self.drift])
        polynomial = [np.linspace(-1.0, 1.0, n) ** k for k in powers]
        bad = [np.eye(1, n, i)[0] for i in self.bad]
        jumps = [(np.arange(n) >= i).astype(float) for i in self.jumps]
        return np.array([*polynomial, *bad, *jumps]).reshape(-1, n).T


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """A regression y = X theta + zero + noise, whose rows are white once more, and free of the zero.

    Attributes:
        theta: Shape (p,).
        information: X'X, shape (p, p): its inverse times the variance of the noise is the covariance.
        left: Residuals, shape (n - 1, d), by frequency.
        design: Shape (n - 1, d, p), by frequency.
        basis: Orthonormal columns that the zero took, shape (n - 1, k).
        weight: Root of the weight of each frequency, shape (n - 1,).
        freedom: Degrees of freedom of the residuals.
        floor: Smallest sum of squares that is no rounding.
    """

    theta: FloatArray
    information: FloatArray
    left: FloatArray
    design: FloatArray
    basis: FloatArray
    weight: FloatArray
    freedom: int
    floor: float

    @property
    def variance(self) -> float:
        """Of the white noise, from the residuals."""
        return float((self.left**2).sum()) / max(self.freedom, 1)

    @property
    def cost(self) -> float:
        """-2 log of the largest likelihood, but for a constant."""
        n, d = self.left.shape
        power = float((self.left**2).sum()) + self.floor
        return float(n * d * math.log(power / (n * d)) - 2.0 * d * float(np.log(self.weight).sum()))

    def in_time(self) -> FloatArray:
        """Return the white residuals in the order of the poses, shape (n, d)."""
        return _in_time(self.left)

    def scores(self) -> FloatArray:
        """Return what each pose contributes to the normal equations, shape (n, p)."""
        n, d, p = self.design.shape
        design = _in_time(self.design.reshape(n, d * p)).reshape(n + 1, d, p)
        return np.asarray((design * self.in_time()[:, :, None]).sum(axis=1))

    def of_events(self, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return unit columns of shape (n - 1, k) for events of shape (n, k), free of the zero, and their rarity.

        The rarity is the probability with which white noise would show as much there or more, shape (k,).
        """
        moved = self.weight[:, None] * _by_frequency(columns)
        own = moved - self.basis @ (self.basis.T @ moved)
        length = np.linalg.norm(own, axis=0)
        seen = length > math.sqrt(BLIND) * np.linalg.norm(moved, axis=0)
        unit = np.where(seen, own / np.where(seen, length, 1.0), 0.0)
        d = self.left.shape[1]
        explained = ((unit.T @ self.left) ** 2).sum(axis=1)
        rest = np.maximum(float((self.left**2).sum()) - explained, 0.0) + self.floor
        free = self.freedom - d
        if free < d:
            return unit, np.ones(len(explained))
        return unit, np.asarray(fdtrc(d, free, explained / d / (rest / free)))


def whitened(design: FloatArray, y: FloatArray, zero: Zero, ratio: float, noise: float) -> Whitened:
    """Return the regression with a zero of that kind.

    Args:
        design: Shape (n, d, p).
        y: Shape (n, d).
        zero: What moves the zero.
        ratio: Variance of the drift's differences in units of the noise's variance.
        noise: Standard deviation as given.
    """
    n, d, p = design.shape
    weight = 1.0 / np.sqrt(1.0 + ratio / _differences(n) ** POWER[zero.drift]) if ratio else np.ones(n - 1)
    columns = weight[:, None] * _by_frequency(zero.columns(n))
    basis = np.linalg.qr(columns)[0] if columns.shape[1] else np.zeros((n - 1, 0))
    rows = weight[:, None] * _by_frequency(np.concatenate([design.reshape(n, d * p), y], axis=1))
    rows = rows - basis @ (basis.T @ rows)
    X = rows[:, : d * p].reshape(n - 1, d, p)
    Y = rows[:, d * p :]
    flat = X.reshape(-1, p)
    information = flat.T @ flat
    theta = np.asarray(np.linalg.lstsq(flat, Y.ravel())[0], dtype=np.float64)
    freedom = d * (n - 1 - basis.shape[1]) - p
    return Whitened(
        theta, information, Y - X @ theta, X, basis, weight, freedom, d * n * (SMALLEST_NOISE * noise) ** 2
    )


def best_ratio(design: FloatArray, y: FloatArray, zero: Zero, noise: float) -> tuple[Whitened, float]:
    """Return the regression with a ratio of drift to noise, and that ratio.

    It is one standard deviation above the likeliest: taken as known, that would make intervals too narrow.
    """
    power = POWER[zero.drift]
    if power == 0:
        return whitened(design, y, zero, 0.0, noise), 0.0
    n = len(y)
    # from nothing at the slowest frequency to nothing but drift at the fastest
    low, high = math.log10(0.03 * (math.pi / n) ** (2 * power)), math.log10(1e4 * 4.0**power)
    tried = {x: whitened(design, y, zero, 10.0**x, noise) for x in np.linspace(low, high, 15)}
    step = (high - low) / 14
    while step > 0.05:
        step /= 3.0
        at = min(tried, key=lambda x: tried[x].cost)
        tried |= {x: whitened(design, y, zero, 10.0**x, noise) for x in (at - step, at + step) if low <= x <= high}
    least = min(fit.cost for fit in tried.values())
    at = max(x for x, fit in tried.items() if fit.cost <= least + ONE_SD)
    return tried[at], 10.0**at


@dataclass(frozen=True, slots=True, eq=False)
class Explained:
    """Forces and moments with the zero that explains them.

    Attributes:
        zero: Of both.
        force: Of the forces.
        moment: Of the moments.
        bic: Schwarz' criterion: smaller is better.
    """

    zero: Zero
    force: Whitened
    moment: Whitened
    bic: float


Block = tuple[FloatArray, FloatArray, float]
"""Design (n, 3, p), data (n, 3), noise."""


def explained(force: Block, moment: Block) -> Explained:
    """Return the regressions with the zero that has the best evidence."""
    n = len(force[1])
    still = _with_events(force, moment, ZeroDrift.NONE)
    if n < FEWEST_FOR_DRIFT:
        return still
    drifting = [_with_events(force, moment, kind) for kind in ZeroDrift if kind is not ZeroDrift.NONE]
    best = min(drifting, key=lambda found: found.bic)
    return best if best.bic < still.bic - STRONG else still


def zero_in_time(fit: Whitened, design: FloatArray, y: FloatArray, zero: Zero) -> tuple[FloatArray, FloatArray]:
    """Return the zero at each pose, and the residual of each, shape (n, 3) both; bad poses show all they have."""
    n = len(y)
    raw = y - design @ fit.theta
    columns = zero.columns(n)
    by_frequency = _by_frequency(raw)
    solved = np.linalg.lstsq(fit.weight[:, None] * _by_frequency(columns), fit.weight[:, None] * by_frequency)[0]
    events = columns @ solved
    free = _by_frequency(raw - events)
    white = _in_time(fit.weight[:, None] ** 2 * free)
    exceptions = np.zeros_like(raw)
    first = columns.shape[1] - len(zero.bad) - len(zero.jumps)
    exceptions[list(zero.bad)] = solved[first : first + len(zero.bad)]
    residual = white + exceptions
    return raw - residual, residual


def _with_events(force: Block, moment: Block, drift: ZeroDrift) -> Explained:
    n = len(force[1])
    zero = Zero(drift)
    most = int(EVENTS * n) if n >= FEWEST_FOR_DRIFT else 0
    candidates = np.hstack([np.eye(n), np.tril(np.ones((n, n)))[:, 1:]])
    while True:
        f, _ = best_ratio(force[0], force[1], zero, force[2])
        m, _ = best_ratio(moment[0], moment[1], zero, moment[2])
        if len(zero.bad) + len(zero.jumps) >= most:
            break
        rarity = 2.0 * np.minimum(f.of_events(candidates)[1], m.of_events(candidates)[1]) * candidates.shape[1]
        worst = int(np.argmin(rarity))
        if rarity[worst] >= RARE:
            break
        if worst < n:
            zero = Zero(drift, (*zero.bad, worst), zero.jumps)
        else:
            zero = Zero(drift, zero.bad, (*zero.jumps, worst - n + 1))
    events = len(zero.bad) + len(zero.jumps)
    parameters = 6 * events + 6 * POLYNOMIAL[drift] + 2 * (POWER[drift] > 0)
    # where an event is counts as a parameter, too
    bic = f.cost + m.cost + (parameters + events) * math.log(6.0 * n)
    return Explained(zero, f, m, bic)


def _differences(n: int) -> FloatArray:
    """Return the squared length of the differences of each cosine but the constant, shape (n - 1,)."""
    return np.asarray(2.0 - 2.0 * np.cos(np.pi * np.arange(1, n) / n))


def _by_frequency(columns: FloatArray) -> FloatArray:
    return np.asarray(dct(columns, axis=0, norm="ortho")[1:])


def _in_time(rows: FloatArray) -> FloatArray:
    return np.asarray(idct(np.vstack([np.zeros(rows.shape[1]), rows]), axis=0, norm="ortho"))
