"""The friction law and its bristle without MuJoCo: limit surface, normality, energy, no creep."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.sim.friction.bristle import borne, nearest, packed
from palpate.sim.friction.contacts import (
    FORCE,
    NORMAL,
    NORMAL_FORCE,
    PAIR,
    POSITION,
    SLIP,
    SPIN,
    STRETCH,
    TORQUE,
    TWIST,
    WIDTH,
    carry_bristle,
    find_before,
    load_bristle,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.texture import FrictionMap, Grating

DT, DAMPING = 0.5e-3, 20.0
EXPONENTS = st.sampled_from([1.0, 1.1, 1.3, 1.6, 2.0]) | st.floats(1.0, 2.0)
ANGLES = st.floats(0.0, math.pi / 2)


@st.composite
def laws(draw):
    static = draw(st.floats(0.05, 1.5))
    return FrictionLaw(
        static_friction=static,
        kinetic_friction=static * draw(st.floats(0.7, 1.0)),
        stribeck_speed=draw(st.floats(0.01, 0.1)),
        viscous_friction=draw(st.sampled_from([0.0, 0.5])),
        spin_length=draw(st.floats(1e-3, 8e-3)),
        load_exponent=draw(st.floats(0.0, 0.33)),
        norm_exponent=draw(EXPONENTS),
    )


def sticking_or_slipping(law, force, torque, normal_force, factor=1.0):
    """Return the part of a trial load (force [N], torque [N m]) that friction carries, and the drag."""
    drag = law.stiffness * DT + DAMPING
    return borne(force, torque, normal_force, drag, np.array(packed(law, DAMPING)), factor), drag


@settings(deadline=None)
@given(laws(), st.floats(0.01, 20.0), st.floats(1e-4, 1.0), ANGLES)
def test_full_slip_is_on_the_limit_surface_where_it_dissipates_most(law, normal_force, speed, angle):
    e = law.spin_length_at(normal_force)
    v, spin = speed * math.cos(angle), speed * math.sin(angle) / e
    force, torque = law.slipping_load(normal_force, v, spin)
    mu = law.friction_at(law.slip_speed(normal_force, v, spin))
    assert law.load_ratio(normal_force, force, torque, mu) == pytest.approx(1.0, rel=1e-9)
    power = force * v + torque * spin
    assert power == pytest.approx(mu * normal_force * law.slip_speed(normal_force, v, spin), rel=1e-9)
    for x in np.linspace(0.0, 1.0, 41):  # no other load on the surface takes more
        y = (1.0 - x**law.norm_exponent) ** (1.0 / law.norm_exponent)
        assert mu * normal_force * (x * v + y * e * spin) <= power * (1.0 + 1e-9)


@given(st.floats(0.0, 5.0))
def test_friction_falls_from_static_to_kinetic_and_grows_viscously(speed):
    law = FrictionLaw(static_friction=0.5, kinetic_friction=0.4, stribeck_speed=0.02, viscous_friction=0.1)
    expected = 0.4 + 0.1 * math.exp(-((speed / 0.02) ** 2)) + 0.1 * speed
    assert law.friction_at(speed) == pytest.approx(expected)
    assert law.friction_at(0.0) == 0.5


def test_the_spin_length_is_given_at_one_newton_and_grows_with_the_load():
    law = FrictionLaw(spin_length=0.004, load_exponent=0.25)
    assert law.spin_length_at(1.0) == pytest.approx(0.004)
    assert law.spin_length_at(16.0) == pytest.approx(0.008)


@settings(deadline=None)
@given(st.floats(0.0, 50.0), st.floats(0.0, 50.0), st.floats(0.01, 100.0), EXPONENTS)
@example(1e-9, 3.0, 1.0, 1.05)
@example(0.999999, 1e-3, 0.3, 1.5)
def test_the_nearest_point_fulfils_the_variational_inequality(a, b, w, p):
    """(a - x)(u - x) + w (b - y)(v - y) <= 0 for every (u, v) of the convex set: the projection, and only it."""
    assume(a**p + b**p > 1.0)
    x, y = nearest(a, b, w, p)
    assert x**p + y**p == pytest.approx(1.0, abs=1e-13)
    to_x, to_y = a - x, w * (b - y)
    largest = max(abs(to_x), abs(to_y))
    for u in np.linspace(0.0, 1.0, 101):
        v = (1.0 - u**p) ** (1.0 / p)
        assert to_x * (u - x) + to_y * (v - y) <= 1e-9 * largest + 1e-14


@pytest.mark.slow
@settings(deadline=None)
@given(laws(), st.floats(0.0, 10.0), st.floats(0.0, 0.05), st.floats(0.01, 10.0), st.floats(0.5, 2.0))
def test_a_load_inside_is_carried_whole_and_one_outside_slips_along_the_normal(law, force, torque, f_n, factor):
    (borne_force, borne_torque, speed), drag = sticking_or_slipping(law, force, torque, f_n, factor)
    if law.load_ratio(f_n, force, torque, factor * law.static_friction) < 1.0 - 1e-12:
        assert (borne_force, borne_torque, speed) == (force, torque, 0.0)
        return
    mu = factor * law.friction_at(speed)
    assert law.load_ratio(f_n, borne_force, borne_torque, mu) == pytest.approx(1.0, rel=1e-8)
    # what was not borne went into slip, for which the closed form gives the same load
    v = (force - borne_force) / drag
    spin = (torque - borne_torque) / (drag * law.spin_length**2)
    assert law.slip_speed(f_n, v, spin) == pytest.approx(speed, rel=1e-6, abs=1e-12)
    if law.norm_exponent >= 1.05 and speed > 1e-6:  # below, the direction of slip amplifies rounding
        expected = law.slipping_load(f_n, v, spin)
        most = mu * f_n
        assert borne_force == pytest.approx(factor * expected[0], abs=1e-5 * most)
        assert borne_torque == pytest.approx(factor * expected[1], abs=1e-5 * most * law.spin_length_at(f_n))


def bristle(law):
    return np.zeros(WIDTH), np.array(packed(law, DAMPING))


def move(row, law_row, shift, turn, normal_force):
    """One time step of the bristle; returns the work done on it and its elastic energy before and after."""
    law_stiffness, radius = law_row[7], law_row[4]

    def energy():
        stretch = row[STRETCH : STRETCH + 3]
        return 0.5 * law_stiffness * (stretch @ stretch + radius**2 * row[TWIST] ** 2)

    before, row[NORMAL_FORCE] = energy(), normal_force
    load_bristle(
        row, row[STRETCH : STRETCH + 3].copy(), row[TWIST], np.asarray(shift), turn, law_row, 1.0, 1.0, DT
    )
    return row[FORCE : FORCE + 3] @ shift + row[TORQUE] * turn, before, energy()


STEPS = st.lists(
    st.tuples(st.floats(-1e-4, 1e-4), st.floats(-1e-4, 1e-4), st.floats(-0.02, 0.02), st.floats(0.0, 5.0)),
    min_size=1,
    max_size=40,
)


@pytest.mark.slow
@settings(deadline=None)
@given(laws(), STEPS)
def test_no_time_step_gives_energy_back(law, steps):
    """Work on the bristle - energy stored = dissipation >= 0, also while the normal force changes or vanishes."""
    row, law_row = bristle(law)
    for x, y, turn, normal_force in steps:
        work, before, after = move(row, law_row, np.array([x, y, 0.0]), turn, normal_force)
        assert work - (after - before) >= -1e-12 * (abs(work) + before + after)
        slip = row[FORCE : FORCE + 3] @ row[SLIP : SLIP + 3] + row[TORQUE] * row[SPIN]
        assert slip >= -1e-12  # of which slip is the part at the slider


def test_a_stuck_load_slips_when_the_normal_force_falls_and_vanishes_with_it():
    law = FrictionLaw(static_friction=0.5, kinetic_friction=0.5)
    row, law_row = bristle(law)
    move(row, law_row, np.array([1e-5, 0.0, 0.0]), 0.0, 2.0)
    for _ in range(100):
        move(row, law_row, np.zeros(3), 0.0, 2.0)
    assert row[FORCE] == pytest.approx(law.stiffness * 1e-5, rel=1e-3)
    for normal_force in (1.0, 0.3, 0.1, 1e-3, 1e-13, 0.0):
        move(row, law_row, np.zeros(3), 0.0, normal_force)
        assert 0.0 <= row[FORCE] <= 0.5 * normal_force + 1e-15
    assert row[FORCE] == 0.0
    assert np.isfinite(row).all()


ROTATIONS = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(lambda vector: Rotation.from_rotvec(vector).as_matrix())


def carried(stretch, twist, normal, mean_turn):
    row, before, now = np.zeros(WIDTH), np.zeros(WIDTH), np.zeros(3)
    before[STRETCH : STRETCH + 3], before[TWIST], row[NORMAL : NORMAL + 3] = stretch, twist, normal
    return carry_bristle(row, before, np.ascontiguousarray(mean_turn), now), now


@settings(deadline=None)
@given(ROTATIONS, st.tuples(*[st.floats(-0.02, 0.02)] * 3), st.floats(-3.0, 3.0))
def test_a_bristle_turns_with_its_bodies_and_keeps_its_length(common, apart, angle):
    """Exactly with a common motion; with bodies that turn against each other it stays in the plane."""
    normal, stretch = np.array([0.0, 0.0, 1.0]), 1e-5 * np.array([math.cos(angle), math.sin(angle), 0.0])
    twist, turned = carried(stretch, 0.01, common @ normal, common)
    assert np.allclose(turned, common @ stretch, rtol=0, atol=1e-19)
    assert twist == 0.01
    rolling = Rotation.from_rotvec(apart).as_matrix()
    twist, turned = carried(stretch, 0.01, common @ normal, 0.5 * (common + common @ rolling))
    assert np.linalg.norm(turned) == pytest.approx(1e-5, rel=1e-12)
    assert abs(turned @ common @ normal) < 1e-18
    assert twist == 0.01


def test_on_another_face_a_bristle_begins_anew():
    twist, turned = carried([0.0, 0.0, 1e-5], 0.01, [0.0, 0.0, 1.0], np.eye(3))
    assert twist == 0.0
    assert not turned.any()


def test_a_contact_is_the_nearest_before_that_no_other_has_taken():
    before = np.zeros((4, WIDTH))
    before[:, PAIR] = (0, 0, 1, 0)
    before[:, POSITION] = (0.010, 0.013, 0.0101, 0.030)
    row = np.zeros(WIDTH)
    row[POSITION] = 0.0101
    still, taken = np.eye(3), np.zeros(4, bool)

    def find(only_one=False):
        return find_before(row, before, taken, only_one, 0.005, still, np.zeros(3))

    assert find() == 0
    taken[0] = True
    assert find() == 1
    taken[1] = True
    assert find() == -1
    assert find(only_one=True) == 3


def test_a_grating_swings_about_one_along_its_direction_only():
    grating = Grating(wavelength=2e-3, amplitude=0.2, direction=(0.0, 2.0, 0.0))
    assert grating.factor(0.0, 0.5e-3, 0.0) == pytest.approx(1.2)
    assert grating.factor(0.7, 1.5e-3, -0.3) == pytest.approx(0.8)
    y = np.linspace(0.0, 2e-3, 1000, endpoint=False)
    assert np.mean([grating.factor(0.0, value, 0.0) for value in y]) == pytest.approx(1.0)


def test_a_friction_map_is_exact_at_its_nodes_linear_between_and_constant_beyond():
    factors = np.random.default_rng(1).uniform(0.5, 1.5, (4, 3))
    texture = FrictionMap(factors, 0.01, center=(0.02, -0.01))
    x, y = 0.02 + 0.01 * (np.arange(4) - 1.5), -0.01 + 0.01 * (np.arange(3) - 1.0)
    for i in range(4):
        for j in range(3):
            assert texture.factor(x[i], y[j], 0.1) == pytest.approx(factors[i, j])
    assert texture.factor(x[1] + 0.005, y[1] + 0.005, 0.0) == pytest.approx(factors[1:3, 1:3].mean())
    assert texture.factor(-9.0, 9.0, 0.0) == pytest.approx(factors[0, 2])
