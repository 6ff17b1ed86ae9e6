"""A survey of an unknown limit surface: rubs at several loads and speeds, twists, and both at once.

At every load the finger rubs there and back, then turns there and back, as fast as a slip of the same speed asks
for once e is roughly known. At one load it rubs at other speeds, too, at that of the twists' slip if it
is not between these, and in other directions. If exponents are wanted, slips follow that slide and turn at once
(`palpate.friction.rubbing.stroke_plan`). What seems only to yield is rubbed again, twice as far each time, until
it slips or as far as it may: then what was borne is a lower bound, and nothing is made of it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from palpate.controllers.rubs import RAMP, Rub, RubMeasurement
from palpate.errors import InvalidValueError, check_positive, not_negative, positive
from palpate.friction.rubbing.slip_test import LARGEST_RISE
from palpate.friction.rubbing.stroke_plan import MIN_LOAD_SPAN, MIN_SLIPS, planned_slips

MIN_DURATION = 0.5
"""Least duration of one direction of a rub [s]: transients take 0.1 s of it, noise of 10 mN averages to 1 mN in
the rest."""

MIN_SPIN = 0.2
"""[rad/s]: nothing is turned more slowly, or a twist of 0.5 s winds up and does not slip."""

NEAR, APART = 1.02, 2.2
"""Strokes are done at the slip speed of twists unless one is within the first factor of it, or two, that lie no
farther apart than the second, have it between them: mu on a Stribeck curve falls by up to 0.4 per ln v."""

AIM, BELOW, CRUDE, MOST_STROKES = 0.88, 1.2, 1.04, 3
"""Stroke over the slip speed of a twist that is slower than others, and the inverse of one that is faster: where
mu falls with the speed, e by mu of other strokes is wrong; of that 0.4 at most is left from stroke
to stroke. One that is slower by less than the second is near enough beside a faster one, and by more than the
third surely slower."""

RAMPS = 3.0
"""Of a motion, that it lasts at least: a third of it is steady."""

HEADINGS = (math.pi / 3.0, 2.0 * math.pi / 3.0)
"""Of strokes at the middle load beside the usual direction [rad]: three directions 60 degrees apart tell both axes
of an ellipse of friction, whichever way they lie."""

FARTHER = 0.012
"""How far those go [m]: places that no other stroke at their speed comes to."""

FIRST_SHARE = 0.5
"""Of the angle, that the shortest twist takes of it at most: what only yields is turned twice as far."""

MAX_DURATION = 5.0
"""Longest duration of one direction of a rub [s]: a slower one takes too long to reach slip."""


@dataclass(frozen=True, slots=True)
class SurveyWanted:
    """Parameters of a survey of a surface.

    Attributes:
        loads: Normal forces, rising [N].
        speed: Slip speed of strokes, and of twists as far as the tip turns fast enough [m/s].
        speeds: Others at which strokes tell mu [m/s].
        travel: Least travel of a stroke [m].
        most_travel: How far a stroke may go at most [m].
        most_spin: How fast the tip may turn [rad/s]; 0: it cannot.
        most_angle: How far it may turn in one direction [rad].
        repeats: How often each stroke and twist is done.
        exponent_slips: How many slips there and back tell the exponents; 0: none.
        angular_acceleration: With which the robot can begin to turn [rad/s^2].
    """

    loads: tuple[float, ...]
    speed: float
    speeds: tuple[float, ...] = ()
    travel: float = 0.004
    most_travel: float = 0.02
    most_spin: float = 2.0
    most_angle: float = 1.5
    repeats: int = 1
    exponent_slips: int = 0
    angular_acceleration: float = math.inf

    def __post_init__(self) -> None:
        if not self.loads or list(self.loads) != sorted(set(self.loads)):
            raise InvalidValueError(f"loads = {self.loads}: must be one force or more, each above the one before")
        for load in self.loads:
            positive("load", load, "N")
        for speed in (self.speed, *self.speeds):
            positive("speed", speed, "m/s")
            if self.stroke(self.loads[0], speed).travel > self.most_travel * (1.0 + 1e-9):
                raise InvalidValueError(
                    f"speed = {speed:g} m/s: in {MIN_DURATION:g} s it goes "
                    f"{self.stroke(1.0, speed).travel:.3g} m, the most here is {self.most_travel:.3g} m; "
                    "rub more slowly"
                )
        check_positive(self, travel="m", most_travel="m", most_angle="rad")
        not_negative("most_spin", self.most_spin, "rad/s")
        positive("angular_acceleration", self.angular_acceleration, "rad/s^2", infinite_allowed=True)
        if self.repeats < 1:
            raise InvalidValueError(f"repeats = {self.repeats}: must be at least 1")
        if self.exponent_slips and self.exponent_slips < MIN_SLIPS:
            raise InvalidValueError(
                f"exponent_slips = {self.exponent_slips}: must be 0, or at least {MIN_SLIPS}, three per load"
            )

    @property
    def fastest_spin(self) -> float:
        """How fast to turn at most [rad/s]: half of the shortest rub must stay within the angle."""
        # in RAMPS ramps it turns by (RAMPS - 1) spin^2 / acceleration
        soon = math.sqrt(FIRST_SHARE * self.most_angle * self.angular_acceleration / (RAMPS - 1.0))
        in_time = self.angular_acceleration * MAX_DURATION / RAMPS
        return min(self.most_spin, self.most_angle / (MIN_DURATION - RAMP), soon, in_time)

    def stroke(self, load: float, speed: float) -> Rub:
        """Return a stroke of the least travel, or duration."""
        shape = Rub(load, speed, 0.0, MAX_DURATION)
        wanted = self.travel / speed + shape.ramp
        return replace(shape, duration=min(max(MIN_DURATION, RAMPS * shape.ramp, wanted), MAX_DURATION))

    def aside(self, load: float, heading: float) -> Rub:
        """Return a stroke in another direction, to other places."""
        usual = self.stroke(load, self.speed)
        farther = min(FARTHER, self.most_travel) / self.speed + usual.ramp
        return replace(usual, duration=max(usual.duration, min(farther, MAX_DURATION)), heading=heading)

    def twist(self, load: float, spin: float) -> Rub:
        """Return a twist of the least angle, or duration."""
        shape = Rub(load, 0.0, spin, MAX_DURATION, self.angular_acceleration)
        wanted = min(0.5, self.most_angle) / abs(spin) + shape.ramp
        return replace(shape, duration=min(max(MIN_DURATION, RAMPS * shape.ramp, wanted), MAX_DURATION))

    @property
    def expected_duration(self) -> float:
        """About how long all of it takes [s], if everything slips."""
        pause = 0.2
        strokes = [self.stroke(load, self.speed) for load in self.loads]
        middle = self.loads[len(self.loads) // 2]
        strokes += [self.aside(middle, heading) for heading in HEADINGS]
        durations = [stroke.duration for stroke in strokes] + [
            self.stroke(self.loads[0], speed).duration for speed in self.speeds if speed != self.speed
        ]
        twists = 2 * len(self.loads) if self.most_spin else 0
        turning = self.twist(self.loads[0], self.fastest_spin).duration if self.most_spin else MIN_DURATION
        return (
            2.0 * self.repeats * (sum(durations) + len(durations) * pause + twists * (turning + pause))
            + 2.0 * self.exponent_slips * (turning + pause)
            + 1.5 * len(self.loads)
        )


class Survey:
    """Asks for the rubs of a survey, one by one.

    Attributes:
        stuck_sliding: Loads at which strokes never seemed to slip, however far they went [N].
        stuck_turning: Likewise twists.
        exponents_measured: Whether slips for the exponents were done, if they were wanted; for that it must slip
            in both directions at two loads.
    """

    def __init__(self, wanted: SurveyWanted) -> None:
        """Take what is wanted."""
        self._wanted = wanted
        self.start()

    def start(self) -> None:
        """See `RubProgram`."""
        self.stuck_sliding: list[float] = []
        self.stuck_turning: list[float] = []
        self.exponents_measured = True
        self._felt: RubMeasurement | None = None
        self._frictions: dict[float, float] = {}
        self._lengths: dict[float, float] = {}
        self._turned: dict[float, float] = {}
        self._rubs = self._all()

    def next(self, felt: RubMeasurement | None) -> Rub | None:
        """See `RubProgram`."""
        self._felt = felt
        return next(self._rubs, None)

    def _all(self) -> Iterator[Rub]:
        wanted = self._wanted
        middle = wanted.loads[len(wanted.loads) // 2]
        for load in wanted.loads:
            yield from self._until_slip(wanted.stroke(load, wanted.speed), load)
            if wanted.most_spin > 0.0:
                yield from self._twists(load)
            if load == middle and load in self._frictions:
                yield from (wanted.aside(load, heading) for heading in HEADINGS)
            if load == middle:
                for speed in wanted.speeds:
                    if speed != wanted.speed:
                        yield from self._repeated(wanted.stroke(load, speed))
                yield from self._as_fast_as_twists(load)
        if wanted.exponent_slips:
            yield from self._exponents()

    def _repeated(self, rub: Rub, times: int | None = None) -> Iterator[Rub]:
        for _ in range(self._wanted.repeats if times is None else times):
            yield rub

    def _until_slip(self, rub: Rub, load: float) -> Iterator[Rub]:
        """A stroke, farther and farther until it slips, then its repetitions."""
        while True:
            yield rub
            felt = self._felt
            if felt is not None and felt.rise < LARGEST_RISE:
                self._frictions[load] = felt.friction
                break
            longer = min(self._wanted.most_travel / rub.speed + rub.ramp, 2.0 * rub.duration)
            if longer <= 1.01 * rub.duration:
                self.stuck_sliding.append(load)
                return
            rub = replace(rub, duration=longer)
        yield from self._repeated(rub, self._wanted.repeats - 1)

    def _twists(self, load: float) -> Iterator[Rub]:
        spin, wanted = self._spin(load), self._wanted
        self._turned[load] = spin
        rub = wanted.twist(load, spin)
        while True:
            # in the opposite sense first in every second one: a steady drift then cancels
            yield rub
            first = self._felt
            yield replace(rub, spin=-rub.spin)
            felt = self._felt
            if felt is not None and first is not None and max(felt.rise, first.rise) < LARGEST_RISE:
                if load in self._frictions and self._frictions[load] > 0.0:
                    self._lengths[load] = 0.5 * (felt.torque_ratio + first.torque_ratio) / self._frictions[load]
                break
            longer = min(wanted.most_angle / abs(rub.spin) + rub.ramp, 2.0 * rub.duration)
            if longer <= 1.01 * rub.duration:
                self.stuck_turning.append(load)
                return
            rub = replace(rub, duration=longer)
        for _ in range(wanted.repeats - 1):
            yield rub
            yield replace(rub, spin=-rub.spin)

    def _as_fast_as_twists(self, load: float) -> Iterator[Rub]:
        """Strokes at the slip speeds of twists so far, where others do not tell mu there: it may be another."""
        wanted = self._wanted
        done = [wanted.speed, *wanted.speeds]
        for each in sorted(self._lengths, key=lambda one: self._turned[one] * self._lengths[one]):
            torque_speed = self._turned[each] * self._lengths[each] * self._frictions[each]
            speed, near = torque_speed / self._frictions[each], NEAR
            for _ in range(MOST_STROKES):
                slower = max((one for one in done if one <= near * speed), default=0.0)
                faster = min((one for one in done if one >= speed / near), default=math.inf)
                if faster <= APART * slower or slower * BELOW >= speed <= max(done):
                    break
                rub = wanted.stroke(load, speed * AIM if speed < wanted.speed else speed / AIM)
                if rub.travel > wanted.most_travel or any(abs(rub.speed / one - 1.0) < NEAR - 1.0 for one in done):
                    break
                done.append(rub.speed)
                yield from self._repeated(rub)
                if self._felt is None or self._felt.friction <= 0.0:
                    break
                # e by mu as it is there
                speed, near = torque_speed / self._felt.friction, 1.0 / CRUDE

    def _spin(self, load: float) -> float:
        """How fast to turn [rad/s]: so that it slips about as fast as strokes do."""
        most = self._wanted.fastest_spin
        if not self._lengths:
            return most
        nearest = min(self._lengths, key=lambda other: abs(other - load))
        return min(most, max(MIN_SPIN, self._wanted.speed / self._lengths[nearest]))

    def _exponents(self) -> Iterator[Rub]:
        wanted, lengths = self._wanted, self._lengths
        low, high = wanted.loads[0], wanted.loads[-1]
        if low not in lengths or high not in lengths or high < MIN_LOAD_SPAN * low:
            self.exponents_measured = False
            return
        # as fast as the tip can turn, but no faster than strokes
        speed = min(wanted.speed, wanted.fastest_spin * min(lengths[low], lengths[high]))
        slips = planned_slips((low, high), (lengths[low], lengths[high]), wanted.exponent_slips, speed)
        sense = 1.0
        for slip in sorted(slips, key=lambda slip: slip.normal_force):
            # the same sequence for slides and turns of either kind, and as far as a stroke of the survey; in
            # either sense by turns, for what a sensor makes of a sliding force as torque then changes sign
            spin, sense = sense * slip.spin, -sense if slip.speed * slip.spin else sense
            rub = Rub(slip.normal_force, slip.speed, spin, MAX_DURATION, wanted.angular_acceleration)
            yield replace(rub, duration=max(MIN_DURATION, RAMPS * rub.ramp))
