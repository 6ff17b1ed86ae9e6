"""Grasps whose load moves as in a control loop: 0.1 to 1 % of its size from one period to the next."""

from dataclasses import dataclass

import numpy as np

from grasp_forces.cone_form import ClarabelDirect
from grasp_forces.problem import Ended, Load, Problem
from palpate.errors import FloatArray
from palpate.grasp import Objective
from palpate.grasp.problem.scaled import ScaledGrasp
from support.grasp_families import around, grasp_of

LEAST_STEP, LARGEST_STEP = 1e-3, 1e-2
"""Of the load's size, per period."""
RANGE = 0.5
"""How far the load goes from its first value, over its size."""
STRONGEST = 20.0
"""force_max over the load."""
MOMENT = 0.3
"""Of the load, over its force, lengths in units of the grasp's."""
LARGE, SELDOM = 10, 20
"""Grasps of more contacts are never near their limits: of theirs, one load in so many is tried beforehand."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """A grasp and its loads, period by period; all can be held."""

    problem: Problem
    loads: tuple[Load, ...]


def trajectory(n: int, periods: int, rng: np.random.Generator) -> Trajectory:
    """Draw a grasp of n contacts and a path of loads that it holds."""
    while True:
        found = _drawn(n, periods, rng)
        # judged by a solver that is not palpate's, so that what palpate fails on is not left out
        judge = ClarabelDirect(found.problem, Objective.MIN_EFFORT)
        if all(_holds(judge, load) for load in found.loads[:: 1 if n <= LARGE else SELDOM]):
            return found


def _holds(judge: ClarabelDirect, load: Load) -> bool:
    judge.solve(load, warm=False)
    return judge.answer().ended is Ended.SOLVED


def _drawn(n: int, periods: int, rng: np.random.Generator) -> Trajectory:
    positions, normals = around(n, rng)
    if n == 2:  # two fingers hold only what is between them
        positions[1] = -positions[0]
        normals[1] = -positions[1] / 0.03 + 0.1 * rng.normal(size=3)
    size = 10.0 ** rng.uniform(-1.0, 1.0)
    friction, spin = rng.uniform(0.4, 1.0, n), rng.uniform(0.002, 0.006, n)
    grasp = grasp_of(positions, normals, friction, spin, rng, force_max=STRONGEST * size)
    first = rng.normal(size=6) * np.repeat([1.0, MOMENT], 3)
    first /= np.linalg.norm(first)
    wrenches = []
    away, heading = np.zeros(6), _direction(rng)
    scaling = ScaledGrasp.of(grasp)
    for _ in range(periods):
        wrench = size * (first + away) * np.repeat([1.0, scaling.length], 3)
        wrench[3:] += np.cross(scaling.center, wrench[:3])
        wrenches.append(wrench)
        step = rng.uniform(LEAST_STEP, LARGEST_STEP)
        if np.linalg.norm(away + step * heading) > RANGE:
            heading = _direction(rng)
            heading -= 2.0 * max(float(heading @ away), 0.0) / float(away @ away) * away
        away = away + step * heading
    problem = Problem.of(grasp, wrenches[0])
    return Trajectory(problem, tuple(problem.load(each) for each in wrenches))


def _direction(rng: np.random.Generator) -> FloatArray:
    out = rng.normal(size=6)
    return out / np.linalg.norm(out)
