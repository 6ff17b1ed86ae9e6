"""Own objectives, own limits and shared actuators: against IPOPT, against the named solvers, and by symmetry."""

import copy
import math
import pickle
from dataclasses import replace

import casadi
import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.grasp import GraspForceOptimizer, SolveStatus
from support.coupled_grasps import CONVEX, LOAD, OTHERS, SHARED, TENDONS, effort, ring
from support.grasp_families import instances
from support.opti_grasp import opti_forces
from support.refusals import check_refusals


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CONVEX, *OTHERS])
def test_ipopt_finds_the_same_forces(name):
    objective, subject_to = (CONVEX | OTHERS)[name]
    grasp = ring()
    optimizer = GraspForceOptimizer(grasp, objective, subject_to=subject_to, shared_actuators=SHARED)
    optimizer.solve(1.02 * LOAD)
    result = optimizer.solve(LOAD)
    value, forces = opti_forces(grasp, LOAD, objective, subject_to, SHARED)
    assert result.status is SolveStatus.SOLVED
    assert result.local == (name in OTHERS)
    assert result.objective == pytest.approx(value, rel=1e-9)
    np.testing.assert_allclose(result.forces, forces, atol=1e-8)
    assert np.abs(result.equilibrium_residual).max() < 1e-9
    assert result.margin.min() > -1e-9
    assert (TENDONS @ result.forces.ravel() <= np.array(SHARED[2]) + 1e-11).all()


@pytest.mark.slow
def test_a_size_is_two_linear_limits():
    def forces(subject_to):
        return GraspForceOptimizer(ring(), effort, subject_to=subject_to).solve(LOAD).forces

    both = forces(lambda w: [2.0 * (w[1:, 1] - w[0, 1]) <= 0.1, 2.0 * (w[0, 1] - w[1:, 1]) <= 0.1])
    np.testing.assert_allclose(forces(lambda w: [2.0 * casadi.fabs(w[:, 1] - w[0, 1]) <= 0.1]), both, atol=1e-6)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"objective": CONVEX["a tendon"][0], "shared_actuators": SHARED},
        {"objective": effort, "subject_to": OTHERS["product"][1], "shared_actuators": SHARED},
    ],
    ids=["least effort", "a tendon", "product"],
)
def test_the_dual_is_what_the_objective_grows_by(options):
    optimizer = GraspForceOptimizer(ring(), **options)
    dual, steps = optimizer.solve(LOAD).dual, 1e-5 * np.diag([1.0, 1.0, 1.0, 0.03, 0.03, 0.03])
    for step in steps:
        rise = optimizer.solve(LOAD + step).objective - optimizer.solve(LOAD - step).objective
        assert rise == pytest.approx(2.0 * dual @ step, rel=1e-3, abs=1e-9)


@pytest.mark.slow
def test_limits_that_do_not_bind_change_nothing_of_the_hardest_grasps():
    undecided = 0
    for each in instances(seed=21, per_family=2):
        rows = np.zeros((1, 4 * len(each.grasp)))
        rows[0, ::4] = 1.0
        result = GraspForceOptimizer(each.grasp, shared_actuators=(rows, -np.inf, 1e12)).solve(each.load)
        plain = GraspForceOptimizer(each.grasp).solve(each.load)
        undecided += result.status is SolveStatus.MAX_ITERATIONS
        if result.status is SolveStatus.SOLVED:
            assert plain.status is SolveStatus.SOLVED
            assert result.objective == pytest.approx(plain.objective, rel=1e-7)
        elif result.status is SolveStatus.INFEASIBLE:
            assert plain.status is SolveStatus.INFEASIBLE
            assert result.load_factor == pytest.approx(plain.load_factor, rel=1e-5)
    assert undecided <= 2


@pytest.mark.parametrize("objective", ["min_effort", "max_margin", "min_peak", "load_factor"])
def test_named_objectives_with_limits_that_do_not_bind_are_what_they_were(objective):
    shared = (TENDONS, -np.inf, 9.0)
    result = GraspForceOptimizer(ring(), objective, shared_actuators=shared).solve(LOAD)
    assert result.objective == pytest.approx(
        GraspForceOptimizer(ring(), objective).solve(LOAD).objective, rel=1e-8
    )


def test_any_multiple_of_no_load_is_held_and_of_a_load_that_nothing_limits():
    nothing = GraspForceOptimizer(ring(), "load_factor", shared_actuators=SHARED).solve(np.zeros(6))
    unlimited = (TENDONS, -0.01, np.inf)
    endless = GraspForceOptimizer(ring(force_max=np.inf), "load_factor", shared_actuators=unlimited).solve(LOAD)
    for result in (nothing, endless):
        assert result.status is SolveStatus.SOLVED
        assert result.load_factor == math.inf
        assert np.abs(result.equilibrium_residual).max() < 1e-9


