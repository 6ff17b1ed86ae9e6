"""Joint angles at which an arm of the UR's build holds its tip in a given pose, in closed form.

Such an arm has three parallel axes (2, 3, 4) and three wrist axes that meet in pairs, so that the joints come one
after the other (Hawkins 2013, "Analytic inverse kinematics for the Universal Robots UR-5/UR-10 arms"): two
shoulders, two wrists, two elbows, eight solutions at most. Each is improved by Newton's method to rounding: close
to a singularity the closed form loses half the digits. For setting up, not for a control period.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import InvalidValueError
from palpate.kinematics.arm import DHRow, SerialArm
from palpate.kinematics.forward import ArmKinematics
from palpate.kinematics.pose import Pose, checked_pose, rotvec_from_rotation, times, transposed
from palpate.spatial import Vector, add_scaled, norm, subtract

_ROUNDING = 1e-9
"""By how much a cosine may exceed 1 where a pose is at the very edge of the reach: Newton takes care of it."""

_STRAIGHT = 1e-7
"""Sine of joint 5 below which joints 4 and 6 turn about one axis, and joint 6 may stay where it is."""

_MAX_STEPS = 20
_ACCURACY = 1e-12
"""[m, rad] of the pose that counts as reached."""

_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class _Wrist:
    """Joint 1, 5 and 6 of a solution, and where they leave the planar arm of joints 2, 3 and 4."""

    first: float
    fifth: float
    sixth: float
    x: float
    y: float
    heading: float


def all_joint_positions(
    kinematics: ArmKinematics, pose_base_tip: Pose, seed: Sequence[float]
) -> tuple[tuple[float, ...], ...]:
    """Return all joint angles that hold the tip in a pose [rad], nearest to `seed` first, up to whole turns.

    Args:
        kinematics: An arm of the UR's build.
        pose_base_tip: Wanted.
        seed: Joint angles to be near to [rad]; each solution's joints are within their ranges, and of the angles
            that are whole turns apart the nearest to these. Also decides what the pose leaves open.

    Raises:
        InvalidValueError: The arm is of another build, or the pose out of its reach; the message says by how much.
    """
    arm = kinematics.arm
    seed = arm.joint_position("seed", tuple(seed))
    checked_pose("pose_base_tip", pose_base_tip)
    d = _offsets(arm)
    upper, fore = arm.rows[1].a, arm.rows[2].a
    flange = kinematics.pose_base_robot.inverse() @ pose_base_tip @ kinematics.pose_flange_tip.inverse()
    found: list[tuple[float, ...]] = []
    distances: list[float] = []
    for wrist in _wrists(flange, d, seed):
        reach = math.hypot(wrist.x, wrist.y)
        distances.append(reach)
        cosine = (reach**2 - upper**2 - fore**2) / (2.0 * upper * fore)
        if abs(cosine) > 1.0 + _ROUNDING:
            continue
        for sign in (1.0, -1.0):
            third = sign * math.acos(max(-1.0, min(1.0, cosine)))
            second = math.atan2(wrist.y, wrist.x) - math.atan2(
                fore * math.sin(third), upper + fore * math.cos(third)
            )
            fourth = wrist.heading - second - third
            raw = (wrist.first, second, third, fourth, wrist.fifth, wrist.sixth)
            joints = _improved(kinematics, pose_base_tip, _within(arm, raw, seed))
            if joints is not None and all(math.dist(joints, other) > 1e-6 for other in found):
                found.append(joints)
    if not found:
        shortest, longest = abs(abs(upper) - abs(fore)), abs(upper) + abs(fore)
        problem = f"{arm.name} cannot hold its tip at {_shown(pose_base_tip.position)} m in this orientation: "
        if any(shortest <= distance <= longest for distance in distances):
            raise InvalidValueError(
                problem + "only with joints beyond their ranges; move arm or object, or turn the tip"
            )
        nearest = min(distances, key=lambda distance: max(shortest - distance, distance - longest))
        raise InvalidValueError(
            problem + f"its wrist would be {nearest:.4f} m from the shoulder, and reaches from {shortest:.4f} to "
            f"{longest:.4f} m; move arm or object, or turn the tip"
        )
    return tuple(sorted(found, key=lambda joints: math.dist(joints, seed)))


def nearest_joint_position(
    kinematics: ArmKinematics, pose_base_tip: Pose, seed: Sequence[float]
) -> tuple[float, ...]:
    """Return the joint angles nearest to `seed` that hold the tip in a pose [rad]: see `all_joint_positions`.

    Raises:
        InvalidValueError: As there.
    """
    return all_joint_positions(kinematics, pose_base_tip, seed)[0]


def _offsets(arm: SerialArm) -> tuple[float, float, float, float]:
    """Offsets d of joints 1, 4, 5 and 6 [m] of an arm of the UR's build; others are refused."""
    if arm.joints == 6:
        one, two, three, four, five, six = arm.rows
        quarter = math.pi / 2.0
        build = (
            DHRow(0.0, one.d, quarter),
            DHRow(two.a, 0.0, 0.0),
            DHRow(three.a, 0.0, 0.0),
            DHRow(0.0, four.d, quarter),
            DHRow(0.0, five.d, -quarter),
            DHRow(0.0, six.d, 0.0),
        )
        if arm.rows == build and two.a * three.a > 0.0:
            return one.d, four.d, five.d, six.d
    raise InvalidValueError(
        f"{arm.name} is not of the UR's build (DH rows with alpha = +90, 0, 0, +90, -90, 0 deg, lengths a in "
        "joints 2 and 3 only, offsets d in joints 1, 4, 5 and 6 only): its start must be given as joint angles"
    )


