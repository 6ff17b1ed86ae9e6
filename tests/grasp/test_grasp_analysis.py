"""What a grasp could hold: closure, internal forces, largest and worst disturbance, what mu and e are worth."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.grasp.certificates.closure import Closure, force_closure, internal_forces
from palpate.grasp.certificates.disturbance import largest_disturbance, worst_disturbance
from palpate.grasp.certificates.sensitivity import grip_sensitivity
from palpate.grasp.certificates.support_function import BearableWrenches
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.solvers.least_effort import Outcome
from support.grasp_families import check_forces, grasp_of, solved
from support.refusals import check_refusals

MU, E, RADIUS = 0.5, 0.006, 0.03


def on_sphere(directions, **more):
    """Contacts of a ball that push inwards."""
    out = np.array(directions, dtype=float)
    out /= np.linalg.norm(out, axis=1)[:, None]
    return grasp_of(RADIUS * out, -out, MU, E, np.random.default_rng([7, 1]), **more)


PAIR = ((1, 0, 0), (-1, 0, 0))
THREE = ((1, 0, 0), (-0.5, 0.866, 0), (-0.5, -0.866, 0))
FOUR = ((1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1))


def moved(grasp, rotvec, shift, size=1.0):
    turn = Rotation.from_rotvec(rotvec).as_matrix()
    return replace(
        grasp,
        positions=size * grasp.positions @ turn.T + shift,
        frames=turn @ grasp.frames,
        spin_length=size * grasp.spin_length,
    )


def holds(grasp, load):
    return solved(grasp, load)[0] == Outcome.SOLVED


@pytest.mark.parametrize("directions", [PAIR, THREE, FOUR])
def test_opposed_soft_fingers_close(directions):
    """Two soft fingers do: their spin holds the turn about their line that points would not (Nguyen 1988)."""
    grasp = on_sphere(directions)
    found = force_closure(grasp)
    assert found.closure is Closure.CLOSED
    assert found.forces is not None
    assert np.abs(grasp.grasp_map @ found.forces.ravel()).max() < 1e-9
    assert (grasp.margins(found.forces) > 0.0).all()
    assert found.forces[:, 0].min() >= 1.0 - 1e-9


@pytest.mark.parametrize(
    ("directions", "rank"),
    [([(1, 0, 0)], 4), ([(1, 0, 0), (0.9, 0.3, 0)], 6), ([(1, 0, 0), (0, 1, 0), (0, 0, 1)], 6)],
)
def test_fingers_on_one_side_do_not_close_and_the_certificate_shows_it(directions, rank):
    grasp = on_sphere(directions)
    found = force_closure(grasp)
    assert found.closure is Closure.OPEN
    assert found.rank == rank
    y = found.certificate
    assert y is not None
    # nothing within the cones pulls against it, so that a load along y is not held however hard they press
    assert BearableWrenches.of(grasp).pull(y).max() < 1e-6
    assert not holds(grasp, y)


def test_a_sheet_pinched_at_one_point_is_not_closed_though_it_can_be_squeezed():
    """The two contacts press against each other, but nothing there holds a turn about a line in the sheet."""
    sheet = GraspContacts(np.zeros((2, 3)), [np.eye(3), np.diag([-1.0, -1.0, 1.0])], [MU] * 2, [E] * 2)
    found = force_closure(sheet)
    assert found.closure is Closure.OPEN
    assert found.rank == 4
    assert found.certificate is not None
    assert np.abs(found.certificate @ sheet.grasp_map).max() < 1e-12


def test_two_fingers_close_exactly_while_their_line_is_inside_both_cones():
    """Tilted by less than the friction angle they close (Nguyen 1988), by more they do not."""

    def tilted(angle):
        out = np.array([[RADIUS, 0, 0], [-RADIUS, 0, 0]])
        normals = [(-np.cos(angle), np.sin(angle), 0), (np.cos(angle), np.sin(angle), 0)]
        return grasp_of(out, np.array(normals), MU, E, np.random.default_rng([7, 1]))

    limit = np.arctan(MU)
    assert force_closure(tilted(limit - 1e-3)).closure is Closure.CLOSED
    assert force_closure(tilted(limit + 1e-3)).closure is Closure.OPEN


def test_closure_is_the_same_in_every_frame_and_size():
    rng = np.random.default_rng(4)
    for directions in (PAIR, THREE, ((1, 0, 0), (0, 1, 0), (0, 0, 1))):
        grasp = on_sphere(directions)
        other = moved(grasp, rng.standard_normal(3), rng.standard_normal(3), size=10.0)
        assert force_closure(other).closure is force_closure(grasp).closure


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 6))
def test_internal_forces_balance_and_are_all(seed, n):
    rng = np.random.default_rng(seed)
    grasp = on_sphere(rng.standard_normal((n, 3)))
    basis = internal_forces(grasp)
    rank = np.linalg.matrix_rank(grasp.grasp_map, tol=1e-8)
    assert basis.shape == (4 * n, 4 * n - rank)
    assert np.linalg.matrix_rank(basis, tol=1e-6) == basis.shape[1]
    assert np.abs(grasp.grasp_map @ basis).max(initial=0.0) < 1e-12


def test_reach_is_the_most_that_any_force_does():
    """The support function against forces drawn within the limits: none beyond, and one attains it."""
    rng = np.random.default_rng(0)
    grasp = on_sphere(FOUR, force_min=0.5, force_max=5.0)
    borne = BearableWrenches.of(grasp)
    for _ in range(20):
        y = rng.standard_normal(6) / np.array([1, 1, 1, RADIUS, RADIUS, RADIUS])
        f = rng.uniform(0.5, 5.0, (500, 4))
        u = rng.standard_normal((500, 4, 3))
        u *= (MU * f / np.linalg.norm(u, axis=2))[..., None]
        w = np.concatenate([f[..., None], u * [1.0, 1.0, E]], axis=2).reshape(500, 16)
        assert (-(w @ grasp.grasp_map.T) @ y).max() <= borne.reach(y) * (1.0 + 1e-12)
        pull = borne.tangents @ y
        best = -pull / np.linalg.norm(pull, axis=1)[:, None]
        f = np.where(borne.pull(y) > 0.0, 5.0, 0.5)
        w = np.concatenate([f[:, None], best * (MU * f)[:, None] * [1.0, 1.0, E]], axis=1)
        assert -(grasp.grasp_map @ w.ravel()) @ y == pytest.approx(borne.reach(y), rel=1e-12)


def test_a_pair_holds_what_friction_says():
    """Across: 2 mu f. About its line: 2 mu e f. Along: with friction of both, 10 N against nothing."""
    pair = on_sphere(PAIR, force_max=10.0)
    assert largest_disturbance(pair, np.array([0, 0, -1.0, 0, 0, 0])).factor == pytest.approx(2 * MU * 10)
    assert largest_disturbance(pair, np.array([0, 0, 0, 1.0, 0, 0])).factor == pytest.approx(2 * MU * E * 10)
    assert largest_disturbance(pair, np.array([1.0, 0, 0, 0, 0, 0])).factor == pytest.approx(10.0)
    weight = np.array([0, 0, -4.0, 0, 0, 0])
    assert largest_disturbance(pair, np.array([0, 0, -1.0, 0, 0, 0]), weight).factor == pytest.approx(6.0)
    assert largest_disturbance(pair, np.array([0, 0, 1.0, 0, 0, 0]), weight).factor == pytest.approx(14.0)
    assert largest_disturbance(pair, np.array([0, 1.0, 0, 0, 0, 0]), weight).factor == pytest.approx(84.0**0.5)


@pytest.mark.parametrize("directions", [PAIR, THREE, FOUR])
def test_largest_disturbance_is_held_and_a_little_more_is_not(directions):
    rng = np.random.default_rng(1)
    grasp = on_sphere(directions, force_max=10.0)
    load = np.array([0.2, 0.1, -1.0, 0.0, 0.001, 0.0])
    borne = BearableWrenches.of(grasp)
    for _ in range(3):
        direction = rng.standard_normal(6) * [1, 1, 1, RADIUS, RADIUS, RADIUS]
        found = largest_disturbance(grasp, direction, load)
        check_forces(grasp, load + found.factor * direction, found.forces, 1e-7)
        # no forces at all do better: proven by the normal alone
        assert found.normal @ direction == pytest.approx(1.0)
        proven = borne.reach(found.normal) - found.normal @ load
        assert found.factor <= proven * (1.0 + 1e-7)
        assert proven <= found.factor * (1.0 + 1e-5)


def test_without_a_largest_force_a_closed_grasp_holds_anything():
    assert largest_disturbance(on_sphere(THREE), np.array([0.1, 1.0, -1.0, 0, 0, 0.01])).factor == np.inf


def test_worst_disturbance_of_a_pair_is_its_spin():
    """2 mu e f of torque is held, at a radius of 30 mm a fifth of 2 mu f: nothing is held less."""
    found = worst_disturbance(on_sphere(PAIR, force_max=10.0), RADIUS, starts=6)
    assert found.factor <= 2 * MU * E * 10 / RADIUS * (1.0 + 1e-6)
    assert np.linalg.norm(found.direction / [1, 1, 1, RADIUS, RADIUS, RADIUS]) == pytest.approx(1.0)


@pytest.mark.slow
def test_no_random_disturbance_is_worse_than_the_worst():
    rng = np.random.default_rng(3)
    grasp = on_sphere(THREE, force_max=10.0)
    worst = worst_disturbance(grasp, RADIUS, starts=10)
    borne = BearableWrenches.of(grasp)
    unit = np.array([1, 1, 1, RADIUS, RADIUS, RADIUS])
    y = rng.standard_normal((20_000, 6))
    y /= np.linalg.norm(y, axis=1)[:, None]
    # the border's distance is the least reach over unit normals, in this metric
    assert min(borne.reach(each / unit) for each in y) >= worst.factor * (1.0 - 1e-6)
    for _ in range(40):
        near = worst.direction / unit + 0.05 * rng.standard_normal(6)
        near *= unit / np.linalg.norm(near)
        assert holds(grasp, 0.999 * worst.factor * near)
    assert not holds(grasp, 1.001 * worst.factor * worst.direction)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(2, 6))
def test_sensitivity_is_what_solving_again_tells(seed, n):
    """Central differences over a contact's mu and e, for effort and for grip."""
    rng = np.random.default_rng(seed)
    out = rng.standard_normal((n, 3)) if n > 3 else np.array(PAIR if n == 2 else THREE)
    grasp = on_sphere(out, force_min=0.1, force_max=50.0)
    load = np.concatenate([rng.standard_normal(3), 0.01 * rng.standard_normal(3)])

    def changed(which, i, change):
        values = getattr(grasp, which).copy()
        values[i] *= 1.0 + change
        outcome, _, forces, solver = solved(replace(grasp, **{which: values}), load)
        return outcome, float(solver.out[6]), forces

    outcome, effort, forces = changed("friction", 0, 0.0)
    if outcome != Outcome.SOLVED:
        return
    found = grip_sensitivity(grasp, load)
    for which, by_effort, by_grip in (
        ("friction", found.effort_by_friction, found.grip_by_friction),
        ("spin_length", found.effort_by_spin_length, found.grip_by_spin_length),
    ):
        for i in range(n):
            (ok, more, up), (fine, less, down) = changed(which, i, 1e-5), changed(which, i, -1e-5)
            if not ok == fine == Outcome.SOLVED:
                continue
            step = 2e-5 * getattr(grasp, which)[i]
            assert (more - less) / step * getattr(grasp, which)[i] == pytest.approx(
                by_effort[i] * getattr(grasp, which)[i], abs=2e-4 * effort
            )
            slope = (up[:, 0].sum() - down[:, 0].sum()) / 2e-5
            kinked = np.abs(up[:, 0].sum() + down[:, 0].sum() - 2 * forces[:, 0].sum()) > 1e-8 * effort**0.5
            if not kinked:
                assert by_grip[i] * getattr(grasp, which)[i] == pytest.approx(slope, abs=2e-5 * forces[:, 0].sum())


def test_more_friction_never_costs_effort():
    found = grip_sensitivity(on_sphere(FOUR), np.array([0.3, 0.2, -2.0, 0.005, 0.0, 0.002]))
    assert (found.effort_by_friction <= 0.0).all()
    assert (found.effort_by_spin_length <= 0.0).all()
    assert found.effort_by_friction.min() < 0.0


def test_what_makes_no_sense_is_refused():
    grasp = on_sphere(THREE, force_max=10.0)
    check_refusals(
        ("direction is zero", lambda: largest_disturbance(grasp, np.zeros(6))),
        ("force_max is infinite", lambda: worst_disturbance(on_sphere(THREE), RADIUS)),
        ("length = 0", lambda: worst_disturbance(grasp, 0.0)),
        ("cones alone", lambda: worst_disturbance(replace(grasp, load_exponent=[0.3] * 3), RADIUS)),
        ("is not held", lambda: grip_sensitivity(on_sphere([(1, 0, 0)]), np.array([-1.0, 0, 0, 0, 0, 0]))),
    )
