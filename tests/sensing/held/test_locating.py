"""Where a pin is held, found by touching a ball with it."""

from dataclasses import replace

import numpy as np
import pytest
from grip.held_pin import PIN, RADIUS
from scipy.spatial.transform import Rotation

from palpate.estimation import Assumption
from palpate.kinematics.pose import Pose
from palpate.sensing.held import HeldTool, locate_tool
from palpate.sensing.held.wrench_frame import wrench_from
from palpate.sensing.tip_calibration import Instrument, TargetKind, Touches, TouchTarget

STIFFNESS, ARM, FORCE = 2e4, 2e-5, 2.0
BALL = TouchTarget("ball", TargetKind.POINT, (0.4, 0.1, 0.2), radius=0.005, place_sd=2e-4)
BELIEVED = HeldTool(PIN, Pose((0.0, 0.0, 0.06)), np.diag([5e-4**2] * 3 + [0.015**2] * 3))
SD = np.array([1e-3] * 3 + [1e-5] * 3)


def rows(matrix):
    return tuple(map(tuple, matrix.tolist()))


def touched(rng, true, n, ends):
    """Touches of the ball from all around, by the pin's round end and by its side, or by its side alone."""
    made = []
    for i in range(n):
        around = rng.uniform(0.0, 2 * np.pi)
        up = rng.uniform(0.1, 1.0) if ends and i % 2 else 0.0
        u = np.array([np.cos(around) * np.sqrt(1 - up * up), np.sin(around) * np.sqrt(1 - up * up), up])
        x = RADIUS * u + [0.0, 0.0, 0.0 if up else rng.uniform(-0.07, -0.01)]
        deep = FORCE / STIFFNESS
        f = -FORCE * u
        wrench = wrench_from(true.pose, tuple(np.concatenate((f, np.cross(x - deep * u, f))).tolist()))
        R, T = Rotation.random(rng=rng).as_matrix(), np.array(true.pose.rotation)
        ball = np.array(true.pose.position) + T @ (x + (BALL.radius - deep) * u)
        position = np.array(BALL.place) - R @ ball + ARM * rng.normal(size=3)
        made.append((np.array(wrench) + SD * rng.normal(size=6), R, position))
    wrench, R, position = map(np.array, zip(*made, strict=True))
    return Touches(np.zeros(n, int), wrench, np.tile(SD, (n, 1)), R, position, np.arange(float(n)))


def held_elsewhere(rng):
    e = np.sqrt(np.diag(BELIEVED.pose_covariance)) * rng.normal(size=6)
    turn = Rotation.from_rotvec(e[3:]).as_matrix() @ np.array(BELIEVED.pose.rotation)
    shift = np.array(BELIEVED.pose.position) + e[:3]
    return replace(BELIEVED, pose=Pose(tuple(shift.tolist()), rows(turn)))


def located(seed, n, ends=True):
    rng = np.random.default_rng(seed)
    true = held_elsewhere(rng)
    found = locate_tool(BELIEVED, touched(rng, true, n, ends), [BALL], Instrument(position_sd=ARM), STIFFNESS)
    return true, found


@pytest.mark.slow
def test_it_is_found_within_its_covariance():
    squares = []
    for seed in range(12):
        true, found = located(seed, n=20)
        # the wall of a capsule is rounded by some micrometres there: of 80 mm, that is sometimes noticed
        assert all(each.assumption is Assumption.CONSISTENT for each in found.verdict.broken), found.verdict
        off = np.zeros(6)
        off[:3] = np.array(true.pose.position) - found.tool.pose.position
        turn = np.array(true.pose.rotation) @ np.array(found.tool.pose.rotation).T
        off[3:] = Rotation.from_matrix(turn).as_rotvec()
        told = np.sqrt(np.diag(found.tool.pose_covariance))
        assert (told[:3] < 2e-5).all()
        assert (np.delete(told[3:], 2) < 1e-3).all()
        squares.append(off @ np.linalg.solve(found.tool.pose_covariance, off))
    assert 3.0 < np.mean(squares) < 12.0  # 6 expected; seldom more than 20
    assert max(squares) < 25.0


def test_its_side_alone_does_not_tell_where_it_is_along_its_axis():
    _, found = located(0, n=8, ends=False)
    assert found.verdict.breaks(Assumption.CONDITIONED)
    assert "center_z_m" in str(found.verdict)
    told = np.sqrt(np.diag(found.tool.pose_covariance))
    assert told[2] > 3e-4  # as it was believed
    assert (told[:2] < 5e-5).all()
