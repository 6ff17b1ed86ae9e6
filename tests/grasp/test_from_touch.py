"""A grasp made of contacts bears what the contacts feel: frames, signs, and fingers that come and go."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.friction import LimitSurface
from palpate.grasp.problem.from_touch import (
    contact_place,
    force_on_object,
    grasp_from_touch,
    other_side,
    wrench_on_finger,
)
from palpate.kinematics import Pose
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.sensing.contact import ContactStatus
from palpate.sensing.solver import contact_from_wrench
from palpate.surfaces import Ellipsoid, Sphere
from support.refusals import check_refusals

TIP = Ellipsoid((0.008, 0.009, 0.012))
RUBBER = LimitSurface(0.8, 0.005)

part = st.floats(-1.0, 1.0)
vectors = st.tuples(part, part, part)


def felt(force=(0.3, 0.1, -2.0), spin=0.002):
    """A contact of the tip, from a wrench with some spin."""
    wrench = np.array([*force, 0.004, 0.008, spin])
    return contact_from_wrench(TIP, wrench), wrench


@settings(max_examples=60, deadline=None)
@given(force=vectors, spin=part, position=vectors, rotvec=vectors)
def test_the_object_feels_the_opposite_of_what_the_finger_feels(force, spin, position, rotvec):
    """Newton's third law: G w about the object's origin is minus the sensor's wrench, carried to that frame."""
    contact, wrench = felt((force[0], force[1], -2.0 + force[2]), 0.005 * spin)
    if contact.status is not ContactStatus.OK:
        return
    pose = Pose(position, rotation_from_rotvec(rotvec))
    touched = grasp_from_touch([contact], [pose], [RUBBER])
    assert touched is not None
    on_object = touched.grasp.grasp_map @ force_on_object(contact)
    rotation = np.array(pose.rotation)
    f, m = rotation @ wrench[:3], rotation @ wrench[3:]
    assert on_object[:3] == pytest.approx(-f, abs=1e-12)
    assert on_object[3:] == pytest.approx(-(m + np.cross(position, f)), abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(force=vectors, spin=part)
def test_there_and_back_is_the_sensors_wrench(force, spin):
    contact, wrench = felt((force[0], force[1], -2.0 + force[2]), 0.005 * spin)
    if contact.status is ContactStatus.OK:
        assert wrench_on_finger(force_on_object(contact), contact_place(contact)) == pytest.approx(
            wrench, abs=1e-13
        )


def test_pushing_is_positive_on_both_sides_and_friction_is_not():
    assert other_side((2.0, 0.3, -0.1, 0.004)) == (2.0, -0.3, 0.1, -0.004)
    assert other_side(other_side((2.0, 0.3, -0.1, 0.004))) == (2.0, 0.3, -0.1, 0.004)
    contact, _ = felt()
    assert force_on_object(contact)[0] == contact.normal_force > 0.0


def test_normal_points_into_the_object():
    """A finger at +x of an object pushes towards -x."""
    contact = contact_from_wrench(Sphere(0.01), np.array([0.0, 0.0, -3.0, 0.0, 0.0, 0.0]))
    # the sensor's z axis, out of the fingertip, along the object's -x
    pose = Pose((0.05, 0.0, 0.0), ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
    touched = grasp_from_touch([contact], [pose], [RUBBER])
    assert touched is not None
    assert touched.grasp.frames[0, :, 0] == pytest.approx([-1.0, 0.0, 0.0])
    assert touched.grasp.positions[0] == pytest.approx([0.04, 0.0, 0.0])
    assert touched.grasp.grasp_map @ force_on_object(contact) == pytest.approx([-3.0, 0, 0, 0, 0, 0])


def frame_of(normal):
    """Frame of a contact with a normal of any length."""
    n = normal / np.linalg.norm(normal)
    contact, _ = felt()
    turned = type(contact)(contact.centroid, n, -n, 1.0, np.zeros(3), 0.0, contact.condition, ContactStatus.OK)
    return np.array(contact_place(turned).frame)


@settings(max_examples=100, deadline=None)
@given(angle=st.floats(0.0, 0.95 * math.pi), around=st.floats(-math.pi, math.pi), aside=vectors)
def test_frames_of_neighbouring_normals_are_neighbours(angle, around, aside):
    """No jump up to 9 degrees from -z: the frame turns at most 26 times as much as the normal."""

    n = np.array([math.sin(angle) * math.cos(around), math.sin(angle) * math.sin(around), math.cos(angle)])
    step = 1e-5 * np.array(aside)
    first, second = frame_of(n), frame_of(n + step)
    assert first.T @ first == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(first) == pytest.approx(1.0)
    assert np.abs(second - first).max() <= 27.0 * np.linalg.norm(step) + 1e-15


@settings(max_examples=50, deadline=None)
@given(angle=st.floats(1e-3, 0.95 * math.pi), around=st.floats(-math.pi, math.pi))
def test_the_frame_is_the_sensors_after_the_shortest_turn_of_z_to_n(angle, around):
    axis = (-math.sin(around), math.cos(around), 0.0)
    turn = np.array(rotation_from_rotvec((angle * axis[0], angle * axis[1], 0.0)))
    assert frame_of(turn[:, 2]) == pytest.approx(turn[:, [2, 0, 1]], abs=1e-12)


def test_fingers_come_and_go():
    touching, _ = felt()
    gone = contact_from_wrench(TIP, np.zeros(6))
    poses = [Pose((0.01 * i, 0.0, 0.0)) for i in range(3)]
    surfaces = [LimitSurface(0.4 + 0.1 * i, 0.005) for i in range(3)]
    touched = grasp_from_touch([touching, gone, touching], poses, surfaces, force_max=20.0)
    assert touched is not None
    assert touched.fingers == (0, 2)
    assert touched.grasp.friction.tolist() == [0.4, 0.6000000000000001]
    assert touched.grasp.force_max.tolist() == [20.0, 20.0]
    assert grasp_from_touch([gone], poses[:1], surfaces[:1]) is None


def test_what_cannot_be_used_is_refused():
    gone = contact_from_wrench(TIP, np.zeros(6))
    check_refusals(
        (r"contact.status = NO_FORCE", lambda: contact_place(gone)),
        ("1 contacts, 1 poses, 0 surfaces", lambda: grasp_from_touch([gone], [Pose()], [])),
    )
