"""A nudge before lifting measures the limit surface of the contacts while the object still stands.

The fingers close lightly and move down a little: what the object stands on holds it, so that they slip along its
sides, and friction over grip is mu. Then they twist about the line through the contacts, there and back: half the
difference of both torques over mu f_n is e, whatever bias there is. What did not slip gives no number: the load
then goes on growing with the motion, and what was planned with before stays.

A tangential load that is left during the twist lowers the torque: with the elliptic limit surface (p = 2) it is
divided by sqrt(1 - (f_t / mu f_n)^2). For other exponents e comes out too small there, which is the safe side.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from palpate.controllers.grip.lift import LiftController
from palpate.errors import check_positive, positive
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.live import LiveParameters
from palpate.spatial import ZERO, Vector, cross, rotate, scale, unit

MAX_GROWTH = 0.05
"""Share by which the load may still grow from the third to the last quarter of a stroke that slips. Without slip a
spring of any stiffness that starts unloaded grows by 40 % (7/8 over 5/8)."""

FIRST_SHARE = 0.02
"""Share of a stroke that counts as its beginning: of 2 mm 40 um, a sixth of the deflection of a contact of 5
kN/m."""

MIN_CHANGE = 0.5
"""Share of a plateau by which the load must have changed since the stroke began: all of it where it began without
load, twice as much where it is turned round. A sensor that stands still shows plateaus, too."""

MAX_SLIDE_SHARE = 0.9
"""Of f_t / mu f_n during the twist: above, the torque says nothing."""


@dataclass(frozen=True, slots=True)
class NudgeParameters:
    """Parameters of a nudge.

    Attributes:
        grip: With which the fingers slip [N]. The twist's torque, 2 mu e f_n, must not tip the object over.
        settle_time: From the last finger's touch to the nudge, and between its parts [s].
        stroke: How far the fingers go down [m]; a few times the elastic travel mu f_n / K.
        speed: With which they do [m/s].
        angle: Of the twist, there and back [rad]; a few times the elastic one, mu f_n / K e.
        spin: With which they twist [rad/s].
        acceleration: With which stroke and twist begin and end, at most [m/s^2].
        angular_acceleration: Likewise [rad/s^2].
        close_time: By when all fingers must touch [s], as in `LiftParameters`; or it is LOST.
        axis: Along the line through the contacts, in the hand frame.
        center: A point on it, in the hand frame [m].
    """

    grip: float
    center: Vector
    axis: Vector = (1.0, 0.0, 0.0)
    settle_time: float = 0.3
    stroke: float = 0.002
    speed: float = 0.005
    angle: float = 0.3
    spin: float = 0.5
    acceleration: float = 0.2
    angular_acceleration: float = 20.0
    close_time: float = 15.0

    def __post_init__(self) -> None:
        check_positive(
            self,
            grip="N",
            settle_time="s",
            stroke="m",
            speed="m/s",
            angle="rad",
            spin="rad/s",
            acceleration="m/s^2",
            angular_acceleration="rad/s^2",
            close_time="s",
        )
        object.__setattr__(self, "axis", unit(self.axis))

    @property
    def duration(self) -> float:
        """From the last finger's touch until it is over [s]; a few periods of control longer."""
        down = Ramped(self.stroke, self.speed, self.acceleration)
        twist = Ramped(self.angle, self.spin, self.angular_acceleration)
        return 2.0 * self.settle_time + down.duration + 2.0 * twist.duration


class Ramped:
    """A motion over a distance, from rest to rest: up to speed, steady, and down, with one acceleration.

    Attributes:
        distance: [m or rad].
        corner: How long it takes to get up to speed, and down again [s].
        duration: Of all of it [s].
    """

    __slots__ = ("_acceleration", "corner", "distance", "duration")

    def __init__(self, distance: float, speed: float, acceleration: float) -> None:
        """Take the distance, and the largest speed and acceleration; a short motion does not reach the speed."""
        self.distance, self._acceleration = distance, acceleration
        self.corner = min(speed / acceleration, math.sqrt(distance / acceleration))
        self.duration = distance / (acceleration * self.corner) + self.corner

    def speed(self, time: float) -> float:
        """Return the speed at a time since it began [s]."""
        return self._acceleration * max(0.0, min(time, self.corner, self.duration - time))

    def progress(self, time: float) -> float:
        """Return the share of the distance covered at a time since it began [s]."""
        at = min(max(time, 0.0), self.duration)
        rising, falling = min(at, self.corner), max(0.0, at - (self.duration - self.corner))
        done = rising * (at - 0.5 * rising) - 0.5 * falling * falling
        return self._acceleration * done / self.distance


