"""mu of one load from strokes there and back.

In full slip the force on the finger lies on the friction cone, at atan(mu) from the normal, and by reversal on
the opposite side of it. So the two forces enclose twice that angle and the normal bisects it, whatever the normal
forces were: neither the sensor's origin, nor its tilt, nor the fingertip's shape comes in.

On a curved surface means are taken over the stretch that both strokes rubbed, as normals differ elsewhere. Strokes
there should be shorter than 0.3 mu times its radius: the turning normal looks like something that yields, and
longer ones end as a mere bound.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction.rubbing.bend import NormalAlongLine, bend_of
from palpate.friction.rubbing.estimate import Estimate, SensorErrors
from palpate.friction.rubbing.slip_test import Resistance, SlipEvidence, ends_level, slip_evidence
from palpate.friction.rubbing.stick_slip import MIN_TURNS, StickSlip, stick_slip
from palpate.friction.rubbing.stroke import MIN_SAMPLES, RubbingStroke, TwoWay, batch_means, steady_part
from palpate.friction.rubbing.uniformity import FrictionProfile, profile_of

SETTLING = 0.1
"""How long a motion's transients last [s]: five times the lag of a servo of 100 rad/s."""

LATEST_SLIP = 0.15
"""Share of a stroke's steady part within which slip has begun, if it counts as slip: a resistance that turns from
-mu to mu over a share x of it, and stays, rises by (3 x - 2 x^2) / (1 - x), and more than 0.15 for x > 0.05; twice
that share if the other stroke slips at once. The rest is for noise."""

SEEN_RISE = 2.0
"""By how many of its standard deviations a rise must lie above 0 for the share before that to be left out."""

LATE_SHARES = (LATEST_SLIP, 2.0 * LATEST_SLIP)
"""Of a motion's steady part, how much of its beginning is left out where the resistance still rises: slip that is
seen with little doubt begins within the first, with noise or a kink within the second (0.19 was seen)."""

STUCK_SHARE = 0.4
"""Standard deviation of the kinetic mu in stick-slip, over how far the static one lies above the mean: of a
sawtooth the mean is the kinetic one, or 1 to 5 % more, as a prototype found; where the friction plant chatters, it
was seen to be off by 0.65 of that."""

STRETCHES = 10
"""Of a stroke, over which loads are averaged to see what was borne: noise is down by 5 at 500 Hz, and 10 % of the
travel is lost."""


@dataclass(frozen=True, slots=True, eq=False)
class FrictionMeasured:
    """Friction measured by strokes there and back, at one load and speed.

    Attributes:
        friction: mu in slip; the kinetic one where it sticks and slips.
        turns: How it stuck and slipped, None if it did not.
        normal: Out of the finger into the object, base coordinates, shape (3,).
        normal_force: Mean [N].
        speed: Of the slip, mean [m/s].
        evidence: That it slipped.
        bend: How the normal turns along the strokes.
        time: In the middle of the strokes [s].
        profiles: mu along each of them.
    """

    friction: Estimate
    turns: StickSlip | None
    normal: FloatArray
    normal_force: float
    speed: float
    evidence: SlipEvidence
    bend: NormalAlongLine
    time: float = 0.0
    profiles: tuple[FrictionProfile, ...] = ()

    def normal_at(self, place: FloatArray) -> FloatArray:
        """Return the normal at a place near the strokes, base coordinates [m], shape (3,)."""
        return self.bend.normal_at(self.normal, place)

    @property
    def stick_slip(self) -> bool:
        """Whether it stuck and slipped by turns."""
        return self.turns is not None and self.turns.times >= MIN_TURNS

    @property
    def static_friction(self) -> float | None:
        """Static mu, at which slip begins, as stick-slip shows it; None otherwise."""
        return self.turns.ratio if self.turns is not None and self.stick_slip else None


@dataclass(frozen=True, slots=True, eq=False)
class FrictionBound:
    """Bound on friction from strokes that never slipped.

    Attributes:
        least_friction: mu is at least this.
        normal: As well as such strokes tell it, base coordinates, shape (3,).
        normal_force: Mean [N].
        evidence: Why this counts as no slip.
        partly: Whether a motion or more still ended in slip: too short, or in one direction only, to measure mu.
    """

    least_friction: float
    normal: FloatArray
    normal_force: float
    evidence: SlipEvidence
    partly: bool = False


