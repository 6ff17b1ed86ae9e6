"""Two descriptions of one fingertip give the same contacts, and limiting shapes give those of their limit."""

import math

import numpy as np
import pytest

from palpate import (
    CompliantTip,
    Composite,
    Ellipsoid,
    Hyperboloid,
    ImplicitSurface,
    Paraboloid,
    Patch,
    Sphere,
    Superellipsoid,
    contacts_from_wrenches,
)
from palpate.surfaces import HERTZ, LINEAR

R = 0.01
FIELDS = ("centroid", "normal", "force", "tangential_force", "normal_force", "spin_torque", "condition", "status")
AXES = (0.008, 0.011, 0.015)
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.60, 0.0], [0.48, 0.64, 0.60]])
FRAME = {"center": (0.002, -0.03, 0.01), "rotation": TURN}
ELLIPSOID = Ellipsoid(AXES, **FRAME)
SQUARES = np.array(AXES) ** 2
SAME = {
    "superellipsoid of exponent two": (Superellipsoid(AXES, 2.0, **FRAME), 400, 1e-13),
    "plain functions": (
        ImplicitSurface(lambda p: p @ (p / SQUARES) - 1.0, lambda p: 2.0 * p / SQUARES, **FRAME),
        25,
        1e-12,
    ),
    "very stiff": (CompliantTip(ELLIPSOID, 1e12), 200, 1e-9),  # a picometre under newtons
}
"""Other descriptions of the ellipsoid, the number of wrenches, and the largest error per condition number."""


def wrenches(n, seed=0, reach=0.5 * R):
    """Soft contacts of a tip about its centre, for which every closed tip has a contact, shape (n, 6)."""
    rng = np.random.default_rng(seed)
    return np.hstack([rng.normal(size=(n, 3)), reach * rng.normal(size=(n, 3))])


def about(rows):
    """Wrenches about the origin and along the axes of `FRAME`, in the frame of the sensor."""
    f, m = rows[:, :3] @ TURN.T, rows[:, 3:] @ TURN.T
    return np.hstack([f, m + np.cross(FRAME["center"], f)])


def close(found, wanted, limit):
    """Equal status; errors within `limit` times the condition number."""
    np.testing.assert_array_equal(found.status, wanted.status)
    ok = wanted.status == 0
    assert ok.mean() > 0.95
    size = np.linalg.norm(wanted.centroid[ok], axis=1).max()
    allowed, force = limit * np.minimum(wanted.condition[ok], 1e6), np.linalg.norm(wanted.force[ok], axis=1)
    moment = np.maximum(force * size, np.abs(wanted.spin_torque[ok]))
    scales = {"centroid": size, "normal": 10.0, "normal_force": 10.0 * force, "spin_torque": 20.0 * moment}
    for name, scale in scales.items():
        off = (getattr(found, name) - getattr(wanted, name))[ok].reshape(len(force), -1)
        assert (np.linalg.norm(off, axis=1) <= allowed * scale).all(), name


@pytest.mark.parametrize("name", SAME)
def test_other_descriptions_of_an_ellipsoid_give_its_contacts(name):
    tip, count, limit = SAME[name]
    rows = about(wrenches(count))
    close(contacts_from_wrenches(tip, rows), contacts_from_wrenches(ELLIPSOID, rows), limit)


@pytest.mark.parametrize("reach", [2.0 * R, 0.2 * R])
def test_the_hard_model_gives_the_same_entry_point_or_none(reach):
    rows = about(wrenches(400, reach=reach))
    tips = SAME["superellipsoid of exponent two"][0], ELLIPSOID
    found, wanted = (contacts_from_wrenches(tip, rows, model="hard") for tip in tips)
    np.testing.assert_array_equal(found.status, wanted.status)
    well = (wanted.status == 0) & (wanted.condition < 1e3)
    np.testing.assert_allclose(found.centroid[well], wanted.centroid[well], atol=1e-11 * R)


@pytest.mark.parametrize("quadric", [Sphere(R), ELLIPSOID], ids=["sphere", "ellipsoid"])
def test_a_composite_of_one_patch_is_that_quadric_bit_for_bit(quadric):
    found, wanted = (contacts_from_wrenches(tip, wrenches(300)) for tip in (Composite([Patch(quadric)]), quadric))
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(found, field), getattr(wanted, field))


@pytest.mark.parametrize("times", [1e2, 1e4, 1e6])
def test_a_hyperboloid_far_from_its_centre_is_a_paraboloid(times):
    """With a^2 = R c, their centroids differ in proportion to R/c."""
    c, rng = times * R, np.random.default_rng(4)
    tips = Hyperboloid((math.sqrt(R * c), math.sqrt(2 * R * c), c), **FRAME), Paraboloid((R, 2 * R), **FRAME)
    t = 0.5 * rng.normal(size=(200, 2))
    at = R * np.column_stack([t[:, 0], 2 * t[:, 1], -(t[:, 0] ** 2) / 2 - t[:, 1] ** 2])
    n = np.column_stack([t, np.ones(200)]) / np.sqrt(1.0 + (t**2).sum(axis=1, keepdims=True))
    f = 10 ** rng.uniform(-1, 1, (200, 1)) * (0.5 * np.cross(n, rng.normal(size=(200, 3))) - n)
    rows = about(np.hstack([f, np.cross(at, f) + 1e-3 * rng.normal(size=(200, 1)) * n]))
    found, wanted = (contacts_from_wrenches(tip, rows) for tip in tips)
    assert not np.any([found.status, wanted.status])
    error = np.linalg.norm(found.centroid - wanted.centroid, axis=1) / R
    assert 1e-3 / times < error.max() < 100 / times


@pytest.mark.parametrize(
    ("surface", "stiffness", "exponent"),
    [
        (Sphere(R), 1e4, LINEAR),
        (ELLIPSOID, 1e6, HERTZ),
        (Superellipsoid(AXES, 5.0), 1e9, 0.4),
        (Superellipsoid(AXES, 5.0), 1e4, LINEAR),
    ],
)
def test_the_centroid_of_a_soft_tip_lies_below_its_surface_by_the_indentation(surface, stiffness, exponent):
    """The point c + delta n is on the rigid surface, with the normal of a rigid contact there."""
    tip = CompliantTip(surface, stiffness, exponent)
    found = contacts_from_wrenches(tip, about(wrenches(60)) if surface is ELLIPSOID else wrenches(60))
    delta = np.array([tip.indentation(push) for push in found.normal_force])
    np.testing.assert_allclose(delta, (found.normal_force / stiffness) ** exponent, rtol=1e-12)
    x, f = found.centroid + delta[:, None] * found.normal, found.force
    rigid = contacts_from_wrenches(
        surface, np.hstack([f, np.cross(x, f) + found.spin_torque[:, None] * found.normal])
    )
    assert not np.any([found.status, rigid.status])
    well = rigid.condition < 1e4
    np.testing.assert_allclose(rigid.centroid[well], x[well], atol=1e-9 * R)
    np.testing.assert_allclose(rigid.normal[well], found.normal[well], atol=1e-6)


def test_the_contact_radius_is_hertzs():
    """A ball of radius R and modulus E* on a flat: f = 4/3 E* sqrt(R) delta^1.5 and a^2 = R delta."""
    modulus = 1e6
    tip = CompliantTip(Sphere(R), 4.0 / 3.0 * modulus * math.sqrt(R), HERTZ)
    a = tip.contact_radius(2.0, 1.0 / R)
    assert a**3 == pytest.approx(3 * 2.0 * R / (4 * modulus))  # Johnson 1985, equation 4.22
    assert tip.indentation(-1.0) == 0.0
