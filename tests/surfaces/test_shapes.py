"""Fingertip shapes: what they refuse and how they say it, and that they are values."""

import math

import numpy as np
import pytest

from palpate import Cylinder, Ellipsoid, Plane, Sphere
from palpate.errors import InvalidValueError, PalpateError

SHAPES = {
    Sphere: ("radius", 0.0125),
    Cylinder: ("radius", 0.0125),
    Plane: ("distance", 0.0125),
    Ellipsoid: ("semi_axes", (0.0125, 0.02, 0.03)),
}
every_shape = pytest.mark.parametrize("shape", SHAPES, ids=lambda s: s.__name__)
one_size = pytest.mark.parametrize("shape", [Sphere, Cylinder, Plane], ids=lambda s: s.__name__)
NINETY_DEGREES = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


def make(shape, **more):
    return shape(SHAPES[shape][1], **more)


@every_shape
def test_good_values_by_position_and_by_name(shape):
    """The size by position or by name, center and rotation by name."""
    name, size = SHAPES[shape]
    for surface in (
        shape(size),
        shape(**{name: size}),
        shape(size, center=(1, 2, 3), rotation=NINETY_DEGREES),
    ):
        np.testing.assert_array_equal(getattr(surface, name), size)
    np.testing.assert_array_equal(surface.center, (1, 2, 3))
    np.testing.assert_array_equal(surface.rotation, NINETY_DEGREES)
    np.testing.assert_array_equal(shape(size).center, (0, 0, 0))
    np.testing.assert_array_equal(shape(size).rotation, np.eye(3))


@one_size
@pytest.mark.parametrize("good", [1, 1e-100, 1e100, np.float32(0.5), np.float64(0.5), np.int64(2)])
def test_any_positive_number_is_a_size(shape, good):
    """Also an int, a numpy number, a very small and a very large one."""
    assert float(getattr(shape(good), SHAPES[shape][0])) == float(good)


@one_size
@pytest.mark.parametrize("bad", [0, 0.0, -0.0, -1.0, -5e-324, math.nan, math.inf, -math.inf])
def test_size_not_above_zero(shape, bad):
    """The message names the argument, the value and what would be right."""
    name = SHAPES[shape][0]
    with pytest.raises(InvalidValueError, match="above 0") as raised:
        shape(bad)
    assert name in str(raised.value)
    assert repr(bad) in str(raised.value)


@one_size
@pytest.mark.parametrize("bad", ["large", None, [1.0, 2.0], {}, 1j])
def test_size_not_a_number(shape, bad):
    """Strings, None, arrays and complex numbers are no length."""
    with pytest.raises(InvalidValueError, match=f"{SHAPES[shape][0]}.*number"):
        shape(bad)


@pytest.mark.parametrize("index", range(3))
@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, -math.inf])
def test_bad_semi_axis(index, bad):
    """Each of the three must be above 0 (infinity is: an elliptic cylinder)."""
    axes = [1.0, 2.0, 3.0]
    axes[index] = bad
    with pytest.raises(InvalidValueError, match="semi_axes") as raised:
        Ellipsoid(axes)
    assert str(bad) in str(raised.value)
    assert "above 0" in str(raised.value)


@pytest.mark.parametrize("bad", [1.0, (1.0,), (1.0, 2.0), (1.0, 2.0, 3.0, 4.0), [], [[1, 2, 3]]])
def test_semi_axes_of_wrong_shape(bad):
    """Three of them, in a flat sequence."""
    with pytest.raises(InvalidValueError, match=r"semi_axes.*(\(3,\)|three|3)"):
        Ellipsoid(bad)


@pytest.mark.parametrize(
    "bad", ["abc", None, np.ones((3, 1)), ("a", "b", "c"), (1.0, None, 2.0), (1.0, [2.0], 3.0), (1j, 1, 1)]
)
def test_semi_axes_not_numbers(bad):
    """Not numbers in a flat sequence: said so, by name."""
    with pytest.raises(InvalidValueError, match="semi_axes"):
        Ellipsoid(bad)


def test_infinite_semi_axes():
    """One or two may be infinite; three leave no surface."""
    for axes in [(math.inf, 1, 2), (1, math.inf, 2), (1, 2, math.inf), (math.inf, math.inf, 1)]:
        np.testing.assert_array_equal(Ellipsoid(axes).semi_axes, axes)
    with pytest.raises(InvalidValueError, match="semi_axes"):
        Ellipsoid((math.inf, math.inf, math.inf))


def test_semi_axes_too_far_apart():
    """Lengths that differ by 200 powers of ten mean an infinite one: refused, and said so."""
    with pytest.raises(InvalidValueError, match=r"semi_axes.*infinite"):
        Ellipsoid((1e100, 1e-100, 1.0))


@every_shape
def test_rotation_to_rounding_is_accepted(shape):
    """Products of rotations drift by some units of rounding; that is not an error, and nothing is changed."""
    c, s = math.cos(0.3), math.sin(0.3)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    for _ in range(10):
        R = R @ R.T @ R
    np.testing.assert_array_equal(make(shape, rotation=R).rotation, R)


def test_errors_have_two_parents():
    """Caught as the package's own and as a ValueError."""
    for kind in (PalpateError, ValueError):
        with pytest.raises(kind):
            Sphere(-1.0)


@every_shape
def test_shapes_are_frozen(shape):
    """No attribute can be set, no array written to, and the caller's arrays are not shared."""
    name, size = SHAPES[shape]
    center, R = np.array([1.0, 2.0, 3.0]), np.array(NINETY_DEGREES)
    given = np.array(size) if shape is Ellipsoid else size
    surface = shape(given, center=center, rotation=R)
    for attribute in (name, "center", "rotation"):
        with pytest.raises(AttributeError):
            setattr(surface, attribute, getattr(surface, attribute))
    with pytest.raises((AttributeError, TypeError)):
        surface.colour = "red"  # pyright: ignore[reportAttributeAccessIssue] refused on purpose
    for array in (surface.center, surface.rotation):
        if isinstance(array, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0.0
    center[0], R[0, 0] = 9.0, 9.0
    if shape is Ellipsoid:
        given[0] = 9.0
    np.testing.assert_array_equal(surface.center, (1, 2, 3))
    np.testing.assert_array_equal(surface.rotation, NINETY_DEGREES)
    np.testing.assert_array_equal(getattr(surface, name), size)


@every_shape
def test_repr_is_readable(shape):
    """A surface in a log shows its kind and its size."""
    text = repr(make(shape, center=(0.25, 0.0, 0.5)))
    assert text.startswith(shape.__name__ + "(")
    assert SHAPES[shape][0] in text
    assert "0.0125" in text
    assert "0.25" in text
    assert "object at 0x" not in text
    assert "\n" not in make(Sphere).__repr__()
