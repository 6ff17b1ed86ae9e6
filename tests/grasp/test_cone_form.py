"""The cone form of grasp forces: optimal by its own conditions, certain about loads that cannot be held."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.errors import FloatArray
from palpate.grasp import GraspContacts, GraspForceOptimizer, Objective, SolveStatus
from palpate.grasp.problem.cone_form import CoupledProgramme
from palpate.grasp.problem.limits import CoupledLimits, actuator_limits
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.conic import ConicOutcome, ConicProgramme, ConicSolution
from support.grasp_families import least_value
from support.hard_grasps import antipodal, around, held, instances, unit

ENDLESS = (Objective.MAX_MARGIN, Objective.LOAD_FACTOR)
"""Objectives that grow without limit where forces close and no contact has a largest force."""


def grasp_of(contacts: FloatArray, **more: FloatArray) -> GraspContacts:
    frames = contacts[:, 3:12].reshape(-1, 3, 3).transpose(0, 2, 1)
    return GraspContacts(contacts[:, :3], frames, *(contacts[:, k] for k in (13, 12, 14, 15)), **more)


def rooms(v: FloatArray, blocks: FloatArray) -> FloatArray:
    return np.array([v[a] - np.linalg.norm(v[a + 1 : b]) for a, b in pairwise(blocks)])


def assert_optimal(programme: ConicProgramme, found: ConicSolution) -> None:
    p, x, s, z = programme, found.x, found.s, found.z
    size, slope = 1.0 + np.abs(s).max() + np.abs(p.b).max(), 1.0 + np.abs(z).max() + np.abs(found.y).max()
    assert np.abs(p.A @ x - p.b).max() <= 1e-9 * size
    assert np.abs(p.G @ x + s - p.h).max() <= 1e-9 * size
    assert np.abs(p.P @ x + p.q + p.A.T @ found.y + p.G.T @ z).max() <= 1e-9 * slope
    assert rooms(s, p.blocks).min() >= -1e-9 * size
    assert rooms(z, p.blocks).min() >= -1e-9 * slope
    value = 0.5 * x @ p.P @ x + p.q @ x
    bound = -0.5 * x @ p.P @ x - p.b @ found.y - p.h @ z
    assert abs(value - bound) <= 1e-8 * max(abs(value), 1e-3)


def assert_decided(objective: Objective, family: str, contacts: FloatArray, load: FloatArray) -> None:
    if objective in ENDLESS:
        contacts[:, 15] = np.minimum(contacts[:, 15], 30.0)
    grasp = grasp_of(contacts)
    scaled = ScaledGrasp.of(grasp)
    programme = CoupledProgramme(scaled, objective, 0.01, CoupledLimits.none(len(grasp))).of(*scaled.load(load))
    found = programme.solve()
    if found.outcome == ConicOutcome.SOLVED:
        assert_optimal(programme, found)
    result = GraspForceOptimizer(grasp, objective).solve(load)
    if result.status is SolveStatus.INFEASIBLE:
        assert "holds" not in family
        if result.certificate is None:
            assert objective is Objective.MAX_MARGIN
            assert result.objective < 0.0
        else:
            assert least_value(grasp, load, result.certificate, 0.999 * min(result.reach, 1e300)) > 0
        return
    assert result.status is SolveStatus.SOLVED, family
    if objective is not Objective.LOAD_FACTOR:
        size = max(1.0, contacts[:, 14].max())
        assert np.abs(result.equilibrium_residual).max() <= 1e-9 * size
        assert result.margin.min() >= -1e-9 * size


@pytest.mark.parametrize("objective", Objective)
@pytest.mark.parametrize(("seed", "each"), [(11, 1), pytest.param(314, 30, marks=pytest.mark.slow)])
def test_of_hard_grasps_of_every_family_none_is_left_undecided(objective: Objective, seed: int, each: int) -> None:
    for family, contacts, load in instances(seed, each):
        assert_decided(objective, family, contacts, load)


@pytest.mark.parametrize("objective", Objective)
def test_spin_about_the_line_of_two_fingers_is_borne_by_e_alone(objective: Objective) -> None:
    mu, e = 0.4, 0.1
    for spin in (0.5, 0.99, 0.999, 1.001, 1.01):
        contacts, load = antipodal(mu, e, spin)
        found, press = GraspForceOptimizer(grasp_of(contacts), objective).solve(load), contacts[0, 15]
        if objective is Objective.LOAD_FACTOR:
            assert found.load_factor == pytest.approx(1.0 / spin, rel=1e-8)
        elif objective is Objective.MAX_MARGIN:
            assert found.objective == pytest.approx(mu * press * (1.0 - spin), rel=1e-7)
            assert (found.status is SolveStatus.SOLVED) == (spin < 1.0)
        elif spin > 1.0:
            assert found.status is SolveStatus.INFEASIBLE
        else:
            np.testing.assert_allclose(found.forces[:, 0], spin * press, rtol=1e-8)


@pytest.mark.parametrize("objective", Objective)
def test_units_of_force_do_not_matter(objective: Objective) -> None:
    rng = np.random.default_rng(2)
    contacts = around(rng, 4, hi=4.0)
    contacts[:, 14] = 0.1
    load = held(rng, contacts, 0.5)
    one = GraspForceOptimizer(grasp_of(contacts), objective).solve(load)
    power = {Objective.MIN_EFFORT: 2, Objective.LOAD_FACTOR: 0}.get(objective, 1)
    for unit_of_force in (1e-3, 1e3, 2.0**10):
        scaled = contacts.copy()
        scaled[:, 14:16] *= unit_of_force
        found = GraspForceOptimizer(grasp_of(scaled), objective).solve(unit_of_force * load)
        assert found.status is SolveStatus.SOLVED
        assert found.objective == pytest.approx(unit_of_force**power * one.objective, rel=1e-8)


def test_actuator_limits_bind_or_make_it_impossible() -> None:
    rng = np.random.default_rng(8)
    solved = bound = 0
    for objective in [each for each in Objective for _ in range(4)]:
        contacts = around(rng, 3, hi=5.0)
        load, rows = held(rng, contacts, 0.5), rng.normal(size=(3, 2, 4)) * [1.0, 1.0, 1.0, 5.0]
        free = GraspForceOptimizer(grasp_of(contacts), objective).solve(load)
        limits = 0.97 * np.abs(np.einsum("nkj,nj->nk", rows, free.forces)) + 1e-3
        limits[0, 0] = np.inf
        limited = grasp_of(contacts, actuator_map=rows, actuator_limit=limits)
        found = GraspForceOptimizer(limited, objective).solve(load)
        scaled, stated = ScaledGrasp.of(limited), actuator_limits(rows, limits, 3)
        programme = CoupledProgramme(scaled, objective, 0.01, stated).of(*scaled.load(load))
        answer = programme.solve()
        if answer.outcome == ConicOutcome.SOLVED:
            assert_optimal(programme, answer)
        if found.status is not SolveStatus.SOLVED:
            assert found.status is SolveStatus.INFEASIBLE
            continue
        solved += 1
        loaded = np.abs(np.einsum("nkj,nj->nk", rows, found.forces))
        assert (loaded <= limits + 1e-8 * np.maximum(limits, 1.0)).all()
        bound += bool((loaded >= limits - 1e-6)[np.isfinite(limits)].any())
        none = grasp_of(contacts, actuator_map=rows, actuator_limit=np.full((3, 2), np.inf))
        again = GraspForceOptimizer(none, objective).solve(load)
        assert again.objective == pytest.approx(free.objective, rel=1e-6, abs=1e-7)
    assert solved >= 8
    assert bound >= 6


def test_no_load_needs_no_forces_and_two_opposite_fingers_hold_any_multiple() -> None:
    contacts = around(np.random.default_rng(1), 3)
    nothing = GraspForceOptimizer(grasp_of(contacts), "min_peak").solve(np.zeros(6))
    assert nothing.objective == pytest.approx(0.0, abs=1e-8)
    contacts, load = antipodal(0.5, 0.2, 0.5)
    contacts[:, 15] = np.inf
    endless = GraspForceOptimizer(grasp_of(contacts), "load_factor").solve(load)
    assert endless.load_factor == np.inf
    assert np.abs(endless.equilibrium_residual).max() <= 1e-8
    assert endless.margin.min() >= -1e-8


def test_the_least_violation_is_a_margin_below_zero() -> None:
    contacts, load = antipodal(0.5, 0.2, 1.5)
    found = GraspForceOptimizer(grasp_of(contacts), "max_margin").solve(load)
    assert found.status is SolveStatus.INFEASIBLE
    assert found.objective < 0.0
    np.testing.assert_allclose(found.margin, found.objective, rtol=1e-6)


def test_a_hundred_contacts_take_hardly_more_iterations() -> None:
    rng = np.random.default_rng(6)
    found = GraspForceOptimizer(grasp_of(around(rng, 100)), "min_peak").solve(unit(rng, 6))
    assert found.status is SolveStatus.SOLVED
    assert found.iterations <= 35
