"""Whether an arm that measures no force gives way only as far as its fingertip's sensor feels a push.

A position servo that is pushed with F stands F / K beside where its commands lead it. So the motion that does not
happen is a second channel of force, beside a sensor that may be dead. Like `palpate.runtime.following` this is for
runs of a robot: samples that are replayed under other options do not follow what is commanded there.
"""

import math
from dataclasses import dataclass

from palpate.errors import not_negative, positive
from palpate.runtime.data import ArmSample, Command, Observation, Sample
from palpate.runtime.following import CommandedMotion, Following, FollowingError, FollowingMaker
from palpate.spatial import ZERO, Vector, dot, norm

SHARE = 0.35
"""Of the force limit, that may push an arm and is not felt. The true force may be twice as large: a tip that
friction holds sideways gives way less than by its stiffness, and servos give way later than a contact presses."""

ALONG, ACROSS = 0.5, 1.5
"""Of the felt force, by which an arm may give way otherwise along it and across it: its stiffness differs by
direction. A sensor that shows two thirds or more is not found."""

TIMING, CYCLES = 0.2, 3.0
"""Share of its response, or control periods if they are more, by which an arm may be late or early."""

SPEED_ERROR = 0.01
"""Of the path, which an arm may go too far or not."""

SETTLED = 0.1
"""[s] For which a speed may have its tip late: five times the response of a slow arm."""

MEMORY = 1.0
"""Time constant [s] with which the model is drawn to where the arm is, so that errors of speed do not add up: a
push that grows by less than `SHARE` of the limit in this time is not found."""


@dataclass(frozen=True, slots=True)
class PositionServo:
    """A critically damped position servo, alike in all directions.

    Attributes:
        stiffness: K, with which it holds the tip [N/m].
        response: 2 / w, how long it takes to follow [s].
        lag: How far it runs behind a ramp [s]: `response`, or less where velocity is fed forward.
    """

    stiffness: float
    response: float
    lag: float

    def __post_init__(self) -> None:
        positive("stiffness", self.stiffness, "N/m")
        positive("response", self.response, "s")
        not_negative("lag", self.lag, "s")

    def following(self, limit: float) -> FollowingMaker:
        """Return what compares commands with motion under a force limit [N].

        An arm that measures force by itself needs no model: `ForceComparison` of the supervisor is closer.
        """

        def made(period: float, first: ArmSample) -> Following:
            plain = CommandedMotion(period, first)
            return plain if first.tip_force_base is not None else ServoFollowing(self, limit, period, plain, first)

        return made


class ServoFollowing:
    """Compares where a finger's tip is with where commands and felt force should have led it: a `Following`."""

    def __init__(
        self, servo: PositionServo, limit: float, period: float, plain: Following, first: ArmSample
    ) -> None:
        """Begin at rest, with the force limit [N], the control period [s], and what judges motion alone."""
        self._servo, self._allowed, self._plain = servo, SHARE * limit / servo.stiffness, plain
        self._axes = tuple(_Axis(servo, x) for x in first.position_base_tip)
        self._felt: Vector = ZERO
        self._late = max(TIMING * servo.response, CYCLES * period)
        self._speed = self._path = 0.0

    def take(self, command: Command, before: Observation, after: Sample) -> None:
        """See `Following`."""
        self._plain.take(command, before, after)
        if len(before.fingers) != 1 or before.hand is not None:
            return
        (a, b, c), (d, e, f), (g, h, i) = before.arm.rotation_base_tip
        x, y, z, _, _, _ = before.fingers[0].wrench
        felt = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
        u, v, w = command.velocity_base_tip
        p, q, r = after.arm.position_base_tip
        time, (first, second, third) = after.time - before.time, self._axes
        forget, decay = min(1.0, time / MEMORY), first.decay(time)
        off = (
            first.off(time, decay, forget, u, felt[0], p),
            second.off(time, decay, forget, v, felt[1], q),
            third.off(time, decay, forget, w, felt[2], r),
        )
        k, m, n = self._felt  # by it the model was drawn aside, too
        k, m, n = k - forget * k, m - forget * m, n - forget * n
        self._felt = felt if math.hypot(*felt) >= math.hypot(k, m, n) else (k, m, n)
        speed, kept = math.hypot(u, v, w), self._speed * (1.0 - min(1.0, time / SETTLED))
        self._speed = kept if kept > speed else speed
        self._path += speed * time - forget * self._path
        allowed = self._allowed + self._late * self._speed + SPEED_ERROR * self._path
        if math.hypot(*off) > allowed:
            self._judge(off, felt, allowed)

    def _judge(self, off: Vector, felt: Vector, allowed: float) -> None:
        stiffness = self._servo.stiffness
        if _unexplained(stiffness, off, self._felt) > stiffness * allowed:
            raise FollowingError(
                f"the tip stands {1e3 * norm(off):.2g} mm beside where commands and felt force lead it, as if "
                f"pushed with {stiffness * norm(off):.3g} N that its sensor does not feel (it shows "
                f"{norm(felt):.3g} N); the limit is {stiffness * allowed:.3g} N; check the fingertip's sensor, "
                "and stiffness_N_per_m, response_s and lag_s of the arm in the robot file"
            )


class _Axis:
    """A servo's model along one axis of the base frame."""

    def __init__(self, servo: PositionServo, position: float) -> None:
        self._rate, self._compliance = 2.0 / servo.response, 1.0 / servo.stiffness
        self._lead = max(0.0, servo.response - servo.lag)
        self._reference = self._position = position
        self._velocity = 0.0

    def decay(self, time: float) -> float:
        """Return by how much a deviation shrinks in a time [s]."""
        return math.exp(-self._rate * time)

    def off(
        self, time: float, decay: float, forget: float, commanded: float, felt: float, position: float
    ) -> float:
        """Move the model on by a time [s]; return where the tip is from it [m]."""
        v, turned = self._velocity, self._rate * time
        goal = (
            self._reference + (0.5 * time + self._lead) * commanded + self._compliance * felt
        )  # the period's mean
        y = self._position - goal
        self._velocity = decay * (v - turned * (v + self._rate * y))
        modelled = goal + decay * (y + turned * y + time * v)
        off = position - modelled
        self._position = modelled + forget * off
        self._reference += time * commanded + forget * off
        return off


def _unexplained(stiffness: float, off: Vector, felt: Vector) -> float:
    """What an arm gives way by that differences of its stiffness do not explain, as a force [N]."""
    feels = norm(felt)
    along = abs(dot(off, felt)) / feels if feels > 0.0 else 0.0
    across = math.sqrt(max(0.0, dot(off, off) - along * along))
    return math.hypot(max(0.0, stiffness * along - ALONG * feels), max(0.0, stiffness * across - ACROSS * feels))
