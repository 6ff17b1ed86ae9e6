"""One finger of a hand explores what the others hold: as a back end whose tip is that finger's."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.kinematics.held_frame import HeldFrame
from palpate.kinematics.pose import Pose
from palpate.runtime.data import ArmSample, Command, HandSample, Sample
from palpate.runtime.pacing import Pacer
from palpate.sim.carriers.carrier import refuse_to_turn
from palpate.sim.contact_truth import CONTACT_COLUMNS, Truth, numbers_of_truth
from palpate.sim.hand.backend import HandBackend, WrappedHand
from palpate.spatial import ZERO, Vector, rotate_back, scale, subtract

EXPLORING = 0
"""Number of the finger that explores; all others hold."""

SETTLING = 0.3
"""[s] For which the object is gripped before it is let go of, and then held before the run begins."""


@dataclass(frozen=True, slots=True)
class _Kept:
    """What the next sample is compared with."""

    time: float
    position: Vector
    rotation: np.ndarray[tuple[int, int], np.dtype[np.float64]]


class ExploringFinger(WrappedHand):
    """A simulated hand whose first finger explores what its other fingers hold. A `Backend`.

    The base frame of its samples and commands is fixed to the object, as the fingertips that hold it show where it
    is (`palpate.kinematics.held_frame`); there the object's frame coincides with it when the run begins. The arm
    of its samples is the exploring finger. `start` closes the holding fingers on the object, which a fixture holds
    in place until then; thereafter the first of them stands still and the others press against it: fingers that
    only press would give way to any force along their line.
    """

    def __init__(self, hand: HandBackend, grip: float, closing_time: float, pacer: Pacer | None = None) -> None:
        """Take a hand around an object that a fixture holds.

        Args:
            hand: In a scene with a fixture.
            grip: Normal force with which each of the other fingers holds the object [N].
            closing_time: Until they have closed on it [s].
            pacer: Where time comes from, once the run has begun; as the hand's, if not given.
        """
        super().__init__(hand, pacer)
        others = hand.scene.hand.fingers - 2
        self._closing = Command(
            grip_force=(0.0, grip) + (grip,) * others, finger_velocity=(ZERO, None) + (None,) * others
        )
        self._grips = (0.0, 0.0) + (grip,) * others
        self._standing: tuple[Vector | None, ...] = (ZERO,) + (None,) * others
        self._closing_periods = round((closing_time + SETTLING) / hand.period)
        self._held: HeldFrame | None = None
        self._kept: _Kept | None = None
        self._pose_base_finger = Pose()

    def start(self) -> Sample:
        """Grip the object, let go of the fixture, and return the first sample."""
        hand, holding = self._hand, Command(grip_force=self._grips, finger_velocity=(ZERO, *self._standing))
        hand.start()
        for _ in range(self._closing_periods):
            hand.step(self._closing)
        hand.release()
        sample = hand.step(holding)
        for _ in range(round(SETTLING / hand.period)):
            sample = hand.step(holding)
        truth = hand.truth()
        self._held = HeldFrame(self._holding(truth.joint_position), truth.pose_base_object)
        self._begin, self._kept = sample.time, None
        return self._seen(sample)

    def step(self, command: Command) -> Sample:
        """Simulate one period with the commanded velocity of the exploring finger.

        Raises:
            InvalidValueError: It is to turn, or to move by absurd numbers.
            SimulationDivergedError: The simulation diverged.
        """
        refuse_to_turn(command.angular_velocity_base_tip, "finger")
        velocity = rotate_back(self._pose_base_finger.rotation, command.velocity_base_tip)
        moving = (velocity, *self._standing)
        sample = self._hand.step(Command(ZERO, command.phase, self._grips, finger_velocity=moving))
        self._pacer.wait()
        return self._seen(sample)

    def truth(self) -> Truth:
        """Return what really happened at the exploring finger at the last sample, in the base frame."""
        truth = self._hand.truth()
        finger, pose = truth.fingers[EXPLORING], self._pose_world_base(truth.joint_position)
        back = pose.inverse()
        return Truth(
            finger.touching,
            (back @ Pose(finger.position)).position,
            rotate_back(pose.rotation, finger.force),
            rotate_back(pose.rotation, finger.torque),
            back @ truth.pose_base_object,
        )

    @property
    def truth_columns(self) -> tuple[str, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        return CONTACT_COLUMNS

    def truth_row(self) -> tuple[float, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        return numbers_of_truth(self.truth())

    def _holding(self, joint_position: tuple[float, ...]) -> list[Vector]:
        """Where the middles of the holding fingertips are, base frame of the scene."""
        scene = self._hand.scene
        poses = zip(scene.hand.sensor_poses(joint_position), scene.hand.tips, strict=True)
        palm = Pose(scene.palm)
        return [(palm @ pose @ Pose(tip.center_of_mass)).position for pose, tip in list(poses)[1:]]

    def _pose_world_base(self, joint_position: tuple[float, ...]) -> Pose:
        assert self._held is not None  # it has been started
        return self._held.pose(self._holding(joint_position))

    def _seen(self, sample: Sample) -> Sample:
        """The sample of the hand as one of an arm that is its exploring finger."""
        hand = sample.hand
        assert hand is not None  # it is a hand's
        joints = hand.joint_position
        world_base = self._pose_world_base(joints)
        palm = Pose(self._hand.scene.palm)
        pose = world_base.inverse() @ palm @ self._hand.scene.hand.sensor_poses(joints)[EXPLORING]
        self._pose_base_finger = pose
        velocity, turning = ZERO, ZERO
        rotation, before = np.array(pose.rotation), self._kept
        if before is not None:
            rate = 1.0 / (hand.time - before.time)
            velocity = scale(rate, subtract(pose.position, before.position))
            turned = rotation @ before.rotation.T
            x, y, z = turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]
            turning = (0.5 * rate * float(x), 0.5 * rate * float(y), 0.5 * rate * float(z))
        self._kept = _Kept(hand.time, pose.position, rotation)
        begin = self._begin
        arm = ArmSample(hand.time - begin, pose.position, pose.rotation, velocity, (), turning)
        wrenches = tuple(replace(each, time=each.time - begin) for each in sample.wrenches)
        return Sample(sample.time - begin, arm, wrenches, HandSample(hand.time - begin, joints))


def held_pose(palm_center: Vector) -> Pose:
    """Return the object's pose in the hand frame: its z points away from the palm, its origin at the middle."""
    return Pose(palm_center, ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)))
