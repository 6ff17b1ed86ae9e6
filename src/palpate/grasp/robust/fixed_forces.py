"""How probably planned forces, as they are, lie within every contact's own true limit.

A limit |(f_t, tau / e)| <= mu f_n knows two errors, that of mu and that of e. Of one contact the probability is an
integral over one of them, of the other's normal distribution: over the one that moves the margin more, so that the
integrand is smooth. How contacts fail together is known only as far as margins are straight; what is told is the
better of two bounds, of which the first needs nothing of that: the sum of all failures, and Hunter's
(`joint_probability`) with every contact as weak as the weakest.
"""

import math
from typing import Any

import numpy as np
from scipy.special import ndtri

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.grasp.robust.joint_probability import failing, tree_ratios

__all__ = ["probability_within_limits"]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(32)
"""Over `TAIL` standard deviations to either side: leaves 1e-5."""

TAIL = 6.5
"""[standard deviations]. Beyond lie 1e-10."""

ROUNDING = 1e-9
"""Of the largest normal force: by so much forces may be beyond a limit."""


@njit(cache=True, error_model="numpy")
def _below(x: float, mean: float, deviation: float) -> float:
    """Return the probability that a normal variable is below x."""
    if deviation > 0.0:
        return 0.5 * math.erfc((mean - x) / (deviation * math.sqrt(2.0)))
    return 1.0 if mean < x else 0.0


@njit(cache=True, error_model="numpy")
def _exceeding(f: float, slide: float, spin: float, mu: float, of_mu: float, e: float, of_e: float) -> float:
    """Return with which probability a contact's forces are beyond its limit.

    Args:
        f: Normal force, and what rounding forgives, over mu [N].
        slide: |f_t| [N].
        spin: |tau| [N m].
        mu: Mean.
        of_mu: Standard deviation.
        e: Mean [m].
        of_e: Standard deviation [m].
    """
    if f <= 0.0:
        return 1.0 if slide + spin > 0.0 else 0.0
    if spin == 0.0:
        return _below(slide / f, mu, of_mu)
    size = math.sqrt(slide**2 + (spin / e) ** 2)
    along_e = of_mu * f > spin**2 / (e**3 * size) * of_e
    out = 0.0
    for k in range(NODES.shape[0]):
        z = TAIL * NODES[k]
        if along_e:
            x = e + z * of_e
            fails = _below(math.sqrt(slide**2 + (spin / x) ** 2) / f, mu, of_mu) if x > 0.0 else 1.0
        else:
            left = ((mu + z * of_mu) * f) ** 2 - slide**2 if mu + z * of_mu > 0.0 else -1.0
            fails = _below(spin / math.sqrt(left), e, of_e) if left > 0.0 else 1.0
        out += WEIGHTS[k] * math.exp(-0.5 * z * z) * fails
    return min(TAIL * out / math.sqrt(2.0 * math.pi), 1.0)


@njit(cache=True, error_model="numpy")
def _each(forces: Any, friction: Any, lengths: Any, cov_mu: Any, cov_e: Any, margins: Any) -> Any:
    """Return failures of each contact (n,); fill the covariance of their margins (n, n)."""
    n, most = forces.shape[0], 0.0
    out, slope = np.empty(n), np.zeros(n)
    for i in range(n):
        most = max(most, forces[i, 0])
    for i in range(n):
        f, slide, spin = forces[i, 0], math.hypot(forces[i, 1], forces[i, 2]), abs(forces[i, 3])
        size = math.hypot(slide, spin / lengths[i])
        if size > 0.0:
            slope[i] = spin**2 / (lengths[i] ** 3 * size)
        f += ROUNDING * most / friction[i]
        out[i] = _exceeding(
            f, slide, spin, friction[i], math.sqrt(cov_mu[i, i]), lengths[i], math.sqrt(cov_e[i, i])
        )
    for i in range(n):
        for j in range(n):
            margins[i, j] = forces[i, 0] * cov_mu[i, j] * forces[j, 0] + slope[i] * cov_e[i, j] * slope[j]
    return out


@njit(cache=True, error_model="numpy")
def _any(weakest: float, covariance: Any) -> float:
    """Return Hunter's bound of the failures of all, each as weak as the weakest."""
    return failing(weakest, tree_ratios(covariance))


def probability_within_limits(
    forces: FloatArray, friction: FloatArray, lengths: FloatArray, cov_mu: FloatArray, cov_e: FloatArray
) -> float:
    """Return a lower bound of the probability that forces are within the limits of all contacts.

    Args:
        forces: (f_n, f_t1, f_t2, tau) of each contact, shape (n, 4) [N, N, N, N m].
        friction: mu as believed, shape (n,).
        lengths: e as believed, shape (n,) [m].
        cov_mu: Covariance of mu, shape (n, n).
        cov_e: Of e, shape (n, n) [m^2].
    """
    margins = np.empty((len(forces), len(forces)))
    each = _each(forces, friction, lengths, cov_mu, cov_e, margins)
    weakest, total = float(each.max()), float(each.sum())
    if weakest < total < math.inf and 0.0 < weakest < 1.0:
        total = min(total, _any(-float(ndtri(weakest)), margins))
    return max(1.0 - total, 0.0)
