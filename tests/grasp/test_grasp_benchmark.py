"""The benchmark of grasp forces: its solvers agree where all can, and its judges can refuse."""

import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))

from grasp_forces import study
from grasp_forces.cone_form import NORMALS, RADIUS
from grasp_forces.hard import FEASIBLE, INFEASIBLE, Score, Verdict, scores
from grasp_forces.judges import EffortJudge, ThetaJudge, bracket, dual, least_effort
from grasp_forces.methods import CLARABEL, METHODS, NEWTON, OPTIMIZER, GraspMethod, of_objective
from grasp_forces.problem import Answer, Ended, Problem
from grasp_forces.trajectories import LARGEST_STEP, LEAST_STEP, trajectory
from harness.study import Check, Effort

from palpate.grasp import Objective
from support.grasp_families import around, grasp_of, instances

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
INSTALLED = [method for method in METHODS if method.installed]
SOLVES = {"fatrop", "superscs"}
"""Those that do not say "solved" even of easy grasps, though their forces may be near."""
QUICK = Effort(quick=True)


@pytest.fixture(scope="module")
def easy() -> Problem:
    rng = np.random.default_rng(6)
    grasp = grasp_of(*around(4, rng), 0.8, 0.004, rng, force_max=20.0)
    return Problem.of(grasp, np.array([0.3, -1.0, 0.5, 0.004, 0.002, -0.006]))


@pytest.fixture(scope="module")
def load(easy):
    return easy.load(np.array([0.3, -1.0, 0.5, 0.004, 0.002, -0.006]))


def test_scaled_forces_balance_the_scaled_load_as_newtons_do_the_load(easy, load):
    rng = np.random.default_rng(0)
    forces = rng.normal(size=(4, 4)) * [1.0, 1.0, 1.0, 0.004]
    left = easy.grasp.grasp_map @ forces.ravel() + load.wrench
    scaled = easy.columns @ easy.from_newtons(forces).ravel() + load.scaled
    np.testing.assert_allclose(scaled[:3] * easy.unit, left[:3], rtol=1e-12)
    arm = easy.scaling.center
    moment = (left[3:] - np.cross(arm, left[:3])) / easy.scaling.length
    np.testing.assert_allclose(scaled[3:] * easy.unit, moment, rtol=1e-10, atol=1e-12)


def test_the_reference_is_bracketed_from_both_sides(easy, load):
    known = least_effort(easy, load)
    assert known.gap < 1e-17
    assert known.clarabel < 1e-9
    # any other multipliers give a lower bound, any other forces that hold cost more
    rng = np.random.default_rng(1)
    columns, scaled = easy.columns.astype(np.longdouble), load.scaled.astype(np.longdouble)
    for _ in range(100):
        assert dual(easy, columns, scaled, rng.normal(size=6))[0] < known.effort
    for objective in (Objective.MIN_PEAK, Objective.MAX_MARGIN):
        other = of_objective(objective)[-1].prepare(easy)
        other.solve(load, warm=False)
        assert easy.effort(other.answer().x) > known.effort
    assert not bracket(easy, 1e3 * load.scaled, np.zeros(6))[1] < 1e-9  # nothing holds that


@pytest.mark.parametrize("method", INSTALLED, ids=lambda method: method.name)
def test_every_solver_finds_the_least_effort_of_an_easy_grasp_cold_and_warm(method, easy, load):
    known = least_effort(easy, load).effort
    with study.silent():
        solver = method.prepare(easy)
        for warm in (False, True):
            solver.solve(load, warm=warm)
    answer = solver.answer()
    if method.name in SOLVES:
        assert answer.ended is not Ended.INFEASIBLE
        return
    assert answer.ended is Ended.SOLVED
    assert easy.violation(answer.x, load.scaled) < 1e-5
    effort = easy.effort(answer.x)
    if method.name.startswith("16 facets"):
        assert 1.01 * known < effort < 10.0 * known
    else:
        assert effort == pytest.approx(known, rel=1e-4)


@pytest.mark.parametrize("objective", [Objective.MAX_MARGIN, Objective.MIN_PEAK, Objective.LOAD_FACTOR])
def test_solvers_of_the_other_objectives_agree(objective, easy, load):
    judge = ThetaJudge(easy, objective)
    for method in of_objective(objective):
        solver = method.prepare(easy)
        for warm in (False, True):
            solver.solve(load, warm=warm)
            error, violation = judge(solver.answer(), load)
            assert error < 1e-7
            assert violation < 1e-7


