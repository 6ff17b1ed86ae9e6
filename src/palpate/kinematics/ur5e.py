"""The Universal Robots UR5e in numbers.

Sources:
    [1] Universal Robots, "DH Parameters for calculations of kinematics and dynamics"
        (universal-robots.com/articles/ur/application-installation/dh-parameters-for-calculations-of-kinematics-
        and-dynamics): DH rows, masses, centres of mass.
    [2] UniversalRobots/Universal_Robots_ROS2_Description, config/ur5e/physical_parameters.yaml (commit 3426d674):
        inertias; joint_limits.yaml (commit 1c32d8fb): speed, torque, range.

Nominal numbers: every real arm has its own factory calibration, which moves its tip by millimetres; read it from
the robot's controller. [2] limits the elbow to half a turn for the sake of planners; the joint itself has
+-360 degrees like the others, and that is what stands here. That the inertias of [2] are in DH frames is inferred
from the rotation it gives with each link, which is the DH alpha; [2] does not say so.
"""

import math

from palpate.kinematics.arm import DHRow, JointLimits, LinkInertia, SerialArm

_QUARTER = math.pi / 2.0

_ROWS = (  # [1]
    DHRow(a=0.0, d=0.1625, alpha=_QUARTER),
    DHRow(a=-0.425, d=0.0, alpha=0.0),
    DHRow(a=-0.3922, d=0.0, alpha=0.0),
    DHRow(a=0.0, d=0.1333, alpha=_QUARTER),
    DHRow(a=0.0, d=0.0997, alpha=-_QUARTER),
    DHRow(a=0.0, d=0.0996, alpha=0.0),
)

_SPEED = math.radians(180.0)  # [2], all joints
_RANGE = math.radians(360.0)  # [2]
_LARGE, _SMALL = 150.0, 28.0  # [2] torque of the three large and the three wrist joints, N m
_LIMITS = tuple(JointLimits(-_RANGE, _RANGE, _SPEED, torque) for torque in (_LARGE,) * 3 + (_SMALL,) * 3)

_LINKS = (  # masses and centres [1], inertias [2]
    LinkInertia(  # shoulder
        3.761,
        (0.0, -0.02561, 0.00193),
        (0.00700210, 0.00000073, -0.00001053, 0.00648091, 0.00049994, 0.00657286),
    ),
    LinkInertia(  # upper arm
        8.058,
        (0.2125, 0.0, 0.11336),
        (0.01505885, -0.00005400, 0.00000563, 0.33388086, -0.00000181, 0.33247207),
    ),
    LinkInertia(  # forearm
        2.846,
        (0.15, 0.0, 0.0265),
        (0.00399632, -0.00001365, 0.00137272, 0.07879254, -0.00000660, 0.07848510),
    ),
    LinkInertia(  # wrist 1
        1.370,
        (0.0, -0.0018, 0.01634),
        (0.00165491, -0.00000282, -0.00000438, 0.00135962, 0.00010157, 0.00126279),
    ),
    LinkInertia(  # wrist 2
        1.300,
        (0.0, 0.0018, 0.01634),
        (0.00135617, -0.00000274, 0.00000444, 0.00127827, -0.00005048, 0.00096614),
    ),
    LinkInertia(  # wrist 3
        0.365,
        (0.0, 0.0, -0.001159),
        (0.00018694, 0.00000006, -0.00000017, 0.00018908, -0.00000092, 0.00025756),
    ),
)

UR5E = SerialArm("UR5e", _ROWS, _LIMITS, _LINKS)
"""Geometry, limits and masses of the UR5e, without a tool."""