def _wrists(flange: Pose, d: tuple[float, float, float, float], seed: Sequence[float]) -> list[_Wrist]:
    """Up to four solutions for joints 1, 5 and 6; `flange` is seen from the robot base."""
    d1, d4, d5, d6 = d
    turned = transposed(flange.rotation)  # its rows are the flange's axes
    x6, y6, z6 = turned
    px, py, _ = add_scaled(flange.position, -d6, z6)
    beside = math.hypot(px, py)
    if beside < d4 * (1.0 - _ROUNDING):
        raise InvalidValueError(
            f"the wrist would be {beside:.4f} m from the axis of joint 1, which passes it at {d4:.4f} m or more: "
            "move the pose away from that axis"
        )
    side = math.acos(min(1.0, d4 / beside))
    result: list[_Wrist] = []
    for sign in (1.0, -1.0):
        first = math.atan2(py, px) + sign * side + math.pi / 2.0
        s1, c1 = math.sin(first), math.cos(first)
        # along the axes of joints 2 to 4, the flange lies d4 + d6 cos(q5) off joint 1
        cosine = (flange.position[0] * s1 - flange.position[1] * c1 - d4) / d6
        if abs(cosine) > 1.0 + _ROUNDING:
            continue
        for flip in (1.0, -1.0):
            fifth = flip * math.acos(max(-1.0, min(1.0, cosine)))
            s5 = math.sin(fifth)
            sixth = seed[5]
            if abs(s5) > _STRAIGHT:
                sixth = math.atan2((y6[1] * c1 - y6[0] * s1) / s5, (x6[0] * s1 - x6[1] * c1) / s5)
            result.append(_wrist(flange, d1, d5, d6, (first, fifth, sixth)))
    return result


def _wrist(flange: Pose, d1: float, d5: float, d6: float, joints: Vector) -> _Wrist:
    first, fifth, sixth = joints
    s1, c1 = math.sin(first), math.cos(first)
    c5, s5, c6, s6 = math.cos(fifth), math.sin(fifth), math.cos(sixth), math.sin(sixth)
    x6, y6, z6 = transposed(flange.rotation)
    # frame 4 from frame 6, through joints 6 and 5: its x axis, and its z axis, along which d5 lies
    x5 = add_scaled((c6 * x6[0], c6 * x6[1], c6 * x6[2]), -s6, y6)
    z4 = add_scaled((s6 * x6[0], s6 * x6[1], s6 * x6[2]), c6, y6)
    z4 = (-z4[0], -z4[1], -z4[2])  # y of frame 5 is -z of frame 4 for alpha = -90 deg
    x4 = add_scaled((c5 * x5[0], c5 * x5[1], c5 * x5[2]), -s5, z6)
    at = add_scaled(add_scaled(flange.position, -d6, z6), -d5, z4)
    # in the plane of joints 2 to 4: out from joint 1, and up from the shoulder
    out, up = c1 * at[0] + s1 * at[1], at[2] - d1
    return _Wrist(first, fifth, sixth, out, up, math.atan2(x4[2], c1 * x4[0] + s1 * x4[1]))


def _within(arm: SerialArm, joints: Sequence[float], seed: Sequence[float]) -> tuple[float, ...] | None:
    """The same angles, by whole turns within their ranges and nearest to `seed`; None if one has no such."""
    result: list[float] = []
    for angle, near, limits in zip(joints, seed, arm.limits, strict=True):
        nearest = angle + _TURN * round((near - angle) / _TURN)
        fitting = [a for a in (nearest, nearest - _TURN, nearest + _TURN) if limits.lower <= a <= limits.upper]
        if not fitting:
            return None
        result.append(fitting[0])
    return tuple(result)


def _improved(
    kinematics: ArmKinematics, wanted: Pose, joints: tuple[float, ...] | None
) -> tuple[float, ...] | None:
    """The joint angles after Newton's method; None if they cannot be made to hold the pose."""
    for _ in range(_MAX_STEPS):
        if joints is None:
            return None
        actual = kinematics.pose(joints)
        shift = subtract(wanted.position, actual.position)
        turn = rotvec_from_rotation(times(wanted.rotation, transposed(actual.rotation)))
        if max(norm(shift), norm(turn)) <= _ACCURACY:
            return joints
        # least squares: of the angles that a singular pose leaves open, the nearest
        step, *_ = np.linalg.lstsq(kinematics.jacobian(joints), np.array(shift + turn), rcond=1e-9)
        joints = _within(kinematics.arm, [q + dq for q, dq in zip(joints, step.tolist(), strict=True)], joints)
    return None


def _shown(position: Vector) -> str:
    return f"({position[0]:.4f}, {position[1]:.4f}, {position[2]:.4f})"
