"""The fall of a load that hangs on friction: slip, heard whatever is believed of the surface.

What hangs goes on pulling; where the contacts cannot bear it any more, they bear what their friction still gives,
and the rest accelerates the object. So the load that is felt falls: by the same share by which the object falls
with g, 5 % for 0.5 m/s^2 and 0.6 mm within 50 ms. No limit surface says when, the load itself does.

It is compared with what hung there before: an average that follows a growing load soon, a falling one late.
Page's test decides between "it fell by `LEFT_OUT` of a share at most" and "by that share at least", and where the
load swings by more than what it has swung lately.
"""

import math
from dataclasses import dataclass

from palpate.errors import positive
from palpate.friction.slip.page_test import PageTest
from palpate.friction.slip.recent_swing import RecentSwing

LEFT_OUT = 0.2
"""Of the share that makes a fall, what is none."""

RISES, FALLS = 0.02, 0.3
"""[s] Time constants of what hung there before: upwards about what a contact rings, downwards three times what
friction takes to fall by 10 % where it falls slowly (20 % in 0.2 s)."""

LATEST, NOISY = 0.01, 2.5
"""[s] Over which the latest load is averaged, and standard deviations of that mean by which it must exceed what
hung there before to have grown: else noise alone would lift that."""

FALLS_AGAIN = 3.5
"""Times what a load has swung lately that makes a fall: their middle is twice as much. A length that swings
through 0 does so too shortly to be seen whole."""

SEEN = 0.05
"""[s] For which a load must have been followed before it can fall."""

MOST = 4.0
"""Of what one sample adds to Page's test: no single one decides, as one or two may be odd."""

MOST_DOUBT = 16.0
"""Times what a load must fall at most."""


@dataclass(frozen=True, slots=True)
class FallParameters:
    """What is a fall.

    Attributes:
        share: Of a load at rest.
        swings: Standard deviations of what the load has swung lately, that a fall must exceed.
        threshold: Of Page's test; exp(12) samples at 1 kHz are 160 s, and that at `LEFT_OUT` all the time.
        lost: For how long the whole load must be missing [s], or for longer a part of it, whatever the noise: what
            is not borne gains speed by g, and goes on with it when it is borne again.
        fades: Time constant with which falls that were none of friction are forgotten [s].
    """

    share: float
    swings: float
    threshold: float
    lost: float
    fades: float


FALL = FallParameters(share=0.013, swings=3.0, threshold=12.0, lost=5e-5, fades=1.0)
"""To be answered: what slides with 0.5 mm/s."""

SHARED_FALL = FallParameters(share=0.02, swings=3.0, threshold=12.0, lost=5e-5, fades=1.0)
"""The same for three fingers or more, which take 5 % off the load for some milliseconds as they move."""

SHARE_FALL = FallParameters(share=0.05, swings=3.0, threshold=12.0, lost=1e-5, fades=1.0)
"""Of what two fingers share as they did before: a sixth goes over where one loses 30 % of its friction."""

SLIGHT_FALL = FallParameters(share=0.01, swings=2.0, threshold=6.0, lost=2e-5, fades=2.0)
"""To be looked into: what has gained less within the 20 ms in which its friction fell to what it weighs, and
slides on at that speed."""


class LoadFall:
    """Tells when a load falls. One call of `step` per period.

    Attributes:
        hung: What hung there before [N].
        swing: By how much it has fallen lately.
    """

    def __init__(self, period: float, parameters: FallParameters = FALL) -> None:
        """Take the period [s], and what is a fall."""
        self._period, self._own = positive("period", period, "s"), parameters
        self._rise, self._fall = -math.expm1(-period / RISES), -math.expm1(-period / FALLS)
        self.swing = RecentSwing(period)
        self._latest = -math.expm1(-period / LATEST)
        self._forget = math.exp(-period / parameters.fades)
        self._test = PageTest(parameters.threshold, MOST)
        self.start()

    def start(self) -> None:
        """Nothing hangs yet."""
        self._doubt, self._late = 1.0, 0.0
        self.swing.start()
        self.restart()

    def restart(self) -> None:
        """Something else hangs now; it may swing as what hung before."""
        self._test.restart()
        self.hung, self._seen, self._rms = 0.0, 0, 0.0

    def refuted(self) -> None:
        """The last fall was none of friction: the next is to be twice as deep."""
        self._doubt = min(2.0 * self._doubt, MOST_DOUBT)
        self.restart()

    def watch(self, load: float) -> None:
        """Take one sample of what slips: only how it swings."""
        self._late += self._latest * (load - self._late)
        self.swing.step(self._late)

    def step(self, load: float, deviation: float, *, wanders: float = 0.0, shaken: float = 1.0) -> bool:
        """Take one sample and its standard deviation [N]; return whether the load falls.

        Args:
            load: [N]
            deviation: Of its noise [N].
            wanders: As what the load is measured with may [N/s]: so fast it falls by itself.
            shaken: Times what is a fall otherwise, while something else shakes the load.
        """
        self._seen += 1
        self._doubt = 1.0 + self._forget * (self._doubt - 1.0)
        # a plain mean at first: one sample says little
        first = 1.0 / self._seen
        self.watch(load)
        noise = NOISY * deviation * math.sqrt(0.5 * self._latest)
        share = self._rise if self._late > self.hung + noise else self._fall
        self.hung += max(share, first) * (load - self.hung)
        if self._seen * self._period < SEEN:
            return False
        off = self.hung - load - wanders * FALLS
        self._rms += self._fall * (off * off - deviation**2 - self._rms)
        own = self._own
        swung = max(
            own.swings * math.sqrt(max(self._rms, 0.0)), FALLS_AGAIN * (self.swing.size - NOISY * deviation)
        )
        fell = shaken * max(own.share * self._doubt * self.hung, swung)
        left_out = LEFT_OUT * fell
        by_noise, by_speed = (
            (fell - left_out) / deviation**2,
            own.threshold * self._period / (own.lost * self.hung),
        )
        return self._test.add(min(by_noise, by_speed) * (off - 0.5 * (fell + left_out)))
