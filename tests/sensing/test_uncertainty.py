"""What sensor noise does to a contact: derivatives against high precision, covariances against Monte Carlo."""

import dataclasses

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st
from mpmath import mp, mpf
from scipy.spatial.transform import Rotation
from trust.contacts import QUANTITIES, SURE, inside

from palpate import (
    Capsule,
    CompliantTip,
    Cylinder,
    Ellipsoid,
    Paraboloid,
    Plane,
    RoundedBox,
    Sphere,
    Superellipsoid,
    contact_from_wrench,
    contacts_from_wrenches,
)
from palpate.sensing.contact_jacobian import contact_jacobians
from palpate.sensing.curvature import shape_operator
from palpate.sensing.surface_at_contacts import surface_at_contacts
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty
from palpate.sensing.uncertainty import (
    UncertaintyStatus,
    contact_uncertainty,
    contacts_uncertainties,
    white_noise,
)
from palpate.surfaces import Hyperboloid
from reference import quadric

KINDS = ("sphere", "ellipsoid", "cylinder", "plane")
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
PLACED = {"rotation": TURN, "center": (0.001, 0.002, 0.003)}
TIPS = {
    "sphere": Sphere(0.01, **PLACED),
    "ellipsoid": Ellipsoid((0.01, 0.012, 0.02), **PLACED),
    "cylinder": Cylinder(0.01, center=PLACED["center"], rotation=TURN[:, [2, 0, 1]]),
    "plane": Plane(0.01, **PLACED),
    "paraboloid": Paraboloid((0.01, 0.02), **PLACED),
    "hyperboloid": Hyperboloid((0.01, 0.02, 0.03), rotation=TURN),
    "capsule": Capsule(0.01, 0.03, rotation=TURN),
    "rounded box": RoundedBox((0.02, 0.015, 0.01), 0.004, rotation=TURN),
    "superellipsoid": Superellipsoid((0.01, 0.012, 0.02), 3.0, rotation=TURN),
}
YIELDING = {  # at 5 N these yield by 2.5 mm and 2.2 mm, a quarter of the radius and not small at all
    "linear": CompliantTip(Sphere(0.01, center=(0.001, 0.002, 0.003)), stiffness=2e3),
    "Hertz": CompliantTip(Ellipsoid((0.008, 0.01, 0.012), center=(0.001, -0.002, 0.003)), 5e4, exponent=2 / 3),
}
FIELDS = ("centroid", "normal", "normal_force", "tangential_force", "spin_torque")


def random_tip(kind, rng, size=0.01):
    """A fingertip of about this size, somewhere near the sensor."""
    placed = {"center": rng.uniform(-1, 1, 3) * size, "rotation": Rotation.random(rng=rng).as_matrix()}
    if kind == "ellipsoid":
        return Ellipsoid(tuple(size * np.exp(rng.uniform(-0.35, 0.35, 3))), **placed)
    return {"sphere": Sphere, "cylinder": Cylinder, "plane": Plane}[kind](size, **placed)


def wrench_at(c, n, normal_force, tangential, spin):
    """The wrench of a contact at c; `tangential` is any vector, its part along n does not count."""
    f = -normal_force * n + tangential - (tangential @ n) * n
    return np.concatenate((f, spin * n + np.cross(c, f)))


def random_wrench(tip, rng, size=0.01):
    """A wrench of a contact anywhere on a quadric, and its normal force."""
    lengths = np.array(tip.half_lengths)
    finite = np.isfinite(lengths)
    along = np.where(finite, rng.normal(size=3), 0.0)
    along /= np.linalg.norm(along)
    point = np.where(finite, np.where(finite, lengths, 0.0) * along, rng.uniform(-1, 1, 3) * lengths[finite].min())
    gradient = np.where(finite, along / lengths, 0.0)
    n = tip.rotation @ (gradient / np.linalg.norm(gradient))
    push = 10 ** rng.uniform(-1, 2)
    across = np.cross(n, rng.normal(size=3))
    across *= rng.uniform() * push / np.linalg.norm(across)
    spin = rng.uniform(-0.3, 0.3) * push * size
    return wrench_at(tip.rotation @ point + tip.center, n, push, across, spin), push


