"""Slip heard by what the fingers feel together, and the friction that it shows.

A signal (`palpate.controllers.grip.slip_signals`) begins an episode. All contacts whose own load fell are then
taken to slip, or where none did the one that is nearest to its limit, and bear all that they can:
|(f_t, tau / e)| / f_n is their friction. What hung there before still hangs there.

A grip that is raised for it tells whether that was so: friction grows with the grip, a load that has gone away
does not. The episode ends when the load is borne again, or is refuted: it falls on while the grip rises, or is not
borne in time.
"""

import math
from collections import deque
from collections.abc import Sequence

from palpate.controllers.grip.hanging_load import HangingLoad, MeasuredLoad
from palpate.controllers.grip.slip_alarm import Signal
from palpate.controllers.grip.slip_bounded_surface import SlipBoundedSurface
from palpate.controllers.grip.slip_signals import SlipSignals
from palpate.errors import positive
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.recent_swing import REMEMBERED
from palpate.runtime.data import Observation

MEAN = 0.006
"""[s] Over which friction is averaged: a third of the 20 ms in which it is to be followed, six samples."""

OWN_FALL = 0.03
"""Share by which the load of a contact that slips has fallen: more than its part is known to."""

BORNE = 0.03
"""Share within which of what hung before the load is borne again."""

ANSWERED = 0.035
"""[s] From the alarm to when a raised grip is felt and friction falls no longer: 20 ms, and 15 of the servos."""

COMPARED = 0.015
"""[s] Over which load and grip are compared then."""

GRIP_ROSE, LOAD_FELL = 0.03, 0.03
"""Shares by which the grip must have risen and the load have fallen in that time, to refute it."""

LONGEST, STOPPED = 0.4, 0.15
"""[s] By when it must be borne, servos raising a grip by 15 N/s, and by when what is borne stands still again."""

STANDARD_GRAVITY, MOST_G = 9.80665, 0.5
"""[m/s^2] (CGPM 1901), and the share of it by which a hand may accelerate: more is an odd sample."""

SHOWS = 0.008
"""[s] For which a slip is listened to at least."""

SWINGS, LEAST_SWING, SWINGS_FOR = 0.5, 0.06, 2.0
"""Share of the fall, and of the load at least, by which a load that is held again must fall without slip to have
swung all the time, and [s] for which that is looked at."""

SWINGS_BACK, SETTLED = 0.2, 0.03
"""Share of what hung by which it hangs more, on average over so long [s] once the momentum is gone, if it swings:
what slid and stands still is borne, and no more."""

KNOWN = 10.0
"""Standard deviations that a load must hang by for its fall to say how much is missing."""

SHARES = 0.1
"""[s] Time constant with which each contact's part is followed."""

_Row = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


