"""The problem as it is stated: signs and units against the grasp map, and an optimum known by hand."""

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.friction import LimitSurface
from palpate.grasp.problem.objective_spec import Objective
from palpate.grasp.problem.statement import cone_margin, dual_cone_margin, optimality, state_contact
from support.hard_grasps import antipodal, around, pushed

NONE = np.zeros((0, 2))


def test_wrench_is_the_grasp_map_times_the_forces() -> None:
    rng = np.random.default_rng(0)
    one = state_contact(Objective.MIN_EFFORT)
    wrench = casadi.Function("wrench", [one.contact, one.forces], [one.wrench])
    contacts, forces = around(rng, 5), rng.normal(size=(5, 4))
    total = sum(np.array(wrench(c, x)).ravel() for c, x in zip(contacts, forces, strict=True))
    np.testing.assert_allclose(total, pushed(contacts, forces), atol=1e-14)


@pytest.mark.slow
@given(
    st.floats(0.05, 2.0),
    st.floats(1e-3, 0.1),
    st.floats(0.0, 1.0 / 3.0),
    st.floats(1.0, 2.0),
    st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3),
    st.floats(0.01, 5.0),
)
def test_cone_margin_is_that_of_the_limit_surface(
    mu: float, c: float, gamma: float, p: float, u: list[float], f: float
) -> None:
    exponent = casadi.SX.sym("gamma")
    one = state_contact(Objective.MIN_EFFORT, load_exponent=exponent)
    margin = casadi.Function("margin", [one.contact, exponent, one.forces], [cone_margin(one.cone, p)])
    contact = np.zeros(16)
    contact[12:14] = c, mu
    surface = LimitSurface(mu, c, gamma, p)
    expected = surface.margin(f, float(np.hypot(u[0], u[1])), c * u[2])
    assert float(margin(contact, gamma, [f, *u])) == pytest.approx(expected, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("p", [1.0, 1.5, 2.0])
def test_cone_margin_is_above_no_tangent_also_where_nothing_slides(p: float) -> None:
    """It is concave: what exists as its gradient must be above it everywhere."""
    s = casadi.SX.sym("s", 4)
    tangent = casadi.Function("tangent", [s], [cone_margin(s, p), casadi.gradient(cone_margin(s, p), s)])
    rng = np.random.default_rng(3)
    for at in ([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [1.0, 0.2, 0.0, 0.0], [1.0, 0.0, 0.0, -0.2]):
        value, slope = (np.array(each).ravel() for each in tangent(at))
        for other in rng.normal(size=(100, 4)):
            assert float(tangent(other)[0]) <= value + slope @ (other - at) + 1e-12


@given(st.floats(1.0, 2.0), st.integers(0, 2**32 - 1))
def test_points_and_multipliers_inside_their_cones_have_no_negative_product(p: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s, z = rng.normal(size=4), rng.normal(size=4)
    s[0] -= float(cone_margin(casadi.DM(s), p))
    z[0] -= float(dual_cone_margin(casadi.DM(z), p))
    assert s @ z >= -1e-12


def test_dual_cone_is_no_smaller_than_it_must_be() -> None:
    # for each z on its boundary there is a point on the boundary of the cone whose product with it vanishes
    for p in (1.0, 1.5, 2.0):
        z = np.array([0.0, 0.6, 0.0, 0.3])
        z[0] = -float(dual_cone_margin(casadi.DM(z), p))
        angles = np.linspace(0.0, 0.5 * np.pi, 20001)
        points = np.column_stack([np.zeros_like(angles), -np.cos(angles), 0.0 * angles, -np.sin(angles)])
        points[:, 0] = (np.abs(points[:, 1]) ** p + np.abs(points[:, 3]) ** p) ** (1.0 / p)
        assert (points @ z).min() == pytest.approx(0.0, abs=1e-7)


def test_optimum_known_by_hand_meets_the_conditions_and_nothing_else_does() -> None:
    # two fingers hold a load along their tangent: each takes half of it, and presses just enough
    contacts, _ = antipodal(0.5, 0.2, 0.5)
    contacts[:, 15] = np.inf
    weight = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    up = np.array([c[[8, 11]] for c in contacts])  # the tangents' share of z
    forces = np.column_stack([np.full(2, 1.0), -0.5 * up, np.zeros(2)])
    np.testing.assert_allclose(pushed(contacts, forces) + weight, 0.0, atol=1e-15)
    # stationary: 2 f = mu z0 and 2 eps u + A_u'y = z_u, with z_u = -z0 u / |u| on the cone
    eps, z0 = 0.01, 2.0 / 0.5
    cone = np.column_stack([np.full(2, z0), -z0 * forces[:, 1:] / 0.5])
    dual = np.array([0.0, 0.0, z0 + 2.0 * eps * 0.5, 0.0, 0.0, 0.0])
    conditions = optimality(2, Objective.MIN_EFFORT, effort_weight=eps)

    def found(forces: np.ndarray) -> list[np.ndarray]:
        exponents, bounds = np.tile([[0.0], [2.0]], 2), np.zeros((2, 2))
        given = (contacts.T, weight, NONE, NONE, exponents, forces.T, 0.0, dual, cone.T, bounds)
        return [np.array(each).ravel() for each in conditions(*given)]

    stationarity, equilibrium, feasible, dual_feasible, product, gap, objective = found(forces)
    np.testing.assert_allclose(equilibrium, 0.0, atol=1e-15)
    np.testing.assert_allclose([*feasible, *dual_feasible, *product], 0.0, atol=1e-14)
    np.testing.assert_allclose(stationarity, 0.0, atol=1e-13)
    assert gap[0] == pytest.approx(0.0, abs=1e-13)
    assert objective[0] == pytest.approx(2.0 * (1.0 + eps * 0.25))
    assert np.abs(found(1.1 * forces)[0]).max() > 0.1
