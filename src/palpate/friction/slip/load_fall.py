"""The fall of a load that hangs on friction: slip, heard whatever is believed of the surface.

What hangs goes on pulling; where the contacts cannot bear it any more, they bear what their friction still gives,
and the rest accelerates the object. So the load that is felt falls: by the same share by which the object falls
with g, 5 % for 0.5 m/s^2 and 0.6 mm within 50 ms. No limit surface says when, the load itself does.

It is compared with what hung there before: an average that follows a growing load soon, a falling one late.
Page's test decides between "it fell by `LEFT_OUT` at most" and "by `FELL` at least".
"""

import math

from palpate.errors import positive
from palpate.friction.slip.page_test import PageTest

LEFT_OUT, FELL = 0.02, 0.08
"""Shares of the load: a hand that stops from 0.3 m/s^2 takes 3 % off it, and half of the second is 0.4 m/s^2 of an
object that slides."""

RISES, FALLS = 0.02, 0.3
"""[s] Time constants of what hung there before: upwards about what a contact rings, downwards three times what
friction takes to fall by 10 % where it falls slowly (20 % in 0.2 s)."""

SEEN = 0.05
"""[s] For which a load must have been followed before it can fall."""

THRESHOLD, MOST = 12.0, 4.0
"""Of Page's test, and of one sample: three at least, as one or two may be odd."""

MOST_DOUBT = 8.0
"""Times `FELL`, that a load must fall at most: by 64 %."""

DOUBT_FADES = 1.0
"""[s] Time constant with which falls that were none of friction are forgotten."""


class LoadFall:
    """Tells when a load falls. One call of `step` per period."""

    def __init__(self, period: float) -> None:
        """Take the period [s]."""
        self._period = positive("period", period, "s")
        self._rise, self._fall = -math.expm1(-period / RISES), -math.expm1(-period / FALLS)
        self._forget = math.exp(-period / DOUBT_FADES)
        self._test = PageTest(THRESHOLD, MOST)
        self.start()

    def start(self) -> None:
        """Nothing hangs yet."""
        self._doubt = 1.0
        self.restart()

    def restart(self) -> None:
        """Something else hangs now."""
        self._test.restart()
        self.hung, self._seen = 0.0, 0

    hung: float
    """What hung there before [N]."""

    def refuted(self) -> None:
        """The last fall was none of friction: the next is to be twice as deep."""
        self._doubt = min(2.0 * self._doubt, MOST_DOUBT)
        self.restart()

    def step(self, load: float, deviation: float) -> bool:
        """Take one sample and its standard deviation [N]; return whether the load falls."""
        self._seen += 1
        self._doubt = 1.0 + self._forget * (self._doubt - 1.0)
        # a plain mean at first: one sample says little
        share = max(self._rise if load > self.hung else self._fall, 1.0 / self._seen)
        self.hung += share * (load - self.hung)
        if self._seen * self._period < SEEN:
            return False
        between = (FELL * self._doubt - LEFT_OUT) * self.hung
        middle = 0.5 * (FELL * self._doubt + LEFT_OUT) * self.hung
        return self._test.add(between / deviation**2 * (self.hung - load - middle))
