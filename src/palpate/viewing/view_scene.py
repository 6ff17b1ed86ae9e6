"""What a view shows of the world: parts made of triangles, and how they move."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.kinematics import ArmKinematics, Pose
from palpate.kinematics.pose import times
from palpate.spatial import Matrix, add, rotate

Colour = tuple[int, int, int]
"""RGB, 0 to 255."""


class Place(Enum):
    """What a part is fixed to."""

    BASE = "base"
    TIP = "tip"
    LINK = "link"
    """Of the arm: see `Part.link`."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A rigid piece.

    Attributes:
        vertices: In the frame that it is fixed to, shape (n, 3) [m].
        triangles: Corners, shape (m, 3).
        colour: RGB.
        place: What it is fixed to.
        link: Number of the arm's link, from 0; counts only where `place` says so.
        opacity: 1 for solid.
    """

    vertices: FloatArray
    triangles: npt.NDArray[np.int64]
    colour: Colour
    place: Place = Place.BASE
    link: int = 0
    opacity: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class ViewScene:
    """All that a view shows beside what is measured.

    Attributes:
        title: For people; may hold whatever they typed.
        parts: Solid things.
        arm: What carries the tip; None for a stage, which is not shown.
        map_spacing: Distance below which points of the map are not told apart [m].
    """

    title: str
    parts: tuple[Part, ...]
    arm: ArmKinematics | None = None
    map_spacing: float = 5e-4

    def __post_init__(self) -> None:
        positive("map_spacing", self.map_spacing, "m")
        links = 0 if self.arm is None else self.arm.arm.joints
        for part in self.parts:
            if part.place is Place.LINK and not 0 <= part.link < links:
                raise InvalidValueError(f"link = {part.link}: the scene's arm has {links} links, numbered from 0")

    @property
    def joints(self) -> int:
        """Of the arm."""
        return 0 if self.arm is None else self.arm.arm.joints


def link_poses(arm: ArmKinematics, joint_position: tuple[float, ...]) -> tuple[Pose, ...]:
    """Return pose_base_link of each link: of the DH frame behind its joint.

    Args:
        arm: As it stands.
        joint_position: One per joint [rad].
    """
    poses = []
    position, rotation = arm.pose_base_foot.position, arm.pose_base_foot.rotation
    for row, angle in zip(arm.arm.rows, joint_position, strict=True):
        c, s = float(np.cos(angle + row.offset)), float(np.sin(angle + row.offset))
        ca, sa = float(np.cos(row.alpha)), float(np.sin(row.alpha))
        # standard DH: Rot_z(q) Trans_z(d) Trans_x(a) Rot_x(alpha)
        step: Matrix = ((c, -s * ca, s * sa), (s, c * ca, -c * sa), (0.0, sa, ca))
        position = add(position, rotate(rotation, (row.a * c, row.a * s, row.d)))
        rotation = times(rotation, step)
        poses.append(Pose(position, rotation))
    return tuple(poses)