class NudgedSurface:
    """Limit surfaces measured by a nudge; before it, the worst case. A `SurfaceBelief`."""

    def __init__(self, cautious: LimitSurface) -> None:
        """Take the least that the contacts can bear."""
        self._cautious = cautious
        self._learned: dict[int, LimitSurface] = {}

    def start(self) -> None:
        """Forget what was learned."""
        self._learned.clear()

    def learn(self, finger: int, friction: float | None, spin_length: float | None) -> None:
        """Take what slipped; None where nothing did."""
        before = self._cautious
        self._learned[finger] = LimitSurface(
            friction or before.friction,
            spin_length or before.spin_length,
            before.load_exponent,
            before.norm_exponent,
        )

    def surface(self, finger: int) -> LimitSurface:
        """See `SurfaceBelief`."""
        return self._learned.get(finger, self._cautious)

    def watch(self, time: float, loads: Sequence[ContactLoad | None], onsets: Sequence[bool]) -> None:
        """It learns from nudges only."""


class _Part(Enum):
    CLOSE = "close"
    DOWN = "down"
    REST = "rest"
    THERE = "there"
    BACK = "back"
    DONE = "done"


class _Quarters:
    """Means over the beginning and the last two quarters of a stroke, of one finger."""

    __slots__ = ("_count", "_first", "_firsts", "_sum")

    def __init__(self) -> None:
        self._sum, self._count = [[0.0, 0.0], [0.0, 0.0]], [0, 0]
        self._first, self._firsts = 0.0, 0

    def take(self, progress: float, value: float, residual: float) -> None:
        """Take a sample at a share of the stroke."""
        if progress < FIRST_SHARE:
            self._first += value
            self._firsts += 1
        elif 0.5 <= progress < 1.0:
            quarter = int(progress >= 0.75)
            self._sum[quarter][0] += value
            self._sum[quarter][1] += residual
            self._count[quarter] += 1

    def plateau(self) -> tuple[float, float] | None:
        """Return the mean of both over the last quarter, or None if the first still grew, or never did."""
        if not all(self._count) or not self._firsts:
            return None
        (before, _), (last, residual) = ((a / n, b / n) for (a, b), n in zip(self._sum, self._count, strict=True))
        if abs(last) > (1.0 + MAX_GROWTH) * abs(before):
            return None
        return (last, residual) if abs(last - self._first / self._firsts) > MIN_CHANGE * abs(last) else None