class SlipHearing:
    """Hears slip of what a hand holds, and teaches what it shows. One call of `step` per period.

    Attributes:
        slipping: Whether an episode goes on.
        missing: What hung before over what is felt now, 1 or above; 1 where nothing slips.
        signal: By what the last one was heard.
        refuted_at: When the last one was found to be none [s].
    """

    def __init__(
        self,
        surface: LimitSurface,
        belief: SlipBoundedSurface,
        period: float,
        load: HangingLoad,
        loads: int,
        fingers: int,
    ) -> None:
        """Take how torque is weighed against force, and what hangs.

        Args:
            surface: Only its e and exponents count.
            belief: Which is taught what slipping contacts show.
            period: Of control [s].
            load: Measures what hangs,
            loads: as so many loads.
            fingers: How many there are.
        """
        self._surface, self._belief, self._fingers = surface, belief, fingers
        self._period = positive("period", period, "s")
        self._load, self._signals = load, SlipSignals(fingers, loads, period)
        self._mean = deque[_Row](maxlen=max(round(MEAN / period), 1))
        self._past = deque[tuple[float, float]](maxlen=max(round(COMPARED / period), 1))
        self._speeds = deque[tuple[float, float]](maxlen=max(round(MEAN / period), 2))
        self._follow = -math.expm1(-period / SHARES)
        self._nowhere = (False,) * fingers
        self.start()

    @property
    def squeeze(self) -> tuple[float, ...] | None:
        """By how much each finger is to press more than before [N], to test what holds; None: no test."""
        return None if self.slipping else self._signals.squeeze

    def start(self) -> None:
        """A new grip begins."""
        self._signals.start()
        self._load.start()
        self.signal, self.refuted_at = Signal.FALL, -math.inf
        self._parts: tuple[float, ...] = ()
        self._speeds.clear()
        self._ended = math.inf
        self._hangs = False
        self._end()

    def step(
        self, now: Observation, loads: Sequence[ContactLoad | None], *, hanging: bool = True
    ) -> tuple[bool, ...]:
        """Return for each finger whether slip is first heard there in this period.

        Args:
            now: What is known.
            loads: Of it, one per finger, sensor frame; None where there is none to be believed.
            hanging: Whether nothing but the fingers bears the object.
        """
        felt = [load for load in loads if load is not None]
        if len(felt) < self._fingers or not hanging:
            if self._hangs:
                self._hangs = False
                self._restart()
                self._end()
            return self._nowhere
        self._hangs = True
        by = 1.0 / self._lifted_by(now)
        hangs = tuple([load.scaled(by) for load in self._load.measured(now, felt)])
        sizes = tuple([self._size(load) for load in felt])
        grips = tuple([load.normal_force for load in felt])
        self._mean.append((tuple([load.size for load in hangs]), sizes, grips))
        if self.slipping:
            for fall, load in zip(self._signals.falls, hangs, strict=True):
                fall.watch(load.size)
            onsets = self._heard()
            self._judge(now.time)
            return onsets
        ratios = tuple([size / grip if grip > 0.0 else 0.0 for size, grip in zip(sizes, grips, strict=True)])
        believed = [self._belief.believed.surface(i).friction for i in range(self._fingers)]
        shared = self._load.shared(now, felt)
        signal = self._signals.step(now.time, hangs, shared, ratios, grips, believed)
        if self._swings(now.time):
            if now.time < self._ended + SETTLED:
                for fall in self._signals.falls:
                    fall.swing.admit()
            self._ended, self.refuted_at = math.inf, now.time
            self._belief.forget()
        if signal is not None:
            self.signal = signal
            self._begin(now.time, hangs)
            return self._heard()
        before = self._parts or sizes
        follow = self._follow
        self._parts = tuple([a + follow * (b - a) for a, b in zip(before, sizes, strict=True)])
        return self._nowhere

    def _swings(self, time: float) -> bool:
        """Whether what fell and was held goes on to fall and rise, and so was no slip."""
        if self._ended < time < self._ended + SETTLED:
            self._impulse += (1.0 - self._borne()) * self._period
            return self._impulse < -SWINGS_BACK * SETTLED
        if not self._ended + REMEMBERED < time < self._ended + REMEMBERED + SWINGS_FOR:
            return False
        least = max(SWINGS * self._depth, LEAST_SWING)
        return any(
            fall.swing.size > max(least * hung, known)
            for fall, hung, known in zip(self._signals.falls, self._hung, self._heard_above, strict=True)
        )

    def _size(self, load: ContactLoad) -> float:
        """|(f_t, tau / e)| of a load [N]: what friction, times its normal force, must be."""
        surface = self._surface
        return surface.friction * surface.load_ratio(1.0, load.tangential_length, load.spin_torque)

    def _heard(self) -> tuple[bool, ...]:
        """Listen on; return which contacts are heard for the first time in this episode."""
        before = self._shown
        self._listen()
        return tuple(a == math.inf > b for a, b in zip(before, self._shown, strict=True))

    def _lifted_by(self, now: Observation) -> float:
        """Share of what hangs at rest that hangs while the hand accelerates: 1 + a / g."""
        self._speeds.append((now.time, now.arm.velocity_base_tip[2]))
        (began, before), (time, speed) = self._speeds[0], self._speeds[-1]
        if time == began:
            return 1.0
        return 1.0 + min(max((speed - before) / (time - began) / STANDARD_GRAVITY, -MOST_G), MOST_G)

    def _begin(self, time: float, loads: Sequence[MeasuredLoad]) -> None:
        self.slipping, self._began, self._caught = True, time, False
        self._impulse = 0.0
        self._depth, self._ended = 0.0, math.inf
        self._hung: tuple[float, ...] = tuple(fall.hung for fall in self._signals.falls)
        self._heard_above = tuple(KNOWN * load.deviation for load in loads)
        self._belief.keep()
        self._past.clear()

    def _restart(self) -> None:
        self._signals.restart()
        self._load.start()

    def _end(self) -> None:
        self.slipping, self.missing = False, 1.0
        self._shown = (math.inf,) * self._fingers
        self._mean.clear()

    def _averaged(self) -> list[list[float]]:
        """Mean of what hangs, of what each contact bears, and of the grips."""
        n = len(self._mean)
        return [
            [sum(values) / n for values in zip(*(each[k] for each in self._mean), strict=True)] for k in range(3)
        ]

    def _borne(self) -> float:
        """Share of what hung before borne, of the load that lacks most: an object may turn and not fall."""
        return min(
            load / hung if load > 0.0 and hung > least else 1.0
            for load, hung, least in zip(self._averaged()[0], self._hung, self._heard_above, strict=True)
        )

    def _listen(self) -> None:
        """What slips shows its friction."""
        _, sizes, grips = self._averaged()
        borne = self._borne()
        self.missing, self._depth = max(1.0 / borne, 1.0), max(self._depth, 1.0 - borne)
        self._past.append((borne, sum(grips)))
        if self._caught:
            return
        ratios = [size / grip if grip > 0.0 else math.inf for size, grip in zip(sizes, grips, strict=True)]
        fell = [size < (1.0 - OWN_FALL) * part for size, part in zip(sizes, self._parts, strict=True)]
        if not any(fell) and min(self._shown) == math.inf:
            near = [ratio / self._belief.surface(i).friction for i, ratio in enumerate(ratios)]
            fell[near.index(max(near))] = True
        self._shown = tuple(
            min(known, ratio) if its else known
            for known, ratio, its in zip(self._shown, ratios, fell, strict=True)
        )
        self._belief.show(self._shown, ratios)

    def _judge(self, time: float) -> None:
        """Whether it is over."""
        (borne, grip), (borne_before, grip_before) = self._past[-1], self._past[0]
        gone = time - self._began
        # of what was missing: the object's momentum, which friction beyond the load takes off again
        self._impulse += (1.0 - borne) * self._period
        self._caught = self._caught or (gone > SHOWS and borne > 1.0 - BORNE)
        against = grip > (1.0 + GRIP_ROSE) * grip_before and borne < (1.0 - LOAD_FELL) * borne_before
        if self._caught:
            if self._impulse <= 0.0 or gone > STOPPED:
                self._ended, self._impulse = time, 0.0
                self._restart()
                self._end()
        elif (gone > ANSWERED and against) or gone > LONGEST:
            for fall in self._signals.falls:
                fall.refuted()
            self._belief.take_back()
            self.refuted_at = time
            self._restart()
            self._end()
