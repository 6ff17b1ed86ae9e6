"""Where a convex tip touches a point, a line or a plane.

With y the target in the tip's frame, the gap is
    max over u of u.y - h(u),
u over all directions for a point, those at right angles to a line, or the one against a plane's normal: the
distance of separating planes. The maximum is found by Newton's method on the sphere of u; it is negative where the
target lies inside, by as much as the skin gives way.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.sensing.tip_calibration.targets import across

SupportAt = Callable[[FloatArray, npt.NDArray[np.intp]], tuple[FloatArray, FloatArray]]
"""(unit normals (m, 3), rows (m,)) -> h (m,), x (m, 3): of the tips in those rows, about their frames' origins."""

STEPS = 60
"""Newton's method needs 4 to 8; a corner of a superellipsoid some 30."""

DIFFERENCE = 1e-6
"""[rad] by which x(u) is differenced: curvature steers the iteration, not its result."""

LONGEST = 0.5
"""[rad] of a step."""

CLOSE = 1e-8
"""[rad] of a step that ends the iteration: what is left is its square."""


def touching(
    support: SupportAt, y: FloatArray, start: FloatArray, freedom: npt.NDArray[np.intp], line: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return normal, gap and point of n tips that touch.

    Args:
        support: Of the tips.
        y: Of the targets, in the tips' frames, shape (n, 3) [m].
        start: Unit normals to start from, which keep to the targets' directions, shape (n, 3).
        freedom: In how many directions u may turn: 2 for a point, 1 for a line, 0 for a plane, shape (n,).
        line: Of a line, its unit direction in the tip's frame; of no matter otherwise; shape (n, 3).

    Returns:
        u (n, 3), gap (n,) [m], x(u) (n, 3) [m].
    """
    u = start.copy()
    rows = np.arange(len(u))
    h, x = support(u, rows)
    gap = np.einsum("ni,ni->n", u, y) - h
    active = rows[freedom > 0]
    for _ in range(STEPS):
        if not len(active):
            break
        tangents = turning(u[active], freedom[active], line[active])
        slope = np.einsum("nki,ni->nk", tangents, y[active] - x[active])
        curvature = np.zeros((len(active), 2, 2))
        for k in range(2):
            ahead, behind = (
                support(_unit(u[active] + sign * DIFFERENCE * tangents[:, k]), active)[1] for sign in (1.0, -1.0)
            )
            curvature[:, :, k] = np.einsum("nli,ni->nl", tangents, ahead - behind) / (2.0 * DIFFERENCE)
        curvature = 0.5 * (curvature + curvature.transpose(0, 2, 1)) + gap[active, None, None] * np.eye(2)
        # what cannot turn gets any curvature; one that is not positive means a start too far off
        scale = np.abs(curvature).max(axis=(1, 2), initial=1e-9)
        still = np.linalg.norm(tangents, axis=2) == 0.0
        curvature[:, range(2), range(2)] += np.where(still, scale[:, None], 0.0)
        least = np.linalg.eigvalsh(curvature)[:, 0]
        curvature += np.maximum(0.0, 1e-7 * scale - least)[:, None, None] * np.eye(2)
        step = np.linalg.solve(curvature, slope[:, :, None])[:, :, 0]
        length = np.linalg.norm(step, axis=1)
        step *= np.minimum(1.0, LONGEST / np.maximum(length, LONGEST))[:, None]
        moved = np.einsum("nk,nki->ni", step, tangents)
        factor = np.ones(len(active))
        tried, higher, at = u[active], gap[active], x[active]
        for _ in range(12):  # never downhill
            tried = _unit(u[active] + factor[:, None] * moved)
            h, at = support(tried, active)
            higher = np.einsum("ni,ni->n", tried, y[active]) - h
            worse = higher < gap[active] - 1e-15
            if not worse.any():
                break
            factor[worse] *= 0.5
        u[active], x[active], gap[active] = tried, at, np.maximum(higher, gap[active] - 1e-15)
        active = active[np.minimum(length, LONGEST) > CLOSE]
    return u, gap, x


def turning(u: FloatArray, freedom: npt.NDArray[np.intp], line: FloatArray) -> FloatArray:
    """Return the directions in which u may turn, shape (n, 2, 3): unit vectors or zeros; see `touching`."""
    found = across(u)
    found[freedom == 1, 0] = np.cross(line[freedom == 1], u[freedom == 1])
    found[freedom < 2, 1] = 0.0
    found[freedom < 1, 0] = 0.0
    return found


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