def measure_friction(
    strokes: Sequence[TwoWay], errors: SensorErrors | None = None, settling: float = SETTLING
) -> FrictionMeasured | FrictionBound:
    """Return mu, or a lower bound if the finger never slipped.

    One stroke there and back of 10 mm in half a second each is enough; more, taken by turns, average noise and
    cancel a steady drift if every second pair starts back. One speed does not show creep: see
    `palpate.friction.rubbing.speed_curve`.

    Args:
        strokes: Without turning, all at one load and one speed.
        errors: Of the sensor; those of the Nano17 class if not given.
        settling: How long transients last, the sensor's filter and delay included [s].

    Raises:
        InvalidValueError: There are none, or one is too short or does not reverse the other.
    """
    if not strokes:
        raise InvalidValueError("0 strokes: must be at least one there and one back")
    errors = errors or SensorErrors()
    pairs = [_rubbed(pair, settling) for pair in strokes]
    normal, resistances = _resistances(pairs)
    evidence = slip_evidence(resistances)
    rising = evidence.rise > SEEN_RISE * evidence.uncertainty
    if evidence.slipped and rising and min(len(each.travel) for each in resistances) >= 2 * MIN_SAMPLES:
        # at either end one of the two did not slip yet: the mean is to be of slip alone
        pairs = [_rubbed(pair, settling, LATEST_SLIP) for pair in strokes]
        normal, resistances = _resistances(pairs)
    normal_force = float(np.mean([pair.normal_force for pair in pairs]))
    if not evidence.slipped:
        least = least_friction([stroke.force for pair in strokes for stroke in pair.both], errors.force_noise)
        partly = any(ends_level(each) for each in resistances)
        return FrictionBound(least, normal, normal_force, evidence, partly)

    mu = float(np.mean([pair.friction for pair in pairs]))
    # half the sum of two independent means, over the pairs
    variances = [batch_means(each.ratio).var(axis=0, ddof=1) / 8.0 for each in resistances]
    noise = 0.5 * math.sqrt(float(np.sum(variances))) / len(pairs)
    # there, back, back, there cancels a steady drift: then these have both signs
    wait = float(np.mean([math.copysign(pair.wait, pair.direction @ pairs[0].direction) for pair in pairs]))
    turns = stick_slip(resistances, mu, errors.force_noise * math.hypot(1.0, mu) / normal_force)
    model = math.hypot(
        mu * errors.of_friction(normal_force),
        0.5 * errors.force_drift * wait / normal_force,
        # between sticking and slipping the mean lies somewhere from kinetic to static
        0.0 if turns is None else STUCK_SHARE * max(0.0, turns.ratio - mu),
    )
    return FrictionMeasured(
        Estimate(mu, noise, model, 7.0 * len(resistances)),
        turns,
        normal,
        normal_force,
        float(np.mean([pair.speed for pair in pairs])),
        evidence,
        bend_of(
            (pairs[0].there.contact, pairs[0].back.contact),
            (pairs[0].there.force, pairs[0].back.force),
            pairs[0].direction,
        ),
        float(np.mean([stroke.time.mean() for pair in strokes for stroke in pair.both])),
        tuple(pair.profile for pair in pairs),
    )


def least_friction(forces: Sequence[FloatArray], force_noise: float) -> float:
    """Return the least mu of a cone that holds all these forces, whatever its axis.

    tan of half the largest angle between any two of them, means of short stretches; three standard deviations of
    those are taken off.

    Args:
        forces: One array for each stroke, shape (n, 3) [N].
        force_noise: Standard deviation of one sample of a component [N].
    """
    means = np.concatenate([batch_means(each, STRETCHES) for each in forces])
    lengths = np.linalg.norm(means, axis=1)
    directions = means / lengths[:, None]
    shortest = min(len(each) for each in forces) // STRETCHES
    noise = force_noise * math.sqrt(2.0 / shortest) / float(lengths.min())  # of the angle between two
    angle = math.acos(max(-1.0, min(1.0, float((directions @ directions.T).min()))))
    return math.tan(0.5 * max(0.0, angle - 3.0 * noise))


