"""Small vectors obey the axioms of vector algebra, and agree with numpy."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from palpate.spatial import (
    IDENTITY,
    ZERO,
    add,
    add_scaled,
    cross,
    dot,
    limit_norm,
    norm,
    rotate,
    rotate_back,
    scale,
    subtract,
    toward,
    unit,
)

component = st.floats(-1e3, 1e3, allow_subnormal=False)
vectors = st.tuples(component, component, component)
checked = settings(max_examples=150, deadline=None, derandomize=True)


@st.composite
def rotations(draw):
    w, x, y, z = draw(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(c * c for c in q) > 0.1))
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)),
        (s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)),
        (s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)),
    )


def close(a, b, size=1e3):
    return a == pytest.approx(b, rel=1e-12, abs=1e-12 * size)


@checked
@given(vectors, vectors, component)
def test_they_agree_with_numpy(a, b, factor):
    assert add(a, b) == tuple(np.add(a, b))
    assert subtract(a, b) == tuple(np.subtract(a, b))
    assert scale(factor, a) == tuple(factor * np.array(a))
    assert close(add_scaled(a, factor, b), tuple(np.array(a) + factor * np.array(b)), 1e6)
    assert close(dot(a, b), float(np.dot(a, b)), 1e6)
    assert close(cross(a, b), tuple(np.cross(a, b)), 1e6)
    assert close(norm(a), float(np.linalg.norm(a)))


@checked
@given(vectors, vectors, vectors)
def test_the_cross_product_is_perpendicular_and_cyclic(a, b, c):
    assert cross(a, b) == scale(-1.0, cross(b, a))
    assert cross(a, a) == ZERO
    size = max(norm(a) * norm(b) * norm(c), 1e-300)
    assert abs(dot(a, cross(b, c)) - dot(b, cross(c, a))) <= 1e-13 * size
    area = norm(a) * norm(b)
    assert abs(dot(a, cross(a, b))) <= 1e-13 * norm(a) * area
    # Lagrange: |a x b|^2 + (a.b)^2 = |a|^2 |b|^2
    assert math.hypot(norm(cross(a, b)), dot(a, b)) == pytest.approx(area, rel=1e-9, abs=1e-300)


@checked
@given(vectors, vectors, st.floats(0, 2e3))
def test_toward_goes_no_farther_than_allowed_and_straight(a, b, most):
    there = toward(a, b, most)
    distance = norm(subtract(b, a))
    assert norm(subtract(there, a)) == pytest.approx(min(most, distance), abs=1e-9)
    assert norm(subtract(b, there)) == pytest.approx(max(0.0, distance - most), abs=1e-9)
    if distance <= most:
        assert there == b


@checked
@given(rotations(), vectors, vectors)
def test_rotations_keep_lengths_angles_and_orientation(rotation, a, b):
    size = max(1.0, norm(a) * norm(b))
    assert norm(rotate(rotation, a)) == pytest.approx(norm(a), rel=1e-12)
    assert abs(dot(rotate(rotation, a), rotate(rotation, b)) - dot(a, b)) <= 1e-12 * size
    turned = cross(rotate(rotation, a), rotate(rotation, b))
    assert turned == pytest.approx(rotate(rotation, cross(a, b)), abs=1e-11 * size)
    assert rotate(rotation, a) == pytest.approx(tuple(np.array(rotation) @ a), abs=1e-10)


@checked
@given(rotations(), vectors)
def test_rotating_back_undoes_a_rotation(rotation, a):
    assert rotate_back(rotation, rotate(rotation, a)) == pytest.approx(a, abs=1e-9)
    assert rotate(rotation, rotate_back(rotation, a)) == pytest.approx(a, abs=1e-9)
    assert rotate(IDENTITY, a) == a
    assert rotate_back(IDENTITY, a) == a


@checked
@given(vectors, st.integers(-140, 140))
def test_unit_vectors_have_length_one_at_any_scale(a, exponent):
    assume(norm(a) > 1e-3)
    scaled = scale(10.0**exponent, a)
    assert norm(unit(scaled)) == pytest.approx(1.0, rel=1e-14)
    assert unit(scaled) == pytest.approx(unit(a), abs=1e-14)


@checked
@given(vectors, st.floats(1e-3, 1e3))
def test_a_limit_shortens_and_never_turns(a, longest):
    limited = limit_norm(a, longest)
    assert norm(limited) <= longest * (1 + 1e-14)
    if norm(a) <= longest:
        assert limited == a
    else:
        assert norm(limited) == pytest.approx(longest, rel=1e-14)
        assert norm(cross(limited, a)) <= 1e-13 * norm(limited) * norm(a)
        assert dot(limited, a) > 0.0
