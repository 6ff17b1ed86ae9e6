"""Bad inputs of kinematics: each is refused, and the message names it."""

import math
from dataclasses import replace

import pytest

from palpate.errors import InvalidValueError
from palpate.kinematics import (
    UR5E,
    ArmKinematics,
    DHRow,
    FollowingErrorLimit,
    InverseVelocity,
    JointLimits,
    Pose,
    SerialArm,
    TipReference,
    arm_of_rows,
    nearest_joint_position,
)
from palpate.kinematics.pose import checked_pose
from support.file_arms import own_arm

BARE = ArmKinematics(UR5E)
NARROW = tuple(replace(joint, limits=JointLimits(-0.1, 0.1, 1.0, 1.0)) for joint in UR5E.joints)
HOME, ZERO = (0.0, -1.5, 1.6, -1.7, -1.57, 0.0), (0.0,) * 6
DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
SKEW = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.1), (0.0, 0.0, 1.0))


def posture(x, y, z, seed=HOME, kinematics=BARE):
    return nearest_joint_position(kinematics, Pose((x, y, z), DOWN), seed)


ROWS = [
    (lambda: arm_of_rows("short", (DHRow(0.1, 0.0, 0.0),), UR5E.limits), "one of each"),
    (lambda: SerialArm("none", ()), "no joints"),
    (lambda: JointLimits(1.0, 1.0, 1.0, 1.0), "lower"),
    (lambda: JointLimits(-1.0, 1.0, 0.0, 1.0), "speed"),
    (lambda: DHRow(math.nan, 0.0, 0.0), "DH row"),
    (
        lambda: UR5E.joint_position("start", (0.0, 0.0, 7.0, 0.0, 0.0, 0.0)),
        r"joint 3, is 7.0000 rad \(401.1 deg\)",
    ),
    (lambda: UR5E.joint_position("start", (0.0,) * 5), "shape"),
    (lambda: checked_pose("here", Pose((0.0, math.nan, 0.0))), r"here\.position"),
    (lambda: checked_pose("here", Pose(rotation=SKEW)), r"here\.rotation"),
    (lambda: posture(0.4, 0.2, 0.3, (9.0,) * 6), "seed"),
    (lambda: posture(math.nan, 0.2, 0.3), "pose_base_tip"),
    (lambda: posture(1.5, 0.2, 0.1), r"is 1\.51\d+ m from its first joint, .* reach 1\.\d+ m"),
    (lambda: posture(0.05, 0.0, 0.5), r"with its joints within their ranges: .* off"),
    (
        lambda: posture(-0.1333, 0.45, 0.3, ZERO, ArmKinematics(replace(UR5E, joints=NARROW))),
        "within their ranges",
    ),
    (lambda: InverseVelocity(ArmKinematics(SerialArm("short", UR5E.joints[:2]))), "short has 2 joints"),
    (lambda: InverseVelocity(BARE, length=0.0), "length"),
    (lambda: InverseVelocity(BARE, threshold=0.0), "threshold"),
    (lambda: InverseVelocity(BARE, braking_rate=0.0), "braking_rate"),
    (lambda: InverseVelocity(ArmKinematics(own_arm("panda.xml").arm), home=(0.0,) * 7), "home, joint 4"),
    (lambda: TipReference(InverseVelocity(BARE), 0.2), "period"),
    (lambda: TipReference(InverseVelocity(BARE), 1e-3).start((7.0, *ZERO[1:])), "joint 1"),
    (lambda: FollowingErrorLimit(distance=0.0), "distance"),
    (lambda: FollowingErrorLimit(angle=2.0), "angle"),
]


@pytest.mark.parametrize(("call", "message"), ROWS, ids=[f"{i}-{row[1]}" for i, row in enumerate(ROWS)])
def test_a_bad_input_is_refused_by_name(call, message):
    with pytest.raises(InvalidValueError, match=message):
        call()