@dataclass(frozen=True, slots=True, eq=False)
class _Rub:
    """The steady part of a stroke, as far as both directions rubbed there."""

    force: FloatArray
    contact: FloatArray
    travel: FloatArray
    direction: FloatArray
    speed: float


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    there: _Rub
    back: _Rub
    direction: FloatArray
    friction: float
    normal: FloatArray
    normal_force: float
    speed: float
    wait: float

    @property
    def profile(self) -> FrictionProfile:
        """Mu along it."""
        both = self.there, self.back
        places = tuple(rub.contact @ self.direction for rub in both)
        return profile_of((places[0], places[1]), (self.there.force, self.back.force), self.direction)


def _rubbed(pair: TwoWay, settling: float, left_out: float = 0.0) -> _Pair:
    """The stretch that both rubbed, but for a share of it at either end."""
    direction = _direction(pair.there)
    if float(direction @ _direction(pair.back)) > -0.9:
        raise InvalidValueError("the second stroke does not reverse the first: must go back along the same path")
    places = [stroke.position @ direction for stroke in pair.both]
    parts = [
        steady_part(stroke.time, sign * (stroke.contact_velocity @ direction), settling)
        for stroke, sign in zip(pair.both, (1.0, -1.0), strict=True)
    ]
    low = max(float(place[part].min()) for place, part in zip(places, parts, strict=True))
    high = min(float(place[part].max()) for place, part in zip(places, parts, strict=True))
    low, high = low + left_out * (high - low), high - left_out * (high - low)
    there, back = (
        _kept(stroke, place, part, low, high, sign * direction)
        for stroke, place, part, sign in zip(pair.both, places, parts, (1.0, -1.0), strict=True)
    )
    a, b = there.force.mean(axis=0), back.force.mean(axis=0)
    u, v = _unit(a), _unit(b)
    # of the two halves of a rhombus: exact for small and for large angles
    half = math.atan2(float(np.linalg.norm(u - v)), float(np.linalg.norm(u + v)))
    normal = -_unit(u + v)
    wait = float(pair.back.time.mean() - pair.there.time.mean())
    pushing = -0.5 * float((a + b) @ normal)
    return _Pair(there, back, direction, math.tan(half), normal, pushing, 0.5 * (there.speed + back.speed), wait)


def _kept(
    stroke: RubbingStroke, place: FloatArray, part: slice, low: float, high: float, direction: FloatArray
) -> _Rub:
    start = place[0]
    inside = (place[part] >= low) & (place[part] <= high)
    if np.count_nonzero(inside) < MIN_SAMPLES:
        raise InvalidValueError(
            f"there and back have {np.count_nonzero(inside)} steady samples in common: must be at least "
            f"{MIN_SAMPLES}; go back over the same place, for longer"
        )
    velocity = stroke.contact_velocity[part][inside]
    return _Rub(
        stroke.force[part][inside],
        stroke.contact[part][inside],
        np.abs(place[part][inside] - start),
        direction,
        float((velocity @ direction).mean()),
    )


def _resistances(pairs: Sequence[_Pair]) -> tuple[FloatArray, list[Resistance]]:
    """The normal of all pairs together, and what resisted every stroke."""
    normal = _unit(np.sum([pair.normal for pair in pairs], axis=0))
    return normal, [_resistance(rub, normal) for pair in pairs for rub in (pair.there, pair.back)]


def _resistance(rub: _Rub, normal: FloatArray) -> Resistance:
    along = _unit(rub.direction - float(rub.direction @ normal) * normal)
    return Resistance(rub.travel, (rub.force @ along) / (rub.force @ normal))


def _direction(stroke: RubbingStroke) -> FloatArray:
    velocity = stroke.contact_velocity
    mean = velocity.mean(axis=0)
    if not np.any(mean):
        raise InvalidValueError("the finger does not move in this stroke: must be a motion in one direction")
    return _unit(mean)


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
