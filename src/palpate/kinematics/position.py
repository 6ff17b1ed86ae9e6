"""Joint positions at which a serial arm holds its tip in a given pose, by damped least squares from a seed.

Levenberg-Marquardt with the squared error as damping (Sugihara 2011, "Solvability-unconcerned inverse kinematics
by the Levenberg-Marquardt method"), joints at the end of their ranges taken out of a step that leads beyond. So it
finds what lies near the seed. If that is nothing, seeds drawn over the joints' ranges are tried, and of what they
lead to the nearest to the given seed is taken. For setting up, not for a control period.
"""

import math
from collections.abc import Sequence

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.kinematics.arm import JointKind, SerialArm
from palpate.kinematics.forward import ArmKinematics
from palpate.kinematics.pose import Pose, checked_pose, rotvec_from_rotation, times, transposed
from palpate.kinematics.velocity import LENGTH, SIX
from palpate.spatial import norm, subtract

_MAX_STEPS = 100
"""From one seed; 5 to 15 are usual."""

_ACCURACY = 1e-12
"""[m, rad] of the pose that counts as reached."""

_SUFFICES = 3e-12
"""Likewise, where the last steps gain nothing any more: rounding at a singularity."""

_LARGEST_STEP = 0.5
"""[rad] that a joint is moved at once: linear to an eighth."""

_DAMPING, _FLOOR = 0.1, 1e-24
"""Of the squared error, and at least: poses at singularities take 8 steps from 0.01 rad away; with a hundredth of
this it is up to 30. It vanishes with the error, so that convergence is quadratic in the end."""

_OTHER_SEEDS = 24
"""Of 700 poses, each from a seed anywhere, most took none of these, and one took 10 (UR5e), 12 (Panda), or 20
(xArm 6)."""

_TURN = 2.0 * math.pi


def nearest_joint_position(
    kinematics: ArmKinematics, pose_base_tip: Pose, seed: Sequence[float]
) -> tuple[float, ...]:
    """Return joint positions near a seed that hold the tip in a pose [rad or m], each within its range.

    Args:
        kinematics: Of the arm. One of less than six joints holds the tip's position only.
        pose_base_tip: Wanted.
        seed: Joint positions to be near to [rad or m]. Hinges are as few whole turns away from it as can be.

    Raises:
        InvalidValueError: The pose is out of reach; the message says by how much.
    """
    arm = kinematics.arm
    start = np.array(arm.joint_position("seed", tuple(seed)))
    checked_pose("pose_base_tip", pose_base_tip)
    _check_distance(kinematics, pose_base_tip)
    bounds = np.array([(each.lower, each.upper) for each in arm.limits]).T
    found, closest = _held(kinematics, pose_base_tip, start, bounds)
    if found is not None:
        return _wound(arm, found, start)
    rng, (lower, upper) = np.random.default_rng(0), np.clip(bounds, -math.pi, math.pi)
    others: list[tuple[float, ...]] = []
    for other in rng.uniform(lower, upper, (_OTHER_SEEDS, len(start))):
        found, error = _held(kinematics, pose_base_tip, np.clip(other, *bounds), bounds)
        closest = min(closest, error)
        if found is not None:
            others.append(_wound(arm, found, start))
    if not others:
        raise InvalidValueError(
            f"{_unreachable(arm, pose_base_tip)} with its joints within their ranges: the nearest that was found "
            f"is {closest:.2g} off (m or rad); move arm or object, or turn the tip"
        )
    return min(others, key=lambda joints: math.dist(joints, start))


def _held(
    kinematics: ArmKinematics, wanted: Pose, seed: FloatArray, bounds: FloatArray
) -> tuple[FloatArray | None, float]:
    """Joint positions that hold the pose, if any are found from a seed, and how far off [m, rad] it ended."""
    q = seed.copy()
    size = 6 if len(q) >= SIX else 3
    weight = np.array([1.0 / LENGTH] * 3 + [1.0] * 3)[:size]
    largest = best = math.inf
    stalled = 0
    for _ in range(_MAX_STEPS):
        error = _error(kinematics, wanted, q)[:size]
        largest = float(np.abs(error).max())
        if largest <= _ACCURACY:
            return q, largest
        stalled = 0 if largest < 0.9 * best else stalled + 1
        best = min(best, largest)
        if stalled > _MAX_STEPS // 4:
            break
        J = weight[:, None] * kinematics.jacobian(q.tolist())[:size]
        q = _stepped(q, J, weight * error, bounds)
    return (q if largest <= _SUFFICES else None), best


def _stepped(q: FloatArray, J: FloatArray, error: FloatArray, bounds: FloatArray) -> FloatArray:
    """One step; joints that would leave their ranges stay at their ends, and the others do without them."""
    free = np.ones(len(q), dtype=bool)
    damping = _DAMPING * float(error @ error) + _FLOOR
    moved = q
    for _ in range(len(q)):
        A = J[:, free]
        step = np.zeros(len(q))
        U, sigma, Vt = np.linalg.svd(A, full_matrices=False)
        step[free] = Vt.T @ (sigma / (sigma * sigma + damping) * (U.T @ error))
        step *= min(1.0, _LARGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        moved = np.clip(q + step, *bounds)
        beyond = free & (moved != q + step)
        if not beyond.any():
            break
        free &= ~beyond
    result: FloatArray = moved
    return result


def _error(kinematics: ArmKinematics, wanted: Pose, q: FloatArray) -> FloatArray:
    actual = kinematics.pose(q.tolist())
    turn = rotvec_from_rotation(times(wanted.rotation, transposed(actual.rotation)))
    return np.array(subtract(wanted.position, actual.position) + turn)


def _wound(arm: SerialArm, joints: FloatArray, seed: FloatArray) -> tuple[float, ...]:
    """The same, hinges by whole turns as near to the seed as their ranges let them."""
    result: list[float] = []
    for position, near, joint in zip(joints.tolist(), seed.tolist(), arm.joints, strict=True):
        lower, upper = joint.limits.lower, joint.limits.upper
        turned = position + _TURN * round((near - position) / _TURN)
        result.append(turned if joint.kind is JointKind.HINGE and lower <= turned <= upper else position)
    return tuple(result)


def _check_distance(kinematics: ArmKinematics, wanted: Pose) -> None:
    """Refuse a pose that is farther from the first joint than all links together are long."""
    joints = kinematics.arm.joints
    behind = [joint.pose_before_joint for joint in joints[1:]]
    reach = sum(norm(pose.position) for pose in behind)
    reach += norm((kinematics.arm.pose_joint_flange @ kinematics.pose_flange_tip).position)
    for joint in joints:
        if joint.kind is JointKind.SLIDE:
            reach += max(abs(joint.limits.lower), abs(joint.limits.upper))
    first = (kinematics.pose_base_robot @ joints[0].pose_before_joint).position
    distance = norm(subtract(wanted.position, first))
    if distance > reach:
        raise InvalidValueError(
            f"{_unreachable(kinematics.arm, wanted)}: it is {distance:.4f} m from its first joint, and its links "
            f"stretched out reach {reach:.4f} m; move arm or object"
        )


def _unreachable(arm: SerialArm, wanted: Pose) -> str:
    x, y, z = wanted.position
    return f"{arm.name} cannot hold its tip at ({x:.4f}, {y:.4f}, {z:.4f}) m in this orientation"
