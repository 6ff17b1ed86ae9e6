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
from palpate.spatial import ZERO, Vector, add, add_scaled, dot, norm, rotate, scale, subtract

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
class ServoModel:
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
    """Compares where one finger's tip is with where commands and felt force should have led it: a `Following`."""

    def __init__(self, servo: ServoModel, limit: float, period: float, plain: Following, first: ArmSample) -> None:
        """Begin at rest, with the force limit [N], the control period [s], and what judges motion alone."""
        self._servo, self._limit, self._plain = servo, limit, plain
        self._rate = 2.0 / servo.response
        self._lead = max(0.0, servo.response - servo.lag)
        self._reference = self._position = first.position_base_tip
        self._velocity: Vector = ZERO
        self._felt: Vector = ZERO
        self._late = max(TIMING * servo.response, CYCLES * period)
        self._speed = self._path = 0.0

    def take(self, command: Command, before: Observation, after: Sample) -> None:
        """See `Following`."""
        self._plain.take(command, before, after)
        if len(before.fingers) != 1 or before.hand is not None:
            return
        felt = rotate(before.arm.rotation_base_tip, before.fingers[0].force)
        off = self._off(command.velocity_base_tip, felt, after.arm.position_base_tip, after.time - before.time)
        stiffness = self._servo.stiffness
        allowed = SHARE * self._limit + stiffness * (self._late * self._speed + SPEED_ERROR * self._path)
        push = stiffness * norm(off)
        if push > allowed and _unexplained(stiffness, off, self._felt) > allowed:
            raise FollowingError(
                f"the tip stands {1e3 * norm(off):.2g} mm beside where commands and felt force lead it, as if "
                f"pushed with {push:.3g} N that its sensor does not feel (it shows {norm(felt):.3g} N); the limit "
                f"is {allowed:.3g} N; check the fingertip's sensor, and stiffness_N_per_m, response_s and lag_s "
                "of the arm in the robot file"
            )

    def _off(self, commanded: Vector, felt: Vector, position: Vector, time: float) -> Vector:
        """Move the model on by a time [s]; return where the tip is from it [m]."""
        rate, lead, stiffness = self._rate, self._lead, self._servo.stiffness
        decay, forget = math.exp(-rate * time), min(1.0, time / MEMORY)
        faded = scale(1.0 - forget, self._felt)  # by which the model was drawn aside, too
        self._felt = felt if dot(felt, felt) >= dot(faded, faded) else faded
        speed = norm(commanded)
        self._speed = max(speed, self._speed * (1.0 - min(1.0, time / SETTLED)))
        self._path += speed * time - forget * self._path
        goal = add(add_scaled(self._reference, 0.5 * time + lead, commanded), scale(1.0 / stiffness, felt))
        y, v = subtract(self._position, goal), self._velocity  # goal: the mean of this period
        modelled = add(goal, scale(decay, add_scaled(scale(1.0 + rate * time, y), time, v)))
        self._velocity = scale(decay, add_scaled(scale(1.0 - rate * time, v), -rate * rate * time, y))
        off = subtract(position, modelled)
        self._position = add_scaled(modelled, forget, off)
        self._reference = add_scaled(add_scaled(self._reference, time, commanded), forget, off)
        return off


def _unexplained(stiffness: float, off: Vector, felt: Vector) -> float:
    """What an arm gives way by that differences of its stiffness do not explain, as a force [N]."""
    feels = norm(felt)
    along = abs(dot(off, felt)) / feels if feels > 0.0 else 0.0
    across = math.sqrt(max(0.0, dot(off, off) - along * along))
    return math.hypot(max(0.0, stiffness * along - ALONG * feels), max(0.0, stiffness * across - ACROSS * feels))
