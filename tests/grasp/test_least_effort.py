"""Least effort by dual Newton steps: optimality, certificates and invariances, on easy and hard grasps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.grasp.problem.balance import balance
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.dual_newton import evaluate
from palpate.grasp.solvers.least_effort import LeastEffort, Outcome, least_violation
from support.grasp_families import FAMILIES, Instance, Reference, around, grasp_of, instances, solved

WEIGHT = 0.01


@pytest.fixture(scope="module")
def many() -> list[Instance]:
    return list(instances(seed=7, per_family=3))


def test_what_is_called_solved_is_in_balance_within_limits_and_as_good_as_a_cone_programme_finds(many):
    worst, count = 0.0, 0
    for each in many:
        outcome, _, forces, solver = solved(each.grasp, each.load)
        if outcome != Outcome.SOLVED:
            continue
        count += 1
        assert each.factor > 1.0
        scale, length = solver.out[7], max(np.abs(each.grasp.positions).max(), 1e-3)
        left = (each.grasp.grasp_map @ forces.ravel() + each.load) / [1, 1, 1, length, length, length]
        assert np.abs(left).max() <= 1e-9 * scale
        assert (each.grasp.margins(forces) >= -1e-9 * scale).all()
        assert (forces[:, 0] >= each.grasp.force_min - 1e-12 * scale).all()
        assert (forces[:, 0] <= each.grasp.force_max * (1.0 + 1e-12)).all()
        reference = Reference(each.grasp).least_effort(each.load, WEIGHT)
        if np.isfinite(reference):
            worst = max(worst, abs(solver.out[6] - reference) / reference)
    assert worst <= 1e-8
    assert count >= 0.9 * sum(each.factor > 1.0 for each in many)


def test_what_is_called_infeasible_is(many):
    outcomes = [(each, solved(each.grasp, each.load)[0]) for each in many]
    assert all(each.factor < 1.0 for each, outcome in outcomes if outcome == Outcome.INFEASIBLE)
    well_beyond = [outcome == Outcome.INFEASIBLE for each, outcome in outcomes if each.factor <= 0.9]
    assert np.mean(well_beyond) >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_a_certificate_holds_for_every_force_within_the_limits(family, many):
    rng = np.random.default_rng(0)
    for each in many:
        if each.family != family:
            continue
        outcome, _, forces, solver = solved(each.grasp, each.load)
        if outcome != Outcome.INFEASIBLE:
            continue
        y = solver._grasp.multiplier(solver.y)
        grasp = each.grasp
        for _ in range(200):
            normal = rng.uniform(grasp.force_min, grasp.force_max)
            u = rng.normal(size=(len(grasp), 3))
            u *= (grasp.friction * normal / np.linalg.norm(u, axis=1))[:, None]
            forces = np.column_stack([normal, u[:, :2], u[:, 2] * grasp.spin_length])
            assert y @ (grasp.grasp_map @ forces.ravel() + each.load) > 0.0


def test_the_gradient_and_the_hessian_are_derivatives():
    rng = np.random.default_rng(3)
    grasp = grasp_of(*around(5, rng), 0.6, 0.004, rng, force_min=0.1, force_max=2.0)
    rows = ScaledGrasp.of(grasp, np.full(5, 0.05)).sized(1.0)
    load, y, step = rng.normal(size=6), rng.normal(size=6), 1e-6

    def at(place):
        forces, gradient, hessian = np.zeros((5, 4)), np.zeros(7), np.zeros((6, 6))
        value = evaluate(rows, load, WEIGHT, 0.0, load, place, forces, gradient, hessian)
        return value, gradient[:6], hessian

    _, gradient, hessian = at(y)
    pairs = [(at(y + step * unit), at(y - step * unit)) for unit in np.eye(6)]
    slopes = np.array([(a[0] - b[0]) / (2 * step) for a, b in pairs])
    bends = np.array([(a[1] - b[1]) / (2 * step) for a, b in pairs])
    np.testing.assert_allclose(slopes, gradient, atol=1e-8)
    np.testing.assert_allclose(np.tril(bends), hessian, atol=1e-7)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(-3.0, 3.0))
def test_forces_turn_move_and_grow_with_the_grasp_and_its_load(seed, decades):
    rng = np.random.default_rng(seed)
    grasp = grasp_of(*around(4, rng), rng.uniform(0.4, 1.0, 4), rng.uniform(0.002, 0.006, 4), rng)
    load = rng.normal(size=6) * [1, 1, 1, 0.02, 0.02, 0.02]
    outcome, _, forces, _ = solved(grasp, load)
    if outcome != Outcome.SOLVED:
        return
    turn, move, factor = Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3) * 0.1, 10.0**decades
    moved = GraspContacts(grasp.positions @ turn.T + move, turn @ grasp.frames, grasp.friction, grasp.spin_length)
    force = turn @ load[:3]
    other = factor * np.concatenate([force, turn @ load[3:] + np.cross(move, force)])
    outcome, _, same, _ = solved(moved, other)
    assert outcome == Outcome.SOLVED
    np.testing.assert_allclose(same / factor, forces, atol=2e-8 * np.abs(forces).max(), rtol=0)


def test_a_warm_start_on_a_path_takes_few_evaluations():
    rng = np.random.default_rng(5)
    grasp = grasp_of(*around(4, rng), 0.8, 0.004, rng)
    solver, forces, used = LeastEffort(ScaledGrasp.of(grasp), WEIGHT), np.zeros((4, 4)), []
    for t in np.linspace(0.0, 2.0, 2000):
        load = np.array([np.sin(5 * t), np.cos(3 * t), -1.0, 0.01 * np.sin(9 * t), 0.0, 0.01 * np.cos(4 * t)])
        outcome, count = solver.solve(load, forces)
        assert outcome == Outcome.SOLVED
        used.append(count)
    assert np.median(used) <= 4
    assert max(used[1:]) <= 20


def test_two_fingers_need_no_warm_start():
    """Once everything slides the Hessian is a thousandth of what it is beyond the next kink."""
    given_up, tried, rng = 0, 0, np.random.default_rng(12)
    while tried < 100:
        positions, normals = around(2, rng)
        positions[1], normals[1] = -positions[0], positions[0] / 0.03 + 0.1 * rng.normal(size=3)
        grasp = grasp_of(
            positions, normals, rng.uniform(0.4, 1.0, 2), rng.uniform(0.002, 0.006, 2), rng, force_max=20.0
        )
        load = rng.normal(size=6) * [1, 1, 1, 0.009, 0.009, 0.009]
        load /= np.linalg.norm(load[:3])
        if not np.isfinite(Reference(grasp).least_effort(load)):
            continue
        tried += 1
        given_up += solved(grasp, load)[0] != Outcome.SOLVED
    assert given_up <= 2


def test_a_reserve_is_kept_of_every_limit():
    rng = np.random.default_rng(6)
    grasp = grasp_of(*around(4, rng), 0.8, 0.004, rng, force_max=50.0)
    reserve = rng.uniform(0.05, 0.2, 4)
    load = np.array([0.3, -1.0, 0.5, 0.004, 0.002, -0.006])
    outcome, _, forces, solver = solved(grasp, load, reserve)
    assert outcome == Outcome.SOLVED
    assert (grasp.margins(forces) >= reserve - 1e-12).all()
    np.testing.assert_allclose(grasp.grasp_map @ forces.ravel(), -load, atol=1e-10)
    # an effort of the forces themselves, and no less than without
    effort = (
        forces[:, 0] ** 2 + WEIGHT * (forces[:, 1:3] ** 2).sum(axis=1) + WEIGHT * (forces[:, 3] / 0.004) ** 2
    ).sum()
    assert solver.out[6] == pytest.approx(effort, rel=1e-12)
    assert effort > solved(grasp, load)[3].out[6]


def test_without_a_load_nothing_presses_but_what_must():
    rng = np.random.default_rng(8)
    positions = np.array([[0.02, 0.0, 0.0], [-0.02, 0.0, 0.0]])
    for least in (0.0, 0.7):
        grasp = grasp_of(positions, -positions, 0.5, 0.004, rng, force_min=least)
        outcome, _, forces, _ = solved(grasp, np.zeros(6))
        assert outcome == Outcome.SOLVED
        np.testing.assert_allclose(forces, [[least, 0, 0, 0]] * 2, atol=1e-12)


def test_the_least_violation_leaves_as_little_of_a_load_as_a_cone_programme_and_keeps_all_limits(many):
    for each in many:
        scaled = ScaledGrasp.of(each.grasp)
        load, size = scaled.load(each.load)
        forces, left = least_violation(scaled.sized(size), load, WEIGHT)
        real = scaled.forces(forces, size)
        assert (each.grasp.margins(real) >= -1e-9 * size).all()
        assert (real[:, 0] <= each.grasp.force_max * (1 + 1e-12)).all()
        if each.factor > 1.0:
            assert np.linalg.norm(left) <= 1e-4
        else:
            assert np.linalg.norm(left) <= 1.01 * Reference(each.grasp).least_left(each.load)


@given(st.integers(0, 10**6))
def test_residual_margins_and_effort_are_those_of_the_grasp(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    grasp = grasp_of(*around(n, rng), rng.uniform(0.3, 1.0, n), rng.uniform(0.002, 0.006, n), rng)
    scaled, forces, load = ScaledGrasp.of(grasp), rng.normal(size=(n, 4)) * [1, 1, 1, 0.004], rng.normal(size=6)
    residual, margins = np.empty(6), np.empty(n)
    effort = balance(scaled.rows, scaled.center, scaled.length, load, 0.01, forces, residual, margins)
    np.testing.assert_allclose(residual, grasp.grasp_map @ forces.ravel() + load, atol=1e-13)
    np.testing.assert_allclose(margins, grasp.margins(forces), atol=1e-13)
    twist = forces[:, 3] / grasp.spin_length
    assert effort == pytest.approx(
        ((forces[:, 0] ** 2) + 0.01 * ((forces[:, 1:3] ** 2).sum(axis=1) + twist**2)).sum()
    )
