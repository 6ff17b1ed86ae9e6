"""What each contact keeps back, and the grasp that keeps it back by itself, compiled."""

import math
from typing import Any

import numpy as np
from numba import njit

from palpate.grasp.dual_newton import MU, E
from palpate.grasp.joint_probability import joint_deviations
from palpate.grasp.sharing import spread

SHORTEST = 0.05
"""An e is never taken for less than this share of its mean: a normal distribution's tail would go below zero."""

EMPTY = 1e-4
"""A contact that bears less than this share of the largest normal force bears nothing."""

FOUND = 1e-3
"""Largest change of an e, over the largest, at which the search ends."""


@njit(cache=True, error_model="numpy")
def size_of(forces: Any, lengths: Any) -> Any:
    """Return |(f_t, tau / e)| of each contact, (n,) [N]."""
    return np.sqrt(forces[:, 1] ** 2 + forces[:, 2] ** 2 + (forces[:, 3] / lengths) ** 2)


@njit(cache=True, error_model="numpy")
def _straightened(
    rows: Any,
    forces: Any,
    lengths: Any,
    cov_mu: Any,
    cov_e: Any,
    cov_p: Any,
    cov_n: Any,
    cov_load: Any,
    failures: float,
) -> tuple[Any, float, Any, Any, Any, Any, Any, Any]:
    """Return what margins do that are straightened at e = `lengths`: the next guess of the likeliest e first."""
    u = forces[:, 1:].copy()
    u[:, 2] /= lengths
    covariance, of_mu, turning, together, rule, of_e, slope = spread(
        rows, forces[:, 0].copy(), u, lengths, cov_mu, cov_e, cov_p, cov_n, cov_load
    )
    beta = joint_deviations(covariance, failures)
    size = size_of(forces, lengths)
    # friction that turns aside grows: by how far it has where the margin fails, and by what is open besides
    variance = np.diag(covariance)
    square = turning + (beta**2 - 1.0) * together / np.where(variance > 0.0, variance, 1.0)
    bias = np.sqrt(size**2 + square) - size
    variance = variance + (np.sqrt(size**2 + turning) - size) ** 2
    sd = np.sqrt(variance)
    e = rows[:, E]
    likeliest = np.maximum(e - beta * of_e / np.where(sd > 0.0, sd, 1.0), SHORTEST * e)
    return likeliest, beta, variance, bias, rule, of_mu, of_e, slope


@njit(cache=True, error_model="numpy")
def reserve_kernel(
    rows: Any,
    forces: Any,
    start: Any,
    cov_mu: Any,
    cov_e: Any,
    cov_p: Any,
    cov_n: Any,
    cov_load: Any,
    failures: float,
    searches: int,
) -> tuple[Any, Any, Any, Any, Any, float]:
    """Return mu, e and a constant share that keep back as much; the likeliest failure's e; the reserve; beta.

    |(f_t, tau / e)| is straightened at the e of the failure that is likeliest (the design point of Hasofer & Lind
    1974), not at its mean: e may well be half of that, and 1 / e is not straight over such a way.

    Args:
        rows: Scaled contacts, (n, ROW), mu and e as believed.
        forces: (f_n, f_t1, f_t2, tau over the unit of length), (n, 4) [N].
        start: Guess of the likeliest failure's e, (n,).
        cov_mu: As in `spread`, like those that follow.
        cov_e: Scaled.
        cov_p: Scaled.
        cov_n: Of normals.
        cov_load: Scaled.
        failures: Largest probability that any margin is below zero.
        searches: For the likeliest failure, at most: each looks from where the last one found it.
    """
    n = rows.shape[0]
    f, mu, e = forces[:, 0].copy(), rows[:, MU], rows[:, E]
    believed = size_of(forces, e)
    lengths = start
    at = _straightened(rows, forces, lengths, cov_mu, cov_e, cov_p, cov_n, cov_load, failures)
    for _ in range(searches - 1):
        if np.abs(at[0] - lengths).max() <= FOUND * e.max():
            break
        lengths = at[0]
        at = _straightened(rows, forces, lengths, cov_mu, cov_e, cov_p, cov_n, cov_load, failures)
    likeliest, beta, variance, bias, rule, of_mu, of_e, slope = at
    size, sd = size_of(forces, lengths), np.sqrt(variance)
    per = beta / np.where(sd > 0.0, sd, 1.0)
    # the tangent of |(f_t, tau / e)| at the likeliest e starts so much lower, and it curves up from there
    lower = believed - size + slope * (e - lengths)
    opened = np.maximum(np.diag(cov_e) - of_e**2 / np.where(variance > 0.0, variance, 1.0), 0.0)
    curved = 0.5 * opened * slope / lengths * (3.0 - slope * lengths / np.where(size > 0.0, size, 1.0))
    reserve = np.maximum(beta * sd + bias + rule @ (curved - lower), 0.0)
    taken = e - np.minimum(np.maximum(np.diag(rule), 0.0), 1.0) * (e - likeliest)
    # what grows with a contact's own force comes off its mu and e; the rest does not, or not with that force alone
    lost = per * of_mu
    for i in range(n):
        if f[i] <= EMPTY * f.max():
            lost[i] = beta * math.sqrt(cov_mu[i, i])
    constant = np.maximum(reserve - lost * f - (size_of(forces, taken) - believed), 0.0)
    friction = mu - lost
    return friction, taken, constant, likeliest, reserve, beta
