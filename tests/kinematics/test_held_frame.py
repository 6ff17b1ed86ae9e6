"""Where an object is, from the fingertips that hold it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.kinematics.held_frame import HeldFrame
from palpate.kinematics.pose import Pose, rotation_from_rotvec

lengths = st.floats(-0.05, 0.05)
vectors = st.tuples(lengths, lengths, lengths)
turns = st.tuples(*[st.floats(-0.5, 0.5)] * 3)
CORNERS = [(0.03, 0.0, 0.0), (-0.02, 0.03, 0.0), (-0.01, -0.02, 0.01), (0.0, 0.0, -0.03)]


def moved(pose, points):
    return [(pose @ Pose(point)).position for point in points]


@settings(max_examples=100)
@given(vectors, turns, vectors, turns, st.integers(3, 4))
def test_it_moves_rigidly_with_three_fingertips_or_more(position, rotvec, at, turned, count):
    motion, object_pose = Pose(position, rotation_from_rotvec(rotvec)), Pose(at, rotation_from_rotvec(turned))
    found = HeldFrame(CORNERS[:count], object_pose).pose(moved(motion, CORNERS[:count]))
    wanted = motion @ object_pose
    assert found.position == pytest.approx(wanted.position, abs=1e-12)
    assert np.array(found.rotation) == pytest.approx(np.array(wanted.rotation), abs=1e-11)


@settings(max_examples=100)
@given(vectors, turns)
def test_two_fingertips_turn_it_no_more_than_their_line(position, rotvec):
    """And bring every point of that line to where it is."""
    ends = [(0.03, 0.0, 0.0), (-0.03, 0.0, 0.0)]
    motion = Pose(position, rotation_from_rotvec(rotvec))
    found = HeldFrame(ends, Pose()).pose(moved(motion, ends))
    for share in (-0.03, 0.01, 0.03):
        point = Pose((share, 0.0, 0.0))
        assert (found @ point).position == pytest.approx((motion @ point).position, abs=1e-12)
    R = np.array(found.rotation)
    about = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    assert about @ (R[:, 0] + [1.0, 0.0, 0.0]) == pytest.approx(0.0, abs=1e-12)
