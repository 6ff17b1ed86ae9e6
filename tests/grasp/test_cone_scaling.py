"""The scaling of a cone, and what answers say of forces: identities that hold for any point."""

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import FloatArray
from palpate.grasp.balance import balance
from palpate.grasp.cone_scaling import OVER_SQUARES, back, back_acting, jordan, scaling, turn
from palpate.grasp.scaled import ScaledGrasp
from support.grasp_families import around, grasp_of

V, Z = casadi.SX.sym("v", 4), casadi.SX.sym("z", 4)
W = scaling(V, Z)
COORDINATES = OVER_SQUARES * turn(W.frame, V)
LOOK = casadi.Function(
    "look",
    [V, Z],
    [
        COORDINATES,
        turn(W.frame, Z),
        W.curvature,
        W.values * W.inverses,
        back(W.frame, COORDINATES),
        back_acting(W.frame, turn(W.frame, Z)),
    ],
)
"""Coordinates of v and z, eigenvalues of W^-2, those of W W^-1, and both points back again."""

DV, DZ = casadi.SX.sym("dv", 4), casadi.SX.sym("dz", 4)
BLOCKED = casadi.Function(
    "blocked",
    [V, Z, DV, DZ],
    [jordan(W, turn(W.frame, Z), OVER_SQUARES * turn(W.frame, DV), turn(W.frame, DZ))[0]],
)


def inside(rng: np.random.Generator, margin: float) -> FloatArray:
    """Return a point of the cone at a relative distance from its boundary."""
    u = rng.normal(size=3)
    return np.array([np.linalg.norm(u) * (1.0 + margin), *u]) * 10.0 ** rng.uniform(-3.0, 3.0)


def at(v: FloatArray, z: FloatArray) -> list[FloatArray]:
    return [np.array(each).ravel() for each in LOOK(v, z)]


@given(st.integers(0, 10**6), st.floats(-6.0, 1.0), st.floats(-6.0, 1.0))
def test_the_scaling_maps_the_multiplier_to_the_point(seed: int, one: float, two: float) -> None:
    rng = np.random.default_rng(seed)
    v, z = inside(rng, 10.0**one), inside(rng, 10.0**two)
    coordinates, acting, curvature, unit, v_again, z_again = at(v, z)
    np.testing.assert_allclose(curvature * coordinates, acting, rtol=1e-7, atol=1e-7 * np.abs(acting).max())
    np.testing.assert_allclose(unit, 1.0, rtol=1e-14)
    np.testing.assert_allclose(v_again, v, atol=4e-15 * v[0])
    np.testing.assert_allclose(z_again, z, atol=4e-15 * z[0])
    assert coordinates @ acting == pytest.approx(v @ z, rel=1e-12)


def test_points_along_the_axis_have_a_frame_too() -> None:
    v, z = np.array([2.0, 0.0, 0.0, 0.0]), np.array([0.5, 0.0, 0.0, 0.0])
    assert at(v, z)[2] == pytest.approx([0.5, 0.25, 0.25, 0.5])
    frame = np.array(casadi.Function("frame", [V, Z], [W.frame])(v, z))
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)


@given(st.integers(0, 10**6))
def test_a_step_to_the_boundary_ends_there(seed: int) -> None:
    rng = np.random.default_rng(seed)
    v, z, dv, dz = inside(rng, 0.3), inside(rng, 0.3), rng.normal(size=4), rng.normal(size=4)
    blocked = float(BLOCKED(v, z, dv, dz))
    if blocked <= 1e-3:
        return

    def least(share: float) -> float:
        moved = [(x + share / blocked * d) / x[0] for x, d in ((v, dv), (z, dz))]
        return float(min(each[0] - np.linalg.norm(each[1:]) for each in moved))

    assert least(0.999) > 0.0
    assert least(1.001) < 0.0


@given(st.integers(0, 10**6))
def test_residual_margins_and_effort_are_those_of_the_grasp(seed: int) -> None:
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
