"""Fingertips beyond the centred quadrics: what they refuse and how they say it, and how they print."""

import math

import numpy as np
import pytest

from palpate import (
    Capsule,
    CompliantTip,
    Composite,
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
)
from palpate.errors import InvalidValueError

R = 0.01
EYE = np.eye(3)
NAN, INF = math.nan, math.inf


def value(point):
    return point @ point / R**2 - 1.0


def gradient(point):
    return 2.0 * point / R**2


def ball(**frame):
    return ImplicitSurface(value, gradient, **frame)


FRAMED = {
    "Paraboloid": lambda **frame: Paraboloid((R, 2 * R), **frame),
    "Hyperboloid": lambda **frame: Hyperboloid((R, 2 * R, 3 * R), **frame),
    "Capsule": lambda **frame: Capsule(R, 2 * R, **frame),
    "RoundedBox": lambda **frame: RoundedBox((R, 2 * R, 3 * R), R / 2, **frame),
    "Superellipsoid": lambda **frame: Superellipsoid((R, R, 2 * R), 4.0, **frame),
    "ImplicitSurface": ball,
}

# (what, builds it, words that the message must hold: argument, value, what would be right)
REFUSED = [
    ("paraboloid, one radius", lambda: Paraboloid((R,)), ("radii", "0.01", "2 lengths")),
    ("paraboloid, none", lambda: Paraboloid(None), ("radii", "None", "2 lengths")),
    ("paraboloid, number", lambda: Paraboloid(R), ("radii", "0.01", "2 lengths")),
    ("paraboloid, zero", lambda: Paraboloid((R, 0.0)), ("radii[1]", "0.0", "above 0")),
    ("paraboloid, infinite", lambda: Paraboloid((INF, R)), ("radii[0]", "inf", "finite")),
    ("paraboloid, string", lambda: Paraboloid(("a", R)), ("radii[0]", "'a'", "number")),
    ("hyperboloid, two", lambda: Hyperboloid((R, R)), ("semi_axes", "3 lengths")),
    ("hyperboloid, negative", lambda: Hyperboloid((R, R, -R)), ("semi_axes[2]", "-0.01", "above 0")),
    ("hyperboloid, nan", lambda: Hyperboloid((NAN, R, R)), ("semi_axes[0]", "nan", "finite")),
    ("capsule, radius", lambda: Capsule(-R, R), ("radius", "-0.01", "above 0")),
    ("capsule, length", lambda: Capsule(R, 0.0), ("length", "0.0", "above 0")),
    ("capsule, endless", lambda: Capsule(R, INF), ("length", "inf", "finite")),
    ("capsule, string", lambda: Capsule("thick", R), ("radius", "'thick'", "number")),
    ("box, two", lambda: RoundedBox((R, R), R / 2), ("half_lengths", "(2,)", "(3,)")),
    ("box, nan", lambda: RoundedBox((R, NAN, R), R / 2), ("half_lengths", "nan", "finite")),
    ("box, too round", lambda: RoundedBox((R, 2 * R, R), R), ("radius", "0.01", "less than")),
    ("box, sharp", lambda: RoundedBox((R, R, R), 0.0), ("radius", "0.0", "above 0")),
    ("box, inside out", lambda: RoundedBox((-R, R, R), R / 2), ("half length", "-0.01")),
    ("patch of a tip", lambda: Patch(Paraboloid((R, R))), ("surface", "Paraboloid", "Sphere, Ellipsoid")),
    ("patch of a class", lambda: Patch(Sphere), ("surface", "must be")),
    ("half space, flat", lambda: Patch(Sphere(R), [0, 0, 1, 0]), ("half_spaces", "(4,)", "(k, 4)")),
    ("half space, nan", lambda: Patch(Sphere(R), [[0, 0, 1, NAN]]), ("half_spaces", "finite")),
    ("half space, long", lambda: Patch(Sphere(R), [[0, 0, 2, 0]]), ("half_spaces", "2.0", "must be 1")),
    ("composite of nothing", lambda: Composite([]), ("patches", "[]", "one Patch or more")),
    ("composite of quadrics", lambda: Composite([Sphere(R)]), ("patches", "Sphere", "Patch")),
    ("superellipsoid, round", lambda: Superellipsoid((R, R, R), 1.9), ("exponent", "1.9", "between 2 and 10")),
    ("superellipsoid, sharp", lambda: Superellipsoid((R, R, R), 11), ("exponent", "11", "between 2 and 10")),
    ("superellipsoid, nan", lambda: Superellipsoid((R, R, R), NAN), ("exponent", "nan", "finite")),
    ("superellipsoid, zero", lambda: Superellipsoid((R, 0, R), 4), ("semi_axes[1]", "0.0", "above 0")),
    ("superellipsoid, two", lambda: Superellipsoid((R, R), 4), ("semi_axes", "(2,)", "(3,)")),
    ("soft, stiffness", lambda: CompliantTip(Sphere(R), 0.0), ("stiffness", "0.0", "above 0")),
    ("soft, rigid", lambda: CompliantTip(Sphere(R), INF), ("stiffness", "inf", "finite")),
    ("soft, exponent", lambda: CompliantTip(Sphere(R), 1.0, 1.5), ("exponent", "1.5", "at most 1")),
    ("soft, nan", lambda: CompliantTip(Sphere(R), 1.0, NAN), ("exponent", "nan", "at most 1")),
    ("soft cylinder", lambda: CompliantTip(Cylinder(R), 1.0), ("surface", "Cylinder", "closed")),
    ("soft plane", lambda: CompliantTip(Plane(R), 1.0), ("surface", "Plane", "closed")),
    ("soft tube", lambda: CompliantTip(Ellipsoid((R, R, INF)), 1.0), ("surface", "inf", "closed")),
    ("soft thimble", lambda: CompliantTip(Capsule(R, R), 1.0), ("surface", "Capsule", "closed")),
    ("soft soft", lambda: CompliantTip(CompliantTip(Sphere(R), 1.0), 1.0), ("surface", "closed")),
    ("implicit, size", lambda: ImplicitSurface(value, gradient, size=0.0), ("size", "0.0", "above 0")),
]


