"""Ground truth of a grasp, for checks; no controller sees it."""

from dataclasses import dataclass

from scipy.spatial.transform import Rotation

from palpate.kinematics.pose import Pose
from palpate.sim.friction.plant import FrictionContact
from palpate.sim.friction.resultant import resultant
from palpate.spatial import ZERO, Vector


@dataclass(frozen=True, slots=True)
class FingerTruth:
    """What really happens at one fingertip; base frame.

    Attributes:
        touching: Whether it touches the object.
        position: Force-weighted centroid of the contacts [m].
        force: What the object exerts on the tip [N].
        torque: Likewise, about `position` [N m].
        current: Of its servo [A]; 0 where its motors are not modelled.
    """

    touching: bool
    position: Vector
    force: Vector
    torque: Vector
    current: float


@dataclass(frozen=True, slots=True)
class HandTruth:
    """What really happens in a grasp. Base frame.

    Attributes:
        time: To which it belongs, that of the last sample [s].
        fingers: One per finger.
        joint_position: Of the hand, as in `HandSample`, without rounding [rad or m].
        position: Of the object's frame [m].
        quat_wxyz: Its orientation, object to base.
        velocity: Of its frame [m/s].
        angular_velocity: Of the object [rad/s].
    """

    time: float
    fingers: tuple[FingerTruth, ...]
    joint_position: tuple[float, ...]
    position: Vector
    quat_wxyz: tuple[float, float, float, float]
    velocity: Vector
    angular_velocity: Vector

    @property
    def pose_base_object(self) -> Pose:
        """Where the object is."""
        w, x, y, z = self.quat_wxyz
        (a, b, c), (d, e, f), (g, h, i) = Rotation.from_quat((x, y, z, w)).as_matrix().tolist()
        return Pose(self.position, ((a, b, c), (d, e, f), (g, h, i)))


def truth_of_readings(readings: list[float], current: float) -> FingerTruth:
    """Return what a fingertip's contact sensor says, where MuJoCo presses and rubs.

    Args:
        readings: Of that sensor: found, force, torque, position.
        current: Of the finger's servo [A].
    """
    found, fx, fy, fz, tx, ty, tz, x, y, z = readings
    # the contact sensor gives what its first geom, the tip, exerts on the object
    return FingerTruth(found > 0.0, (x, y, z), (-fx, -fy, -fz), (-tx, -ty, -tz), current)


def truth_of_contacts(contacts: tuple[FrictionContact, ...], current: float) -> FingerTruth:
    """Return what contacts of a friction plant come to, on one fingertip.

    Args:
        contacts: Of that tip alone, which is the first geom of their pair.
        current: Of the finger's servo [A].
    """
    if not contacts:
        return FingerTruth(False, ZERO, ZERO, ZERO, current)
    return FingerTruth(True, *resultant(contacts), current)
