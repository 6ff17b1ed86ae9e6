"""The soft finger frame: what the paper says of it, and what happens where friction has no direction."""

import math

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st

from palpate import Ellipsoid, Sphere, contact_from_wrench
from palpate.errors import InvalidValueError
from palpate.sensing.contact_frame import contact_frame

TIP = Ellipsoid((0.008, 0.01, 0.012), center=(0.001, -0.002, 0.03))


def contact_at(n, normal_force, tangential, spin, radius=0.01):
    n = np.asarray(n, float)
    f = -normal_force * n + tangential - (tangential @ n) * n
    return contact_from_wrench(Sphere(radius), np.concatenate((f, spin * n + np.cross(radius * n, f))))


def axes(frame):
    return np.array(frame.rotation_sensor_contact)


component = st.floats(-1, 1, allow_subnormal=False)
wrenches = st.tuples(*[component] * 6).map(
    lambda w: (w[0], w[1], w[2] - 2.0, 0.01 * w[3], 0.01 * w[4], 0.002 * w[5])
)


def given(*strategies):
    def decorate(test):
        return hypothesis.settings(max_examples=150, deadline=None, derandomize=True)(
            hypothesis.given(*strategies)(test)
        )

    return decorate


@given(wrenches)
def test_the_frame_is_the_papers(wrench):
    """Section 2: origin at the centroid, z along the inward normal, y across the force; p = (p_x, 0, p_z)."""
    contact = contact_from_wrench(TIP, wrench)
    hypothesis.assume(contact.status == 0)
    friction = np.linalg.norm(contact.tangential_force)
    hypothesis.assume(friction > 1e-3)
    frame = contact_frame(contact, 1e-4)
    R = axes(frame)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(frame.origin, contact.centroid)
    np.testing.assert_allclose(R[:, 2], -contact.normal, atol=1e-14)
    force = R.T @ contact.force
    np.testing.assert_allclose(force, [frame.friction_force, 0, frame.normal_force], atol=1e-12)
    assert frame.is_along_friction
    assert frame.friction_force == pytest.approx(friction)
    assert frame.normal_force == contact.normal_force > 0
    # the moment about the centroid is along z alone, with the sign of the inward normal
    f, m = np.array(wrench[:3]), np.array(wrench[3:])
    torque = R.T @ (m - np.cross(contact.centroid, f))
    np.testing.assert_allclose(torque, [0, 0, frame.spin_torque], atol=1e-13)
    assert frame.spin_torque == -contact.spin_torque


@given(st.floats(0, 3), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_the_frame_is_always_a_rotation_and_keeps_its_direction_below_the_noise(size, angle, before):
    n = np.array([0.0, 0.6, 0.8])
    first, second = np.array([1.0, 0.0, 0.0]), np.cross(n, [1.0, 0.0, 0.0])
    x_before = tuple(math.cos(before) * first + math.sin(before) * second)
    friction = size * 0.01 * (math.cos(angle) * first + math.sin(angle) * second)
    frame = contact_frame(contact_at(n, 2.0, friction, 0.0), 0.01, x_before)
    R = axes(frame)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(R[:, 2], -n, atol=1e-12)
    assert frame.is_along_friction == (size >= 2) or abs(size - 2) < 1e-9
    if size <= 1 - 1e-9:
        np.testing.assert_allclose(frame.x, x_before, atol=1e-10)
    if size >= 2:
        assert frame.friction_force == pytest.approx(0.01 * size)


@pytest.mark.slow
def test_the_frame_is_continuous_as_friction_grows_out_of_the_noise_and_turns_in_it():
    """A slow path out of the noise and back, while friction turns: x never jumps."""
    n = np.array([0.0, 0.0, 1.0])
    x, largest = (1.0, 0.0, 0.0), 0.0
    for i in range(4001):
        t = i / 1000
        size, angle = 0.015 * (1 - math.cos(math.pi * t)), 2.0 + 0.5 * t
        friction = size * np.array([math.cos(angle), math.sin(angle), 0.0])
        frame = contact_frame(contact_at(n, 2.0, friction, 0.0), 0.01, x)
        largest = max(largest, math.acos(min(1.0, np.dot(frame.x, x))))
        x = frame.x
    assert largest < 0.1
    # and as a function of friction alone, across both edges of the band
    for size in (0.01, 0.02):
        for angle in np.linspace(-3, 3, 13):
            direction = np.array([math.cos(angle), math.sin(angle), 0.0])
            near, far = (
                contact_frame(contact_at(n, 2.0, size * (1 + e) * direction, 0.0), 0.01, (1.0, 0.0, 0.0)).x
                for e in (-1e-6, 1e-6)
            )
            np.testing.assert_allclose(near, far, atol=1e-4)


@pytest.mark.slow
def test_without_a_former_frame_x_follows_the_normal_continuously_over_the_whole_front_of_the_finger():
    nothing = np.zeros(3)
    for polar in np.linspace(0, 3.0, 31):
        for azimuth in np.linspace(-math.pi, math.pi, 17):
            for d_polar, d_azimuth in ((1e-6, 0), (0, 1e-6)):
                x = []
                for k in (0, 1):
                    a, b = polar + k * d_polar, azimuth + k * d_azimuth
                    n = (math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a))
                    x.append(contact_frame(contact_at(n, 1.0, nothing, 0.0), 0.1).x)
                np.testing.assert_allclose(*x, atol=1e-4)
    assert contact_frame(contact_at((0, 0, 1), 1.0, nothing, 0.0), 0.1).x == pytest.approx((1, 0, 0))
    behind = contact_frame(contact_at((0, 0, -1), 1.0, nothing, 0.0), 0.1)
    np.testing.assert_allclose(axes(behind).T @ axes(behind), np.eye(3), atol=1e-14)


def test_a_former_x_along_the_normal_is_replaced():
    frame = contact_frame(contact_at((0, 0, 1), 1.0, np.zeros(3), 0.0), 0.1, (0.0, 0.0, 1.0))
    np.testing.assert_allclose(axes(frame).T @ axes(frame), np.eye(3), atol=1e-14)


def test_no_contact_has_no_frame():
    with pytest.raises(InvalidValueError, match="NO_FORCE"):
        contact_frame(contact_from_wrench(TIP, np.zeros(6)), 0.1)
    with pytest.raises(InvalidValueError, match="friction_noise"):
        contact_frame(contact_at((0, 0, 1), 1.0, np.zeros(3), 0.0), 0.0)
