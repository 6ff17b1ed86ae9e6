"""The wrench on a held object: balance, frames, and covariances against random errors."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.kinematics.pose import Pose
from palpate.sensing.held import (
    ExternalWrenches,
    FingersFelt,
    HeldBody,
    ObjectMotion,
    external_wrench,
    external_wrenches,
)
from palpate.sensing.held.wrench_frame import into_matrix, wrench_from, wrench_into

BLOCK = HeldBody(
    mass=0.4,
    center_of_mass=(0.01, -0.02, 0.03),
    inertia=((3e-4, 1e-5, 0.0), (1e-5, 4e-4, 2e-5), (0.0, 2e-5, 5e-4)),
    mass_sd=0.01,
    center_of_mass_sd=1e-3,
)
SCALE = np.array([1.0, 1.0, 1.0, 0.01, 0.01, 0.01])
SPREAD = np.diag([1e-2] * 3 + [1e-4] * 3)


def pose(rotation, position):
    return Pose(tuple(position.tolist()), tuple(map(tuple, rotation.tolist())))


def felt(rng, n=5, k=2):
    return FingersFelt(
        wrench=rng.normal(size=(n, k, 6)) * [3, 3, 3, 0.05, 0.05, 0.05],
        rotation=Rotation.random(k, rng=rng).as_matrix(),
        position=0.05 * rng.normal(size=(k, 3)),
        noise=np.array([SPREAD @ SPREAD] * k),
        zero=np.array([4 * SPREAD @ SPREAD] * k),
        pose=np.array([np.diag([1e-8] * 3 + [1e-4] * 3)] * k),
        matrix=np.array([5e-3 * np.outer(SCALE, 1.0 / SCALE)] * k),
    )


def moved(rng, n=5):
    return ObjectMotion(*(scale * rng.normal(size=(n, 3)) for scale in (9.8, 3.0, 20.0)))


def test_fingers_and_environment_together_give_the_object_its_motion():
    """A body that moves along a known path: forces on it are from momenta, differentiated numerically."""
    c, inertia, g = np.array(BLOCK.center_of_mass), np.array(BLOCK.inertia), np.array([0.0, 0.0, -9.81])
    h, t = 1e-4, 0.3

    def turn(t):
        return Rotation.from_rotvec([0.7 * t + 0.3 * t**2, 0.1 * t**2 - 1.1 * t, 0.4 * t - 0.2 * t**2]).as_matrix()

    def place(t):
        return np.array([0.1 * np.sin(3 * t), 0.2 * t**2, 0.1 * np.cos(2 * t)])

    def slope(of, t):
        return (of(t - 2 * h) - 8 * of(t - h) + 8 * of(t + h) - of(t + 2 * h)) / (12 * h)

    def spin(t):
        W = slope(turn, t) @ turn(t).T
        return np.array([W[2, 1], W[0, 2], W[1, 0]])

    R = turn(t)
    force = BLOCK.mass * (slope(lambda t: slope(lambda t: place(t) + turn(t) @ c, t), t) - g)
    moment = slope(lambda t: turn(t) @ inertia @ turn(t).T @ spin(t), t)
    total = np.concatenate((R.T @ force, R.T @ moment + np.cross(c, R.T @ force)))  # about the frame's origin
    grip, finger = (0.5, -2.0, 1.0, 0.01, 0.02, -0.03), Pose((0.02, 0.0, 0.01))  # of the object on the only finger
    acceleration = slope(lambda t: slope(place, t), t) - g
    motion = (tuple((R.T @ each).tolist()) for each in (acceleration, spin(t), slope(spin, t)))
    found = external_wrench([grip], [finger], BLOCK, *motion)
    np.testing.assert_allclose(np.array(found) - wrench_from(finger, grip), total, atol=1e-5)


def test_one_at_a_time_is_all_at_once():
    rng = np.random.default_rng(0)
    fingers, motion = felt(rng), moved(rng)
    batch = external_wrenches(fingers, BLOCK, motion)
    poses = [pose(R, p) for R, p in zip(fingers.rotation, fingers.position, strict=True)]
    for i in range(len(batch)):
        parts = (motion.specific_force, motion.angular_velocity, motion.angular_acceleration)
        grips = [tuple(w) for w in fingers.wrench[i].tolist()]
        one = external_wrench(grips, poses, BLOCK, *(tuple(each[i].tolist()) for each in parts))
        np.testing.assert_allclose(one, batch.wrench[i], rtol=1e-12, atol=1e-14)


def test_covariance_is_that_of_random_errors():
    rng = np.random.default_rng(1)
    fingers, motion = felt(rng), moved(rng)
    told = external_wrenches(fingers, BLOCK, motion)
    seen = []
    for _ in range(2000):
        by_pose = np.linalg.cholesky(fingers.pose) @ rng.normal(size=(2, 6, 1))
        zero = np.linalg.cholesky(fingers.zero) @ rng.normal(size=(2, 6, 1))
        matrix = np.einsum("kab,nkb->nka", fingers.matrix * rng.normal(size=(2, 6, 6)), fingers.wrench)
        noise = np.linalg.cholesky(fingers.noise) @ rng.normal(size=(5, 2, 6, 1))
        wrong = replace(
            fingers,
            wrench=fingers.wrench + matrix + zero[..., 0] + noise[..., 0],
            rotation=Rotation.from_rotvec(by_pose[:, 3:, 0]).as_matrix() @ fingers.rotation,
            position=fingers.position + by_pose[:, :3, 0],
        )
        center = tuple(np.array(BLOCK.center_of_mass) + BLOCK.center_of_mass_sd * rng.normal(size=3))
        held = replace(BLOCK, mass=BLOCK.mass + BLOCK.mass_sd * rng.normal(), center_of_mass=center)
        seen.append(external_wrenches(wrong, held, motion).wrench - told.wrench)
    together = np.cov(np.array(seen).reshape(2000, -1), rowvar=False)
    common = told.common.reshape(30, -1)
    expected = common @ common.T
    for i in range(5):
        expected[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] += told.noise[i]
    sd = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(np.sqrt(np.diag(together)) / sd, 1.0, atol=0.07)
    np.testing.assert_allclose((together - expected) / np.outer(sd, sd), 0.0, atol=0.11)
    np.testing.assert_allclose(told.covariance[2], expected[12:18, 12:18], rtol=1e-9)


def test_seen_from_a_frame_that_is_not_quite_known():
    rng = np.random.default_rng(2)
    wrenches = ExternalWrenches.measured(rng.normal(size=(3, 6)), 1e-8 * np.eye(6), 1e-8 * np.eye(6))
    R, p, S = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3) * 0.1, np.diag([1e-6] * 3 + [1e-4] * 3)
    told = wrenches.seen_from(pose(R, p), S)
    seen = []
    for _ in range(2000):
        off = np.sqrt(np.diag(S)) * rng.normal(size=6)
        X = into_matrix(pose(Rotation.from_rotvec(off[3:]).as_matrix() @ R, p + off[:3]))
        seen.append((wrenches.wrench + 1e-4 * (rng.normal(size=(3, 6)) + rng.normal(size=6))) @ X.T)
    for i in range(3):
        sd = np.sqrt(np.diag(told.covariance[i]))
        cov = np.cov(np.array(seen)[:, i], rowvar=False)
        np.testing.assert_allclose((cov - told.covariance[i]) / np.outer(sd, sd), 0.0, atol=0.11)


def test_what_is_the_same_in_the_air_cancels():
    rng = np.random.default_rng(5)
    still = felt(rng, n=400)
    grip = rng.normal(size=(1, 2, 6)) * [3, 3, 3, 0.05, 0.05, 0.05]
    still = replace(still, wrench=np.broadcast_to(grip, (400, 2, 6)))
    rest = ObjectMotion.at_rest((0.0, 0.0, 9.81))
    air = external_wrenches(still, BLOCK, rest)
    less = air.less(air)
    np.testing.assert_allclose(less.wrench, 0.0, atol=1e-12)
    np.testing.assert_allclose(less.common @ less.common.transpose(0, 2, 1), less.noise / 400, atol=1e-15)
    mean = air.mean()
    np.testing.assert_allclose(mean.covariance[0], air.noise[0] / 400 + air.common[0] @ air.common[0].T, rtol=1e-9)


def test_there_and_back_is_nothing():
    rng = np.random.default_rng(3)
    frame = pose(Rotation.random(rng=rng).as_matrix(), rng.normal(size=3))
    wrench = tuple(rng.normal(size=6).tolist())
    np.testing.assert_allclose(wrench_into(frame, wrench_from(frame, wrench)), wrench, atol=1e-14)
    np.testing.assert_allclose(into_matrix(frame) @ wrench, wrench_into(frame, wrench), atol=1e-14)
    force, moment = np.array(wrench[:3]), np.array(wrench[3:])
    inside = wrench_into(frame, wrench)
    assert np.dot(inside[:3], inside[3:]) == pytest.approx(force @ moment)  # the pitch stays