def pressed(tip, rng):
    """A wrench with a force roughly along the tip's own -z, where every kind has surface."""
    force = -TURN[:, 2] + rng.uniform(-0.4, 0.4, 3)
    point = np.asarray(getattr(tip, "center", np.zeros(3))) + 0.002 * rng.normal(size=3)
    return np.concatenate([force, np.cross(point, force) + 1e-3 * rng.normal(size=3)])


def random_push(rng):
    """Five newtons from above, with friction and spin, about the sensor's origin; shape (6,)."""
    across, moment = rng.uniform(-1, 1, 2), rng.uniform(-0.006, 0.006, 3)
    return np.array([*across, rng.uniform(-5, -4), *moment])


def tangents(n):
    return np.linalg.svd(n[None])[2][1:]


def jacobians_of(tip, wrench):
    contacts = contacts_from_wrenches(tip, wrench[None])
    return contact_jacobians(contacts, surface_at_contacts(tip, contacts))


def jacobian_of(tip, wrench):
    """All derivatives in rows, shape (11, 6)."""
    return np.vstack([getattr(jacobians_of(tip, wrench), name)[0] for name in FIELDS])


# --- curvature ---


@pytest.mark.parametrize("name", TIPS)
def test_the_normal_turns_as_the_shape_operator_says(name):
    tip, rng = TIPS[name], np.random.default_rng(3)
    for _ in range(20):
        at = contact_from_wrench(tip, pressed(tip, rng))
        assert at.status == 0
        W = shape_operator(tip, at.centroid[None])[0]
        np.testing.assert_allclose(W @ at.normal, 0.0, atol=1e-9)
        np.testing.assert_allclose(W, W.T, atol=1e-9)
        assert np.linalg.eigvalsh(W)[0] > -1e-9, "convex"
        # contacts around it: pure pushes along the normals of points a little way off
        step = 1e-6 * np.cross(at.normal, rng.normal(size=3))
        ahead, behind = (
            contact_from_wrench(tip, wrench_at(at.centroid + x, at.normal + W @ x, 1.0, np.zeros(3), 0.0))
            for x in (step, -step)
        )
        dn = ahead.normal - behind.normal
        moved = W @ (ahead.centroid - behind.centroid)
        np.testing.assert_allclose(dn, moved, atol=1e-3 * np.linalg.norm(dn) + 1e-9)


@pytest.mark.parametrize("size", [1e-100, 1e-3, 1e100])
def test_curvature_of_known_shapes_at_any_size(size):
    point = np.array([[2 * size, 0.0, 0.0]])
    # at the end of the axis a of an ellipsoid the curvatures are a/b^2 and a/c^2
    for tip, bends in (
        (Sphere(2 * size), (0, 0.5, 0.5)),
        (Cylinder(2 * size), (0, 0.5, 0)),
        (Ellipsoid((2 * size, size, 4 * size)), (0, 2, 1 / 8)),
        (Plane(2 * size, rotation=np.eye(3)[[2, 0, 1]]), (0, 0, 0)),
    ):
        np.testing.assert_allclose(size * shape_operator(tip, point)[0], np.diag(bends), atol=1e-12)


# --- derivatives ---


