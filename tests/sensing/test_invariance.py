"""Symmetries of contact on every kind of fingertip: frames, units and mirrors change nothing."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

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

R, INF = 0.01, math.inf
UNSOLVED = ("centroid", "normal", "tangential_force", "normal_force", "spin_torque")


def egg(k, center=(0, 0, 0), rotation=((1, 0, 0), (0, 1, 0), (0, 0, 1))):
    up = np.asarray(rotation)[:, 2]
    plane = np.array([[*up, up @ np.asarray(center)]])
    frame = {"center": center, "rotation": rotation}
    below = Ellipsoid((k * R, k * R, 2 * k * R), **frame)
    return Composite([Patch(Sphere(k * R, **frame), -plane), Patch(below, plane)])


def bean(k, **frame):
    """An ellipsoid with one end blunter than the other, from plain Python functions."""

    def value(p):
        x, y, z = p / (k * R)
        return x * x + y * y + 0.5 * z * z + 0.1 * math.exp(z) - 1.0

    def gradient(p):
        x, y, z = p / (k * R)
        return np.array([2 * x, 2 * y, z + 0.1 * math.exp(z)]) / (k * R)

    return ImplicitSurface(value, gradient, size=k * R, **frame)


def soft(surface, load, k, exponent):
    """Yields a twentieth of R under a newton at unit load and size, whatever those are."""
    return CompliantTip(surface, load / (0.05 * k * R) ** (1 / exponent), exponent)


def lengths(k, *shares):
    return tuple(k * R * share for share in shares)


# of a size k, and under forces that are `load` times as large
TIPS = {
    "sphere": lambda k, _load, **frame: Sphere(k * R, **frame),
    "ellipsoid": lambda k, _load, **frame: Ellipsoid(lengths(k, 1, 1.5, 0.8), **frame),
    "cylinder": lambda k, _load, **frame: Cylinder(k * R, **frame),
    "elliptic cylinder": lambda k, _load, **frame: Ellipsoid(lengths(k, 1, INF, 2), **frame),
    "plane": lambda k, _load, **frame: Plane(k * R, **frame),
    "paraboloid": lambda k, _load, **frame: Paraboloid(lengths(k, 1, 1.5), **frame),
    "hyperboloid": lambda k, _load, **frame: Hyperboloid(lengths(k, 1, 1.5, 2), **frame),
    "capsule": lambda k, _load, **frame: Capsule(k * R, 3 * k * R, **frame),
    "box": lambda k, _load, **frame: RoundedBox(lengths(k, 1, 1.5, 2), k * R / 3, **frame),
    "egg": lambda k, _load, **frame: egg(k, **frame),
    "superellipsoid": lambda k, _load, **frame: Superellipsoid(lengths(k, 1, 1.5, 2), 4.5, **frame),
    "functions": lambda k, _load, **frame: bean(k, **frame),
    "soft": lambda k, load, **frame: soft(Superellipsoid(lengths(k, 1, 1, 2), 2.5, **frame), load, k, LINEAR),
    "soft Hertz": lambda k, load, **frame: soft(Superellipsoid(lengths(k, 1, 1, 2), 2.0, **frame), load, k, HERTZ),
}
QUADRICS = ("sphere", "ellipsoid", "cylinder", "elliptic cylinder", "plane")
CLOSED = ("sphere", "ellipsoid", "egg", "superellipsoid", "functions", "soft", "soft Hertz")
PYTHON = "functions"  # a thousand times slower: few wrenches
every_tip = pytest.mark.parametrize("name", TIPS)
both_models = pytest.mark.parametrize("model", ["soft", "hard"])


def wrenches(name, seed=1):
    """Pushes mostly downwards, so that open tips are touched too; spin is never tiny."""
    rng = np.random.default_rng(seed)
    n = 3 if name == PYTHON else 40
    moment = np.column_stack(
        [0.5 * R * rng.uniform(-1, 1, (n, 2)), 0.1 * R * rng.choice((-1, 1), n) * (1 + rng.random(n))]
    )
    return np.column_stack([0.7 * rng.uniform(-1, 1, (n, 2)), -np.ones(n), moment])


@dataclasses.dataclass(frozen=True)
class Similarity:
    """Points become length turn x + shift, forces force turn f: a mirror is a turn, too."""

    turn: np.ndarray = dataclasses.field(default_factory=lambda: np.eye(3))
    shift: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))
    length: float = 1.0
    force: float = 1.0

    def tip(self, name):
        mirrored = np.linalg.det(self.turn) < 0.0  # tips are symmetric about these planes
        frame = {} if mirrored else {"center": self.shift, "rotation": self.turn}
        return TIPS[name](self.length, self.force, **frame)

    def wrench(self, wrench):
        f = self.force * self.turn @ wrench[:3]
        pseudo = np.linalg.det(self.turn) * self.force * self.length
        return np.concatenate([f, pseudo * self.turn @ wrench[3:] + np.cross(self.shift, f)])


SIMILARITIES = {
    "turned": lambda rng: Similarity(turn=Rotation.random(rng=rng).as_matrix()),
    "shifted": lambda rng: Similarity(shift=R * rng.uniform(-1, 1, 3)),
    "mirrored in x": lambda _rng: Similarity(turn=np.diag([-1.0, 1.0, 1.0])),
    "mirrored in y": lambda _rng: Similarity(turn=np.diag([1.0, -1.0, 1.0])),
    "in another unit of length": lambda rng: Similarity(length=10.0 ** rng.uniform(-2, 2)),
    "in another unit of force": lambda rng: Similarity(force=10.0 ** rng.uniform(-3, 3)),
}


@pytest.mark.slow
@every_tip
@both_models
@pytest.mark.parametrize("change", SIMILARITIES)
def test_a_contact_changes_with_its_tip_and_its_wrench_and_no_otherwise(name, model, change):
    """Lengths and forces scale, vectors turn, moments and spin change their sign in a mirror."""
    rng, compared = np.random.default_rng(2), 0
    for wrench in wrenches(name):
        own = contact_from_wrench(TIPS[name](1.0, 1.0), wrench, model)
        if own.status != ContactStatus.OK or own.condition > 100:  # or near the edge of a tip that ends
            continue
        compared += 1
        by = SIMILARITIES[change](rng)
        found = contact_from_wrench(by.tip(name), by.wrench(wrench), model)
        assert found.status == ContactStatus.OK
        # what a condition number of 100 makes of rounding, and of the iteration's tolerance
        off = 2e-13 * own.condition if name in QUADRICS else 1e-9
        force, size = by.force * np.linalg.norm(own.force), by.length * R
        reach = max(size, np.linalg.norm(found.centroid))
        centroid = by.length * by.turn @ own.centroid + by.shift
        np.testing.assert_allclose(found.centroid, centroid, rtol=0, atol=min(off, 1e-11) * reach)
        np.testing.assert_allclose(found.normal, by.turn @ own.normal, rtol=0, atol=off)
        tangential = by.force * by.turn @ own.tangential_force
        np.testing.assert_allclose(found.tangential_force, tangential, rtol=0, atol=off * force)
        assert found.normal_force == pytest.approx(by.force * own.normal_force, abs=off * force)
        spin = np.linalg.det(by.turn) * by.force * by.length * own.spin_torque
        assert found.spin_torque == pytest.approx(spin, abs=off * force * reach)
        if name in QUADRICS and change != "shifted":
            assert found.condition == pytest.approx(own.condition, rel=1e-9)
    assert compared >= (1 if name == PYTHON else 5)


@pytest.mark.parametrize("name", QUADRICS)
@both_models
def test_powers_of_two_change_neither_status_nor_centroid(name, model):
    """They are exact: no threshold hides anywhere."""
    tip, rows = TIPS[name](1.0, 1.0), np.vstack([wrenches(name), [0, 0, -1, 0, 5, 0], [1, 0, 0, 0, 0, 5]])
    base = contacts_from_wrenches(tip, rows, model)
    for exponent in (-400, -30, 7, 400):
        found = contacts_from_wrenches(tip, 2.0**exponent * rows, model)
        np.testing.assert_array_equal(found.status, base.status)
        np.testing.assert_allclose(found.centroid, base.centroid, rtol=4e-15, atol=4e-15 * R)


def nothing_but_the_status(found, status):
    assert found.status == status
    for field in UNSOLVED:
        assert np.isnan(getattr(found, field)).all(), field
    assert found.condition == math.inf


@every_tip
@both_models
def test_an_axis_that_misses_touches_nothing(name, model):
    """A force at ten times the width of a tip, no spin at all: f.m is exactly zero."""
    tip = TIPS[name](1.0, 1.0)
    passes_above = name in ("paraboloid", "hyperboloid", "plane")  # every axis along z hits them
    wrench = (-1.0, 0.0, 0.0, 0.0, -10 * R, 0.0) if passes_above else (0.0, 0.0, -1.0, 0.0, 10 * R, 0.0)
    found = contact_from_wrench(tip, wrench, model=model)
    assert found.status == ContactStatus.NO_CONTACT or (name == "box" and found.status == ContactStatus.OUTSIDE)
    nothing_but_the_status(found, found.status)
    if name in CLOSED and model == "soft":  # the least spin makes a contact, at the limb
        found = contact_from_wrench(tip, (*wrench[:5], 1e-3 * R))
        assert found.status in (ContactStatus.OK, ContactStatus.NOT_CONVERGED)


@pytest.mark.parametrize("name", ["paraboloid", "hyperboloid"])
def test_nothing_pushes_an_open_tip_from_within(name):
    """Its normals all have a part along +z, so a force along +z pulls everywhere."""
    for spin in (0.0, 1e-3 * R):
        found = contact_from_wrench(TIPS[name](1.0, 1.0), (0.0, 0.0, 1.0, 0.0, 0.3 * R, spin))
        nothing_but_the_status(found, ContactStatus.NO_CONTACT)


@pytest.mark.parametrize("spin", [0.0, 0.1 * R])
def test_a_contact_below_the_end_of_a_capsule_is_outside(spin):
    """On its cylinder, but where that has ended; within the seam's tolerance it still counts."""
    tip, n = Capsule(R, 3 * R), np.array([0.6, 0.8, 0.0])
    f = np.array([0.1, 0.05, 0.2]) - n
    for z, status in ((-2.9, 0), (-3.0, 0), (-3 - 1e-10, 0), (-3 - 1e-7, 3), (-3.1, 3), (-30.0, 3)):
        c = R * np.array([*n[:2], z])
        found = contact_from_wrench(tip, np.concatenate([f, np.cross(c, f) + spin * n]))
        assert found.status == status, z
        if status:
            nothing_but_the_status(found, ContactStatus.OUTSIDE)
            np.testing.assert_array_equal(found.force, f)
        else:
            np.testing.assert_allclose(found.centroid, c, atol=1e-15)