@pytest.mark.parametrize(("build", "words"), [r[1:] for r in REFUSED], ids=[r[0] for r in REFUSED])
def test_the_message_names_argument_value_and_remedy(build, words):
    with pytest.raises(InvalidValueError) as raised:
        build()
    for word in words:
        assert word in str(raised.value), str(raised.value)


UNCAUGHT = {
    "composite of None": (lambda: Composite(None), "patches"),
    "composite of a quadric": (lambda: Composite(Sphere(R)), "patches"),
    "half spaces of words": (lambda: Patch(Sphere(R), "abc"), "half_spaces"),
    "ragged half spaces": (lambda: Patch(Sphere(R), [[0, 0], [1]]), "half_spaces"),
    "soft, exponent a word": (lambda: CompliantTip(Sphere(R), 1.0, "Hertz"), "exponent"),
    "value no function": (lambda: ImplicitSurface(3.0, gradient), "value"),
    "gradient no function": (lambda: ImplicitSurface(value, None), "gradient"),
    "gradient a number": (lambda: ImplicitSurface(value, lambda point: 1.0), "gradient"),
    "paraboloid, huge": (lambda: Paraboloid((1e300, 1e300)), "radii"),
    "hyperboloid, tiny": (lambda: Hyperboloid((R, R, 1e-200)), "semi_axes"),
    "hyperboloid, huge": (lambda: Hyperboloid((R, R, 1e200)), "semi_axes"),
}


@pytest.mark.parametrize(("build", "name"), UNCAUGHT.values(), ids=UNCAUGHT)
def test_nothing_else_leaves_a_constructor(build, name):
    """Whatever is given, the message is the library's and names the argument."""
    with pytest.raises(InvalidValueError, match=name):
        build()


def test_numbers_are_kept_as_numbers():
    """What float() takes is a float from then on."""
    assert CompliantTip(Sphere(R), "100").stiffness == 100.0


# ------------------------------------------------------------------------------------- implicit surfaces


def shell(value, gradient, match, **more):
    with pytest.raises(InvalidValueError, match=match) as raised:
        ImplicitSurface(value, gradient, **more)
    return str(raised.value)


def test_a_wrong_gradient_is_refused():
    """Twice too long, of another sign, swapped: never the surface's normal by accident."""
    for wrong in (lambda p: 1.5 * gradient(p), lambda p: -gradient(p), lambda p: gradient(p)[::-1].copy()):
        text = shell(value, wrong, "gradient at .* must be the gradient of value")
        assert "differences of the value give" in text


def test_a_gradient_in_the_wrong_frame_is_refused():
    """The functions are those of the surface's own frame: not of the sensor's."""
    shift = np.array([0.0, 0.0, R / 2])
    shell(value, lambda p: gradient(p + shift), "own frame")


@pytest.mark.parametrize("offset", [1.01, 5.0])
def test_a_centre_outside_is_refused(offset):
    o = np.array([offset * R, 0, 0])
    shell(lambda p: value(p - o), lambda p: gradient(p - o), "centre .* must be below 0")


