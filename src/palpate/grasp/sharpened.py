"""Multipliers that prove a load impossible though it is beyond the boundary by a ten-thousand-millionth only.

Where a load is as large as can be, multipliers y minimise what all contacts together bear,

    sum max_f f (mu |g_u| - g_n),   g = A'y,   y . load = 1.

An interior point finds them to its tolerance, which is what its proof falls short by: the sum has a kink wherever
a normal force is between its bounds (mu |g_u| = g_n), and where friction is within its cone (g_u = 0). These kinks
are read off, by which of force and slope is the smaller, and held as equations; Newton's method on what is left
takes y to rounding. Nothing is claimed here: whether y proves anything is for `certified_reach` to say.
"""

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.dual_newton import HI, LO, MU, T1, T2, E, N, P

__all__ = ["sharpened"]

STEPS = 8
"""Four are usual."""

ASIDE = 4e-16
"""By so much of the largest slope kinks are passed on the side where rounding cannot make a force pay."""


def sharpened(rows: FloatArray, load: FloatArray, forces: FloatArray, y: FloatArray) -> FloatArray | None:
    """Return multipliers nearer to the best by orders of magnitude; None where equations exclude each other.

    Args:
        rows: Contacts, shape (n, ROW), all scaled.
        load: Scaled, shape (6,).
        forces: Nearly those of the largest multiple of the load, scaled (f, u1, u2, u3), shape (n, 4).
        y: Nearly its multipliers, shape (6,).
    """
    if not (np.isfinite(y).all() and abs(y @ load) > 0.0):
        return None
    columns, y = _columns(rows), y / (y @ load)
    mu, lo, hi = rows[:, MU], rows[:, LO], rows[:, HI]
    slopes = columns @ y
    unit, steep = max(float(forces[:, 0].max()), 1e-300), float(np.abs(slopes).max())
    pays = mu * np.linalg.norm(slopes[:, 1:], axis=1) - slopes[:, 0]
    inside = (mu * forces[:, 0] - np.linalg.norm(forces[:, 1:], axis=1)) / unit > np.linalg.norm(
        slopes[:, 1:], axis=1
    ) / steep
    most = (pays > 0.0) & (pays / steep > (hi - forces[:, 0]) / unit)
    least = (pays <= 0.0) & (-pays / steep > (forces[:, 0] - lo) / unit)
    between, bound = ~(most | least), np.where(most, hi, np.where(least, lo, 0.0))
    pressed = np.where(between, forces[:, 0], bound)
    aside = ASIDE * steep
    fixed, wanted = [load], [1.0]
    for i in np.flatnonzero(inside & (pressed > 0.0)):
        fixed += list(columns[i, 1:])
        wanted += [0.0] * 3
        if between[i]:
            fixed.append(columns[i, 0])
            wanted.append(aside)
    kinks = np.flatnonzero(between & ~inside)
    for _ in range(STEPS):
        slopes = columns @ y
        size = np.linalg.norm(slopes[:, 1:], axis=1)
        slides = ~inside & (size > 0.0)
        toward = np.where(slides, 1.0 / np.where(size > 0.0, size, 1.0), 0.0)[:, None] * slopes[:, 1:]
        # of mu |g_u| - g_n
        gradient = mu[:, None] * np.einsum("ikr,ik->ir", columns[:, 1:], toward) - columns[:, 0]
        curved = np.zeros((6, 6))
        for i in np.flatnonzero(slides & (pressed > 0.0)):
            across = columns[i, 1:] - np.outer(toward[i], toward[i] @ columns[i, 1:])
            curved += pressed[i] * mu[i] / size[i] * across.T @ across
        equations = np.vstack([*fixed, *gradient[kinks]])
        left = np.concatenate(
            [
                np.array(wanted) - np.array(fixed) @ y,
                -(mu[kinks] * size[kinks] - slopes[kinks, 0] + aside),
            ]
        )
        k = len(left)
        whole = np.block([[curved, equations.T], [equations, np.zeros((k, k))]])
        try:
            step = np.linalg.lstsq(whole, np.concatenate([-(bound @ gradient), left]), rcond=1e-13)[0]
        except np.linalg.LinAlgError:
            return None
        y = y + step[:6]
        pressed[kinks] = np.maximum(step[6 + k - len(kinks) :], 0.0)
    return y if np.isfinite(y).all() else None


def _columns(rows: FloatArray) -> FloatArray:
    """Return the wrenches of (f, u1, u2, u3) of each contact, scaled, shape (n, 4, 6)."""
    out = np.zeros((len(rows), 4, 6))
    for k, start in enumerate((N, T1, T2)):
        out[:, k, :3] = rows[:, start : start + 3]
        out[:, k, 3:] = np.cross(rows[:, P : P + 3], rows[:, start : start + 3])
    out[:, 3, 3:] = rows[:, [E]] * rows[:, N : N + 3]
    return out
