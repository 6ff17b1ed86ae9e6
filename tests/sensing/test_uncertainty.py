"""What sensor noise does to a contact: derivatives against high precision, covariances against Monte Carlo."""

import dataclasses

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st
from mpmath import mp, mpf

from palpate import (
    Capsule,
    CompliantTip,
    Cylinder,
    Ellipsoid,
    Plane,
    Sphere,
    contact_from_wrench,
    contacts_from_wrenches,
)
from palpate.errors import InvalidValueError
from palpate.sensing.contact_jacobian import contact_jacobians
from palpate.sensing.curvature import shape_operator
from palpate.sensing.surface_at_contacts import surface_at_contacts
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty
from palpate.sensing.uncertainty import (
    UncertaintyStatus,
    contact_uncertainty,
    contacts_uncertainties,
    white_noise,
    wrench_axis_error,
)
from reference import quadric

KINDS = ("sphere", "ellipsoid", "cylinder", "plane")


def random_rotation(rng):
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return rotation * np.sign(np.linalg.det(rotation))


def random_tip(kind, rng, size=0.01):
    """A fingertip of about this size, somewhere near the sensor."""
    placed = {"center": rng.uniform(-1, 1, 3) * size, "rotation": random_rotation(rng)}
    if kind == "ellipsoid":
        return Ellipsoid(tuple(size * np.exp(rng.uniform(-0.35, 0.35, 3))), **placed)
    return {"sphere": Sphere, "cylinder": Cylinder, "plane": Plane}[kind](size, **placed)


def random_point(tip, rng):
    """A point of the surface and its outward normal, in the sensor frame."""
    lengths = np.array(tip.half_lengths)
    finite = np.isfinite(lengths)
    along = np.where(finite, rng.normal(size=3), 0.0)
    along /= np.linalg.norm(along)
    size = lengths[finite].min()
    point = np.where(finite, np.where(finite, lengths, 0.0) * along, rng.uniform(-1, 1, 3) * size)
    gradient = np.where(finite, along / lengths, 0.0)
    normal = tip.rotation @ (gradient / np.linalg.norm(gradient))
    return tip.rotation @ point + tip.center, normal


def wrench_at(c, n, normal_force, tangential, spin):
    """The wrench of a contact at c; `tangential` is any vector, its part along n does not count."""
    f = -normal_force * n + tangential - (tangential @ n) * n
    return np.concatenate((f, spin * n + np.cross(c, f)))


def random_wrench(tip, rng, size=0.01, friction=1.0, spin=0.3):
    c, n = random_point(tip, rng)
    push = 10 ** rng.uniform(-1, 2)
    across = np.cross(n, rng.normal(size=3))
    across *= rng.uniform(0, friction) * push / np.linalg.norm(across)
    return wrench_at(c, n, push, across, rng.uniform(-spin, spin) * push * size), push