def test_an_inside_out_value_is_refused():
    shell(lambda p: -value(p), lambda p: -gradient(p), "must be below 0")


def test_a_value_that_is_no_number_is_refused():
    shell(lambda p: NAN, gradient, "nan.* must be below 0")


def test_a_peanut_is_refused():
    """Cassini's oval about x, k = 0.95: it has a waist."""
    k = 0.95 * R

    def oval(p):
        return ((p @ p + k * k) ** 2 - 4 * k * k * p[0] ** 2) / R**4 - 1.0

    def slope(p):
        return (4 * (p @ p + k * k) * p - np.array([8 * k * k * p[0], 0, 0])) / R**4

    assert "must be convex" in shell(oval, slope, "bends inwards at")


def test_a_slight_dent_is_refused():
    """A ball with a ripple of a twentieth of its radius."""

    def rippled(p):
        return value(p) + 0.1 * math.cos(12.0 * p[0] / R)

    def slope(p):
        return gradient(p) - np.array([1.2 / R * math.sin(12.0 * p[0] / R), 0, 0])

    shell(rippled, slope, "bends inwards")


@pytest.mark.parametrize("axis", range(3))
def test_an_open_surface_is_refused(axis):
    """A cylinder along an axis and a paraboloid that opens along one."""
    across = 1.0 - EYE[axis]
    shell(lambda p: p @ (across * p) / R**2 - 1.0, lambda p: 2 * across * p / R**2, "must be closed")
    cup = R * EYE[axis]
    shell(
        lambda p: (p @ (across * p) - p[axis] * R) / R**2 - 1.0,
        lambda p: (2 * across * p - cup) / R**2,
        "must be closed",
    )


def test_an_open_surface_askew_gives_no_wrong_contact():
    """No ray of the check runs along it, so it may pass as a long tip: then each contact is one or says not."""
    axis = np.array([1.0, 2.0, 3.0]) / math.sqrt(14.0)

    def tube(p):
        return (p @ p - (p @ axis) ** 2) / R**2 - 1.0

    def slope(p):
        return 2.0 * (p - (p @ axis) * axis) / R**2

    try:
        surface = ImplicitSurface(tube, slope)
    except InvalidValueError:
        return
    rng = np.random.default_rng(1)
    for _ in range(3):
        wrench = np.concatenate([rng.normal(size=3), R * rng.normal(size=3)])
        found = contact_from_wrench(surface, wrench)
        if found.status == 0:
            assert abs(tube(found.centroid)) < 1e-12
            np.testing.assert_allclose(found.normal @ axis, 0.0, atol=1e-12)
            left = wrench[3:] - np.cross(found.centroid, found.force) - found.spin_torque * found.normal
            assert np.linalg.norm(left) < 1e-11 * R * np.linalg.norm(found.force)


@pytest.mark.parametrize("size", [R / 10, R, 10 * R])
def test_a_tenfold_wrong_size_does_no_harm(size):
    wrench = (0.1, 0.2, -1.0, 0.002, 0.001, 0.0005)
    found = contact_from_wrench(ImplicitSurface(value, gradient, size=size), wrench)
    np.testing.assert_allclose(found.centroid, contact_from_wrench(Sphere(R), wrench).centroid, atol=1e-12 * R)


# ---------------------------------------------------------------------------------------------- how they print


@pytest.mark.parametrize("name", FRAMED)
@pytest.mark.parametrize("frame", [{}, {"center": (0, 0, R), "rotation": EYE[[1, 2, 0]]}], ids=["own", "placed"])
def test_one_line(name, frame):
    """It names the kind; centre and rotation only where they are not the sensor's own."""
    text = repr(FRAMED[name](**frame))
    assert text.startswith(name)
    assert "\n" not in text
    assert ("rotation" in text) == ("center" in text) == bool(frame)


def test_one_line_that_gives_the_tip_back():
    for tip in (Capsule(R, 2 * R, center=(0, 0, R)), RoundedBox((R, R, 2 * R), R / 2)):
        again = eval(repr(tip))
        np.testing.assert_array_equal(again.packed, tip.packed)
        np.testing.assert_array_equal(again.domains, tip.domains)


def test_one_line_of_a_composite_and_a_soft_tip():
    own = Composite([Patch(Sphere(R), [[0, 0, 1, 0]]), Patch(Ellipsoid((R, R, 2 * R)), [[0, 0, -1, 0]])])
    assert repr(own) == "Composite of 2 patches"
    assert (
        repr(CompliantTip(Sphere(R), 100.0))
        == "CompliantTip(surface=Sphere(radius=0.01), stiffness=100.0, exponent=1.0)"
    )
