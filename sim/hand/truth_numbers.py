"""The truth of a grasp as plain numbers. Base frame; forces on the tips."""

from collections.abc import Sequence
from itertools import chain

from palpate.runtime.data import ArmSample
from palpate.sim.friction.plant import FrictionContact
from palpate.sim.hand.hand_model import HandModel
from palpate.sim.hand.scene import GraspScene
from palpate.sim.hand.truth import HandTruth
from palpate.spatial import Wrench, norm

OBJECT_POSITION = ("object_x_m", "object_y_m", "object_z_m")
OBJECT_QUATERNION = ("object_qw", "object_qx", "object_qy", "object_qz")

_HAND_COLUMNS = (
    "time_s",
    *OBJECT_POSITION,
    *OBJECT_QUATERNION,
    *(f"object_velocity_{axis}_m_per_s" for axis in "xyz"),
    *(f"object_angular_velocity_{axis}_rad_per_s" for axis in "xyz"),
    *(f"pull_{axis}_n" for axis in "xyz"),
    *(f"pull_moment_{axis}_nm" for axis in "xyz"),
    *(f"hand_{axis}_m" for axis in "xyz"),
    *(f"hand_r{i}{j}" for i in range(3) for j in range(3)),
)
_FINGER_COLUMNS = (
    "touching",
    *(f"contact_{axis}_m" for axis in "xyz"),
    *(f"force_{axis}_n" for axis in "xyz"),
    *(f"torque_{axis}_nm" for axis in "xyz"),
    "current_a",
    "slip_speed_m_per_s",
    "slip_spin_rad_per_s",
)


def hand_columns(hand: HandModel) -> tuple[str, ...]:
    """Return the names of the numbers of a grasp's truth."""
    joints = (f"joint_{k}" for k in range(len(hand.start)))
    return (
        *_HAND_COLUMNS,
        *joints,
        *(f"finger_{i}_{name}" for i in range(hand.fingers) for name in _FINGER_COLUMNS),
    )


def numbers_of_hand(
    truth: HandTruth, pull: Wrench, hand: ArmSample, rubbing: Sequence[FrictionContact], scene: GraspScene
) -> tuple[float, ...]:
    """Return the truth of a grasp as the numbers of `hand_columns`.

    Args:
        truth: Of the scene.
        pull: What pulls at the object [N, N m].
        hand: Where the hand is.
        rubbing: Contacts of the friction plant, if it rubs.
        scene: Whose pairs of tip and object they are.
    """
    fingers: list[float] = []
    for i, f in enumerate(truth.fingers):
        fingers += (float(f.touching), *f.position, *f.force, *f.torque, f.current)
        its = [each for each in rubbing if each.pair is scene.rubbing[i]]
        fingers += (
            sum([norm(each.slip_velocity) for each in its], 0.0),
            sum([abs(each.slip_spin) for each in its], 0.0),
        )
    return (
        truth.time,
        *truth.position,
        *truth.quat_wxyz,
        *truth.velocity,
        *truth.angular_velocity,
        *pull,
        *hand.position_base_tip,
        *chain.from_iterable(hand.rotation_base_tip),
        *truth.joint_position,
        *fingers,
    )
