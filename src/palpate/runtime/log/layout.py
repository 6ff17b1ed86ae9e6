"""How much of everything there is in one run: what a row of the log has room for."""

from dataclasses import dataclass

from palpate.errors import InvalidValueError
from palpate.runtime.data import Sample

MOST = 1000
"""Joints, fingers, channels in all: more is a damaged file, not a robot."""

FEWEST_GRIPS = 2
"""A gripper has two fingers, however few joints it tells of."""

_FEWEST_FINGERS = 2
"""Of a hand."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Numbers that stay the same for a whole run.

    Attributes:
        joints: Of the arm, 0 if it does not tell.
        hand_joints: Of the hand; None if there is no hand.
        channels: Of each finger's force/torque sensor.
        grips: Largest number of grip forces in a command.
        finger_velocities: Number of fingers that a command with finger velocities has; 0: none has any.
        truth: Names of the numbers that a simulation tells of the truth; none on a robot.
        tip_force: Whether the arm reports the force on what it carries.
    """

    joints: int
    hand_joints: int | None
    channels: tuple[int, ...]
    grips: int
    finger_velocities: int = 0
    truth: tuple[str, ...] = ()
    tip_force: bool = False

    def __post_init__(self) -> None:
        counts = (
            self.joints,
            self.hand_joints or 0,
            len(self.channels),
            self.grips,
            sum(self.channels),
            self.finger_velocities,
            len(self.truth),
        )
        if not self.channels or min(*self.channels, self.grips) < 1 or min(counts) < 0 or max(counts) > MOST:
            raise InvalidValueError(
                f"{self}: must have 1 finger or more, each with 1 channel or more, room for 1 grip force or more, "
                f"and at most {MOST} of anything"
            )

    @staticmethod
    def of(sample: Sample, truth: tuple[str, ...] = ()) -> "Layout":
        """Return the layout of a run whose first sample is given, and the names of the numbers of its truth."""
        hand_joints = None if sample.hand is None else len(sample.hand.joint_position)
        fingers = len(sample.wrenches)
        # fingers that do more than press have more joints than one; room that other hands do not use does no harm
        moving = fingers >= _FEWEST_FINGERS and (hand_joints or 0) > fingers
        return Layout(
            joints=len(sample.arm.joint_position),
            hand_joints=hand_joints,
            channels=tuple(len(given.wrench) for given in sample.wrenches),
            grips=max(FEWEST_GRIPS, fingers, hand_joints or 0),
            finger_velocities=fingers if moving else 0,
            truth=truth,
            tip_force=sample.arm.tip_force_base is not None,
        )