def test_a_contact_where_a_composite_has_no_patch_is_outside():
    """Half a ball, touched on the half that is not there."""
    tip = Composite([Patch(Sphere(R), [[0, 0, -1, 0]])])
    for z in (-1.0, 1.0):
        f = -np.array([0.6, 0.0, 0.8 * z])
        found = contact_from_wrench(tip, np.concatenate([f, -0.001 * f]))
        assert found.status == (ContactStatus.OK if z > 0 else ContactStatus.OUTSIDE)


@pytest.mark.parametrize("name", ["paraboloid", "hyperboloid"])
@pytest.mark.parametrize("spin", [0.0, 0.3 * R])
def test_an_open_tip_pressed_along_its_axis(name, spin):
    """The most usual push of all: z f_z, with any moment. A paraboloid's other point then lies at infinity."""
    x, y = np.random.default_rng(1).normal(size=(2, 2000))
    w = np.sqrt(1 + x**2 + y**2)
    c, n = np.column_stack([x, 1.5 * y, -(x**2) / 2 - 0.75 * y**2]), np.column_stack([x, y, np.ones_like(x)])
    if name == "hyperboloid":
        c, n = np.column_stack([x, 1.5 * y, 2 * (1 - w)]), np.column_stack([x, y / 1.5, w / 2.0])
    n /= np.linalg.norm(n, axis=1)[:, None]
    f = np.tile([0.0, 0.0, -1.0], (len(x), 1))
    found = contacts_from_wrenches(TIPS[name](1.0, 1.0), np.hstack([f, R * np.cross(c, f) + spin * n]))
    assert (found.status == ContactStatus.OK).all()
    well = found.condition < 1e3
    np.testing.assert_allclose(found.centroid[well], R * c[well], atol=1e-11 * R)


