"""The reference itself: it satisfies the equations to 100 digits, and errors of a few roundings are seen."""

import numpy as np
import pytest
from mpmath import mp, mpf

from reference import cases, quadric
from reference.compare import sample


@pytest.mark.parametrize("name", cases.ALL)
def test_reference_satisfies_the_equations(name):
    """Surface, moment balance, torque along the normal, pushing: for the soft solution of every category."""
    for case in sample(name, cases.ALL[name], 20):
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
        assert max(left.surface, left.balance, left.parallel) < limit


def test_verifier_sees_what_is_wrong():
    """A point off the surface, an unbalanced moment, a tilted torque and a pull are all noticed."""
    axes, wrench = (1.0, 2.0, 1.5), (0.3, -0.2, -1.0, 0.4, 0.1, 0.2)
    found = quadric.solve(axes, wrench)
    c, q = np.array([float(x) for x in found.centroid]), np.array([float(x) for x in quadric.torque(found)])
    good = quadric.verify(axes, wrench, c, q)
    assert good.pushing
    assert max(good.surface, good.balance, good.parallel) < 1e-15
    assert quadric.verify(axes, wrench, c * (1 + 1e-14), q).surface > 1e-14
    assert quadric.verify(axes, wrench, c, q * (1 + 1e-13)).balance > 1e-15
    assert quadric.verify(axes, wrench, c, q + np.array([1e-13, 0, 0])).parallel > 1e-15
    assert not quadric.verify(axes, wrench, -c, q).pushing


def test_hard_reference_is_the_point_where_the_axis_enters():
    """On the surface, on the wrench axis, pushing."""
    axes, wrench = (1.0, 2.0, 1.5), (0.3, -0.2, -1.0, 0.4, 0.1, 0.2)
    c = quadric.solve(axes, wrench, model="hard").centroid
    with mp.workprec(300):
        f, m = [mpf(x) for x in wrench[:3]], [mpf(x) for x in wrench[3:]]
        pitch = quadric.dot(f, m) / quadric.dot(f, f)
        left = [m[i] - quadric.cross(c, f)[i] - pitch * f[i] for i in range(3)]
        assert quadric.norm(left) < mpf(10) ** -80
        assert abs(sum((c[i] / axes[i]) ** 2 for i in range(3)) - 1) < mpf(10) ** -80
        assert sum(c[i] * f[i] / axes[i] ** 2 for i in range(3)) < 0


def test_signs_are_exact():
    """f.m = 2^-104 among products of order 1 is not taken for zero, nor for its opposite."""
    tiny = 2.0**-52
    f = (1.0, 1.0 + tiny, 0.0)
    plus, minus = (1.0 + tiny, -1.0, 0.0), (1.0 - tiny, -1.0, 0.0)
    assert quadric.solve((0.1,) * 3, (*f, *plus)).status == quadric.NO_CONTACT  # exactly zero
    found = quadric.solve((0.1,) * 3, (1.0 + tiny, 1.0, 0.0, *minus))  # -2^-104
    assert found.status == quadric.OK
    assert found.spin_torque > 0
