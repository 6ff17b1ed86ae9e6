"""Two descriptions of one fingertip feel the same, and what one kind approaches another becomes."""

import math

import numpy as np
import pytest

from palpate import (
    Capsule,
    CompliantTip,
    Composite,
    ContactStatus,
    Cylinder,
    Ellipsoid,
    Hyperboloid,
    ImplicitSurface,
    Paraboloid,
    Patch,
    Plane,
    RoundedBox,
    Sphere,
    Superellipsoid,
    contact_from_wrench,
    contacts_from_wrenches,
)
from palpate.surfaces import HERTZ, LINEAR

R = 0.01
FIELDS = ("centroid", "normal", "force", "tangential_force", "normal_force", "spin_torque", "condition", "status")
AXES = (0.008, 0.011, 0.015)
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.60, 0.0], [0.48, 0.64, 0.60]])
FRAME = {"center": (0.002, -0.03, 0.01), "rotation": TURN}


def wrenches(n, seed=0, reach=0.5 * R):
    """Any soft contacts: closed tips have a contact for each."""
    rng = np.random.default_rng(seed)
    return np.hstack([rng.normal(size=(n, 3)), reach * rng.normal(size=(n, 3))])


def about(frame, rows):
    """The same wrenches, exerted about a tip's centre and along its axes, seen by the sensor."""
    rotation, center = np.asarray(frame["rotation"]), np.asarray(frame["center"])
    f, m = rows[:, :3] @ rotation.T, rows[:, 3:] @ rotation.T
    return np.hstack([f, m + np.cross(center, f)])


def pushes(points, normals, n, seed=0):
    """Soft contacts at points, shape (n, 3)."""
    rng = np.random.default_rng(seed)
    along = np.cross(normals, rng.normal(size=(n, 3)))
    f = 10 ** rng.uniform(-1, 1, (n, 1)) * (0.5 * along - normals)
    return np.hstack([f, np.cross(points, f) + 1e-3 * rng.normal(size=(n, 1)) * normals])


def close(found, wanted, limit):
    """Equal status; centroid and normal within the limit times the condition number."""
    np.testing.assert_array_equal(found.status, wanted.status)
    ok = wanted.status == 0
    assert ok.mean() > 0.95
    size = np.linalg.norm(wanted.centroid[ok], axis=1).max()
    allowed = limit * np.minimum(wanted.condition[ok], 1e6)
    error = np.linalg.norm(found.centroid[ok] - wanted.centroid[ok], axis=1)
    assert (error <= allowed * size).all(), (error / (allowed * size)).max()
    assert (np.linalg.norm(found.normal[ok] - wanted.normal[ok], axis=1) <= 10 * allowed).all()
    force = np.linalg.norm(wanted.force[ok], axis=1)
    assert (np.abs(found.normal_force - wanted.normal_force)[ok] <= 10 * allowed * force).all()
    moment = force * size * np.maximum(1.0, np.abs(wanted.spin_torque[ok]) / force / size)
    assert (np.abs(found.spin_torque - wanted.spin_torque)[ok] <= 20 * allowed * moment).all()


def same(found, wanted):
    """Bit for bit."""
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(found, field), getattr(wanted, field))


def test_a_superellipsoid_of_exponent_two_is_an_ellipsoid():
    rows = about(FRAME, wrenches(400))
    tips = Superellipsoid(AXES, 2.0, **FRAME), Ellipsoid(AXES, **FRAME)
    close(*(contacts_from_wrenches(tip, rows) for tip in tips), 1e-13)


@pytest.mark.parametrize("reach", [2.0 * R, 0.2 * R])
def test_nor_can_the_wrench_axis_method_tell_them_apart(reach):
    """It finds where the axis enters, and says where it misses."""
    rows = about(FRAME, wrenches(400, reach=reach))
    tips = Superellipsoid(AXES, 2.0, **FRAME), Ellipsoid(AXES, **FRAME)
    found, wanted = (contacts_from_wrenches(tip, rows, model="hard") for tip in tips)
    np.testing.assert_array_equal(found.status, wanted.status)
    well = (wanted.status == 0) & (wanted.condition < 1e3)
    np.testing.assert_allclose(found.centroid[well], wanted.centroid[well], atol=1e-11 * R)


