"""What fingers feel together that tells of slip, whatever is believed of friction.

- What hangs in the hand falls (`palpate.friction.slip.load_fall`): an object moves where it is not all borne, and
  only there. What fingers pass on among one another is no slip.
- What two fingers share as before falls: the one that slips hands its part to the other, and what hangs stays.
- A squeeze is answered (`palpate.controllers.grip.squeeze_test`). It is tried where what hangs falls slightly, and
  where a load ratio is higher than any that was shown to hold: what slides at a steady speed is borne, and a load
  that is known only by what friction bears saturates.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from palpate.controllers.grip.hanging_load import MeasuredLoad
from palpate.controllers.grip.slip_alarm import Signal
from palpate.controllers.grip.squeeze_test import LEAST, OPPOSED, SQUEEZE, Answer, SqueezeTest
from palpate.errors import positive
from palpate.friction.slip.load_fall import FALL, NOISY, SHARE_FALL, SHARED_FALL, SLIGHT_FALL, LoadFall

PRESSED, CHANGED = 0.05, 0.04
"""[s], and share by which normal forces may change in that time for a squeeze to begin."""

SWUNG = 0.1
"""Share by which a load may have swung lately for one to begin, and for what fingers share to tell of slip."""

SHOWN = 0.06
"""Share by which a load ratio may exceed what was shown to hold."""

NEAR = 0.55
"""Share of believed friction below which load ratios need not be shown to hold: what has lost more is heard to
fall."""

TURNS, SHARED_TURNS = 0.4, 0.07
"""Share by which a moment must fall: an object that hangs in two elastic fingers swings about them by a quarter
whenever the hand stops, or a pull does."""

TURNED = 1e-3
"""[s] For which the whole moment of two fingers must be missing: it gives what hangs 6 mm beside them, with a
radius of gyration of 30 mm, 4 degrees/s. A moment swings for longer than the time that counts for a force."""

SETTLES = 0.02
"""[s] Time constant of the mean of load ratios: eight samples of noise."""

SHAKEN = 3.0
"""Three fingers take 6 % off the load as they set out: during their squeeze a fall is so many times what it is
otherwise."""

AGAIN = 0.1
"""[s] From one squeeze to the next, at least."""


class SlipSignals:
    """Listens to both. One call of `step` per period.

    Attributes:
        falls: One for each load that hangs.
    """

    def __init__(self, fingers: int, loads: int, period: float) -> None:
        """Take how many fingers there are, and loads that hang, and the period of control [s]."""
        self._fingers, self._period = fingers, positive("period", period, "s")
        force = FALL if fingers <= OPPOSED else SHARED_FALL
        moment = (
            replace(force, share=SHARED_TURNS) if fingers > OPPOSED else replace(force, share=TURNS, lost=TURNED)
        )
        self.falls = (LoadFall(period, force), *(LoadFall(period, moment) for _ in range(loads - 1)))
        self._share = LoadFall(period, SHARE_FALL)
        self._slight = tuple(LoadFall(period, SLIGHT_FALL) for _ in range(loads))
        self._squeeze = SqueezeTest(fingers, period)
        self._pressed = deque[tuple[float, ...]](maxlen=max(round(PRESSED / period), 1))
        self._settle = -math.expm1(-period / SETTLES)
        self.start()

    @property
    def squeeze(self) -> tuple[float, ...] | None:
        """By how much more each finger is to press [N], to see whether the load rises with it; None: no test."""
        return self._wanted if self._squeeze.active else None

    def start(self) -> None:
        """A new grip begins: no load ratio was shown to hold."""
        for fall in (*self.falls, *self._slight, self._share):
            fall.start()
        nothing = (0.0,) * self._fingers
        self._held = self._asked = self._wanted = nothing
        self._tested, self._doubted = -math.inf, False
        self.restart()

    def restart(self) -> None:
        """Something else hangs now, or hangs otherwise."""
        for fall in (*self.falls, *self._slight, self._share):
            fall.restart()
        self._squeeze.restart()
        self._ratios: tuple[float, ...] = ()
        self._pressed.clear()

    def step(
        self,
        time: float,
        loads: Sequence[MeasuredLoad],
        shared: MeasuredLoad | None,
        ratios: tuple[float, ...],
        grips: tuple[float, ...],
        believed: Sequence[float],
    ) -> Signal | None:
        """Take one period.

        Args:
            time: [s]
            loads: What hangs.
            shared: What fingers share of it as before; None: not told.
            ratios: Load ratio of each contact, over its normal force.
            grips: Normal forces [N].
            believed: Friction of each contact.
        """
        before, settle = self._ratios or ratios, self._settle
        self._ratios = tuple([a + settle * (b - a) for a, b in zip(before, ratios, strict=True)])
        self._pressed.append(grips)
        answer = self._squeeze.step(time, loads, sum(grips))
        shaken = SHAKEN if self._squeeze.active and self._fingers > OPPOSED else 1.0
        slightly = _fell(self._slight, loads, shaken)
        if _fell(self.falls, loads, shaken):
            return Signal.FALL
        if shared is not None and self._share.step(shared.size, shared.deviation) and self._calm(loads):
            return Signal.SHARE
        if answer is Answer.SLIDES:
            return Signal.SQUEEZE
        if answer is Answer.HOLDS:
            self._held = tuple(max(a, b) for a, b in zip(self._held, self._asked, strict=True))
            for fall in self._slight if self._doubted else ():
                fall.refuted()
        if (
            time >= self._tested + AGAIN
            and (slightly or self._higher(believed))
            and self._calm(loads)
            and self._unmoved()
            and self._squeeze.steady
        ):
            self._tested, self._asked, self._doubted = time, self._ratios, slightly
            self._wanted = tuple(max(SQUEEZE * grip, LEAST) for grip in grips)
            self._squeeze.begin(time)
        return None

    def _calm(self, loads: Sequence[MeasuredLoad]) -> bool:
        """Whether no load has swung lately."""
        return all(
            fall.swing.size <= SWUNG * fall.hung + NOISY * load.deviation
            for fall, load in zip(self.falls, loads, strict=True)
        )

    def _higher(self, believed: Sequence[float]) -> bool:
        """Whether a load ratio is higher than was shown to hold."""
        return any(
            now > (1.0 + SHOWN) * max(held, NEAR * mu)
            for now, held, mu in zip(self._ratios, self._held, believed, strict=True)
        )

    def _unmoved(self) -> bool:
        """Whether no finger presses otherwise than it did: a grip that is let down tells what slides by itself."""
        return all(
            abs(now - was) <= CHANGED * was for now, was in zip(self._pressed[-1], self._pressed[0], strict=True)
        )


def _fell(falls: Sequence[LoadFall], loads: Sequence[MeasuredLoad], shaken: float) -> bool:
    """Whether one of them falls; all of them listen."""
    fell = False
    for fall, load in zip(falls, loads, strict=True):
        fell |= fall.step(load.size, load.deviation, wanders=load.wanders, shaken=shaken)
    return fell
