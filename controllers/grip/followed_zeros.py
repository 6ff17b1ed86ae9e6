"""Zeros that are found again in flight: from what is not touched, and from what rests.

A finger that touches nothing feels nothing: what it then shows is its zero, and the sensor counts as tared anew.

What a hand at rest holds at rest pulls as it did: weight and friction do not change by themselves. What then
changes no faster than zeros may wander is taken for their wander, and followed. Anything faster is a load; the
zero stays where it was found, and the time runs for which nobody has followed it. `Zeros.reserve` grows with that
time only, not with all that has passed since the tare.

The grip is no part of this: its command goes on, and gears rub. What changes along the normal is compared with the
command; while it rests the grip does not correct its command by what it feels, so that an error there moves
nothing. Stability: the command then follows from tangential loads alone, and what is followed of them is followed
by at most `QUICKER` times the wander, towards what was held when the rest began. Nothing that is commanded comes
back.

Model: the true load of a hand at rest either stays, or changes faster than zeros wander. A load that grows more
slowly looks like a zero. But it grows at all fingers, in the direction in which it pulls, and zeros wander
as they like: `hidden` is the share by which the load has grown at the finger where it grew least, if all that was
followed was load. The cautious one of both is held. What this cannot tell: a load that grows slowly at one finger
while another's zero wanders against it by as much. Slip is heard then (`palpate.controllers.grip.slip_hearing`).
"""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.controllers.grip.zero_wander import TipOnSensor, ZeroWander
from palpate.errors import FloatArray, positive
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import FingerObservation, Observation
from palpate.sensing.contact import Contact, ContactStatus
from palpate.sensing.ft.touch_detector import ContactDetector
from palpate.sensing.solver import Solver, Surface
from palpate.spatial import Wrench, norm

SHORTEST, LONGEST = 0.1, 0.2
"""[s] Over which is averaged: between these, for as long as makes noise and wander weigh alike. Of 10 mN of noise
at 1 kHz 1 and 0.7 mN are left. Twice that, at least, passes before a rest is known as one."""

ROUNDING = 1e-6
"""Of a number of steps."""

STAIR = 0.5
"""[s] In such steps the reserve grows with the time that nobody followed the zeros: a command that rises all the
time never rests."""

SIGMAS = 5.0
"""Of the difference of two such means, above which something has changed: by chance 0.04 times in ten minutes, of
twelve axes."""

QUICKER = 2.0
"""Times the wander of a block by which a mean may be off, and is followed: noise takes the other half."""

UNEVEN = 0.15
"""[N] By which a normal force may be off its command while all rests, beside what gears hold of a change."""

SETTLED = 0.06
"""[N] By which it may be when a rest begins: where a grip was let down, it goes on sinking by more."""

AT_REST = 1e-3
"""[m/s] A hand that is slower stands."""

NOTHING: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

OK = ContactStatus.OK
"""Looked up once."""

FELT = 0.05
"""[N] A tangential load below that has no direction."""


@dataclass(frozen=True, slots=True, eq=False)
class _Held:
    """Means over a block.

    Attributes:
        wrenches: That fingers feel beyond their zeros, sensor frames, shape (k, 6) [N, N m].
        pressed: With which they were told to press [N].
    """

    wrenches: FloatArray
    pressed: FloatArray