def test_an_ellipsoid_from_functions_is_an_ellipsoid():
    """Plain Python functions, in a placed frame."""
    squares = np.array(AXES) ** 2
    tip = ImplicitSurface(lambda p: p @ (p / squares) - 1.0, lambda p: 2.0 * p / squares, **FRAME)
    rows = about(FRAME, wrenches(25))
    close(contacts_from_wrenches(tip, rows), contacts_from_wrenches(Ellipsoid(AXES, **FRAME), rows), 1e-12)


def test_a_composite_of_one_patch_is_that_quadric():
    rows = wrenches(300)
    for quadric in (Sphere(R), Ellipsoid(AXES, **FRAME)):
        same(contacts_from_wrenches(Composite([Patch(quadric)]), rows), contacts_from_wrenches(quadric, rows))


def test_a_capsules_end_is_a_sphere_and_its_side_a_cylinder():
    rng = np.random.default_rng(1)
    n = rng.normal(size=(300, 3))
    n[:, 2] = np.abs(n[:, 2]) + 0.01
    n /= np.linalg.norm(n, axis=1)[:, None]
    rows = pushes(R * n, n, 300)
    capsule = Capsule(R, 3 * R)
    same(contacts_from_wrenches(capsule, rows), contacts_from_wrenches(Sphere(R), rows))
    n[:, 2] = 0.0
    n /= np.linalg.norm(n, axis=1)[:, None]
    at = R * n - np.array([0, 0, 1]) * rng.uniform(0.01, 2.99, (300, 1)) * R
    rows = pushes(at, n, 300)
    same(contacts_from_wrenches(capsule, rows), contacts_from_wrenches(Cylinder(R), rows))


def test_a_boxs_face_is_a_plane_and_its_corner_a_sphere():
    box = RoundedBox((R, 2 * R, 3 * R), R / 2)
    rng = np.random.default_rng(2)
    at = np.column_stack([rng.uniform(-0.45, 0.45, 200) * R, rng.uniform(-1.4, 1.4, 200) * R, np.full(200, 3 * R)])
    rows = pushes(at, np.tile([0.0, 0, 1], (200, 1)), 200)
    close(contacts_from_wrenches(box, rows), contacts_from_wrenches(Plane(3 * R), rows), 1e-15)
    n = np.abs(rng.normal(size=(200, 3))) + 0.01
    n /= np.linalg.norm(n, axis=1)[:, None]
    corner = np.array([R, 2 * R, 3 * R]) - R / 2
    rows = pushes(corner + R / 2 * n, n, 200)
    close(contacts_from_wrenches(box, rows), contacts_from_wrenches(Sphere(R / 2, center=corner), rows), 1e-15)


def test_a_paraboloid_is_a_sphere_near_its_apex():
    """Of the same curvature: they part with the third power of the slope at least."""
    radius = R
    angle = np.random.default_rng(3).uniform(0, 2 * math.pi, 100)
    worst = []
    for slope in (0.08, 0.04, 0.02):
        at = radius * np.column_stack(
            [slope * np.cos(angle), slope * np.sin(angle), np.full(100, -(slope**2) / 2)]
        )
        n = np.column_stack([slope * np.cos(angle), slope * np.sin(angle), np.ones(100)])
        n /= np.linalg.norm(n, axis=1)[:, None]
        rows = pushes(at, n, 100)
        open_, closed = (
            contacts_from_wrenches(tip, rows)
            for tip in (Paraboloid((radius, radius)), Sphere(radius, center=(0, 0, -radius)))
        )
        assert (open_.status == 0).all()
        assert (closed.status == 0).all()
        worst.append(np.linalg.norm(open_.centroid - closed.centroid, axis=1).max() / radius)
    assert worst[0] < 2 * 0.08**3
    assert worst[0] > 5 * worst[1] > 25 * worst[2] > 0


