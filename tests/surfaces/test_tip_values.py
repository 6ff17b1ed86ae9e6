"""Fingertips: what they refuse and how they say it; that they are values, and how they print."""

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
from palpate.errors import InvalidValueError, PalpateError

R = 0.01
EYE = np.eye(3)
NAN, INF = math.nan, math.inf
SIZED = {Sphere: "radius", Cylinder: "radius", Plane: "distance"}
WRONG_GRADIENT = ("gradient at", "must be the gradient of value", "differences of the value give")


def value(point):
    return point @ point / R**2 - 1.0


def gradient(point):
    return 2.0 * point / R**2


def shifted(offset):
    """A ball beside the centre."""
    o = np.array([offset * R, 0, 0])
    return ImplicitSurface(lambda p: value(p - o), lambda p: gradient(p - o))


def tube(direction):
    """Value and gradient of an endless cylinder along a unit vector."""
    return (
        lambda p: (p @ p - (p @ direction) ** 2) / R**2 - 1.0,
        lambda p: 2.0 * (p - (p @ direction) * direction) / R**2,
    )


def cup(axis):
    """A paraboloid that opens along an axis."""
    across, away = 1.0 - EYE[axis], R * EYE[axis]
    return ImplicitSurface(
        lambda p: (p @ (across * p) - p @ away) / R**2 - 1.0, lambda p: (2 * across * p - away) / R**2
    )


# Cassini's oval about x: it has a waist; a ball with a ripple of a twentieth of its radius
K = 0.95 * R
PEANUT = (
    lambda p: ((p @ p + K * K) ** 2 - 4 * K * K * p[0] ** 2) / R**4 - 1.0,
    lambda p: (4 * (p @ p + K * K) * p - np.array([8 * K * K * p[0], 0, 0])) / R**4,
)
DENTED = (
    lambda p: value(p) + 0.1 * math.cos(12.0 * p[0] / R),
    lambda p: gradient(p) - np.array([1.2 / R * math.sin(12.0 * p[0] / R), 0, 0]),
)

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
    ("composite of None", lambda: Composite(None), ("patches",)),
    ("composite of a quadric", lambda: Composite(Sphere(R)), ("patches",)),
    ("half spaces of words", lambda: Patch(Sphere(R), "abc"), ("half_spaces",)),
    ("ragged half spaces", lambda: Patch(Sphere(R), [[0, 0], [1]]), ("half_spaces",)),
    ("soft, exponent a word", lambda: CompliantTip(Sphere(R), 1.0, "Hertz"), ("exponent",)),
    ("value no function", lambda: ImplicitSurface(3.0, gradient), ("value",)),
    ("gradient no function", lambda: ImplicitSurface(value, None), ("gradient",)),
    ("gradient a number", lambda: ImplicitSurface(value, lambda point: 1.0), ("gradient",)),
    ("paraboloid, huge", lambda: Paraboloid((1e300, 1e300)), ("radii",)),
    ("hyperboloid, tiny", lambda: Hyperboloid((R, R, 1e-200)), ("semi_axes",)),
    ("hyperboloid, huge", lambda: Hyperboloid((R, R, 1e200)), ("semi_axes",)),
    ("gradient too long", lambda: ImplicitSurface(value, lambda p: 1.5 * gradient(p)), WRONG_GRADIENT),
    ("gradient inwards", lambda: ImplicitSurface(value, lambda p: -gradient(p)), WRONG_GRADIENT),
    ("gradient swapped", lambda: ImplicitSurface(value, lambda p: gradient(p)[::-1].copy()), WRONG_GRADIENT),
    (
        "gradient elsewhere",
        lambda: ImplicitSurface(value, lambda p: gradient(np.add(p, [0, 0, R / 2]))),
        ("own frame",),
    ),
    ("centre outside", lambda: shifted(1.01), ("centre", "must be below 0")),
    ("centre far outside", lambda: shifted(5.0), ("centre", "must be below 0")),
    ("inside out", lambda: ImplicitSurface(lambda p: -value(p), lambda p: -gradient(p)), ("must be below 0",)),
    ("value nan", lambda: ImplicitSurface(lambda p: NAN, gradient), ("nan", "must be below 0")),
    ("peanut", lambda: ImplicitSurface(*PEANUT), ("must be convex", "bends inwards at")),
    ("slight dent", lambda: ImplicitSurface(*DENTED), ("bends inwards",)),
    *(
        (f"tube along {axis}", lambda axis=axis: ImplicitSurface(*tube(EYE[axis])), ("must be closed",))
        for axis in range(3)
    ),
    *((f"cup along {axis}", lambda axis=axis: cup(axis), ("must be closed",)) for axis in range(3)),
    *(
        (f"{shape.__name__} of {bad!r}", lambda shape=shape, bad=bad: shape(bad), (name, repr(bad), "above 0"))
        for shape, name in SIZED.items()
        for bad in (0, 0.0, -0.0, -1.0, -5e-324, NAN, INF, -INF)
    ),
    *(
        (f"{shape.__name__} of {bad!r}", lambda shape=shape, bad=bad: shape(bad), (name, "number"))
        for shape, name in SIZED.items()
        for bad in ("large", None, [1.0, 2.0], {}, 1j)
    ),
    *(
        (
            f"axis {i} {bad}",
            lambda i=i, bad=bad: Ellipsoid(np.insert([1.0, 2.0], i, bad)),
            ("semi_axes", str(bad), "above 0"),
        )
        for i in range(3)
        for bad in (0.0, -1.0, NAN, -INF)
    ),
    *(
        (f"semi-axes {bad!r}", lambda bad=bad: Ellipsoid(bad), ("semi_axes",))
        for bad in (1.0, (1.0,), (1.0, 2.0), (1.0, 2.0, 3.0, 4.0), [], [[1, 2, 3]])
    ),
    *(
        (f"semi-axes {bad!r:.20}", lambda bad=bad: Ellipsoid(bad), ("semi_axes",))
        for bad in ("abc", None, np.ones((3, 1)), ("a", "b", "c"), (1.0, None, 2.0), (1.0, [2.0], 3.0), (1j, 1, 1))
    ),
    ("endless", lambda: Ellipsoid((INF, INF, INF)), ("semi_axes",)),
    ("too far apart", lambda: Ellipsoid((1e100, 1e-100, 1.0)), ("semi_axes", "infinite")),
]


