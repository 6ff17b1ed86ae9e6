"""States of a UR that lack bytes: ur_rtde 1.6.5 takes them unseen; what it reads of them must not be believed."""

import math
import struct

from hypothesis import given
from hypothesis import strategies as st

from palpate.hw.ur import library
from palpate.hw.ur.state_receiver import _possible, _Read

JOINTS = (0.1, -1.57, 1.8, -1.8, -1.57, 0.3)
MOVING = (0.02, -0.01, 0.03, -0.02, 0.01, 0.004)
POSE = (-0.13, 0.49, 0.21, 2.2, -2.2, 0.01)
LAYOUT = struct.Struct(">d" + "6d" * 5 + "3d" + "iiiII" + "dd" + "6d" + "d")
"""As `library.RECEIVED` orders them, with a raw wrench, and what nobody reads at the end."""


def package(joints=JOINTS, velocity=MOVING):
    """What the controller sends of an arm that moves and presses."""
    force = (1.2, -0.4, 5.1, 0.02, 0.3, -0.01)
    rest = (0.1, 0.2, 9.8, 2, 7, 1, 1, 3, 1.0, 0.8, *force, 0.0005)
    return LAYOUT.pack(12.346, *joints, *velocity, *POSE, *MOVING, *force, *rest)


def read(payload, before):
    """What the library makes of it: for what is missing, it takes bytes of the package before."""
    values = LAYOUT.unpack(payload + before[len(payload) :])
    q, qd, pose, speed, force = (tuple(values[1 + 6 * i : 7 + 6 * i]) for i in range(5))
    runtime, mode, safety, bits, _ = values[34:39]
    return _Read(
        (runtime, mode, safety, bits), values[39:41], q, qd, pose, speed, force, values[41:47], values[31:34]
    )


def test_the_layout_of_these_tests_is_that_of_what_is_asked_for():
    vectors = [name for name in library.RECEIVED if name.startswith("actual_")]
    assert vectors == [
        "actual_q",
        "actual_qd",
        "actual_TCP_pose",
        "actual_TCP_speed",
        "actual_TCP_force",
        "actual_tool_accelerometer",
    ]
    assert library.LAST not in library.RECEIVED
    assert len(package()) == LAYOUT.size


@given(st.integers(1, 8))
def test_bytes_that_are_missing_at_the_end_change_nothing_that_is_read(missing):
    now, before = package(), package(velocity=(0.0,) * 6)
    assert read(now[:-missing], before) == read(now, before)


@given(st.lists(st.floats(0.05, 3.0) | st.floats(-3.0, -0.05), min_size=6, max_size=6), st.integers(8, 55))
def test_a_byte_that_is_missing_among_the_joints_is_noticed(joints, lost):
    """Whatever the joints are: what follows is read a byte off, in which exponents are digits and modes others."""
    whole = package(joints)
    assert _possible(read(whole, whole))
    assert not _possible(read(whole[:lost] + whole[lost + 1 :], whole))


def test_numbers_that_no_controller_sends_are_no_state():
    whole = read(package(), package())
    assert _possible(whole)
    for name in ("joint_position", "joint_velocity", "tool_pose", "tool_velocity", "tool_wrench"):
        for value in (math.nan, math.inf, 1e9, -1e9):
            assert not _possible(whole._replace(**{name: (0.0, value, 0.0, 0.0, 0.0, 0.0)}))
    for shares in ((math.nan, 1.0), (1.0, -0.5), (3.0, 1.0)):
        assert not _possible(whole._replace(speeds=shares))
