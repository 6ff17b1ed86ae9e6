"""The Universal Robots UR5e in numbers.

Geometry and limits; masses are in the simulated one, `sim/arms/ur5e.xml`.

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

from palpate.kinematics.arm import JointLimits
from palpate.kinematics.denavit_hartenberg import DHRow, arm_of_rows

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

UR5E = arm_of_rows("UR5e", _ROWS, _LIMITS)
"""Geometry and limits of the UR5e, without a tool."""