@pytest.mark.parametrize(("build", "words"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED])
def test_the_message_names_argument_value_and_remedy(build, words):
    with pytest.raises(InvalidValueError) as raised:
        build()
    assert {PalpateError, ValueError} <= set(type(raised.value).__mro__)
    for word in words:
        assert word in str(raised.value), str(raised.value)


def test_an_open_surface_askew_gives_no_wrong_contact():
    """No ray of the check runs along it, so it may pass as a long tip: then each contact is one or says not."""
    axis, rng = np.array([1.0, 2.0, 3.0]) / math.sqrt(14.0), np.random.default_rng(1)
    try:
        surface = ImplicitSurface(*tube(axis))
    except InvalidValueError:
        return
    for _ in range(3):
        wrench = np.concatenate([rng.normal(size=3), R * rng.normal(size=3)])
        found = contact_from_wrench(surface, wrench)
        if found.status == 0:
            assert abs(tube(axis)[0](found.centroid)) < 1e-12
            np.testing.assert_allclose(found.normal @ axis, 0.0, atol=1e-12)
            left = wrench[3:] - np.cross(found.centroid, found.force) - found.spin_torque * found.normal
            assert np.linalg.norm(left) < 1e-11 * R * np.linalg.norm(found.force)


@pytest.mark.parametrize("size", [R / 10, R, 10 * R])
def test_a_tenfold_wrong_size_does_no_harm(size):
    wrench = (0.1, 0.2, -1.0, 0.002, 0.001, 0.0005)
    found = contact_from_wrench(ImplicitSurface(value, gradient, size=size), wrench)
    np.testing.assert_allclose(found.centroid, contact_from_wrench(Sphere(R), wrench).centroid, atol=1e-12 * R)


# --- values ---

NINETY_DEGREES = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
SIZES = {Sphere: ("radius", 0.0125), Cylinder: ("radius", 0.0125), Plane: ("distance", 0.0125)}
SHAPES = SIZES | {Ellipsoid: ("semi_axes", (0.0125, 0.02, 0.03))}
every_shape = pytest.mark.parametrize("shape", SHAPES, ids=lambda s: s.__name__)


