"""Whether grips hold as often as they promise, what they cost over the least that would, and how long they take.

    python benchmarks/robust_grasps.py [--quick] [--seed 0]

Grasps: three fingers 120 degrees apart around a cylinder of 30 mm radius (half of them), two opposite fingers
(a fifth), three to five around a sphere. mu 0.4 to 1.0 and e 3 to 8 mm, with standard deviations of 15 % and 25 %
that all contacts have in common (in every other grasp; else independent); loads: a weight of 1 N and a pull of 0.5
to 5 N in any direction up to 8 mm beside. Promised: 99 %.

Whether a grip holds in a draw is decided by statics: normal forces as commanded, and some friction within the
limits drawn balances the load. Two gauges say what a grip costs: normal forces on the straight way from those of
known mu and e to the answer's, as far along as leaves 1 % of draws failing; and those of known mu and e, all
pressed harder by one factor until only 1 % do. The cheaper of both counts. Neither is the least grip of all, and
both know the draws: the ratio may be below 1.

Time is that of one thread, so that other programs do not count: the bounds are those of the control loop.
"""

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from grasp_forces.cone_form import ClarabelDirect
from grasp_forces.problem import Ended, Problem
from harness.command import start
from harness.study import Check, Effort, Study
from harness.tables import grid

from palpate.errors import FloatArray
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.objective_spec import Objective
from palpate.grasp.problem.result import SolveStatus
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.robust.least_effort import RobustForces, RobustLeastEffort
from palpate.grasp.robust.uncertainty import GraspUncertainty
from palpate.grasp.solvers.convex import Convex
from palpate.grasp.solvers.dual_newton import HI, LO, MU, E
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome
from support.grasp_families import grasp_of

PROMISED, RADIUS, STRONGEST = 0.99, 0.03, 30.0
STEPS = 150
"""Loads of a trajectory: from one pull to another in as many control periods of a hundredth of the way."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A grasp, what is not known of it, and two loads."""

    name: str
    grasp: GraspContacts
    uncertainty: GraspUncertainty
    loads: FloatArray


def around(out: FloatArray, rng: np.random.Generator) -> GraspContacts:
    """Contacts where `out` (n, 3) leaves the object, all with the same mu and e."""
    return grasp_of(RADIUS * out, -out, rng.uniform(0.4, 1.0), rng.uniform(0.003, 0.008), rng, force_max=STRONGEST)


def pull(rng: np.random.Generator) -> FloatArray:
    """Weight and a pull beside the middle."""
    force = rng.standard_normal(3)
    force *= rng.uniform(0.5, 5.0) / np.linalg.norm(force)
    return np.concatenate([force - [0.0, 0.0, 1.0], np.cross(rng.uniform(-0.008, 0.008, 3), force)])


def cases(count: int, rng: np.random.Generator) -> list[Case]:
    """Draw what is tried."""
    made = []
    for i in range(count):
        if i % 10 < 5:
            name, angles = "three fingers", 2.0 * np.pi / 3.0 * np.arange(3)
            out = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
        elif i % 10 < 7:
            name, out = "two fingers", np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
        else:
            name, out = "sphere, 3 to 5", rng.standard_normal((int(rng.integers(3, 6)), 3))
            out -= out.mean(axis=0)
            out /= np.linalg.norm(out, axis=1)[:, None]
        grasp = around(out, rng)
        mu, e = 0.15 * grasp.friction, 0.25 * grasp.spin_length
        unsure = GraspUncertainty(mu, e) if i % 2 else GraspUncertainty(np.outer(mu, mu), np.outer(e, e))
        made.append(Case(name, grasp, unsure, np.array([pull(rng), pull(rng)])))
    return made


class Draws:
    """mu and e as they may really be."""

    def __init__(self, case: Case, count: int, rng: np.random.Generator) -> None:
        grasp, unsure, n = case.grasp, case.uncertainty, len(case.grasp)
        self._friction = rng.multivariate_normal(grasp.friction, unsure.friction, count, method="eigh")
        self._length = rng.multivariate_normal(grasp.spin_length, unsure.spin_length, count, method="eigh")
        self._scaled = ScaledGrasp.of(grasp)
        self._grasp, self._load = grasp, case.loads[0]
        self._solver, self._forces = LeastEffort(self._scaled, 0.01), np.zeros((n, 4))
        self.undecided = 0

    def failing(self, press: FloatArray, among: FloatArray | None = None) -> FloatArray:
        """Return the draws, of some or all, in which no friction holds the load under these normal forces."""
        index = np.arange(len(self._friction)) if among is None else among
        return np.array([k for k in index if not self._holds(int(k), press)], int)

    def least(self, start: FloatArray, way: FloatArray, low: float, high: float, most: int) -> FloatArray:
        """Return the first of start + s way, s from low to high, with at most so many draws failing; NaN if none.

        What holds under less is taken to hold under more.
        """
        left = self.failing(start + low * way)
        if len(left) <= most:
            return start + low * way
        if len(self.failing(start + high * way, left)) > most:
            return np.full(len(start), np.nan)
        for _ in range(9):
            middle = 0.5 * (low + high)
            still = self.failing(start + middle * way, left)
            if len(still) > most:
                low, left = middle, still
            else:
                high = middle
        return start + high * way

    def _holds(self, k: int, press: FloatArray) -> bool:
        mu, e = self._friction[k], self._length[k]
        if not (mu.min() > 0.0 and e.min() > 0.0):
            return False
        rows = self._scaled.rows.copy()
        rows[:, E], rows[:, MU] = e / self._scaled.length, mu
        rows[:, LO] = rows[:, HI] = press
        self._solver.update(replace(self._scaled, rows=rows))
        self._solver.y[:] = 0.0
        outcome = self._solver.solve(self._load, self._forces)[0]
        if outcome == Outcome.UNDECIDED:
            self.undecided += 1
            return self._margin(mu, e, press) >= 0.0
        return outcome == Outcome.SOLVED

    def _margin(self, mu: FloatArray, e: FloatArray, press: FloatArray) -> float:
        """Return the largest t with |u_i| <= mu_i f_i - t, by clarabel; -inf without any."""
        grasp = replace(self._grasp, friction=mu, spin_length=e, force_min=press, force_max=press)
        problem = Problem.of(grasp, self._load)
        solver = ClarabelDirect(problem, Objective.MAX_MARGIN)
        solver.solve(problem.load(self._load), warm=False)
        answer = solver.answer()
        return answer.theta if answer.ended is Ended.SOLVED else -np.inf


