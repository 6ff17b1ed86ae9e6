"""Checks let through exactly what can be right, and say of the rest what it was and what would have been."""

import copy
import inspect
import math
import pickle
from dataclasses import FrozenInstanceError, dataclass, field, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import (
    ORTHONORMAL_TOLERANCE,
    InvalidValueError,
    not_negative,
    positive,
    rotation_matrix,
    vector,
)
from palpate.quick_init import quick_init

any_float = st.floats(allow_nan=True, allow_infinity=True)
checked = settings(max_examples=200, deadline=None, derandomize=True)
ROUNDED = np.array([[0.8660, -0.5, 0.0], [0.5, 0.8660, 0.0], [0.0, 0.0, 1.0]])


def accepted(check, *args, **more):
    try:
        check(*args, **more)
    except InvalidValueError:
        return False
    return True


@checked
@given(any_float)
def test_numbers_pass_exactly_when_they_are_in_range(value):
    assert accepted(positive, "x", value, "m") == (0.0 < value < math.inf)
    assert accepted(positive, "x", value, "m", infinite_allowed=True) == (value > 0.0)
    assert accepted(not_negative, "x", value, "m") == (0.0 <= value < math.inf)


@pytest.mark.parametrize("given_as", [2, 2.0, np.float32(2.0), np.int64(2), np.array(2.0)])
def test_any_kind_of_number_comes_back_as_a_float(given_as):
    for check in (positive, not_negative):
        found = check("x", given_as, "m")
        assert type(found) is float
        assert found == 2.0


@pytest.mark.parametrize("value", ["two", None, [1.0, 2.0], {}, 1j])
def test_what_is_no_number_is_refused_not_crashed_on(value):
    for check in (positive, not_negative):
        with pytest.raises(InvalidValueError, match="x = "):
            check("x", value, "m")


@pytest.mark.parametrize(
    ("message", "check"),
    [
        (r"^radius = -1.0 m: must be a finite number above 0$", lambda: positive("radius", -1.0, "m")),
        (r"^ratio = 0.0: must be a finite number above 0$", lambda: positive("ratio", 0.0, "")),
        ("infinity allowed", lambda: positive("radius", 0.0, "m", infinite_allowed=True)),
        ("0 or above", lambda: not_negative("mass", -0.1, "kg")),
        (r"center has shape \(2,\): must be \(3,\)", lambda: vector("center", [0.0, 1.0], 3, "m")),
        ("every entry must be finite", lambda: vector("center", [0.0, 1.0, math.nan], 3, "m")),
        ("regular array", lambda: vector("center", [[0.0], [1.0, 2.0]], 3, "m")),
        (r"not orthonormal.*full precision", lambda: rotation_matrix("R", ROUNDED)),
    ],
)
def test_messages_name_value_unit_and_requirement(message, check):
    with pytest.raises(InvalidValueError, match=message):
        check()


def test_a_vector_is_a_read_only_copy():
    mine = np.array([1.0, 2.0, 3.0])
    checked_vector = vector("v", mine, 3, "m")
    mine[0] = 9.0
    assert checked_vector.tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(ValueError, match="read-only"):
        checked_vector[0] = 0.0
    assert vector("v", [1, 2, 3], 3, "m").dtype == np.float64


@checked
@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(c * c for c in q) > 0.1))
def test_every_rotation_passes_and_every_reflection_of_it_does_not(quaternion):
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    R = np.eye(3) + 2 * w * K + 2 * K @ K
    assert np.array_equal(rotation_matrix("R", R), R)
    assert not rotation_matrix("R", R).flags.writeable
    with pytest.raises(InvalidValueError, match="reflection"):
        rotation_matrix("R", -R)


def test_a_matrix_may_bend_by_the_tolerance():
    assert accepted(rotation_matrix, "R", (1 + 0.4 * ORTHONORMAL_TOLERANCE) * np.eye(3))
    assert not accepted(rotation_matrix, "R", (1 + 0.6 * ORTHONORMAL_TOLERANCE) * np.eye(3))


# --- Classes with the quicker constructor behave as `dataclasses` made them ---


@dataclass(frozen=True, slots=True)
class Plain:
    a: float
    b: tuple[float, ...] = ()
    c: float | None = None


@quick_init
@dataclass(frozen=True, slots=True)
class Quick:
    a: float
    b: tuple[float, ...] = ()
    c: float | None = None


def test_is_what_dataclasses_make_of_it() -> None:
    one = Quick(1.0, c=2.0)
    assert str(inspect.signature(Quick)) == str(inspect.signature(Plain))
    assert repr(one) == repr(Plain(1.0, c=2.0)).replace("Plain", "Quick")
    assert one == Quick(1.0, (), 2.0) == replace(Quick(3.0, c=2.0), a=1.0)
    assert hash(one) == hash(Plain(1.0, c=2.0))
    assert pickle.loads(pickle.dumps(one)) == copy.deepcopy(one) == one
    with pytest.raises(FrozenInstanceError):
        one.a = 3.0  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError):
        del one.a  # type: ignore[misc]
    with pytest.raises(TypeError, match="a"):
        Quick()  # type: ignore[call-arg]


def test_refuses_what_it_cannot_make() -> None:
    class Bare:
        a: float

    @dataclass(frozen=True)
    class WithoutSlots:
        a: float

    @dataclass(frozen=True, slots=True)
    class WithFactory:
        a: list[float] = field(default_factory=list)

    for cls in (Bare, WithoutSlots, WithFactory):
        with pytest.raises(TypeError, match=cls.__name__):
            quick_init(cls)