class FollowedZeros:
    """See the module. `Zeros` of fingers that hold an object together."""

    def __init__(
        self,
        surfaces: Sequence[Surface],
        tip: TipOnSensor,
        wander: ZeroWander,
        noise: Wrench,
        period: float,
        touch_force: float = 0.2,
        release_force: float = 0.1,
    ) -> None:
        """Take what is known of the fingers.

        Args:
            surfaces: Of each fingertip, in the sensor frame.
            tip: Where it stands on the sensor.
            wander: How fast its zero may wander, at most.
            noise: Standard deviation of a reading of each axis [N, N m].
            period: Of control [s].
            touch_force: A force above this [N] is a touch,
            release_force: and it ends below this [N].
        """
        self._tip, self._wander = tip, wander
        self._solvers = tuple(Solver(surface) for surface in surfaces)
        self._unpressed = (0.0,) * len(self._solvers)
        self._count = max(round(_block(wander, noise, positive("period", period, "s")) / period), 1)
        self._span = self._count * period
        self._step = np.array(wander.within(self._span))
        self._chance = SIGMAS * math.sqrt(2.0 / self._count) * np.array(noise)
        # moments are weighed against forces by the lever at which a contact exerts both
        lever = tip.radius + norm(tip.center)
        self._weight = np.array([1.0, 1.0, 1.0, *[1.0 / lever] * 3])
        self._detectors = tuple(
            ContactDetector(touch_force=touch_force, release_force=release_force, noise=0.0, period=period)
            for _ in surfaces
        )
        self.start()

    def start(self) -> None:
        """See `Zeros`."""
        n = len(self._solvers)
        self.unseen = 0.0
        """[s] For which zeros have wandered since the tare and were not followed."""
        self.resting, self.hidden = False, 0.0
        self._zero = np.zeros((n, 6))
        self._given: list[Wrench] = [NOTHING] * n
        self._reserved: tuple[LimitSurface | None, float, float] = (None, 0.0, 0.0)
        self._tared = self._zero
        self._kept: _Held | None = None
        self._before: _Held | None = None
        self._free = self._held = self._still = self._healthy = True
        for detector in self._detectors:
            detector.restart()
        self._begin()

    def reserve(self, surface: LimitSurface) -> float:
        """See `Zeros`."""
        steps = math.ceil(self.unseen / STAIR - ROUNDING)
        known, at, reserve = self._reserved
        if surface is not known or steps != at:  # asked for several times a period, and the same for long
            reserve = self._wander.reserve(surface, self._tip, STAIR * steps)
            self._reserved = (surface, steps, reserve)
        return reserve

    def step(self, now: Observation, forces: tuple[float, ...]) -> Observation:
        """See `Zeros`."""
        seen = tuple([self._beyond(i, finger) for i, finger in enumerate(now.fingers)])
        for finger in seen:
            self._free, self._held = self._free and not finger.touching, self._held and finger.touching
            self._healthy = self._healthy and finger.health.ok
        self._still = self._still and norm(now.arm.velocity_base_tip) < AT_REST
        for finger in now.fingers:
            self._felt.extend(finger.wrench)
        self._pressed.extend(forces or self._unpressed)
        self._taken += 1
        if self._taken == self._count:
            n, k = self._count, len(self._solvers)
            felt, pressed = np.array(self._felt).reshape(n, k, 6), np.array(self._pressed).reshape(n, k)
            self._follow(felt.sum(axis=0) / n, pressed.sum(axis=0) / n)
            self._begin()
        return Observation(now.time, now.arm, seen, now.hand)

    def _begin(self) -> None:
        """The next block."""
        self._felt, self._pressed = array("d"), array("d")
        self._taken, self._free, self._held, self._still, self._healthy = 0, True, True, True, True

    def _beyond(self, i: int, finger: FingerObservation) -> FingerObservation:
        """What a finger feels beyond its zero."""
        wrench, contact, zero = finger.wrench, finger.contact, self._given[i]
        if zero != NOTHING:
            a, b, c, d, e, f = wrench
            p, q, r, s, t, u = zero
            wrench = (a - p, b - q, c - r, d - s, e - t, f - u)
            contact = self._solvers[i](np.array(wrench))
        touching = self._detectors[i].step(norm(wrench[:3])) and contact.status is OK
        return FingerObservation(finger.time, wrench, contact, touching, finger.health)

    def _follow(self, felt: FloatArray, pressed: FloatArray) -> None:
        """Take the means of a block."""
        if self._healthy and self._free:
            self._tare(felt)
        elif self._healthy and self._held and self._still:
            self._rest(_Held(felt - self._zero, pressed))
        else:
            self._move_on(None)

    def _tare(self, felt: FloatArray) -> None:
        """Nothing is touched: what is felt is the zero, as far as it can be."""
        wandered = self._wander.within(self.unseen + self._span)
        near = np.abs(felt - self._zero) <= QUICKER * np.array(wandered) + self._chance
        self._move_on(None)
        if near.all():
            self._set(felt)
            self._tared, self.unseen, self.hidden = self._zero, 0.0, 0.0

    def _rest(self, now: "_Held") -> None:
        """Compare what is held with what was held before, beyond the zeros known so far."""
        known = self._kept or self._before
        if known is None or not self._follows(now, known):
            self._move_on(now)
        elif self._kept is None:
            self._kept, self.resting = now, True
            self.unseen += self._span

    def _follows(self, now: "_Held", known: "_Held") -> bool:
        """Whether no more has changed than zeros wander, and what was commanded; if at rest, follow that."""
        along, told = self._along(known.wrenches), now.pressed - known.pressed
        off = now.wrenches - known.wrenches - told[:, None] * along
        weighted = along * self._weight
        of_grip = np.sum(off * self._weight * weighted, axis=1) / np.sum(weighted * weighted, axis=1)
        beside = off - of_grip[:, None] * along
        most = QUICKER * self._step
        allowed = most + self._chance
        # gears may follow a command, or hold as they are
        of_grip = of_grip - np.clip(of_grip, np.minimum(-told, 0.0), np.maximum(-told, 0.0))
        uneven = (UNEVEN if self.resting else SETTLED) + allowed[0]
        if (np.abs(of_grip) > uneven).any() or (np.abs(beside) > allowed).any():
            return False
        if self.resting:
            # apart: a grip that swings by more than zeros wander must not hide what wanders beside it
            grip = np.clip(of_grip, -most[0], most[0])
            self._set(self._zero + np.clip(beside, -most, most) + grip[:, None] * along)
            self.hidden = self._grown(now.wrenches)
        return True

    def _along(self, wrenches: FloatArray) -> FloatArray:
        """By how much more each finger feels for 1 N of normal force, shape (k, 6) [1, m]."""
        contacts = self._contacts(wrenches)
        rows = [[*-each.normal, *-np.cross(each.centroid, each.normal)] for each in contacts]
        return np.array(rows)

    def _contacts(self, wrenches: FloatArray) -> list[Contact]:
        return [solve(each) for solve, each in zip(self._solvers, wrenches, strict=True)]

    def _grown(self, wrenches: FloatArray) -> float:
        """Share by which the load has grown where it grew least, if all that was followed was load."""
        least = math.inf
        for contact, moved in zip(self._contacts(wrenches), self._zero - self._tared, strict=True):
            load = contact.tangential_force
            size = norm(tuple(load.tolist()))
            if not size > FELT:
                return 0.0
            least = min(least, float(load @ moved[:3]) / size**2)
        return max(least, 0.0)

    def _move_on(self, held: "_Held | None") -> None:
        """Something moves: nobody follows the zeros."""
        self.resting, self._kept, self._before = False, None, held
        self.unseen += self._span

    def _set(self, zero: FloatArray) -> None:
        self._zero = zero
        self._given = [(a, b, c, d, e, f) for a, b, c, d, e, f in zero.tolist()]


def _block(wander: ZeroWander, noise: Wrench, period: float) -> float:
    """Over how long is averaged [s]: SIGMAS noise sqrt(2 period / T) = QUICKER wander T."""
    rates = wander.within(1.0)
    times = [
        (SIGMAS * sd * math.sqrt(2.0 * period) / (QUICKER * rate)) ** (2.0 / 3.0)
        for sd, rate in zip(noise, rates, strict=True)
        if rate > 0.0
    ]
    return min(max(min(times, default=LONGEST), SHORTEST), LONGEST)