def precise(tip, wrench):
    """Every quantity of the contact at 180 digits."""
    found = quadric.solve(tip.half_lengths, wrench, center=tip.center, rotation=tip.rotation.tolist())
    assert found.status == quadric.OK
    return np.hstack([getattr(found, name) for name in FIELDS])


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_agree_with_central_differences_in_high_precision(kind):
    """Steps of about 1e-8 of the wrench: what central differences miss stays at 1e-16 of it."""
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(2):
        tip = random_tip(kind, rng)
        wrench, push = random_wrench(tip, rng)
        J = jacobian_of(tip, wrench)
        for column in range(6):
            # a power of two, added where the sum is exact
            step = 2.0 ** np.floor(np.log2(push * (1.0 if column < 3 else 0.01)) - 26) * np.eye(6)[column]
            ahead, behind = wrench + step, wrench - step
            with mp.workprec(600):
                width = mpf(float(ahead[column])) - mpf(float(behind[column]))
                slope = ((precise(tip, ahead) - precise(tip, behind)) / width).astype(float)
            scale = np.abs(J).max(axis=1) * (1.0 if column >= 3 else 0.01) + np.abs(J[:, column])
            np.testing.assert_array_less(np.abs(J[:, column] - slope), 1e-10 * scale + 1e-13)


@pytest.mark.parametrize("name", YIELDING)
def test_derivatives_of_a_compliant_tip_agree_with_the_solver(name):
    """Its centroid sinks in with the normal force, which no rigid tip's does."""
    tip, rng, steps = YIELDING[name], np.random.default_rng(8), np.diag(np.repeat([1e-5, 1e-7], 3))
    for _ in range(20):
        wrench = random_push(rng)
        J = jacobian_of(tip, wrench)
        ahead, behind = (contacts_from_wrenches(tip, wrench + sign * steps) for sign in (1, -1))
        assert (ahead.status == 0).all()
        rise = np.column_stack([getattr(ahead, name) - getattr(behind, name) for name in FIELDS]).T
        scale = np.abs(J).max(axis=1, keepdims=True)
        np.testing.assert_allclose(J / scale, rise / (2 * np.diag(steps)) / scale, rtol=0, atol=1e-6)
        assert abs(contact_from_wrench(tip, wrench).normal @ J[:3, 2]) > 1e-5, "it sinks in"


@hypothesis.settings(max_examples=40, deadline=None, derandomize=True)
@hypothesis.given(st.sampled_from(KINDS), st.integers(0, 2**32 - 1))
def test_derivatives_keep_normal_balance_and_scale(kind, seed):
    rng = np.random.default_rng(seed)
    tip = random_tip(kind, rng)
    wrench, push = random_wrench(tip, rng)
    contact, J = contact_from_wrench(tip, wrench), jacobians_of(tip, wrench)
    n, f, c = contact.normal, contact.force, contact.centroid
    size = np.abs(J.centroid).max()
    np.testing.assert_allclose(n @ J.centroid[0], 0, atol=1e-12 * size)  # the centroid stays on the surface
    np.testing.assert_allclose(n @ J.normal[0], 0, atol=1e-10 * (1 + np.abs(J.normal).max()))  # |n| stays 1
    # a wrench scaled as a whole moves nothing, and scales forces and torque (Euler)
    np.testing.assert_allclose(J.centroid[0] @ wrench, 0, atol=1e-11 * size * push)
    np.testing.assert_allclose(J.normal_force[0] @ wrench, contact.normal_force, rtol=1e-10)
    np.testing.assert_allclose(J.tangential_force[0] @ wrench, contact.tangential_force, atol=1e-10 * push)
    np.testing.assert_allclose(J.spin_torque[0] @ wrench, contact.spin_torque, atol=1e-11 * push * 0.01)
    # force = tangential - normal_force n, so its derivative is that of the wrench's force
    df = J.tangential_force[0] - np.outer(n, J.normal_force[0]) - contact.normal_force * J.normal[0]
    np.testing.assert_allclose(df, np.eye(3, 6), atol=1e-10 * (1 + push * np.abs(J.normal).max()))
    # the balance m = Q n + c x f, differentiated
    dq = np.outer(n, J.spin_torque[0]) + contact.spin_torque * J.normal[0]
    dm = dq + np.cross(J.centroid[0].T, f).T + np.cross(c, np.eye(3, 6).T).T
    np.testing.assert_allclose(dm, np.eye(3, 6, 3), atol=1e-10 * (1 + size * push))


