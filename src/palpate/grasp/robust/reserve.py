"""The reserve of each contact, and the grasp with limits reduced by it, compiled."""

import math
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.grasp.robust.joint_probability import joint_deviations
from palpate.grasp.robust.sharing import spread
from palpate.grasp.solvers.dual_newton import MU, E

MIN_SPIN_SHARE = 0.05
"""An e is never taken for less than this share of its mean: a normal distribution's tail would go below zero."""

EMPTY = 1e-4
"""A contact that bears less than this share of the largest normal force bears nothing."""

PLAIN = 3
"""Searches that take each guess as it comes: far from the end secants lead astray."""

MIN_SLOPE, MAX_SLOPE = -2.0, -0.3
"""Slopes, over e, of how far an e is from the next guess: -1 where the guess does not depend on it."""

ACTIVE_MARGIN = 1e-6
"""Margin, over the largest normal force, below which a limit holds forces back."""

FOUND = 1e-3
"""Largest change of an e, over the largest, at which the search ends."""


@njit(cache=True, error_model="numpy")
def size_of(forces: Any, lengths: Any, out: Any) -> None:
    """Fill out (n,) with |(f_t, tau / e)| of each contact [N]."""
    for i in range(out.shape[0]):
        out[i] = math.sqrt(forces[i, 1] ** 2 + forces[i, 2] ** 2 + (forces[i, 3] / lengths[i]) ** 2)


@njit(cache=True, error_model="numpy")
def spare_kernel(
    rows: Any,
    forces: Any,
    friction: Any,
    taken: Any,
    constant: Any,
    next_friction: Any,
    next_taken: Any,
    next_constant: Any,
    reserve: Any,
) -> tuple[float, float]:
    """Return the least margin beyond the reserve, and the slack of the limits that hold forces back [N].

    Args:
        rows: As in `reserve_kernel`.
        forces: As there.
        friction: mu that the forces took for granted, (n,).
        taken: e, likewise, scaled.
        constant: Share of each limit that they kept back besides [N].
        next_friction: mu that they want to be taken for granted.
        next_taken: e, likewise.
        next_constant: Share of each limit.
        reserve: That they want [N].
    """
    n, most = rows.shape[0], 0.0
    spare, slack = math.inf, 0.0
    for i in range(n):
        most = max(most, forces[i, 0])
    for i in range(n):
        f, slide, spin = forces[i, 0], forces[i, 1] ** 2 + forces[i, 2] ** 2, forces[i, 3]
        spare = min(spare, rows[i, MU] * f - math.sqrt(slide + (spin / rows[i, E]) ** 2) - reserve[i])
        if friction[i] * f - math.sqrt(slide + (spin / taken[i]) ** 2) - constant[i] <= ACTIVE_MARGIN * most:
            slack = max(
                slack, next_friction[i] * f - math.sqrt(slide + (spin / next_taken[i]) ** 2) - next_constant[i]
            )
    return spare, slack


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
    1974), not at its mean: e may well be half of that, and 1 / e is not straight over such a range.

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
    f, u, e, mu = np.empty(n), np.empty((n, 3)), np.empty(n), np.empty(n)
    lengths, likeliest, believed, size = start.copy(), start.copy(), np.empty(n), np.empty(n)
    variance, bias, step, gap = np.empty(n), np.empty(n), np.zeros(n), np.zeros(n)
    most, longest = 0.0, 0.0
    for i in range(n):
        f[i], u[i, 0], u[i, 1] = forces[i, 0], forces[i, 1], forces[i, 2]
        e[i], mu[i] = rows[i, E], rows[i, MU]
        most, longest = max(most, f[i]), max(longest, e[i])
    size_of(forces, e, believed)
    search = 0
    while True:
        for i in range(n):
            step[i] = max(step[i], MIN_SPIN_SHARE * e[i] - lengths[i])
            lengths[i] += step[i]
            u[i, 2] = forces[i, 3] / lengths[i]
        size_of(forces, lengths, size)
        covariance, of_mu, turning, together, rule, of_e, slope = spread(
            rows, f, u, lengths, cov_mu, cov_e, cov_p, cov_n, cov_load
        )
        beta = joint_deviations(covariance, failures)
        for i in range(n):
            own, s = covariance[i, i], size[i]
            # friction that turns aside grows: by how far it has where the margin fails, and by what is still open
            square = turning[i] + ((beta**2 - 1.0) * together[i] / own if own > 0.0 else 0.0)
            bias[i] = math.sqrt(max(s * s + square, 0.0)) - s
            variance[i] = own + (math.sqrt(s * s + turning[i]) - s) ** 2
            per = beta / math.sqrt(variance[i]) if variance[i] > 0.0 else 0.0
            likeliest[i] = max(e[i] - per * of_e[i], MIN_SPIN_SHARE * e[i])
        search += 1
        moved = 0.0
        for i in range(n):
            left = likeliest[i] - lengths[i]
            moved = max(moved, abs(left))
            # the secant of what is left, each contact by itself: a plain step creeps, or swings to and fro
            slope_left = (left - gap[i]) / step[i] if search >= PLAIN and step[i] != 0.0 else -1.0
            gap[i], step[i] = left, -left / min(max(slope_left, MIN_SLOPE), MAX_SLOPE)
        if search >= searches or moved <= FOUND * longest:
            break
    friction, taken, constant, reserve = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    lower = np.empty(n)
    for i in range(n):
        # the tangent of |(f_t, tau / e)| at the likeliest e starts so much lower, and it curves up from there
        opened = cov_e[i, i] - (of_e[i] ** 2 / variance[i] if variance[i] > 0.0 else 0.0)
        along = slope[i] * lengths[i] / size[i] if size[i] > 0.0 else 0.0
        curved = 0.5 * max(opened, 0.0) * slope[i] / lengths[i] * (3.0 - along)
        lower[i] = curved - (believed[i] - size[i] + slope[i] * (e[i] - lengths[i]))
    for i in range(n):
        sd = math.sqrt(variance[i])
        wanted = beta * sd + bias[i]
        for j in range(n):
            wanted += rule[i, j] * lower[j]
        reserve[i] = max(wanted, 0.0)
        taken[i] = e[i] - min(max(rule[i, i], 0.0), 1.0) * (e[i] - likeliest[i])
        # what grows with a contact's own force comes off its mu and e; the rest does not, or not with it alone
        lost = beta * of_mu[i] / sd if sd > 0.0 else 0.0
        if f[i] <= EMPTY * most:
            lost = beta * math.sqrt(cov_mu[i, i])
        spun = math.sqrt(forces[i, 1] ** 2 + forces[i, 2] ** 2 + (forces[i, 3] / taken[i]) ** 2) - believed[i]
        constant[i] = max(reserve[i] - lost * f[i] - spun, 0.0)
        friction[i] = mu[i] - lost
    return friction, taken, constant, likeliest, reserve, beta