@pytest.mark.parametrize("name", ["paraboloid", "hyperboloid"])
def test_without_spin_an_open_tip_is_touched_on_the_wrench_axis_or_not_at_all(name):
    """Both by the hard model and by wrenches whose f.m is exactly zero."""
    rng = np.random.default_rng(2)
    rows = np.hstack([rng.normal(size=(2000, 3)), 2 * R * rng.normal(size=(2000, 3))])
    flat = rows * [0, 1, 1, 1, 0, 0]  # f = (0, y, z) and m = (x, 0, 0)
    for given, model in ((rows, "hard"), (flat, "soft")):
        found = contacts_from_wrenches(TIPS[name](1.0, 1.0), given, model=model)
        f, m = given[:, :3], given[:, 3:]
        off = np.linalg.norm(np.cross(m - np.cross(found.centroid, f), f), axis=1) / (f * f).sum(axis=1)
        ok = found.status == ContactStatus.OK
        assert 0.0 < ok.mean() < 1.0
        assert (off[ok] <= 1e-10 * np.maximum(R, np.linalg.norm(found.centroid[ok], axis=1))).all()


def test_grazing_composites_do_not_vouch_for_another_patch():
    """The axis misses the cylinder by rounding, and the hemisphere explains what is left with next to no push."""
    rng, n = np.random.default_rng(1), 2000
    turn = rng.uniform(0, 2 * np.pi, n)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    c = R * normal - R * np.column_stack([np.zeros((n, 2)), rng.uniform(0.1, 2.9, n)])
    across = np.column_stack([-normal[:, 1], normal[:, 0], rng.normal(size=n)])
    f = across - 10 ** rng.uniform(-9, -6, n)[:, None] * normal
    found = contacts_from_wrenches(Capsule(R, 3 * R), np.hstack([f, np.cross(c, f)]))
    assert (np.linalg.norm(found.centroid - c, axis=1)[found.status == 0] < 1e-4 * R).all()
    assert (found.status != 0).any()