class NudgeController:
    """Closes, nudges and reports the limit surfaces; then stands still and keeps the grip.

    Attributes:
        friction: mu per finger; None where nothing slipped.
        spin_length: e per finger [m]; None likewise.
        done: Whether it is over.
    """

    def __init__(self, fingers: int, period: float, parameters: NudgeParameters) -> None:
        """Take the number of fingers, the period of control [s], and how to nudge."""
        self._fingers, self._period, self._parameters = fingers, positive("period", period, "s"), parameters
        self._down = Ramped(parameters.stroke, parameters.speed, parameters.acceleration)
        self._twist = Ramped(parameters.angle, parameters.spin, parameters.angular_acceleration)
        self._part, self._since, self._began = _Part.CLOSE, 0.0, 0.0
        self.friction: tuple[float | None, ...] = ()
        self.spin_length: tuple[float | None, ...] = ()
        self._pulls: list[_Quarters] = []
        self._twists: dict[bool, list[_Quarters]] = {}
        self._reset()

    @property
    def done(self) -> bool:
        """Whether it is over."""
        return self._part is _Part.DONE

    def start(self, first: Observation) -> None:
        """Take the first observation."""
        self._reset()
        self._began = first.time
        self._go_on(_Part.CLOSE, first.time)

    def step(self, now: Observation) -> Command:
        """Return what hand and arm are to do during the next period."""
        p, gone = self._parameters, now.time - self._since
        grips, middle = (p.grip,) * self._fingers, 0.5 * self._period
        match self._part:
            case _Part.CLOSE:
                if not all(finger.touching for finger in now.fingers):
                    self._since = now.time
                    if now.time - self._began > p.close_time:
                        return Command(ZERO, Phase.LOST, grips)
                elif gone >= p.settle_time:
                    self._go_on(_Part.DOWN, now.time)
            case _Part.DOWN:
                self._feel(self._pulls, now, self._down.progress(gone))
                if gone < self._down.duration:
                    return Command((0.0, 0.0, -self._down.speed(gone + middle)), Phase.SETTLE, grips)
                self._go_on(_Part.REST, now.time)
            case _Part.REST:
                if gone >= p.settle_time:
                    self._go_on(_Part.THERE, now.time)
            case _Part.THERE | _Part.BACK:
                there = self._part is _Part.THERE
                self._feel(self._twists[there], now, self._twist.progress(gone))
                if gone < self._twist.duration:
                    spin = self._twist.speed(gone + middle)
                    return self._turning(now, spin if there else -spin, grips)
                self._go_on(_Part.BACK if there else _Part.DONE, now.time)
                if not there:
                    self._conclude()
            case _Part.DONE:
                pass
        return Command(ZERO, Phase.SETTLE, grips)

    def _turning(self, now: Observation, spin: float, grips: tuple[float, ...]) -> Command:
        rotation = now.arm.rotation_base_tip
        turn = scale(spin, rotate(rotation, self._parameters.axis))
        lever = scale(-1.0, rotate(rotation, self._parameters.center))
        return Command(cross(turn, lever), Phase.SETTLE, grips, turn)

    def _feel(self, quarters: list[_Quarters], now: Observation, progress: float) -> None:
        """Take what the fingers feel: friction over grip while they pull, torque over grip while they twist."""
        for finger, its in zip(now.fingers, quarters, strict=True):
            if not finger.believed:
                continue
            load = ContactLoad.of(finger.contact)
            if load.normal_force > 0.0:
                pull, twist = load.tangential_length / load.normal_force, load.spin_torque / load.normal_force
                its.take(progress, *((pull, twist) if quarters is self._pulls else (twist, pull)))

    def _conclude(self) -> None:
        friction: list[float | None] = []
        lengths: list[float | None] = []
        for pulls, there, back in zip(self._pulls, self._twists[True], self._twists[False], strict=True):
            pull, one, other = pulls.plateau(), there.plateau(), back.plateau()
            mu = None if pull is None else pull[0]
            friction.append(mu)
            if mu is None or one is None or other is None:
                lengths.append(None)
                continue
            left = max(abs(one[1]), abs(other[1])) / mu
            e = 0.5 * abs(one[0] - other[0]) / mu
            lengths.append(e / math.sqrt(1.0 - left * left) if left < MAX_SLIDE_SHARE else None)
        self.friction, self.spin_length = tuple(friction), tuple(lengths)

    def _reset(self) -> None:
        n = self._fingers
        self.friction = self.spin_length = (None,) * n
        self._pulls = [_Quarters() for _ in range(n)]
        self._twists = {there: [_Quarters() for _ in range(n)] for there in (True, False)}

    def _go_on(self, part: _Part, time: float) -> None:
        self._part, self._since = part, time


class NudgeAndLift:
    """Nudges, then lifts with the limit surfaces measured."""

    def __init__(self, nudge: NudgeController, belief: NudgedSurface, lift: LiftController) -> None:
        """Take the pieces; the lift's grip is planned with that very belief."""
        self._nudge, self._belief, self._lift = nudge, belief, lift
        self._learned = False

    @property
    def live(self) -> LiveParameters:
        """See `palpate.runtime.live.Tunable`."""
        return self._lift.live

    def start(self, first: Observation) -> None:
        """Take the first observation."""
        self._nudge.start(first)
        self._lift.start(first)
        self._learned = False

    def step(self, now: Observation) -> Command:
        """Return what hand and arm are to do during the next period."""
        if not self._nudge.done:
            return self._nudge.step(now)
        if not self._learned:
            for i, (mu, e) in enumerate(zip(self._nudge.friction, self._nudge.spin_length, strict=True)):
                self._belief.learn(i, mu, e)
            self._lift.start_later(now)
            self._learned = True
        return self._lift.step(now)
