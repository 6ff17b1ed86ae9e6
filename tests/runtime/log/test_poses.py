"""Poses between samples: exact for steady motion, untouched where nothing is late."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.runtime.log.poses import poses_at

TIME = 0.002 * np.arange(200)
VELOCITY, SPIN = np.array([0.02, -0.01, 0.005]), np.array([0.3, -0.2, 1.0])


def steady(time):
    return time[:, None] * VELOCITY, Rotation.from_rotvec(time[:, None] * SPIN).as_matrix()


@given(late=st.floats(0.0, 0.03))
def test_steady_motion_is_met_whatever_the_delay(late):
    """18 ms at 22 mm/s are 0.4 mm: all of it must go."""
    wanted = TIME - late
    position, rotation = poses_at(wanted, TIME, *steady(TIME))
    inside = wanted >= 0.0
    np.testing.assert_allclose(position[inside], steady(wanted)[0][inside], atol=1e-12)
    np.testing.assert_allclose(rotation[inside], steady(wanted)[1][inside], atol=1e-9)
    np.testing.assert_allclose(position[~inside], 0.0, atol=1e-15)  # before the first sample it holds


def test_what_is_not_late_keeps_its_bits_also_beside_what_is():
    position, rotation = steady(TIME)
    wanted = TIME.copy()
    wanted[7] -= 0.001
    moved, turned = poses_at(wanted, TIME, position, rotation)
    others = np.arange(200) != 7
    np.testing.assert_array_equal(moved[others], position[others])
    np.testing.assert_array_equal(turned[others], rotation[others])
    assert not np.array_equal(moved[7], position[7])


def test_a_repeated_arm_sample_is_no_obstacle():
    """A device slower than its reader shows the same pose with the same stamp twice."""
    twice = np.repeat(TIME, 2)
    position, _ = poses_at(twice - 0.001, twice, *steady(twice))
    np.testing.assert_allclose(position[2:], steady(twice - 0.001)[0][2:], atol=1e-12)


def test_numbers_that_cannot_be_neither_fail_nor_spread():
    position, rotation = steady(TIME)
    wanted, time = TIME - 0.003, TIME.copy()
    position[50], rotation[60], wanted[70], time[80] = 1e308, 1e200, np.nan, np.inf
    moved, turned = poses_at(wanted, time, position, rotation)
    fine = np.ones(200, dtype=bool)
    fine[[50, 60, 70, 80]] = False
    fine &= wanted > 0.0
    np.testing.assert_allclose(moved[fine], steady(TIME - 0.003)[0][fine], atol=1e-12)
    np.testing.assert_allclose(turned[fine], steady(TIME - 0.003)[1][fine], atol=1e-9)