# --- covariances ---


@pytest.mark.parametrize("name", [*TIPS, *YIELDING])
def test_predictions_are_within_three_percent_of_monte_carlo(name):
    """At one percent of noise, each axis otherwise, and correlated a little, as in a real sensor."""
    tip, rng = (TIPS | YIELDING)[name], np.random.default_rng(11)
    wrench = random_push(rng) if name in YIELDING else pressed(tip, rng)
    level = 0.005 * np.linalg.norm(wrench[:3]) * np.array([1, 1, 1, 0.01, 0.01, 0.01])
    spread = np.diag(level) @ np.linalg.cholesky(0.9 * np.eye(6) + 0.1)
    contact = contact_from_wrench(tip, wrench)
    told = contact_uncertainty(tip, contact, spread @ spread.T)
    assert told.status is UncertaintyStatus.VALID
    drawn = contacts_from_wrenches(tip, wrench + rng.standard_normal((60_000, 6)) @ spread.T)
    T, found = tangents(contact.normal), drawn.status == 0
    variances = [np.diag(T @ told.centroid @ T.T), np.diag(T @ told.tangential_force @ T.T)]
    predicted = np.sqrt(np.hstack([*variances, told.normal_force, told.spin_torque]))
    values = [drawn.centroid @ T.T, drawn.tangential_force @ T.T, drawn.normal_force, drawn.spin_torque]
    np.testing.assert_allclose(predicted / np.column_stack(values)[found].std(axis=0), 1.0, atol=0.03)


def held(tip, wrenches, true, covariance, model=EXACT):
    """Which contacts of measured wrenches are VALID, and which regions of 95 % hold the true ones."""
    found = contacts_from_wrenches(tip, wrenches)
    told = contacts_uncertainties(tip, found, covariance, model)
    valid = told.status == UncertaintyStatus.VALID
    hits = [inside(found, true, getattr(told, name), name) <= SURE[d] for name, d in QUANTITIES.items()]
    return valid, np.column_stack(hits)[valid]


@pytest.mark.parametrize("level", [0.02, 0.1])
def test_valid_regions_of_95_percent_hold(level):
    """VALID contacts alone: their noise is not what makes them VALID. Many more of them: benchmarks/trust."""
    rng, share, noise = np.random.default_rng(5), [], white_noise(level, 0.01 * level)
    for kind in KINDS * 2:
        tip = random_tip(kind, rng)
        wrenches = np.array([wrench / push for wrench, push in (random_wrench(tip, rng) for _ in range(400))])
        measured = wrenches + rng.normal(size=wrenches.shape) * np.sqrt(np.diag(noise))
        valid, hits = held(tip, measured, contacts_from_wrenches(tip, wrenches), noise)
        assert np.mean(valid) > (0.97 if level < 0.1 else 0.5)
        share.append(hits.mean(axis=0))
    assert 0.93 < np.mean(share, axis=0).min() <= np.mean(share, axis=0).max() < 0.985


def test_near_a_seam_regions_hold():
    """A capsule's curvature jumps from sphere to cylinder: what the noise finds beyond the seam counts."""
    tip, rng, noise, share = Capsule(0.008, 0.02), np.random.default_rng(6), white_noise(0.02, 0.0002), []
    for height in np.linspace(-6e-4, 6e-4, 13):
        c = np.array([np.sqrt(0.008**2 - max(height, 0.0) ** 2), 0.0, height])
        n = np.array([c[0], 0.0, max(height, 0.0)]) / 0.008
        wrench = wrench_at(c, n, 2.0, np.array([0.0, 0.5, 0.3]), 0.002)
        measured = wrench + rng.normal(size=(400, 6)) * np.sqrt(np.diag(noise))
        valid, hits = held(tip, measured, contacts_from_wrenches(tip, wrench[None]), noise)
        assert valid.mean() > 0.5
        assert hits.mean(axis=0).min() > 0.85
        share.append(hits.mean(axis=0))
    assert np.mean(share, axis=0).min() > 0.93


