"""Limit surfaces that are no cones: the answer never violates them, and no start does better."""

import dataclasses

import numpy as np
import pytest

from palpate.grasp import GraspContacts, GraspForceOptimizer, SolveStatus
from palpate.grasp.problem.inscribed import inscribed
from support.grasp_families import around, check_forces, grasp_of, within_limits


def best_of_random_starts(solver, result, load, rng, starts):
    """The least effort that the nonlinear programme finds from random forces."""
    grasp, best, n = solver._grasp, result.objective, len(result.forces)
    for _ in range(starts):
        normal = rng.uniform(0.1, 8.0, n)
        aside = (
            0.3 * normal[:, None] * rng.normal(size=(n, 3)) * np.column_stack([np.ones((n, 2)), grasp.spin_length])
        )
        start = dataclasses.replace(result, forces=np.column_stack([normal, aside]))
        forces = solver._by_programme(start, load)
        held = np.abs(grasp.grasp_map @ forces.ravel() + load).max() < 1e-6 * np.linalg.norm(load)
        if held and grasp.margins(forces).min() > -1e-6:
            best = min(best, solver._value(dataclasses.replace(result, forces=forces)))
    return best


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "seed", "count", "starts"),
    [
        ({"load_exponent": 1 / 3}, 4, 4, 10),
        ({"norm_exponent": 1.4}, 4, 4, 10),
        ({"load_exponent": 0.2, "norm_exponent": 1.6}, 4, 4, 10),
        ({"load_exponent": 1 / 3}, 100, 20, 100),  # and of 200, in five minutes
    ],
)
def test_limits_are_kept_and_random_starts_are_1_percent_better_in_5_of_100_grasps(limits, seed, count, starts):
    rng, worse, solutions = np.random.default_rng(seed), 0, 0
    while solutions < count:
        grasp, load = within_limits(rng, **limits)
        optimizer = GraspForceOptimizer(grasp)
        result = optimizer.solve(load, warm_start=False)
        if result.status is SolveStatus.SOLVED:
            solutions += 1
            check_forces(grasp, load, result.forces, 1e-9 * np.linalg.norm(load))
            np.testing.assert_array_equal(result.margin, grasp.margins(result.forces))
            worse += result.objective > 1.01 * best_of_random_starts(optimizer._solver, result, load, rng, starts)
    assert worse <= 0.05 * count


def test_cones_lie_inside_the_limit_surfaces_and_touch_them():
    rng = np.random.default_rng(2)
    grasp, _ = within_limits(rng, load_exponent=0.3, norm_exponent=1.3)
    n = len(grasp)
    forces = np.column_stack([rng.uniform(0.5, 3.0, n), rng.normal(size=(n, 2)), 0.003 * rng.normal(size=n)])
    cones = inscribed(grasp, forces)
    # at the forces they were made for, scaled onto the limit, both limits are reached at once
    for i, surface in enumerate(grasp.surfaces):
        f, a, b, torque = forces[i]
        ratio = surface.load_ratio(f, np.hypot(a, b), torque)
        assert cones.surfaces[i].load_ratio(f, np.hypot(a, b), torque) == pytest.approx(ratio, rel=1e-9)
        for _ in range(100):  # with the same or a larger normal force the cone promises less
            press, angle = f * (1.0 + rng.exponential()), rng.uniform(0, np.pi / 2)
            load = (
                press,
                cones.friction[i] * press * np.cos(angle),
                cones.friction[i] * cones.spin_length[i] * press * np.sin(angle),
            )
            assert surface.load_ratio(*load) <= 1.0 + 1e-12


def test_the_spin_that_only_heavier_contacts_bear_is_borne():
    # two fingers, a torque about their line: tau = 2 mu c f^(4/3) in closed form
    frames = np.array([[[-1, 0, 0], [0, 0, 1], [0, 1, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]], float)
    grasp = GraspContacts([[0.02, 0, 0], [-0.02, 0, 0]], frames, 0.5, 0.004, load_exponent=1 / 3)
    torque = 0.02
    result = GraspForceOptimizer(grasp).solve([0, 0, 0, torque, 0, 0])
    assert result.status is SolveStatus.SOLVED
    force = (torque / (2 * 0.5 * 0.004)) ** 0.75
    np.testing.assert_allclose(result.forces[:, 0], force, rtol=1e-5)


def test_a_load_beyond_all_larger_contacts_is_proven_impossible_and_limits_are_kept():
    rng = np.random.default_rng(9)
    grasp, load = within_limits(rng, load_exponent=1 / 3)
    result = GraspForceOptimizer(grasp).solve(1e3 * load)
    assert result.status is SolveStatus.INFEASIBLE
    assert result.certificate is not None
    assert result.margin.min() >= -1e-6


@pytest.mark.slow
@pytest.mark.parametrize("limits", [{"load_exponent": 1 / 3}, {"norm_exponent": 1.4}])
def test_what_is_a_little_less_than_the_most_that_can_be_held_is_held_and_a_little_more_is_not(limits):
    rng = np.random.default_rng(4)
    grasp = grasp_of(*around(4, rng), 0.7, 0.004, rng, force_max=20.0, **limits)
    load = np.array([0.3, -1.0, 0.5, 0.004, 0.002, -0.006])
    most = GraspForceOptimizer(grasp, "load_factor").solve(load).load_factor
    optimizer = GraspForceOptimizer(grasp)
    assert optimizer.solve(0.99 * most * load).status is SolveStatus.SOLVED
    assert optimizer.solve(1.01 * most * load).status is not SolveStatus.SOLVED
    margin = GraspForceOptimizer(grasp, "max_margin").solve(load)
    assert margin.objective == pytest.approx(margin.margin.min(), rel=1e-9)
    assert margin.objective >= optimizer.solve(load).margin.min()
    peak = GraspForceOptimizer(grasp, "min_peak").solve(load)
    assert peak.forces[:, 0].max() <= optimizer.solve(load).forces[:, 0].max() * (1.0 + 1e-9)