@pytest.mark.parametrize("name", [*CONVEX, *OTHERS])
def test_where_it_begins_changes_nothing(name):
    """Newton's method goes on from the last forces; a convex problem or a sequence of them from none."""
    objective, subject_to = (CONVEX | OTHERS)[name]
    optimizer = GraspForceOptimizer(ring(), objective, subject_to=subject_to, shared_actuators=SHARED)
    for k in range(8):
        load = LOAD * (1.0 + 0.03 * np.sin(k + np.arange(6)))
        warm, cold = optimizer.solve(load), copy.copy(optimizer).solve(load)
        assert warm.status is cold.status
        if warm.status is SolveStatus.SOLVED:
            np.testing.assert_allclose(warm.forces, cold.forces, atol=1e-9)
            np.testing.assert_allclose(warm.dual, cold.dual, rtol=1e-6, atol=1e-6)


@pytest.mark.slow
def test_actuators_behind_one_contact_may_be_stated_as_shared():
    maps, limits = np.tile([[[0.012, 0.004, 0.0, 0.0]]], (4, 1, 1)), np.full((4, 1), 0.0115)
    rows = np.zeros((4, 4, 4))
    rows[range(4), range(4)] = maps[:, 0]
    own = GraspForceOptimizer(replace(ring(), actuator_map=maps, actuator_limit=limits)).solve(LOAD)
    shared = (rows.reshape(4, 16), -limits[:, 0], limits[:, 0])
    result = GraspForceOptimizer(ring(), shared_actuators=shared).solve(LOAD)
    np.testing.assert_allclose(result.forces, own.forces, atol=1e-6)


def test_what_tendons_do_not_bear_is_proven_and_how_much_they_do_is_told():
    optimizer = GraspForceOptimizer(ring(), effort, shared_actuators=(TENDONS, -0.01, [0.015, 0.018]))
    result = optimizer.solve(LOAD)
    assert result.status is SolveStatus.INFEASIBLE
    assert result.certificate is not None
    assert f"{result.load_factor:.6g} of the load" in result.reason
    assert (TENDONS @ result.forces.ravel() <= np.array([0.015, 0.018]) + 1e-9).all()
    assert optimizer.solve(LOAD * result.load_factor * (1.0 - 1e-6)).status is SolveStatus.SOLVED
    refused = optimizer.solve(LOAD * result.load_factor * (1.0 + 1e-6))
    assert refused.status is SolveStatus.INFEASIBLE
    # no forces that the tendons bear are worth more than the load is, along the certificate
    worth = GraspForceOptimizer(
        replace(ring(), force_max=np.full(4, 5.0)),
        lambda w: casadi.dot(result.certificate, casadi.DM(ring().grasp_map) @ casadi.vec(w.T)),
        shared_actuators=(TENDONS, -0.01, [0.015, 0.018]),
    ).solve(LOAD * result.load_factor)
    assert worth.objective + result.certificate @ LOAD > 0.0


def test_own_limits_that_exclude_each_other_are_named():
    optimizer = GraspForceOptimizer(
        ring(), subject_to=lambda w: [w[1, 0] <= 9, w[0, 0] >= 3, w[0, 0] + w[2, 0] <= 2]
    )
    result = optimizer.solve(LOAD)
    assert result.status is SolveStatus.INFEASIBLE
    assert result.reason.endswith(": subject_to[1], subject_to[2]")
    curved = GraspForceOptimizer(ring(), effort, subject_to=lambda w: [casadi.sin(w[0, 0]) >= 1.5]).solve(LOAD)
    assert curved.status is SolveStatus.MAX_ITERATIONS
    assert "subject_to[0]" in curved.reason


def test_an_objective_that_falls_without_end_is_no_solution():
    result = GraspForceOptimizer(ring(force_max=np.inf), lambda w: -casadi.sum1(w[:, 0])).solve(LOAD)
    assert result.status is SolveStatus.MAX_ITERATIONS
    assert "force_max" in result.reason


def test_no_saddle_is_called_solved():
    """Two opposite fingers alike: pressing alike meets the first-order conditions, and is the worst of all."""
    result = GraspForceOptimizer(
        ring(4, aslant=0.0), lambda w: effort(w) - 8.0 * (w[0, 0] + w[2, 0] - w[1, 0] - w[3, 0]) ** 2
    ).solve([0.0, 0.0, -2.0, 0.0, 0.0, 0.0])
    assert result.status is SolveStatus.SOLVED
    assert result.local
    assert abs(result.forces[0, 0] + result.forces[2, 0] - result.forces[1, 0] - result.forces[3, 0]) > 5.0


