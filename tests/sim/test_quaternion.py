"""Quaternions in plain floats against rotation matrices, which were there before."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.kinematics.pose import rotation_from_rotvec, rotvec_from_rotation, times, transposed
from palpate.sim.carriers.turning_stage_drive import UNTURNED, product, turn_between, turn_by

angles = st.floats(-1.8, 1.8)
rotvecs = st.tuples(angles, angles, angles)
tiny = st.floats(-1e-3, 1e-3)


def matrix(q):
    """The turn's matrix, from the definition v -> q v q*."""
    w, x, y, z = q
    columns = [product(product(q, (0.0, *axis)), (w, -x, -y, -z))[1:] for axis in np.eye(3).tolist()]
    return np.array(columns).T


@given(rotvecs, rotvecs)
def test_a_product_is_one_turn_after_the_other(a, b):
    both = times(rotation_from_rotvec(a), rotation_from_rotvec(b))
    assert np.allclose(matrix(product(turn_by(a), turn_by(b))), both, atol=1e-14)


@given(rotvecs | st.tuples(tiny, tiny, tiny))
def test_a_turn_is_that_of_its_rotation_vector(a):
    assert np.allclose(matrix(turn_by(a)), rotation_from_rotvec(a), atol=1e-15, rtol=1e-14)
    assert math.hypot(*turn_by(a)) == pytest.approx(1.0, abs=1e-15)


@given(rotvecs, rotvecs, st.booleans())
def test_the_turn_between_two_takes_the_one_to_the_other_whatever_their_signs(a, b, negative):
    start, end = turn_by(a), turn_by(b)
    if negative:
        start = tuple(-x for x in start)
    between = turn_between(start, end)
    assert math.hypot(*between) <= math.pi * (1 + 1e-15)
    assert np.allclose(matrix(product(turn_by(between), start)), matrix(end), atol=1e-14)
    turned = times(rotation_from_rotvec(b), transposed(rotation_from_rotvec(a)))
    if math.hypot(*between) < 3.0:
        assert np.allclose(between, rotvec_from_rotation(turned), atol=1e-12)


@given(rotvecs)
def test_no_turn_is_between_one_and_itself(a):
    assert math.hypot(*turn_between(turn_by(a), turn_by(a))) < 1e-15
    assert turn_between(UNTURNED, UNTURNED) == (0.0, 0.0, 0.0)
