"""How far a held object has turned in the hand, by touch alone: where contacts are, and how the fingers moved.

A contact that rolls holds material of the fingertip and of the object together: both move there with the same
velocity. Where it is, touch says; how the tip's material moves there, the hand's joints say. So every finger tells
how one point of the object moves, and points that move as one rigid body determine its rotation and translation,
whatever its shape (D. Montana, "The kinematics of contact and grasp", 1988, with the contact points measured
instead of integrated). What is wrong of a contact's place by d is a share d / r of the turn; a rounded joint
position is wrong once, and not more with every turn, for it is differences of positions that are summed up.

A contact that slips is believed to roll: it is for the grip to see to it that none does.
"""

from collections.abc import Sequence

from palpate.kinematics.pose import Pose
from palpate.spatial import Vector, add, add_scaled, cross, rotate, scale, subtract

_AXIS: Vector = (0.0, 0.0, 1.0)

Points = tuple[Vector, ...]
"""One per finger [m]."""


class TurnMeter:
    """Sums up rotation and translation of an object between the fingers, in the plane across the hand's axis.

    Attributes:
        turn: About z of the hand frame since `start`, past half a turn too [rad].
        moved: Way of the point of the object that was on the hand's axis then, across it, hand frame [m].
        points: Where the contacts are, hand frame.
    """

    __slots__ = ("_centroids", "_poses", "moved", "points", "turn")

    def __init__(self) -> None:
        self.start((), ())

    def start(self, poses: Sequence[Pose], centroids: Sequence[Vector]) -> None:
        """Begin to count; arguments as for `step`."""
        self._poses, self._centroids = tuple(poses), tuple(centroids)
        self.points: Points = _places(poses, centroids)
        self.turn = 0.0
        self.moved: Vector = (0.0, 0.0, 0.0)

    def step(self, poses: Sequence[Pose], centroids: Sequence[Vector]) -> None:
        """Take a period.

        Args:
            poses: Sensor frames in the hand frame, one per finger, 2 or more, as `HandKinematics` tells them.
            centroids: Of the contacts, each in its sensor frame [m]; the last that was believed.
        """
        n = len(self._poses)
        before, self.points = self.points, _places(poses, centroids)
        # halfway between both periods: exact to second order of what happened between them
        at = [scale(0.5, add(a, b)) for a, b in zip(before, self.points, strict=True)]
        displacements = [
            subtract(_at(pose, middle), _at(last, middle))
            for pose, last, middle in zip(
                poses,
                self._poses,
                (scale(0.5, add(a, b)) for a, b in zip(self._centroids, centroids, strict=True)),
                strict=True,
            )
        ]
        self._poses, self._centroids = tuple(poses), tuple(centroids)
        center, mean = scale(1.0 / n, _sum(at)), scale(1.0 / n, _sum(displacements))
        # least squares of a turn about z: sum of (p x u)_z over sum of |p|^2, both from their means
        twist = spread = 0.0
        for point, displacement in zip(at, displacements, strict=True):
            x, y, _ = subtract(point, center)
            u, v, _ = subtract(displacement, mean)
            twist += x * v - y * u
            spread += x * x + y * y
        turn = twist / spread if spread > 0.0 else 0.0
        self.turn += turn
        moved = self.moved
        for _ in range(2):  # the second time from halfway of the first
            halfway = scale(0.5, add(self.moved, moved))
            moved = add(self.moved, add_scaled(mean, turn, cross(_AXIS, subtract(halfway, center))))
        self.moved = (moved[0], moved[1], 0.0)


def _at(pose: Pose, point: Vector) -> Vector:
    return add(pose.position, rotate(pose.rotation, point))


def _places(poses: Sequence[Pose], centroids: Sequence[Vector]) -> Points:
    return tuple(_at(pose, centroid) for pose, centroid in zip(poses, centroids, strict=True))


def _sum(vectors: Sequence[Vector]) -> Vector:
    total: Vector = (0.0, 0.0, 0.0)
    for vector in vectors:
        total = add(total, vector)
    return total