def test_a_slope_that_does_not_exist_is_told():
    result = GraspForceOptimizer(ring(), lambda w: casadi.sqrt(w[0, 0] - 30.0)).solve(LOAD)
    assert result.status is SolveStatus.MAX_ITERATIONS
    assert "no value or no slope" in result.reason


def test_forces_scale_with_the_load_where_nothing_else_has_a_size():
    optimizer = GraspForceOptimizer(
        ring(force_max=np.inf), effort, subject_to=lambda w: [w[0, 0] <= 0.9 * w[1, 0]]
    )
    one = optimizer.solve(LOAD).forces
    for scale in (1e-4, 1e5):
        np.testing.assert_allclose(optimizer.solve(scale * LOAD).forces, scale * one, atol=1e-6 * scale)


def test_contacts_and_actuators_change_without_a_new_optimizer():
    optimizer = GraspForceOptimizer(ring(), effort, shared_actuators=SHARED)
    optimizer.update(ring(aslant=0.25), (TENDONS, -0.01, [0.020, 0.021]))
    fresh = GraspForceOptimizer(ring(aslant=0.25), effort, shared_actuators=(TENDONS, -0.01, [0.020, 0.021]))
    np.testing.assert_array_equal(optimizer.solve(LOAD).forces, fresh.solve(LOAD).forces)
    optimizer.update(ring(5), (np.zeros((1, 20)), -1.0, 1.0))
    assert optimizer.solve(LOAD).forces.shape == (5, 4)
    with pytest.raises(InvalidValueError, match=r"must be \(1, 12\)"):
        optimizer.update(ring(3))


def test_copies_and_pickles_solve_alike_and_a_lambda_says_that_it_cannot():
    for one in (
        GraspForceOptimizer(ring(), effort, shared_actuators=SHARED),
        GraspForceOptimizer(ring(), subject_to=OTHERS["product"][1]),
    ):
        expected = one.solve(LOAD, warm_start=False).forces
        for copied in (copy.copy(one), copy.deepcopy(one)):
            np.testing.assert_array_equal(copied.solve(LOAD).forces, expected)
    again = pickle.loads(pickle.dumps(GraspForceOptimizer(ring(), effort, shared_actuators=SHARED)))
    assert again.solve(LOAD).status is SolveStatus.SOLVED
    with pytest.raises(InvalidValueError, match=r"subject_to .* cannot be pickled"):
        pickle.dumps(one)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"objective": lambda w: w}, r"objective: returned shape \(4, 4\)"),
        ({"objective": lambda _: "least"}, "objective: returned a str"),
        ({"objective": lambda _: None}, "objective: returned a NoneType"),
        ({"objective": lambda _: casadi.SX.sym("mass")}, "mass"),
        ({"objective": lambda w: w[7, 0]}, "objective: failed"),
        ({"objective": lambda _: math.nan}, "objective: is nan"),
        ({"subject_to": lambda w: w[0, 0] <= 5}, "must return a list"),
        ({"subject_to": lambda w: [w[0, 0]]}, r"subject_to\[0\] .*relation"),
        ({"subject_to": lambda w: [casadi.SX(2) <= 1]}, "whatever the forces"),
        ({"subject_to": lambda _: [True]}, r"subject_to\[0\]: is a bool"),
        ({"subject_to": lambda w: [0 <= w[0, 0] <= 5]}, "subject_to: failed"),
        ({"objective": lambda w: casadi.fabs(w[0, 1])}, "objective: has a kink"),
        ({"subject_to": lambda w: [casadi.fmin(w[0, 0], w[1, 0]) <= 1]}, r"subject_to\[0\]: has a kink"),
        ({"subject_to": 5}, "must be a function"),
        ({"shared_actuators": TENDONS}, "must be"),
        ({"shared_actuators": (TENDONS[:, :3], 0, 1)}, r"\(2, 3\)"),
        ({"shared_actuators": (TENDONS, 1, 0)}, "actuator 0 has lower = 1 and upper = 0"),
        ({"shared_actuators": (TENDONS, [0, 0, 0], 1)}, "lower has shape"),
        ({"shared_actuators": (TENDONS, math.nan, 1)}, "lower"),
    ],
)
def test_what_cannot_be_meant_is_refused_by_name(wanted, message):
    check_refusals(
        (message, lambda: GraspForceOptimizer(ring(), **wanted)),
        ("load_exponent", lambda: GraspForceOptimizer(ring(load_exponent=0.3), effort)),
    )
