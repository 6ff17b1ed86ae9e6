"""Serial arms from tables of Denavit-Hartenberg parameters, as makers publish them."""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, vector
from palpate.kinematics.arm import Joint, JointLimits, SerialArm
from palpate.kinematics.pose import Pose


@dataclass(frozen=True, slots=True)
class DHRow:
    """One joint and link in standard (distal) Denavit-Hartenberg form.

    Frame i - 1 to frame i: Rz(q + offset) Tz(d) Tx(a) Rx(alpha); the joint turns about z of frame i - 1.

    Attributes:
        a: Link length [m].
        d: Link offset [m].
        alpha: Link twist [rad].
        offset: Of the joint angle [rad].
    """

    a: float
    d: float
    alpha: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        vector("DH row (a, d, alpha, offset)", (self.a, self.d, self.alpha, self.offset), 4, "m, m, rad, rad")

    @property
    def link(self) -> Pose:
        """What stands behind the joint's turn: Tz(d) Tx(a) Rx(alpha)."""
        c, s = math.cos(self.alpha), math.sin(self.alpha)
        return Pose((self.a, 0.0, self.d), ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)))


def arm_of_rows(name: str, rows: tuple[DHRow, ...], limits: tuple[JointLimits, ...]) -> SerialArm:
    """Return the arm of a table, one row and one pair of limits per joint.

    Raises:
        InvalidValueError: Their numbers differ.
    """
    if len(rows) != len(limits):
        raise InvalidValueError(f"{name}: {len(rows)} rows, {len(limits)} limits: give one of each per joint")
    link, joints = Pose(), list[Joint]()
    for row, limit in zip(rows, limits, strict=True):
        c, s = math.cos(row.offset), math.sin(row.offset)
        joints.append(Joint(link @ Pose(rotation=((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))), limit))
        link = row.link
    return SerialArm(name, tuple(joints), link)