@every_shape
def test_shapes_are_frozen_values(shape):
    """Size by position or by name; no attribute can be set, and the caller's arrays are not shared."""
    (name, size), center, R = SHAPES[shape], np.array([1.0, 2.0, 3.0]), np.array(NINETY_DEGREES)
    given = np.array(size) if shape is Ellipsoid else size
    surface, plain = shape(given, center=center, rotation=R), shape(**{name: size})
    for array in (center, R, *([given] if shape is Ellipsoid else [])):
        array[0] = 9.0  # pyright: ignore[reportIndexIssue]
    for tip, expected in ((surface, (size, (1, 2, 3), NINETY_DEGREES)), (plain, (size, (0, 0, 0), EYE))):
        for attribute, wanted in zip((name, "center", "rotation"), expected, strict=True):
            np.testing.assert_array_equal(getattr(tip, attribute), wanted)
            with pytest.raises(AttributeError):
                setattr(tip, attribute, wanted)
    with pytest.raises((AttributeError, TypeError)):
        surface.colour = "red"  # pyright: ignore[reportAttributeAccessIssue]
    for array in (surface.center, surface.rotation):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize("good", [1, 1e-100, 1e100, np.float32(0.5), np.float64(0.5), np.int64(2)])
def test_any_positive_number_is_a_size_and_one_or_two_semi_axes_may_be_infinite(good):
    for shape, name in SIZED.items():
        assert float(getattr(shape(good), name)) == float(good)
    for axes in [(INF, 1, 2), (1, INF, 2), (1, 2, INF), (INF, INF, 1)]:
        np.testing.assert_array_equal(Ellipsoid(axes).semi_axes, axes)
    assert CompliantTip(Sphere(R), "100").stiffness == 100.0  # what float() takes is a float from then on


def test_rotation_to_rounding_is_accepted():
    """Products of rotations drift by some units of rounding; that is not an error, and nothing is changed."""
    turn = np.array([[math.cos(0.3), -math.sin(0.3), 0], [math.sin(0.3), math.cos(0.3), 0], [0, 0, 1]])
    for _ in range(10):
        turn = turn @ turn.T @ turn
    np.testing.assert_array_equal(Ellipsoid((1, 2, 3), rotation=turn).rotation, turn)


# --- how they print ---

FRAMED = {
    "Sphere": lambda **frame: Sphere(R, **frame),
    "Ellipsoid": lambda **frame: Ellipsoid((R, 2 * R, INF), **frame),
    "Cylinder": lambda **frame: Cylinder(R, **frame),
    "Plane": lambda **frame: Plane(R, **frame),
    "Paraboloid": lambda **frame: Paraboloid((R, 2 * R), **frame),
    "Hyperboloid": lambda **frame: Hyperboloid((R, 2 * R, 3 * R), **frame),
    "Capsule": lambda **frame: Capsule(R, 2 * R, **frame),
    "RoundedBox": lambda **frame: RoundedBox((R, 2 * R, 3 * R), R / 2, **frame),
    "Superellipsoid": lambda **frame: Superellipsoid((R, R, 2 * R), 4.0, **frame),
    "ImplicitSurface": lambda **frame: ImplicitSurface(value, gradient, **frame),
}


@pytest.mark.parametrize("name", FRAMED)
@pytest.mark.parametrize("frame", [{}, {"center": (0, 0, R), "rotation": EYE[[1, 2, 0]]}], ids=["own", "placed"])
def test_one_line(name, frame):
    """It names the kind; centre and rotation only where they are not the sensor's own."""
    text = repr(FRAMED[name](**frame))
    assert text.startswith(f"{name}(")
    assert "\n" not in text
    assert "object at 0x" not in text or name == "ImplicitSurface"
    assert ("rotation" in text) == ("center" in text) == bool(frame)


def test_one_line_that_gives_the_tip_back():
    for tip in (Capsule(R, 2 * R, center=(0, 0, R)), RoundedBox((R, R, 2 * R), R / 2)):
        again = eval(repr(tip))
        np.testing.assert_array_equal(again.packed, tip.packed)
        np.testing.assert_array_equal(again.domains, tip.domains)
    own = Composite([Patch(Sphere(R), [[0, 0, 1, 0]]), Patch(Ellipsoid((R, R, 2 * R)), [[0, 0, -1, 0]])])
    assert repr(own) == "Composite of 2 patches"
    soft = "CompliantTip(surface=Sphere(radius=0.01), stiffness=100.0, exponent=1.0)"
    assert repr(CompliantTip(Sphere(R), 100.0)) == soft