@pytest.mark.parametrize("times", [1e2, 1e4, 1e6])
def test_a_hyperboloid_far_from_its_centre_is_a_paraboloid(times):
    """a^2 = R c: they part with R/c."""
    c = times * R
    hyperboloid = Hyperboloid((math.sqrt(R * c), math.sqrt(2 * R * c), c), **FRAME)
    paraboloid = Paraboloid((R, 2 * R), **FRAME)
    rng = np.random.default_rng(4)
    t = 0.5 * rng.normal(size=(200, 2))
    at = R * np.column_stack([t[:, 0], 2 * t[:, 1], -(t[:, 0] ** 2) / 2 - t[:, 1] ** 2])
    n = np.column_stack([t, np.ones(200)])
    n /= np.linalg.norm(n, axis=1)[:, None]
    rows = about(FRAME, pushes(at, n, 200))
    found, wanted = (contacts_from_wrenches(tip, rows) for tip in (hyperboloid, paraboloid))
    assert (found.status == 0).all()
    assert (wanted.status == 0).all()
    error = np.linalg.norm(found.centroid - wanted.centroid, axis=1) / R
    assert error.max() < 100 / times
    assert error.max() > 1e-3 / times


def test_a_hyperboloid_is_a_cone_far_from_its_apex():
    """Normals approach those of the cone z = -(c/a) r, whatever the apex's curvature."""
    a, c, far = R, 2 * R, 1e4
    rows = pushes(np.array([[far * R, 0, -2 * far * R]]), np.array([[2.0, 0, 1]]) / math.sqrt(5), 1)
    found = contact_from_wrench(Hyperboloid((a, a, c)), rows[0])
    assert found.status == ContactStatus.OK
    np.testing.assert_allclose(found.normal, np.array([2, 0, 1]) / math.sqrt(5), atol=1e-3)


TIPS = {"sphere": Sphere(R), "ellipsoid": Ellipsoid(AXES, **FRAME), "superellipsoid": Superellipsoid(AXES, 5.0)}


@pytest.mark.parametrize("name", TIPS)
def test_a_very_stiff_tip_is_rigid(name):
    """1e12 N/m under newtons: a picometre."""
    rows = about(FRAME, wrenches(200)) if name == "ellipsoid" else wrenches(200)
    found = contacts_from_wrenches(CompliantTip(TIPS[name], 1e12), rows)
    wanted = contacts_from_wrenches(TIPS[name], rows)
    close(found, wanted, 1e-9)


@pytest.mark.parametrize("exponent", [LINEAR, HERTZ, 0.4])
@pytest.mark.parametrize("name", TIPS)
def test_a_soft_tips_centroid_lies_below_its_surface_by_the_indentation(name, exponent):
    """c + delta n is on the rigid surface, with the normal that a rigid contact there would have."""
    tip = CompliantTip(TIPS[name], {LINEAR: 1e4, HERTZ: 1e6, 0.4: 1e9}[exponent], exponent)
    rows = about(FRAME, wrenches(60)) if name == "ellipsoid" else wrenches(60)
    found = contacts_from_wrenches(tip, rows)
    assert (found.status == 0).all()
    delta = np.array([tip.indentation(push) for push in found.normal_force])
    np.testing.assert_allclose(delta, (found.normal_force / tip.stiffness) ** exponent, rtol=1e-12)
    x = found.centroid + delta[:, None] * found.normal
    # a rigid tip touched at x with that force and spin
    f, q = found.force, found.spin_torque[:, None] * found.normal
    rigid = contacts_from_wrenches(TIPS[name], np.hstack([f, np.cross(x, f) + q]))
    assert (rigid.status == 0).all()
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
