"""What a sensor tells of how an object moves in the hand: the joint between them that nobody drives.

Its readings follow those of the fingers in `HandSample.joint_position`, so that they reach a controller, a log and
a replay on the way that is there. They are as old as those: taken when the bus is.
"""

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, not_negative
from palpate.runtime.data import Command, HandSample, Sample
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.truth import HandTruth

TURN, SLIDE = 2, 3
"""Where its readings are among the joints of a hand of two fingers."""

_FINGERS = 2


@dataclass(frozen=True, slots=True)
class PassiveNoise:
    """White noise of each reading, standard deviations.

    Attributes:
        turn: [rad]; 0.2 degrees.
        slide: [m]
    """

    turn: float = math.radians(0.2)
    slide: float = 5e-5

    def __post_init__(self) -> None:
        not_negative("turn", self.turn, "rad")
        not_negative("slide", self.slide, "m")


@dataclass(frozen=True, slots=True)
class InHand:
    """How far the object has moved in the hand since the start of the run.

    Attributes:
        turn: About the first finger's outward normal, past half a turn too [rad].
        slide: How far the point of the object that was on the line of contacts has gone away from the palm [m].
        across: How far it has gone across that and across the line of contacts [m].
    """

    turn: float
    slide: float
    across: float


class ObjectInHand:
    """Follows an object in a hand of two fingers by the simulation's truth."""

    def __init__(self, center: float) -> None:
        """Take how far below the palm the line of contacts is [m]."""
        self._center = np.array([0.0, 0.0, -center])
        self._rotation, self._point, self._turn = np.eye(3), np.zeros(3), 0.0

    def start(self, sample: Sample, truth: HandTruth) -> None:
        """Begin to count."""
        rotation, position = _pose_in_hand(sample, truth)
        self._rotation, self._turn = rotation, 0.0
        self._point = rotation.T @ (self._center - position)

    def step(self, sample: Sample, truth: HandTruth) -> InHand:
        """Return how far it has moved; before it has gone on by half a turn."""
        rotation, position = _pose_in_hand(sample, truth)
        turned = rotation @ self._rotation.T
        # the first finger stands at +x and presses towards -x
        angle = -math.atan2(turned[2, 1] - turned[1, 2], turned[1, 1] + turned[2, 2])
        self._turn += math.remainder(angle - self._turn, 2.0 * math.pi)
        moved = rotation @ self._point + position - self._center
        return InHand(self._turn, -float(moved[2]), float(moved[1]))


class WatchedHand(WrappedBackend[HandBackend]):
    """A hand in simulation that also tells how the object moves in it. A `Backend`."""

    def __init__(self, backend: HandBackend, noise: PassiveNoise | None = None, seed: int = 0) -> None:
        """Take a hand of two fingers, how well it is seen, and the seed of that noise.

        Raises:
            InvalidValueError: Another number of fingers.
        """
        hand = backend.scene.hand
        if hand.fingers != _FINGERS:
            raise InvalidValueError(
                f"the hand has {hand.fingers} fingers: an object turns in it about the line between two; take a "
                "hand of two"
            )
        super().__init__(backend)
        self._noise, self._seed = noise or PassiveNoise(), seed
        self._object = ObjectInHand(hand.depth + hand.tip_along)
        self._generator = np.random.default_rng(seed)
        self._told: HandSample | None = None
        self.in_hand = InHand(0.0, 0.0, 0.0)
        """The truth at the time of the last sample; no controller sees it."""

    def start(self) -> Sample:
        """Open the hand, put the object at its start, and return the first sample."""
        sample = super().start()
        self._generator, self._told = np.random.default_rng(self._seed), None
        self._object.start(sample, self.backend.truth())
        return self._watched(sample)

    def step(self, command: Command) -> Sample:
        """Simulate one period; see `HandBackend.step`."""
        return self._watched(super().step(command))

    def _watched(self, sample: Sample) -> Sample:
        """The sample, with readings that are new when those of the fingers are."""
        self.in_hand = now = self._object.step(sample, self.backend.truth())
        hand, told = sample.hand, self._told
        assert hand is not None
        if told is None or told.time < hand.time:
            a, b = self._generator.standard_normal(2).tolist()
            turn, slide = now.turn + a * self._noise.turn, now.slide + b * self._noise.slide
            self._told = told = HandSample(hand.time, (*hand.joint_position, turn, slide))
        return replace(sample, hand=told)


def _pose_in_hand(sample: Sample, truth: HandTruth) -> tuple[FloatArray, FloatArray]:
    """Rotation and position of the object in the hand frame."""
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
    of_hand = np.array(sample.arm.rotation_base_tip)
    position = np.array(truth.position) - np.array(sample.arm.position_base_tip)
    return of_hand.T @ flat.reshape(3, 3), of_hand.T @ position