def timed(solver: RobustLeastEffort, load: FloatArray) -> tuple[RobustForces, float]:
    """Solve; return the answer and its time [us]."""
    begun = time.thread_time_ns()
    answer = solver.solve(load)
    return answer, 1e-3 * (time.thread_time_ns() - begun)


@dataclass(slots=True)
class Speed:
    """Times [us] of a solver, cold and along trajectories, and all outcomes."""

    cold: list[float] = field(default_factory=list)
    warm: list[float] = field(default_factory=list)
    outcomes: Counter[str] = field(default_factory=Counter)

    def first(self, case: Case) -> RobustForces:
        """Solve under the first load, cold; then along the way to the second one; return the first answer."""
        solver = RobustLeastEffort(case.grasp, case.uncertainty, PROMISED)
        answer, spent = timed(solver, case.loads[0])
        self.cold.append(spent)
        self.outcomes[Outcome(answer.outcome).name] += 1
        for share in 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, STEPS)):
            along, spent = timed(solver, case.loads[0] + share * (case.loads[1] - case.loads[0]))
            self.warm.append(spent)
            self.outcomes[Outcome(along.outcome).name] += 1
        return answer

    def checks(self) -> Iterator[Check]:
        """Return times beside those asked for."""
        for name, times, quantile, most in (
            ("warm, median", self.warm, 0.5, 300.0),
            ("warm, 99 %", self.warm, 0.99, None),
            ("warm, worst", self.warm, 1.0, None),
            ("cold, 90 %", self.cold, 0.9, 2000.0),
            ("cold, worst", self.cold, 1.0, None),
        ):
            got = float(np.quantile(times, quantile))
            yield Check(
                f"{name}, us", f"<= {most:.0f}" if most else "", f"{got:.0f}", got <= most if most else None
            )


def costs(case: Case, draws: Draws, press: FloatArray, allowed: int) -> tuple[float, float]:
    """Return what a grip costs over the grip of each gauge with so many draws failing; NaN if there is none."""
    found = Convex(case.grasp, Objective.MIN_EFFORT, 0.01).solve(case.loads[0], warm=False)
    if found.status is not SolveStatus.SOLVED:
        return np.nan, np.nan
    known = found.forces[:, 0]
    dearer = press.sum() / known.sum()
    way = draws.least(known, press - known, 0.3, 1.3, allowed)
    pressed = draws.least(np.zeros(len(known)), known, 0.7 * dearer, 1.2 * dearer, allowed)
    return press.sum() / way.sum(), press.sum() / pressed.sum()


def robust(effort: Effort) -> Study:
    """Measure all grips."""
    rng, count = np.random.default_rng(effort.seed), effort.of(2000, 500)
    tried = cases(effort.of(200, 20), rng)
    RobustLeastEffort(tried[0].grasp, tried[0].uncertainty, PROMISED).solve(tried[0].loads[0])  # compiles
    speed, undecided, rows = Speed(), 0, dict[str, list[tuple[float, float, float]]]()
    for k, case in enumerate(tried):
        effort.tell(f"grasp {k + 1} of {len(tried)}")
        answer = speed.first(case)
        if answer.outcome != Outcome.SOLVED:
            continue
        press, draws = answer.forces[:, 0], Draws(case, count, rng)
        failed = len(draws.failing(press)) / count
        way, other = costs(case, draws, press, int((1.0 - PROMISED) * count))
        undecided += draws.undecided
        common = np.count_nonzero(case.uncertainty.friction) > len(press)
        kind = f"{case.name}, {'common' if common else 'independent'}"
        rows.setdefault(kind, []).append((failed, way, np.fmax(way, other)))
    rows["all"] = [row for each in rows.values() for row in each]
    table = grid(
        "Robust grips",
        "grasps",
        "n",
        "fail: mean %",
        "worst %",
        "grip / way: median",
        "grip / cheaper: median",
        "90 %",
    )
    for name, found in rows.items():
        share, way_ratio, ratio = np.array(found).T
        cells = (100.0 * share.mean(), 100.0 * share.max(), np.nanmedian(way_ratio), np.nanmedian(ratio))
        cells = (*cells, np.nanpercentile(ratio, 90))
        table.add_row(name, str(len(found)), *(f"{each:.3f}" for each in cells))
    about = f"Answers: {dict(speed.outcomes)}; draws left to a second solver: {undecided}."
    return Study("Robust grips", about, checks=tuple(speed.checks()), tables=(table,))


if __name__ == "__main__":
    start(__doc__, {"robust": robust})
