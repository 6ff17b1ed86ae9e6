"""Cones of 16 facets, and an active-set method for the quadratic programme that is left: daqp."""

from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from grasp_forces.problem import WEIGHT, Answer, Ended, Load, Problem
from palpate.errors import FloatArray

FACETS = 16
EQUATION = 5
"""daqp's word for a row that always holds with equality."""
RELAX, STEP = 2000, 0.05


def directions(count: int = FACETS) -> FloatArray:
    """Return unit vectors that repel each other, shape (count, 3): the facets' normals."""
    k = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    out = np.column_stack([np.sqrt(1.0 - z * z) * np.cos(angle), np.sqrt(1.0 - z * z) * np.sin(angle), z])
    for _ in range(RELAX):
        apart = out[:, None] - out
        cube = (apart**2).sum(axis=2) ** 1.5 + np.eye(count)
        out += STEP / count * (apart / cube[..., None]).sum(axis=1)
        out /= np.linalg.norm(out, axis=1)[:, None]
    return out


def inner_radius(facets: FloatArray) -> float:
    """Return the distance of the facets at which the polytope's vertices lie on the unit sphere."""
    # the polytope's vertices are the hull's faces turned inside out
    return float(-ConvexHull(facets).equations[:, 3].max())


NORMALS = directions()
RADIUS = inner_radius(NORMALS)


class FacetsDaqp:
    """daqp on 16 facets a.u <= RADIUS mu f a contact, inside the cone; warm from its last active set."""

    def __init__(self, problem: Problem) -> None:
        import daqp

        n = len(problem)
        self._n = n
        facets = np.hstack([np.full((FACETS, 1), -RADIUS), NORMALS])
        blocks = np.zeros((n, FACETS, n, 4))
        for i in range(n):
            blocks[i, :, i] = facets * [problem.friction[i], 1.0, 1.0, 1.0]
        self._rows = np.ascontiguousarray(np.vstack([problem.columns, blocks.reshape(-1, 4 * n)]))
        large = 1e30  # daqp's infinity
        bounds = np.full((2, 4 * n), large)
        bounds[0, ::4], bounds[1, ::4] = np.minimum(problem.most, large), -problem.least
        self._upper = np.concatenate([bounds[0], np.zeros(6), np.zeros(FACETS * n)])
        self._lower = np.concatenate([-bounds[1], np.zeros(6), np.full(FACETS * n, -large)])
        self._sense = np.zeros(len(self._upper), np.int32)
        self._sense[4 * n : 4 * n + 6] = EQUATION
        self._quadratic = np.diag(np.tile([2.0, *[2.0 * WEIGHT] * 3], n))
        self._kind, self._model, self._found = daqp.Model, None, None

    _model: Any
    _found: Any

    def solve(self, load: Load, *, warm: bool) -> None:
        n = self._n
        self._upper[4 * n : 4 * n + 6] = self._lower[4 * n : 4 * n + 6] = -load.scaled
        if not warm or self._model is None:
            self._model = self._kind()
            linear = np.zeros(4 * n)
            self._model.setup(self._quadratic, linear, self._rows, self._upper, self._lower, self._sense)
        else:
            self._model.update(bupper=self._upper, blower=self._lower)
        self._found = self._model.solve()

    def answer(self) -> Answer:
        x, _, flag, info = self._found
        ended = {1: Ended.SOLVED, -1: Ended.INFEASIBLE}.get(flag, Ended.UNDECIDED)
        return Answer(ended, np.array(x).reshape(-1, 4), evaluations=info.get("iterations", 0))
