"""How far a held object has turned or slid in the hand, as something besides touch tells it.

Touch alone does not tell an angle well: near the horizontal the torque of the weight hardly changes with it, and
of a slide in steady slip it tells nothing. So another sensor has to: an encoder at a pivoting fingertip, a camera,
a distance sensor in the palm. Whatever it is, its readings come through the sample as further joints of the hand,
behind those of the fingers: object and fingertip are a joint, though one that nobody drives. So they are recorded
with everything else, and a recorded run replays bit for bit with nothing else to be kept.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from palpate.errors import InvalidValueError, positive
from palpate.runtime.data import Observation


class MotionReading(NamedTuple):
    """How far the object had moved in the hand.

    Attributes:
        time: When it was read [s].
        value: Turn about the first finger's outward normal [rad], or way [m].
    """

    time: float
    value: float


class MotionSource(Protocol):
    """Tells how far an object has turned or slid in the hand: a pure function of what is observed."""

    def read(self, now: Observation) -> MotionReading | None:
        """Return the newest reading, the last one again if there is none since; None if nothing is known."""
        ...


@dataclass(frozen=True, slots=True)
class HandJoint:
    """A further joint of the hand that tells it. A `MotionSource`.

    Attributes:
        index: In `HandSample.joint_position`; fingers come first.
    """

    index: int

    def __post_init__(self) -> None:
        if self.index < 0:
            raise InvalidValueError(f"index = {self.index}: must be 0 or above, fingers come first")

    def read(self, now: Observation) -> MotionReading | None:
        """See `MotionSource`.

        Raises:
            InvalidValueError: The hand has no such joint.
        """
        hand = now.hand
        if hand is None:
            return None
        if self.index >= len(hand.joint_position):
            raise InvalidValueError(
                f"index = {self.index}: the hand tells {len(hand.joint_position)} joints; take a hand that also "
                "tells how the object moves in it, or a smaller index"
            )
        value = hand.joint_position[self.index]
        return MotionReading(hand.time, value) if math.isfinite(value) else None


class MotionTracker:
    """Follows readings with their rate, between and beyond them, to the present.

    A fading-memory filter of first order (Morrison 1969), critically damped: a steady motion is followed without
    lag. White noise sd of readings every dt leaves sd sqrt(5 dt / 4 T) in the value and sd sqrt(dt / 4 T^3) in
    the rate, T the smoothing time: 0.2 degrees every 2 ms and T = 25 ms leave 0.06 degrees and 1.1 degrees/s.

    Attributes:
        value: Now [rad or m].
        rate: Now [rad/s or m/s].
        silent: For how long there has been no new reading [s]; infinite before the first.
    """

    __slots__ = ("_read", "_smoothing", "rate", "silent", "value")

    def __init__(self, smoothing: float) -> None:
        """Take the time constant of the memory [s]."""
        self._smoothing = positive("smoothing", smoothing, "s")
        self.restart()

    def restart(self) -> None:
        """Forget all readings."""
        self.value = self.rate = 0.0
        self.silent, self._read = math.inf, -math.inf

    def step(self, time: float, reading: MotionReading | None) -> None:
        """Take a period.

        Args:
            time: Of the period [s].
            reading: The newest; one that was given before says nothing new.
        """
        if self._read == -math.inf:
            if reading is not None:
                self.value, self._read, self.silent = reading.value, reading.time, time - reading.time
            return
        at = self._read + self.silent  # `value` is of then
        if reading is not None and reading.time > self._read:
            dt = reading.time - self._read
            keep = math.exp(-dt / self._smoothing)
            off = reading.value - (self.value + self.rate * (reading.time - at))
            self.value += self.rate * (reading.time - at) + (1.0 - keep * keep) * off
            self.rate += (1.0 - keep) ** 2 / dt * off
            at = self._read = reading.time
        self.value += self.rate * (time - at)
        self.silent = time - self._read
