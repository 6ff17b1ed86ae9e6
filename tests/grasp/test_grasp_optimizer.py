"""One class for every grasp-force problem: optimal, certain, and usable by a controller."""

import math
from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.grasp import GraspContacts, GraspForceOptimizer, Objective, SolveStatus
from support.grasp_families import Reference, around, check_forces, grasp_of, instances
from support.refusals import check_refusals

LOAD = np.array([0.3, -1.0, 0.5, 0.004, 0.002, -0.006])


@pytest.fixture
def grasp() -> GraspContacts:
    rng = np.random.default_rng(6)
    return grasp_of(*around(4, rng), 0.8, 0.004, rng, force_max=20.0)


@pytest.mark.slow
def test_every_load_is_held_or_proven_impossible():
    optimizers = {}
    for each in instances(seed=21, per_family=2):
        n = len(each.grasp)
        optimizer = optimizers.setdefault(n, GraspForceOptimizer(each.grasp))
        optimizer.update(each.grasp)
        result = optimizer.solve(each.load, warm_start=False)
        if each.factor > 1.0:
            assert result.status is SolveStatus.SOLVED, each
            size = np.linalg.norm(each.load[:3]) + np.linalg.norm(each.load[3:]) / 0.03
            check_forces(each.grasp, each.load, result.forces, 1e-9 * size)
            reference = Reference(each.grasp).least_effort(each.load)
            if np.isfinite(reference):
                assert result.objective == pytest.approx(reference, rel=1e-8)
        else:
            assert result.status is SolveStatus.INFEASIBLE, each
            assert result.load_factor == pytest.approx(each.factor, rel=1e-6)
            assert (result.margin >= -1e-9 * each.grasp.force_max).all()  # limits are kept all the same
            assert result.certificate is not None


@pytest.mark.parametrize("objective", ["min_peak", "max_margin", "load_factor"])
def test_no_other_objective_does_better_at_its_own(grasp, objective):
    values = {
        "min_peak": lambda r: -r.forces[:, 0].max(),
        "max_margin": lambda r: r.margin.min(),
        "load_factor": lambda r: r.load_factor if r.load_factor is not None else 1.0,
    }
    best = GraspForceOptimizer(grasp, objective).solve(LOAD)
    assert best.status is SolveStatus.SOLVED
    for other in ("min_effort", "min_peak", "max_margin"):
        result = GraspForceOptimizer(grasp, other).solve(LOAD)
        assert values[objective](best) >= values[objective](result) - 1e-8


def test_the_load_factor_is_where_holding_ends(grasp):
    factor = GraspForceOptimizer(grasp, "load_factor").solve(LOAD).load_factor
    optimizer = GraspForceOptimizer(grasp)
    assert optimizer.solve(LOAD * factor * (1 - 1e-6)).status is SolveStatus.SOLVED
    assert optimizer.solve(LOAD * factor * (1 + 1e-3)).status is SolveStatus.INFEASIBLE


def test_without_largest_forces_a_closed_grasp_holds_any_load():
    rng = np.random.default_rng(6)
    endless = grasp_of(*around(4, rng), 0.8, 0.004, rng)
    result = GraspForceOptimizer(endless, "load_factor").solve(LOAD)
    assert result.load_factor == math.inf
    check_forces(endless, LOAD, result.forces)
    with pytest.raises(InvalidValueError, match="max_margin"):
        GraspForceOptimizer(endless, "max_margin")


@pytest.mark.slow
@pytest.mark.parametrize("share", [1e-9, 1e-7])
def test_loads_next_to_the_largest_are_decided(share):
    for each in instances(seed=23, per_family=1, factors=(2.0,)):
        largest = GraspForceOptimizer(each.grasp, "load_factor").solve(each.load).objective * each.load
        optimizer = GraspForceOptimizer(each.grasp)
        held, beyond = (optimizer.solve(largest * (1.0 + side * share), warm_start=False) for side in (-1.0, 1.0))
        assert held.status is SolveStatus.SOLVED, each
        assert held.margin.min() >= -1e-9 * held.forces.max()
        assert beyond.status is SolveStatus.INFEASIBLE, each
        assert beyond.certificate is not None


def test_a_load_that_slips_has_a_margin_below_zero(grasp):
    result = GraspForceOptimizer(grasp, "max_margin").solve(100.0 * LOAD)
    assert result.status is SolveStatus.INFEASIBLE
    assert GraspForceOptimizer(grasp).solve(100.0 * LOAD).load_factor < 1.0


@pytest.mark.slow
def test_actuators_are_not_overloaded():
    """An actuator that bears the normal force alone is one more bound on it: min_peak knows how low it can be."""
    rng = np.random.default_rng(3)
    grasp = grasp_of(*around(5, rng), 0.8, 0.004, rng)
    peak = GraspForceOptimizer(grasp, "min_peak").solve(LOAD).objective
    free = GraspForceOptimizer(grasp).solve(LOAD)
    assert peak < 0.98 * free.forces[:, 0].max()

    def limited(most):
        maps, limits = np.tile([[[1.0, 0.0, 0.0, 0.0]]], (5, 1, 1)), np.full((5, 1), most)
        return replace(grasp, actuator_map=maps, actuator_limit=limits)

    between = 0.5 * (peak + free.forces[:, 0].max())
    result = GraspForceOptimizer(limited(between)).solve(LOAD)
    assert result.status is SolveStatus.SOLVED
    check_forces(grasp, LOAD, result.forces)
    assert result.forces[:, 0].max() == pytest.approx(between, rel=1e-8)
    bounded = GraspForceOptimizer(replace(grasp, force_max=np.full(5, between))).solve(LOAD)
    np.testing.assert_allclose(result.forces, bounded.forces, atol=1e-6)
    loose = GraspForceOptimizer(limited(2.0 * free.forces[:, 0].max())).solve(LOAD)
    np.testing.assert_allclose(loose.forces, free.forces)
    assert GraspForceOptimizer(limited(1.01 * peak)).solve(LOAD).status is SolveStatus.SOLVED
    refused = GraspForceOptimizer(limited(0.99 * peak)).solve(LOAD)
    assert refused.status is SolveStatus.INFEASIBLE
    assert refused.forces[:, 0].max() <= 0.99 * peak * (1.0 + 1e-8)


def test_contacts_come_go_and_move(grasp):
    optimizer = GraspForceOptimizer(grasp, "min_peak")
    for part in ([0, 1, 2], [0, 1, 2, 3], [1, 2, 3]):
        some = grasp.chosen(part)
        optimizer.update(some)
        result = optimizer.solve(LOAD)
        fresh = GraspForceOptimizer(some, "min_peak").solve(LOAD)
        assert result.status is fresh.status
        if result.status is SolveStatus.SOLVED:
            assert result.objective == pytest.approx(fresh.objective, rel=1e-7)
            check_forces(some, LOAD, result.forces, 1e-8)


def test_a_load_that_is_no_number_gets_a_status_and_bad_shapes_and_names_are_refused(grasp):
    optimizer = GraspForceOptimizer(grasp)
    assert optimizer.solve(LOAD * math.nan).status is SolveStatus.INVALID
    assert optimizer.solve(LOAD).status is SolveStatus.SOLVED
    check_refusals(
        (r"must be \(6,\)", lambda: optimizer.solve(LOAD[:3])),
        ("'min_effort', 'max_margin', 'min_peak', 'load_factor'", lambda: GraspForceOptimizer(grasp, "least")),
        ("effort_weight", lambda: GraspForceOptimizer(grasp, Objective.MIN_EFFORT, 0.0)),
    )