def test_sixteen_facets_lie_inside_the_sphere_and_touch_it():
    assert np.linalg.norm(NORMALS, axis=1) == pytest.approx(1.0)
    rng = np.random.default_rng(2)
    directions = rng.normal(size=(200_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    reach = RADIUS / (directions @ NORMALS.T).max(axis=1)
    assert reach.max() <= 1.0 + 1e-12
    assert reach.max() > 0.98
    assert reach.min() == pytest.approx(RADIUS, rel=1e-2)


def test_a_wrong_solution_is_distinguished_from_a_right_one(easy, load):
    judge = EffortJudge(easy)
    solver = OPTIMIZER.prepare(easy)
    solver.solve(load, warm=False)
    x = solver.answer().x
    assert max(judge(Answer(Ended.SOLVED, x), load)) < 1e-9
    error, violation = judge(Answer(Ended.SOLVED, 1.001 * x), load)
    assert error == pytest.approx(0.002001, rel=1e-6)
    assert violation > 1e-4
    assert replace(easy, friction=0.5 * easy.friction).violation(x, load.scaled) > 0.1
    assert replace(easy, least=easy.least + x[:, 0].min() + 0.1).violation(x, load.scaled) == pytest.approx(0.1)
    assert replace(easy, most=np.full(4, x[:, 0].max() - 0.1)).violation(x, load.scaled) == pytest.approx(0.1)


class Liar:
    """Calls everything what it is told to."""

    def __init__(self, problem, ended):
        self._ended, self._n = ended, len(problem)

    def solve(self, load, *, warm):
        pass

    def answer(self):
        return Answer(self._ended, np.zeros((self._n, 4)))


@pytest.mark.parametrize(
    ("ended", "feasible", "infeasible"),
    [
        (Ended.SOLVED, Verdict.VIOLATES, Verdict.WRONGLY_SOLVED),
        (Ended.INFEASIBLE, Verdict.FALSELY_INFEASIBLE, Verdict.CERTIFIED),
        (Ended.UNDECIDED, Verdict.UNDECIDED, Verdict.OPEN),
    ],
)
def test_lies_are_counted(ended, feasible, infeasible):
    some = list(instances(seed=3, per_family=1, factors=(0.9, 1.5)))
    score = scores([GraspMethod("liar", partial(Liar, ended=ended))], some)["liar"]
    assert score.verdicts == {feasible: len(some) // 2, infeasible: len(some) // 2}


def test_slow_solvers_get_instances_of_every_family_and_factor():
    some = list(instances(seed=3, per_family=5))
    seen = set()

    class Keeper(Liar):
        def __init__(self, problem):
            super().__init__(problem, Ended.UNDECIDED)
            seen.add(id(problem.grasp))

    score = scores([GraspMethod("keeper", Keeper, every=5)], some)["keeper"]
    assert sum(score.verdicts.values()) == len(some) // 5
    assert len(seen) == len({id(each.grasp) for each in some})
    assert score.total(FEASIBLE) / score.total(INFEASIBLE) == pytest.approx(6 / 4, rel=0.3)


def test_loads_move_a_thousandth_to_a_hundredth_of_their_size_each_period():
    path = trajectory(3, 300, np.random.default_rng(4))
    scaled = np.array([load.scaled for load in path.loads])
    steps = np.linalg.norm(np.diff(scaled, axis=0), axis=1)
    assert steps.min() >= 0.999 * LEAST_STEP
    assert steps.max() <= 1.001 * LARGEST_STEP
    assert np.linalg.norm(scaled[0]) == pytest.approx(1.0)
    assert np.linalg.norm(scaled - scaled[0], axis=1).max() > 0.1


@pytest.mark.slow
def test_times_are_kept_cold_and_warm_and_solutions_judged():
    found = study.least_effort(QUICK, (3, 4), (NEWTON, OPTIMIZER, CLARABEL))
    rows = {(row.case, row.method): row for row in found.rows}
    assert len(rows) == 12
    for row in found.rows:
        assert row.errors[0].largest < 1e-6
        assert row.errors[0].silent == 0.0
    assert rows["n = 3", NEWTON.name].cost < rows["n = 3", CLARABEL.name].cost
    assert rows["n = 3", CLARABEL.name].ratio.median == 1.0
    assert not rows["n = 3", f"{CLARABEL.name}, cold"].drawn
    kept = {check.what: check.kept for check in found.checks}
    assert kept[f"{OPTIMIZER.name}: share of loads unsolved"]
    assert kept["evaluations along trajectories"]


@pytest.mark.slow
def test_other_objectives_and_hard_families_are_judged(monkeypatch):
    others = study.objectives(QUICK, (4,))
    assert {row.case for row in others.rows} == {
        f"{each}, n = 4" for each in ("max_margin", "min_peak", "load_factor")
    }
    assert all(check.kept for check in others.checks if "clarabel" not in check.what)
    monkeypatch.setattr(study, "instances", partial(instances, factors=(0.9, 1.5)))
    found = study.hard(QUICK, (NEWTON, OPTIMIZER, CLARABEL))
    assert all(check.kept for check in found.checks)
    assert found.tables[0].row_count == 3


def test_a_missed_figure_is_missed():
    assert Check.at_most("", 1.0, 1.0).kept
    assert not Check.at_most("", 1.0, 1.01).kept
    assert not Check.at_most("", 1.0, np.nan).kept


@pytest.mark.slow
def test_it_says_what_it_measures():
    started = [sys.executable, str(BENCHMARKS / "grasp.py"), "--help"]
    said = subprocess.run(started, check=True, capture_output=True, text=True).stdout
    assert "--quick" in said
    assert "--picture" in said


def test_a_score_knows_how_many_there_were():
    score = Score()
    score.verdicts.update({Verdict.RIGHT: 3, Verdict.UNDECIDED: 1, Verdict.CERTIFIED: 2, Verdict.OPEN: 1})
    assert (score.total(FEASIBLE), score.total(INFEASIBLE)) == (4, 3)
