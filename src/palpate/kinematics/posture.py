"""Where everything in a scene is, as far as anybody knows: what machines say, and what was looked up."""

from dataclasses import dataclass, field

from palpate.kinematics.pose import Pose


@dataclass(frozen=True, slots=True)
class Posture:
    """Joint positions and poses at one moment.

    Attributes:
        pose_base_tip: Of the tip frame; with a hand, of the hand frame. An arm is where its joints say.
        arm: Position of each of the arm's joints [rad]; empty if it has none, or does not tell.
        hand: Of each of the hand's joints [rad, or m if it slides]; empty for no hand.
        free: pose_base_body of each body that moves freely, in the scene's order, then of what is touched if it
            yields on one joint; empty for where they start.
        time: On the back end's clock [s]: what has a prescribed motion is where it belongs then.
    """

    pose_base_tip: Pose = field(default_factory=Pose)
    arm: tuple[float, ...] = ()
    hand: tuple[float, ...] = ()
    free: tuple[Pose, ...] = ()
    time: float = 0.0
