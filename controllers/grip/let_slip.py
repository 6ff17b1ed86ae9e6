"""Settle, let go until it slips, brake, hold: what pivots and slides have in common."""

from dataclasses import dataclass

from palpate.controllers.grip.motion_source import MotionSource, MotionTracker
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.slip_servo import SlipServo, SlipServoParameters
from palpate.errors import InvalidValueError, not_negative, positive
from palpate.runtime.data import Observation, Phase

_FINGERS = 2
"""Opposite each other: a line about which an object can turn, and one grip for both."""

NEAR = 0.06
"""Share of grip beyond what is believed to be needed from which on slip may be near: that belief is a few per cent
off."""

JERK = 1.2
"""Of the rate that is wanted: what moves faster has just broken loose, and the servo is braking it already. To
grip for good at that rate would end the slip short of its way: 5 mm on bristles by up to 0.4 mm, so by 0.12."""

BLIND = 0.5
"""Share of the silence that ends it, from which on the grip is let down no further: at the speed of a pivot 25 ms
are 0.7 degrees."""


@dataclass(frozen=True, slots=True)
class LetSlipParameters:
    """What is common to all wanted slips.

    Attributes:
        settle_time: Before it lets go [s].
        hold_time: After it has braked [s].
        lead: From the command to grip until the object stops [s].
        smoothing: Time constant with which the motion is tracked [s].
        silence: Without a reading for so long it brakes, and gives up [s].
        patience: If it has not got there by then it brakes, and gives up [s].
    """

    settle_time: float = 0.2
    hold_time: float = 0.5
    lead: float = 0.015
    smoothing: float = 0.025
    silence: float = 0.05
    patience: float = 20.0

    def __post_init__(self) -> None:
        for name in ("settle_time", "hold_time", "lead"):
            not_negative(name, getattr(self, name), "s")
        for name in ("smoothing", "silence", "patience"):
            positive(name, getattr(self, name), "s")


class LetSlip:
    """Brings an object to a place in the hand by letting it slip. Part of a controller.

    Attributes:
        grip: What holds before and after; while it slips, that stands still.
        tracker: Where the object is, as the source tells it.
        phase: SETTLE, SCAN while it lets go, HOLD, then DONE or LOST.
        direction: 1 if it is to go up in the source's count, -1 if down; 0 before it lets go.
    """

    def __init__(
        self,
        grip: SlipSafeGrip,
        source: MotionSource,
        period: float,
        servo: SlipServoParameters,
        parameters: LetSlipParameters,
    ) -> None:
        """Take the pieces.

        Args:
            grip: That holds the object, as it stands.
            source: Tells where the object is in the hand.
            period: Of control [s].
            servo: How it slips.
            parameters: The rest.
        """
        self.grip, self._source, self._parameters = grip, source, parameters
        self._servo = SlipServo(servo, period)
        self.tracker = MotionTracker(parameters.smoothing)
        self.phase, self.direction = Phase.SETTLE, 0.0
        self._target = self._since = 0.0
        self._failed = False
        self._forces = (grip.target,) * _FINGERS

    def start(self, first: Observation, target: float) -> None:
        """Begin with an object that is held.

        Args:
            first: The first observation.
            target: Where it is to go, in the source's count [rad or m].

        Raises:
            InvalidValueError: Another number of fingers than two.
        """
        if len(first.fingers) != _FINGERS:
            raise InvalidValueError(
                f"the observation has {len(first.fingers)} fingers: wanted slips take two, opposite each other"
            )
        self.tracker.restart()
        self._target, self.direction, self._failed = target, 0.0, False
        self._go_on(Phase.SETTLE, first.time)

    @property
    def remaining(self) -> float:
        """Way that is left [rad or m]."""
        return self.direction * (self._target - self.tracker.value)

    @property
    def rate(self) -> float:
        """Along that way [rad/s or m/s]."""
        return self.direction * self.tracker.rate

    def give_up(self, time: float) -> None:
        """Brake, hold and end with LOST."""
        self._failed = True
        self._go_on(Phase.HOLD, time)

    def step(self, now: Observation, least: float) -> tuple[float, ...]:
        """Return with which force each finger is to press during the next period [N].

        Args:
            now: What is known.
            least: Grip below which it is not to let go [N].
        """
        p, tracker = self._parameters, self.tracker
        tracker.step(now.time, self._source.read(now))
        gone = now.time - self._since
        if self.phase is Phase.SETTLE and gone >= p.settle_time:
            self.direction = 1.0 if self._target >= tracker.value else -1.0
            self._servo.start(self._forces[0], (1.0 + NEAR) * self.grip.needed)
            self._go_on(Phase.SCAN, now.time)
        elif self.phase is Phase.SCAN:
            if (
                not all(finger.believed for finger in now.fingers)
                or tracker.silent > p.silence
                or gone > p.patience
            ):
                self.give_up(now.time)
            elif self.remaining <= min(max(self.rate, 0.0), JERK * self._servo.wanted) * p.lead:
                self._go_on(Phase.HOLD, now.time)
        elif self.phase is Phase.HOLD and gone >= p.hold_time:
            self._go_on(Phase.LOST if self._failed else Phase.DONE, now.time)
        if self.phase is Phase.SCAN:
            if tracker.silent > BLIND * p.silence:  # how it moves is a guess by now: it is let go no further
                least = max(least, self._forces[0])
            most = self.grip.parameters.largest_grip
            grip = min(self._servo.step(self.remaining, self.rate, least, most), most)
            self._forces = (grip,) * _FINGERS
        else:
            self._forces = self.grip.step(now)
        return self._forces

    def _go_on(self, phase: Phase, time: float) -> None:
        if self.phase is Phase.SCAN:
            self.grip.resume(self.grip.target)  # that is still what held before; what it felt then is long ago
        self.phase, self._since = phase, time