def real_tip(wrong, e, axes, center):
    """An assumed tip, and one that differs from it by e in one respect."""
    tip = Ellipsoid(np.full(3, 0.01) if wrong == "size" else axes, center=center)
    change = {
        "position": {"center": center + e},
        "rotation": {"rotation": Rotation.from_rotvec(e).as_matrix()},
        "size": {"semi_axes": tuple(np.full(3, 0.01) + e[0])},
        "stiffness": {},
    }
    true = dataclasses.replace(tip, **change[wrong])
    soft = CompliantTip(tip, 2e4), CompliantTip(true, 2e4 * (1.0 + e[0]))
    return soft if wrong == "stiffness" else (tip, true)


@pytest.mark.parametrize(
    ("wrong", "sd"), [("size", 1e-4), ("position", 5e-4), ("rotation", 0.03), ("stiffness", 0.1)]
)
def test_a_tip_that_is_not_known_exactly_is_covered(wrong, sd):
    """Tips drawn around the assumed one touch; contacts of the assumed one of their wrenches are within 95 %."""
    rng, noise, share = np.random.default_rng(8), white_noise(1e-3, 1e-5), []
    for _ in range(100):
        center, e = rng.uniform(-1, 1, 3) * 0.01, sd * rng.normal(size=3)
        tip, real = real_tip(wrong, e, np.array([0.008, 0.01, 0.012]), center)
        wrenches = np.tile(np.add(random_push(rng), [0, 0, 0, *np.cross(center, [0, 0, -5])]), (4, 1))
        measured = wrenches + rng.normal(size=wrenches.shape) * np.sqrt(np.diag(noise))
        true = contacts_from_wrenches(real, wrenches)
        valid, hits = held(tip, measured, true, noise, TipUncertainty.independent(**{wrong: sd}))
        assert valid.all()
        share.append(hits.mean(axis=0))
    assert np.mean(share, axis=0).min() > 0.9


@hypothesis.settings(max_examples=30, deadline=None, derandomize=True)
@hypothesis.given(st.sampled_from(KINDS), st.integers(0, 2**32 - 1), st.floats(-3, 3), st.floats(-60, 60))
def test_units_and_frames_do_not_matter(kind, seed, length_decades, force_decades):
    """Scaling lengths by a and forces by b scales every standard deviation; a turned sensor turns covariances."""
    rng, a, b = np.random.default_rng(seed), 10**length_decades, 10**force_decades
    tip = random_tip(kind, rng)
    wrench, push = random_wrench(tip, rng)
    E = white_noise(0.01 * push, 1e-4 * push)
    told = contact_uncertainty(tip, contact_from_wrench(tip, wrench), E)
    turn = Rotation.random(rng=rng).as_matrix()
    given = {"ellipsoid": "semi_axes", "plane": "distance"}.get(kind, "radius")
    size = np.multiply(a, getattr(tip, given))
    frame = {"center": a * turn @ tip.center, "rotation": turn @ tip.rotation}
    other = dataclasses.replace(tip, **{given: tuple(size) if kind == "ellipsoid" else float(size)}, **frame)
    units = np.repeat([b, a * b], 3)
    scaled = units * (wrench.reshape(2, 3) @ turn.T).ravel()
    again = contact_uncertainty(other, contact_from_wrench(other, scaled), E * np.outer(units, units))
    np.testing.assert_allclose(again.normal_force, b * b * told.normal_force, rtol=1e-7)
    np.testing.assert_allclose(again.spin_torque, (a * b) ** 2 * told.spin_torque, rtol=1e-7)
    # a plane's normal stands still but for rounding
    for name, unit, floor in (("centroid", a * a, 0.0), ("normal", 1.0, 1e-30), ("tangential_force", b * b, 0.0)):
        expected = unit * turn @ getattr(told, name) @ turn.T
        limit = 1e-7 * np.abs(expected).max() + floor
        np.testing.assert_allclose(getattr(again, name), expected, rtol=0, atol=limit)
    # the nodes do not turn with the sensor, so the nonlinearity is the same only in kind
    assert told.nonlinearity / 4 - 1e-6 < again.nonlinearity < 4 * told.nonlinearity + 1e-6


