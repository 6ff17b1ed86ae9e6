"""The reference itself: it satisfies the equations to 100 digits, agrees with what is stored, and sees errors."""

import numpy as np
import pytest
from mpmath import mp

from reference import answers, cases, quadric
from reference.compare import Answer

AXES, WRENCH = (1.0, 2.0, 1.5), (0.3, -0.2, -1.0, 0.4, 0.1, 0.2)


@pytest.mark.slow
@pytest.mark.parametrize("name", cases.ALL)
def test_the_stored_answers_are_those_of_the_reference_and_satisfy_the_equations(name):
    """Surface, moment balance, torque along the normal, pushing: a few of every category, solved again."""
    for case, stored in zip(cases.sample(name, 3), answers.stored()[name], strict=False):
        solved = case.wanted()
        rounded = Answer.rounded(solved)
        assert rounded.status == stored.status
        np.testing.assert_array_equal(rounded.numbers, stored.numbers)
        np.testing.assert_array_equal(rounded.rest, stored.rest)
        more = {"center": case.center, "rotation": case.rotation}
        found = quadric.solve(case.semi_axes, case.wrench, **more)
        if found.status != quadric.OK:
            continue
        left = quadric.verify(case.semi_axes, case.wrench, found.centroid, quadric.torque(found), **more)
        assert found.normal_force > 0
        size = max(abs(x) for x in case.wrench[:3])
        assert left.pushing or found.normal_force < 1e-100 * size  # 180 digits do not see a spin of 1e-300
        moved = case.rotation != quadric.IDENTITY  # a rounded matrix is not exactly orthonormal
        limit = 3e-15 if moved and name != "quarter_turn" else 1e-100
        assert max(left.surface, left.balance, left.parallel) < limit or name in cases.FUZZED


def test_verifier_detects_errors():
    """A point off the surface, an unbalanced moment, a tilted torque and a pull are all noticed."""
    found = quadric.solve(AXES, WRENCH)
    c, q = found.centroid.astype(float), quadric.torque(found).astype(float)
    good = quadric.verify(AXES, WRENCH, c, q)
    assert good.pushing
    assert max(good.surface, good.balance, good.parallel) < 1e-15
    assert quadric.verify(AXES, WRENCH, c * (1 + 1e-14), q).surface > 1e-14
    assert quadric.verify(AXES, WRENCH, c, q * (1 + 1e-13)).balance > 1e-15
    assert quadric.verify(AXES, WRENCH, c, q + np.array([1e-13, 0, 0])).parallel > 1e-15
    assert not quadric.verify(AXES, WRENCH, -c, q).pushing


def test_hard_reference_is_the_point_where_the_axis_enters():
    """On the surface, on the wrench axis, pushing."""
    c = quadric.solve(AXES, WRENCH, model="hard").centroid
    with mp.workprec(300):
        f, m, a = quadric.digits(WRENCH[:3]), quadric.digits(WRENCH[3:]), quadric.digits(AXES)
        assert quadric.norm(m - np.cross(c, f) - (f @ m) / (f @ f) * f) < mp.mpf(10) ** -80
        assert abs((c / a) @ (c / a) - 1) < mp.mpf(10) ** -80
        assert (c / a**2) @ f < 0


def test_signs_are_exact():
    """f.m = 2^-104 among products of order 1 is not taken for zero, nor for its opposite."""
    tiny = 2.0**-52
    zero = quadric.solve((0.1,) * 3, (1.0, 1.0 + tiny, 0.0, 1.0 + tiny, -1.0, 0.0))
    assert zero.status == quadric.NO_CONTACT
    found = quadric.solve((0.1,) * 3, (1.0 + tiny, 1.0, 0.0, 1.0 - tiny, -1.0, 0.0))  # -2^-104
    assert found.status == quadric.OK
    assert found.spin_torque > 0
