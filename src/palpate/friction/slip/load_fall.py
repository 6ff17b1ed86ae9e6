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
from functools import cache
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.errors import positive
from palpate.friction.slip.page_test import PageTest, add_evidence
from palpate.friction.slip.recent_swing import SIZE, RecentSwing, take_value

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


DOUBT, LATE, HUNG, SAMPLES, RMS = range(5)
"""Where in its state what is kept: times what a load must fall, the latest load [N], what hung there before [N],
samples since it hangs, and the mean square of what was off [N^2]."""

_Constants = tuple[float, float, float, float, float, float, float, float, float]


class LoadFall:
    """Tells when a load falls. One call of `step` per period.

    Attributes:
        swing: By how much it has fallen lately.
    """

    def __init__(self, period: float, parameters: FallParameters = FALL) -> None:
        """Take the period [s], and what is a fall."""
        own, rise = parameters, -math.expm1(-positive("period", period, "s") / RISES)
        fall, latest = -math.expm1(-period / FALLS), -math.expm1(-period / LATEST)
        forget = math.exp(-period / own.fades)
        self._constants: _Constants = (
            *(period, rise, fall, latest, forget),
            *(own.share, own.swings, own.threshold, own.lost),
        )
        self.swing = RecentSwing(period)
        self._test = PageTest(parameters.threshold, MOST)
        self._state = np.zeros(5)
        _kernels()  # compiled before the first period
        self.start()

    @property
    def hung(self) -> float:
        """What hung there before [N]."""
        return float(self._state[HUNG])

    def start(self) -> None:
        """Nothing hangs yet."""
        self._state[DOUBT], self._state[LATE] = 1.0, 0.0
        self.swing.start()
        self.restart()

    def restart(self) -> None:
        """Something else hangs now; it may swing as what hung before."""
        self._test.restart()
        self._state[HUNG:] = 0.0

    def refuted(self) -> None:
        """The last fall was none of friction: the next is to be twice as deep."""
        self._state[DOUBT] = min(2.0 * self._state[DOUBT], MOST_DOUBT)
        self.restart()

    def watch(self, load: float) -> None:
        """Take one sample of what slips: only how it swings."""
        _kernels()[0](self._constants, self._state, self.swing.state, load)

    def step(self, load: float, deviation: float, *, wanders: float = 0.0, shaken: float = 1.0) -> bool:
        """Take one sample and its standard deviation [N]; return whether the load falls.

        Args:
            load: [N]
            deviation: Of its noise [N].
            wanders: As what the load is measured with may [N/s]: so fast it falls by itself.
            shaken: Times what is a fall otherwise, while something else shakes the load.
        """
        falls: bool = _kernels()[1](
            self._constants, self._state, self.swing.state, self._test.state, load, deviation, wanders, shaken
        )
        return falls


@njit(cache=True)
def _watch(constants: _Constants, state: Any, swing: Any, load: float) -> None:
    state[LATE] += constants[3] * (load - state[LATE])
    take_value(swing, state[LATE])


@njit(cache=True)
def _falls(
    constants: _Constants,
    state: Any,
    swing: Any,
    test: Any,
    load: float,
    deviation: float,
    wanders: float,
    shaken: float,
) -> bool:
    period, rise, fall, latest, forget, own_share, swings, threshold, lost = constants
    state[SAMPLES] += 1.0
    state[DOUBT] = 1.0 + forget * (state[DOUBT] - 1.0)
    # a plain mean at first: one sample says little
    first = 1.0 / state[SAMPLES]
    _watch(constants, state, swing, load)
    noise = NOISY * deviation * math.sqrt(0.5 * latest)
    share = rise if state[LATE] > state[HUNG] + noise else fall
    state[HUNG] += max(share, first) * (load - state[HUNG])
    hung = state[HUNG]
    if state[SAMPLES] * period < SEEN:
        return False
    off = hung - load - wanders * FALLS
    state[RMS] += fall * (off * off - deviation * deviation - state[RMS])
    swung = max(swings * math.sqrt(max(state[RMS], 0.0)), FALLS_AGAIN * (swing[SIZE] - NOISY * deviation))
    fell = shaken * max(own_share * state[DOUBT] * hung, swung)
    left_out = LEFT_OUT * fell
    by_noise, by_speed = (fell - left_out) / (deviation * deviation), threshold * period / (lost * hung)
    return add_evidence(test, min(by_noise, by_speed) * (off - 0.5 * (fell + left_out)))


@cache
def _kernels() -> tuple[Any, Any]:
    constants = (1.0,) * 9
    state, swing, test = np.zeros(5), RecentSwing(1.0).state, PageTest(1.0, 1.0).state
    return (
        machine_code(_watch, constants, state, swing, 0.0),
        machine_code(_falls, constants, state, swing, test, 0.0, 0.0, 0.0, 0.0),
    )