def test_one_contact_is_a_row_of_many():
    rng, noise = np.random.default_rng(2), white_noise(0.01, 1e-4)
    tip = random_tip("ellipsoid", rng)
    wrenches = np.array([random_wrench(tip, rng)[0] for _ in range(50)])
    many = contacts_uncertainties(tip, contacts_from_wrenches(tip, wrenches), noise)
    assert len(many) == 50
    for i in (0, 17, 49):
        one = contact_uncertainty(tip, contact_from_wrench(tip, wrenches[i]), noise)
        for name in (*FIELDS, "status"):
            np.testing.assert_allclose(getattr(one, name), getattr(many, name)[i], rtol=1e-13, atol=1e-30)
        assert one.nonlinearity == pytest.approx(many.nonlinearity[i], rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_no_noise_makes_no_spread_and_noise_of_one_channel_is_nearly_linear(kind):
    rng = np.random.default_rng(4)
    tip = random_tip(kind, rng)
    wrench, push = random_wrench(tip, rng)
    contact = contact_from_wrench(tip, wrench)
    none = contact_uncertainty(tip, contact, np.zeros((6, 6)))
    assert none.status is UncertaintyStatus.VALID
    assert not none.centroid.any()
    assert none.nonlinearity == none.normal_force == none.spin_torque == 0.0
    for channel, sd in enumerate(1e-5 * push * np.repeat([1, 0.01], 3)):
        E = np.diag(sd**2 * np.eye(6)[channel])
        assert contact_uncertainty(tip, contact, E).status is UncertaintyStatus.VALID


def test_where_there_is_no_contact_there_is_no_number():
    contact = contact_from_wrench(Sphere(0.01), [0, 0, -1, 0.02, 0, 0])  # the axis misses, no spin
    told = contact_uncertainty(Sphere(0.01), contact, white_noise(0.01, 1e-4))
    assert told.status is UncertaintyStatus.NO_CONTACT
    assert np.isnan([*told.centroid.ravel(), told.normal_force, told.spin_torque, told.nonlinearity]).all()


def test_a_grazing_contact_is_not_trusted():
    """The wrench axis nearly misses a cylinder: noise reaches wrenches without any contact."""
    contact = contact_from_wrench(Cylinder(0.01), [0.0, -1.0, 0.0, 0.0, 0.0, -0.0099999])
    assert contact.condition > 100
    told = contact_uncertainty(Cylinder(0.01), contact, white_noise(0.01, 1e-4))
    assert told.nonlinearity > 1
    # and so is one whose whole force is within the noise
    weak = contact_from_wrench(Plane(0.01), [0.0, 0.0, -0.01, 0.0, 0.0, 0.0])
    faint = contact_uncertainty(Plane(0.01), weak, white_noise(0.01, 1e-4))
    assert UncertaintyStatus.VALID not in (told.status, faint.status)


def test_hostile_rows_give_a_status_and_no_warning():
    rng = np.random.default_rng(9)
    wild = rng.normal(size=(200, 6)) * 10.0 ** rng.uniform(-300, 300, (200, 1))
    special = rng.choice([0.0, -0.0, 1.0, np.nan, np.inf, -np.inf, 1e308, 1e-308], (500, 6))
    for tip in (Sphere(0.01), Ellipsoid((1e-3, 1.0, np.inf)), Cylinder(1e-100), Plane(1e100)):
        contacts = contacts_from_wrenches(tip, np.vstack([wild, special]))
        told = contacts_uncertainties(tip, contacts, white_noise(0.01, 1e-4))
        for name in (*FIELDS, "nonlinearity"):
            assert np.isfinite(getattr(told, name)[told.status == UncertaintyStatus.VALID]).all()
