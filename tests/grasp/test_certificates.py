"""What is claimed of a load is true of the numbers given, at any scale, from any thread, and from a copy."""

import copy
import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from palpate.errors import ConcurrentUseError
from palpate.grasp import GraspContacts, GraspForceOptimizer, Objective, SolveStatus
from support.grasp_families import FAMILIES, check_forces, drawn, instances, least_value, paired

OBJECTIVES = [each.value for each in Objective]
LOAD = np.array([0.3, -1.0, 0.5, 0.004, 0.002, -0.006])


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 15.0), st.sampled_from(OBJECTIVES))
def test_a_preload_far_above_the_load_holds_it(seed, decades, objective):
    """It was called infeasible, with a certificate, where the preload was more than 1e9 times the load."""
    grasp = paired(seed, 10.0, 1e3)
    load = LOAD / np.linalg.norm(LOAD) * 10.0 ** (-decades)
    result = GraspForceOptimizer(grasp, objective).solve(load)
    assert result.status is SolveStatus.SOLVED
    if objective != "load_factor":
        check_forces(grasp, load, result.forces, 1e-8)
        assert (result.forces[:, 0] >= 10.0 * (1.0 - 1e-9)).all()


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.integers(-100, 300), st.sampled_from(OBJECTIVES))
def test_forces_are_as_large_as_the_load_at_any_scale(seed, decades, objective):
    grasp, scale = paired(seed, 0.0, 50.0), 10.0**decades
    large = replace(grasp, force_max=50.0 * scale)
    one, many = (GraspForceOptimizer(g, objective).solve(w) for g, w in ((grasp, LOAD), (large, LOAD * scale)))
    assert many.status is one.status
    assert not math.isnan(many.objective)
    assert many.forces[:, 0] / scale == pytest.approx(one.forces[:, 0], rel=1e-4, abs=1e-6)


def test_where_forces_overflow_nothing_is_called_solved():
    for objective in ("min_effort", "min_peak", "load_factor"):
        found = GraspForceOptimizer(paired(3, 0.0, math.inf), objective).solve(np.full(6, 1e308))
        assert found.status is SolveStatus.INVALID
        assert not found.forces.any()


def test_certificates_hold_at_50_digits_up_to_their_reach():
    seen = 0
    for each in instances(seed=4, per_family=1):
        for grasp in (each.grasp, replace(each.grasp, force_max=math.inf)):
            result = GraspForceOptimizer(grasp).solve(each.load)
            if result.certificate is None:
                continue
            seen += 1
            assert result.reach is not None
            assert least_value(grasp, each.load, result.certificate, 0.999 * min(result.reach, 1e300)) > 0
    assert seen > 10


@settings(max_examples=15)
@given(st.integers(0, 2**32 - 1), st.sampled_from(FAMILIES), st.floats(-8.5, -3.0), st.booleans())
def test_what_can_just_be_held_is_told_from_what_cannot(seed, family, decades, beyond):
    """Both sides of the boundary, which `load_factor` itself knows to 1e-9 of the load."""
    grasp, load = drawn(family, np.random.default_rng(seed))
    most = GraspForceOptimizer(grasp, "load_factor").solve(load).objective
    assume(1e-3 < most < 1e6)
    load = load * most * (1.0 + (1.0 if beyond else -1.0) * 10.0**decades)
    result = GraspForceOptimizer(grasp).solve(load)
    if result.status is SolveStatus.INFEASIBLE:
        assert beyond
        assert least_value(grasp, load, result.certificate, 0.0) > 0
    else:
        assert result.status is SolveStatus.SOLVED
        assert not beyond or decades < -8.0  # there its forces leave no more than is allowed


@pytest.mark.slow
def test_threads_that_share_an_optimizer_get_what_is_right_or_an_error():
    grasp = paired(5, 0.0, 50.0)
    for objective in ("min_effort", "min_peak"):
        shared = GraspForceOptimizer(grasp, objective)
        expected = shared.solve(LOAD, warm_start=False).forces

        def solve(optimizer, expected=expected):
            refused = 0
            for _ in range(500):
                try:
                    assert (optimizer.solve(LOAD, warm_start=False).forces == expected).all()
                except ConcurrentUseError:
                    refused += 1
            return refused

        with ThreadPoolExecutor(4) as threads:
            list(threads.map(solve, [shared] * 4))
            assert sum(threads.map(solve, [copy.copy(shared) for _ in range(4)])) == 0


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
def test_copies_solve_alike_and_their_arrays_stay_read_only(copied):
    grasp = paired(6, 0.0, 50.0)
    again = copied(grasp)
    assert isinstance(again, GraspContacts)
    for field in fields(grasp):
        value = getattr(again, field.name)
        if value is not None:
            assert not value.flags.writeable
            assert (value == getattr(grasp, field.name)).all()
    one = GraspForceOptimizer(grasp, "min_peak")
    assert (copied(one).solve(LOAD).forces == one.solve(LOAD).forces).all()