def tangents(n):
    first = np.cross(n, [1.0, 0.0, 0.0] if abs(n[0]) < 0.7 else [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    return np.stack((first, np.cross(n, first)))


def stacked(jacobians):
    return np.concatenate(
        (
            jacobians.centroid,
            jacobians.normal,
            jacobians.normal_force[:, None],
            jacobians.tangential_force,
            jacobians.spin_torque[:, None],
        ),
        axis=1,
    )


def jacobian_of(tip, wrench):
    contacts = contacts_from_wrenches(tip, wrench[None])
    return stacked(contact_jacobians(contacts, surface_at_contacts(tip, contacts)))[0]


# --- curvature ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_the_shape_operator_tells_how_the_normal_turns(kind):
    """dn = W dc, checked along the surface itself: walk a little, compare normals."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        tip = random_tip(kind, rng)
        c, n = random_point(tip, rng)
        W = shape_operator(tip, c[None])[0]
        np.testing.assert_allclose(W, W.T, atol=1e-11)
        np.testing.assert_allclose(W @ n, 0, atol=1e-10)
        assert np.linalg.eigvalsh(W)[0] > -1e-9, "convex"
        lengths = np.array(tip.half_lengths)

        def normal_at(r, tip=tip, lengths=lengths):
            gradient = tip.rotation @ ((tip.rotation.T @ (r - tip.center)) / lengths**2)
            return gradient / np.linalg.norm(gradient)

        for t in tangents(n):
            step = 1e-6 * t  # leaves the surface in second order only, which central differences cancel
            turned = normal_at(c + step) - normal_at(c - step)
            np.testing.assert_allclose(W @ t, turned / 2e-6, atol=1e-6 * max(1.0, np.abs(W).max()))


def test_curvature_of_known_shapes():
    point = np.array([[0.02, 0.0, 0.0]])
    np.testing.assert_allclose(shape_operator(Sphere(0.02), point)[0], np.diag([0, 50, 50]), atol=1e-12)
    np.testing.assert_allclose(shape_operator(Cylinder(0.02), point)[0], np.diag([0, 50, 0]), atol=1e-12)
    np.testing.assert_allclose(shape_operator(Plane(0.02), np.array([[0.0, 0.0, 0.02]]))[0], 0, atol=1e-12)
    # at the end of the axis a of an ellipsoid the curvatures are a/b^2 and a/c^2
    W = shape_operator(Ellipsoid((0.02, 0.01, 0.04)), point)[0]
    np.testing.assert_allclose(W, np.diag([0, 0.02 / 0.01**2, 0.02 / 0.04**2]), rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("size", [1e-100, 1e-3, 1e100])
def test_curvature_scales_with_size(size):
    W = shape_operator(Sphere(size), np.array([[0.0, 0.0, size]]))[0]
    np.testing.assert_allclose(W * size, np.diag([1, 1, 0]), atol=1e-14)


def test_an_unknown_surface_is_named():
    with pytest.raises(InvalidValueError, match=r"curvature of a float is not known.*register"):
        shape_operator(1.0, np.zeros((1, 3)))


# --- derivatives -------------------------------------------------------------------------------------------------


def precise(tip, wrench):
    """Every quantity of the contact at 180 digits."""
    found = quadric.solve(tip.half_lengths, wrench, center=tip.center, rotation=tip.rotation.tolist())
    assert found.status == quadric.OK
    return [*found.centroid, *found.normal, found.normal_force, *found.tangential_force, found.spin_torque]


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_agree_with_central_differences_in_high_precision(kind):
    """Steps of about 1e-8 of the wrench: what central differences miss stays at 1e-16 of it."""
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(3):
        tip = random_tip(kind, rng)
        wrench, push = random_wrench(tip, rng)
        J = jacobian_of(tip, wrench)
        for column in range(6):
            # a power of two, added where the sum is exact
            step = 2.0 ** np.floor(np.log2(push * (1.0 if column < 3 else 0.01)) - 26)
            ahead, behind = wrench.copy(), wrench.copy()
            ahead[column] += step
            behind[column] -= step
            with mp.workprec(600):
                width = mpf(float(ahead[column])) - mpf(float(behind[column]))
                slope = [
                    float((a - b) / width) for a, b in zip(precise(tip, ahead), precise(tip, behind), strict=True)
                ]
            scale = np.abs(J).max(axis=1) * (1.0 if column >= 3 else 0.01) + np.abs(J[:, column])
            np.testing.assert_array_less(np.abs(J[:, column] - slope), 1e-10 * scale + 1e-13)


finite = st.floats(-1, 1, allow_subnormal=False)


YIELDING = [
    # at 5 N these yield by 2.5 mm and 2.2 mm, a quarter of the radius and not small at all
    CompliantTip(Sphere(0.01, center=(0.001, 0.002, 0.003)), stiffness=2e3),
    CompliantTip(Ellipsoid((0.008, 0.01, 0.012), center=(0.001, -0.002, 0.003)), stiffness=5e4, exponent=2 / 3),
]


def random_push(rng):
    """Five newtons from above, with friction and spin, about the sensor's origin; shape (6,)."""
    across, moment = rng.uniform(-1, 1, 2), rng.uniform(-0.006, 0.006, 3)
    return np.array([*across, rng.uniform(-5, -4), *moment])


@pytest.mark.parametrize("tip", YIELDING, ids=["linear", "Hertz"])
def test_derivatives_of_a_compliant_tip_agree_with_the_solver(tip):
    """Its centroid sinks in with the normal force, which no rigid tip's does."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        wrench = random_push(rng)
        J = jacobian_of(tip, wrench)
        steps = np.diag(np.repeat([1e-5, 1e-7], 3))
        ahead, behind = (contacts_from_wrenches(tip, wrench + sign * steps) for sign in (1, -1))
        assert (ahead.status == 0).all()
        fields = ("centroid", "normal", "normal_force", "tangential_force", "spin_torque")
        rise = np.column_stack([getattr(ahead, name) - getattr(behind, name) for name in fields]).T
        slope = rise / (2 * np.diag(steps))
        scale = np.abs(J).max(axis=1, keepdims=True)
        np.testing.assert_allclose(J / scale, slope / scale, rtol=0, atol=1e-6)
        assert abs(contact_from_wrench(tip, wrench).normal @ J[:3, 2]) > 1e-5, "it sinks in"


@pytest.mark.slow
@pytest.mark.parametrize("tip", [*YIELDING, Capsule(0.008, 0.02)], ids=["linear", "Hertz", "capsule"])
def test_other_fingertips_are_predicted_within_three_percent_at_one_percent_noise(tip):
    rng = np.random.default_rng(6)
    for _ in range(4):
        ratio, told = monte_carlo_ratios(tip, random_push(rng), white_noise(0.05, 0.0004), 50_000, rng)
        assert told.status is UncertaintyStatus.VALID
        np.testing.assert_allclose(ratio, 1, atol=0.03)


def test_near_a_seam_regions_hold():
    """A capsule's curvature jumps from sphere to cylinder: what the noise finds beyond the seam counts."""
    tip, rng, inside = Capsule(0.008, 0.02), np.random.default_rng(6), []
    noise = white_noise(0.02, 0.0002)
    for height in np.linspace(-6e-4, 6e-4, 25):
        c = np.array([np.sqrt(0.008**2 - max(height, 0.0) ** 2), 0.0, height])
        n = np.array([c[0], 0.0, max(height, 0.0)]) / 0.008
        wrench = wrench_at(c, n, 2.0, np.array([0.0, 0.5, 0.3]), 0.002)
        measured = wrench + rng.normal(size=(400, 6)) * np.sqrt(np.diag(noise))
        valid, hits = held(tip, measured, contacts_from_wrenches(tip, wrench[None]), noise)
        assert valid.mean() > 0.5
        assert hits.mean(axis=0).min() > 0.85
        inside.append(hits)
    assert np.concatenate(inside).mean(axis=0).min() > 0.93


@hypothesis.settings(max_examples=40, deadline=None, derandomize=True)
@hypothesis.given(st.sampled_from(KINDS), st.integers(0, 2**32 - 1))
def test_what_derivatives_must_obey(kind, seed):
    rng = np.random.default_rng(seed)
    tip = random_tip(kind, rng)
    wrench, push = random_wrench(tip, rng)
    contact = contact_from_wrench(tip, wrench)
    contacts = contacts_from_wrenches(tip, wrench[None])
    J = contact_jacobians(contacts, surface_at_contacts(tip, contacts))
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
    dm = (
        np.outer(n, J.spin_torque[0])
        + contact.spin_torque * J.normal[0]
        + np.cross(J.centroid[0].T, f).T
        + np.cross(c, np.eye(3, 6).T).T
    )
    np.testing.assert_allclose(dm, np.eye(3, 6, 3), atol=1e-10 * (1 + size * push))


# --- covariances -------------------------------------------------------------------------------------------------


def monte_carlo_ratios(tip, wrench, covariance, samples, rng):
    """Predicted over Monte Carlo standard deviations: centroid (2), tangential force (2), normal force, spin."""
    contact = contact_from_wrench(tip, wrench)
    told = contact_uncertainty(tip, contact, covariance)
    noise = rng.standard_normal((samples, 6)) @ np.linalg.cholesky(covariance).T
    drawn = contacts_from_wrenches(tip, wrench + noise)
    found = drawn.status == 0
    T = tangents(contact.normal)
    predicted = np.sqrt(
        [
            *np.diag(T @ told.centroid @ T.T),
            *np.diag(T @ told.tangential_force @ T.T),
            told.normal_force,
            told.spin_torque,
        ]
    )
    values = np.column_stack(
        (drawn.centroid @ T.T, drawn.tangential_force @ T.T, drawn.normal_force, drawn.spin_torque)
    )
    return predicted / values[found].std(axis=0), told


def survey(level, contacts, samples, seed=11):
    rng = np.random.default_rng(seed)
    ratios, told = [], []
    for i in range(contacts):
        tip = random_tip(KINDS[i % 4], rng)
        wrench, push = random_wrench(tip, rng)
        # each axis differently, and correlated a little, as in a real sensor
        spread = np.diag(level * push * np.array([1, 1, 1, 0.01, 0.01, 0.01])) @ np.linalg.cholesky(
            0.9 * np.eye(6) + 0.1
        )
        ratio, uncertainty = monte_carlo_ratios(tip, wrench, spread @ spread.T, samples, rng)
        ratios.append(ratio)
        told.append(uncertainty)
    return np.array(ratios), np.array([each.status for each in told]), np.array([u.nonlinearity for u in told])


def test_at_one_percent_noise_predictions_are_within_three_percent_of_monte_carlo():
    ratios, status, _ = survey(0.01, contacts=12, samples=200_000)
    assert ratios.min() > 0.97
    assert ratios.max() < 1.03
    assert (status == UncertaintyStatus.VALID).all()


def held(tip, wrenches, true, covariance, model=EXACT):
    """Which contacts of measured wrenches are VALID, and which regions of 95 % hold the true ones."""
    found = contacts_from_wrenches(tip, wrenches)
    told = contacts_uncertainties(tip, found, covariance, model)
    valid = told.status == UncertaintyStatus.VALID
    T = np.array([tangents(n) for n in found.normal])[valid]
    inside = []
    for name in ("centroid", "tangential_force"):
        off = np.einsum("iak,ik->ia", T, (getattr(found, name) - getattr(true, name))[valid])
        S = T @ getattr(told, name)[valid] @ T.transpose(0, 2, 1)
        inside.append(np.einsum("ia,ia->i", off, np.linalg.solve(S, off[:, :, None])[:, :, 0]) < 5.99)
    for name in ("normal_force", "spin_torque"):
        off = (getattr(found, name) - getattr(true, name))[valid]
        inside.append(np.abs(off) < 1.96 * np.sqrt(getattr(told, name)[valid]))
    return valid, np.column_stack(inside)


@pytest.mark.parametrize("level", [0.01, 0.05, 0.1, 0.2])
def test_valid_regions_of_95_percent_hold_at_any_noise(level):
    """VALID contacts alone: their noise is not what makes them VALID."""
    rng = np.random.default_rng(5)
    seen, inside = [], []
    for i in range(24):
        tip = random_tip(KINDS[i % 4], rng)
        wrenches = np.array([wrench / push for wrench, push in (random_wrench(tip, rng) for _ in range(400))])
        noise = white_noise(level, 0.01 * level)
        measured = wrenches + rng.normal(size=wrenches.shape) * np.sqrt(np.diag(noise))
        valid, hits = held(tip, measured, contacts_from_wrenches(tip, wrenches), noise)
        seen.append(valid)
        inside.append(hits)
    assert np.mean(seen) > (0.98 if level < 0.1 else 0.5)
    share = np.concatenate(inside).mean(axis=0)
    assert (share > 0.93).all()
    assert (share < 0.985).all()


@pytest.mark.parametrize("wrong", ["size", "position", "rotation", "stiffness"])
def test_a_tip_that_is_not_known_exactly_is_covered(wrong):
    """Tips drawn around the believed one touch; what the believed one makes of their wrenches is within 95 %."""
    rng, sd = np.random.default_rng(8), {"size": 1e-4, "position": 5e-4, "rotation": 0.03, "stiffness": 0.1}[wrong]
    noise, share = white_noise(1e-3, 1e-5), []
    for _ in range(150):
        center, e = rng.uniform(-1, 1, 3) * 0.01, sd * rng.normal(size=3)
        axes, stiff = np.array([0.008, 0.01, 0.012]), 2e4
        if wrong == "size":
            axes = np.full(3, 0.01)
        sizes, turn = axes + (e[0] if wrong == "size" else 0.0), np.eye(3)
        if wrong == "rotation":
            angle = np.linalg.norm(e)
            K = np.cross(np.eye(3), -e / angle)
            turn = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
        real = Ellipsoid(tuple(sizes), center=center + (e if wrong == "position" else 0.0), rotation=turn)
        tip = Ellipsoid(tuple(axes), center=center)
        if wrong == "stiffness":
            tip, real = CompliantTip(tip, stiff), CompliantTip(real, stiff * (1.0 + e[0]))
        wrenches = np.array([random_push(rng) + np.concatenate(([0, 0, 0], np.cross(center, [0, 0, -5])))] * 4)
        true = contacts_from_wrenches(real, wrenches)
        measured = wrenches + rng.normal(size=wrenches.shape) * np.sqrt(np.diag(noise))
        valid, hits = held(tip, measured, true, noise, TipUncertainty.independent(**{wrong: sd}))
        assert valid.all()
        share.append(hits.mean(axis=0))
    assert np.mean(share, axis=0).min() > 0.9
    assert np.mean(held(tip, measured, true, noise)[1]) < 1.0 or wrong == "stiffness"


@hypothesis.settings(max_examples=30, deadline=None, derandomize=True)
@hypothesis.given(st.sampled_from(KINDS), st.integers(0, 2**32 - 1), st.floats(-3, 3), st.floats(-60, 60))
def test_units_and_frames_do_not_matter(kind, seed, length_decades, force_decades):
    """Scaling lengths by a and forces by b scales every standard deviation; a turned sensor turns covariances."""
    rng = np.random.default_rng(seed)
    a, b = 10**length_decades, 10**force_decades
    tip = random_tip(kind, rng)
    wrench, push = random_wrench(tip, rng)
    E = white_noise(0.01 * push, 1e-4 * push)
    told = contact_uncertainty(tip, contact_from_wrench(tip, wrench), E)

    turn = random_rotation(rng)
    given = {"ellipsoid": "semi_axes", "plane": "distance"}.get(kind, "radius")
    size = getattr(tip, given)
    other = dataclasses.replace(
        tip,
        **{given: tuple(a * x for x in size) if kind == "ellipsoid" else a * size},
        center=a * turn @ tip.center,
        rotation=np.linalg.qr(turn @ tip.rotation)[0] * np.sign(np.diag(np.linalg.qr(turn @ tip.rotation)[1])),
    )
    scaled = np.concatenate((b * turn @ wrench[:3], a * b * turn @ wrench[3:]))
    units = np.repeat([b, a * b], 3)
    again = contact_uncertainty(other, contact_from_wrench(other, scaled), E * np.outer(units, units))
    close = {"rtol": 1e-7}
    np.testing.assert_allclose(again.normal_force, b * b * told.normal_force, **close)
    np.testing.assert_allclose(again.spin_torque, (a * b) ** 2 * told.spin_torque, **close)
    for name, unit in (("centroid", a * a), ("normal", 1.0), ("tangential_force", b * b)):
        expected = unit * turn @ getattr(told, name) @ turn.T
        # a plane's normal stands still but for rounding
        floor = 1e-30 if name == "normal" else 0.0
        np.testing.assert_allclose(
            getattr(again, name), expected, rtol=0, atol=1e-7 * np.abs(expected).max() + floor
        )
    # the nodes do not turn with the sensor, so the nonlinearity is the same only in kind
    assert told.nonlinearity / 4 - 1e-6 < again.nonlinearity < 4 * told.nonlinearity + 1e-6


def test_one_contact_is_a_row_of_many():
    rng = np.random.default_rng(2)
    tip = random_tip("ellipsoid", rng)
    wrenches = np.array([random_wrench(tip, rng)[0] for _ in range(50)])
    E = white_noise(0.01, 1e-4)
    many = contacts_uncertainties(tip, contacts_from_wrenches(tip, wrenches), E)
    assert len(many) == 50
    for i in (0, 17, 49):
        one = contact_uncertainty(tip, contact_from_wrench(tip, wrenches[i]), E)
        for name in ("centroid", "normal", "normal_force", "tangential_force", "spin_torque", "status"):
            np.testing.assert_allclose(getattr(one, name), getattr(many, name)[i], rtol=1e-13, atol=1e-30)
        assert one.nonlinearity == pytest.approx(many.nonlinearity[i], rel=1e-9)


def test_no_noise_no_spread():
    rng = np.random.default_rng(4)
    for kind in KINDS:
        tip = random_tip(kind, rng)
        told = contact_uncertainty(tip, contact_from_wrench(tip, random_wrench(tip, rng)[0]), np.zeros((6, 6)))
        assert told.status is UncertaintyStatus.VALID
        assert told.nonlinearity == 0.0
        assert not told.centroid.any()
        assert told.normal_force == told.spin_torque == 0.0


def test_noise_of_one_channel_only():
    """A covariance of rank 1 is one: its image is nearly a line, and small noise on it is nearly linear."""
    rng = np.random.default_rng(4)
    for kind in KINDS:
        tip = random_tip(kind, rng)
        wrench, push = random_wrench(tip, rng)
        for channel in range(6):
            E = np.zeros((6, 6))
            E[channel, channel] = (1e-5 * push * (1 if channel < 3 else 0.01)) ** 2
            assert contact_uncertainty(tip, contact_from_wrench(tip, wrench), E).status is UncertaintyStatus.VALID


def test_where_there_is_no_contact_there_is_no_number():
    contact = contact_from_wrench(Sphere(0.01), [0, 0, -1, 0.02, 0, 0])  # the axis misses, no spin
    told = contact_uncertainty(Sphere(0.01), contact, white_noise(0.01, 1e-4))
    assert told.status is UncertaintyStatus.NO_CONTACT
    assert np.isnan(told.centroid).all()
    assert np.isnan([told.normal_force, told.spin_torque, told.nonlinearity]).all()


def test_a_grazing_contact_is_not_trusted():
    """The wrench axis nearly misses a cylinder: noise reaches wrenches without any contact."""
    tip = Cylinder(0.01)
    wrench = np.array([0.0, -1.0, 0.0, 0.0, 0.0, -0.0099999])
    contact = contact_from_wrench(tip, wrench)
    assert contact.condition > 100
    told = contact_uncertainty(tip, contact, white_noise(0.01, 1e-4))
    assert told.status is not UncertaintyStatus.VALID
    assert told.nonlinearity > 1
    # and so is one whose whole force is within the noise
    c, n = np.array([0.0, 0.0, 0.01]), np.array([0.0, 0.0, 1.0])
    weak = contact_from_wrench(Plane(0.01), wrench_at(c, n, 0.01, np.zeros(3), 0.0))
    assert contact_uncertainty(Plane(0.01), weak, white_noise(0.01, 1e-4)).status is not UncertaintyStatus.VALID


def test_hostile_rows_give_a_status_and_no_warning():
    rng = np.random.default_rng(9)
    wrenches = np.concatenate(
        (
            rng.normal(size=(200, 6)) * 10.0 ** rng.uniform(-300, 300, (200, 1)),
            rng.choice([0.0, -0.0, 1.0, np.nan, np.inf, -np.inf, 1e308, 1e-308], (500, 6)),
        )
    )
    for tip in (Sphere(0.01), Ellipsoid((1e-3, 1.0, np.inf)), Cylinder(1e-100), Plane(1e100)):
        told = contacts_uncertainties(tip, contacts_from_wrenches(tip, wrenches), white_noise(0.01, 1e-4))
        valid = told.status == UncertaintyStatus.VALID
        for name in ("centroid", "normal", "normal_force", "tangential_force", "spin_torque", "nonlinearity"):
            assert np.isfinite(getattr(told, name)[valid]).all()


@pytest.mark.parametrize(
    ("covariance", "words"),
    [
        (np.ones(6), r"shape \(6,\).*np.diag"),
        (np.diag([1, 1, 1, 1, 1, -1.0]), "negative eigenvalues"),
        (np.eye(6) + np.eye(6, k=1), "symmetric"),
        (np.full((6, 6), np.nan), "finite"),
        ("noise", "must be numbers"),
    ],
)
def test_what_is_no_covariance_is_refused(covariance, words):
    contact = contact_from_wrench(Sphere(0.01), [0, 0, -1, 0, 0, 0])
    with pytest.raises(InvalidValueError, match=words):
        contact_uncertainty(Sphere(0.01), contact, covariance)


# --- what the simpler method costs -------------------------------------------------------------------------------


@hypothesis.settings(max_examples=40, deadline=None, derandomize=True)
@hypothesis.given(st.sampled_from(KINDS), st.integers(0, 2**32 - 1))
def test_equation_10_is_the_wrench_axis_methods_error_in_the_contact_plane(kind, seed):
    rng = np.random.default_rng(seed)
    tip = random_tip(kind, rng)
    wrench, _ = random_wrench(tip, rng, friction=0.6)
    soft, hard = contact_from_wrench(tip, wrench), contact_from_wrench(tip, wrench, "hard")
    hypothesis.assume(hard.status == 0)
    hypothesis.assume(np.linalg.norm(soft.tangential_force) > 1e-3 * soft.normal_force)
    error = hard.centroid - soft.centroid
    across_friction = np.cross(soft.normal, soft.tangential_force)
    across_friction /= np.linalg.norm(across_friction)
    assert wrench_axis_error(soft) == pytest.approx(abs(error @ across_friction), rel=1e-6, abs=1e-15)
    assert wrench_axis_error(soft) <= np.linalg.norm(error) * (1 + 1e-6) + 1e-15


def test_equation_10_without_spin_or_friction_or_contact():
    n, c = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 0.01])
    no_spin = contact_from_wrench(Sphere(0.01), wrench_at(c, n, 2.0, np.array([0.5, 0, 0]), 0.0))
    no_friction = contact_from_wrench(Sphere(0.01), wrench_at(c, n, 2.0, np.zeros(3), 0.003))
    assert wrench_axis_error(no_spin) == pytest.approx(0.0, abs=1e-17)
    assert wrench_axis_error(no_friction) == pytest.approx(0.0, abs=1e-17)
    nothing = contact_from_wrench(Sphere(0.01), np.zeros(6))
    assert np.isnan(wrench_axis_error(nothing))
