"""A squeeze that tells whether what is held slides: friction grows with the grip, a load that is borne does not.

A contact that slides so slowly that its load hardly falls is told from one that holds by nothing that a finger
feels while the grip stays as it is. So the grip is raised by `SQUEEZE` for `LASTS` at most. If a load that hangs
rises with it, by more than it was about to, something slid; what slid is held from then on, or bears more.
"""

import math
from collections import deque
from collections.abc import Sequence
from enum import Enum

from palpate.controllers.grip.hanging_load import MeasuredLoad
from palpate.errors import positive

SQUEEZE, LEAST = 0.07, 0.07
"""Share by which the grip is raised, and [N] at least."""

LASTS = 0.06
"""[s] Within which it must be felt: 15 N/s of a servo raise 3 N by a tenth in 20 ms, and bus and rotor take 30."""

FELT = 0.04
"""Share by which the grip must have risen for an answer: less than half of what was asked for."""

OPPOSED, ROSE, ROSE_OF_MORE, DEVIATIONS = 2, 0.05, 0.07, 3.5
"""Share by which a load then rises where something slides, and above what its noise makes of it. Two opposed
fingers do not move what they squeeze; more swing the load by 5 % as they set out."""

LEAST_WITH_GRIP, MOST_WITH_GRIP = 0.5, 1.3
"""Times the share by which the grip rose, that a load rises by friction: 1 where all contacts slide, less where
some do not, and noise. What rises by less grows as the grip follows it; what rises by more, or before the grip
does, is pulled."""

CONFIRMED, GOES_ON = 0.02, 0.012
"""[s] After which a rise is looked at again, and share by which a load may then have risen beyond what the grip
did: a pull that happens to begin during a squeeze goes on, friction stops where the grip does."""

UNCLEAR = 0.5
"""Of that share: what rises by more holds now, but is not shown to have held."""

BEFORE, MEAN = 0.06, 0.01
"""[s] From which a load's own trend is taken, and over which it is averaged in the end."""

STEADY = 0.02
"""Share by which the first load may be about to change within `BEFORE`: what moves more is none to test with."""


class Answer(Enum):
    """What a squeeze says."""

    SLIDES = "slides"
    HOLDS = "holds"
    NONE = "nothing that is clear"


class SqueezeTest:
    """Follows loads and grip; one call of `step` per period.

    Attributes:
        active: Whether the grip is to be raised now.
    """

    def __init__(self, fingers: int, period: float) -> None:
        """Take how many fingers squeeze, and the period of control [s]."""
        self._period = positive("period", period, "s")
        self._least = ROSE if fingers <= OPPOSED else ROSE_OF_MORE
        self._half = max(round(0.5 * BEFORE / period), 2)
        self._mean = max(round(MEAN / period), 2)
        self._past = deque[tuple[float, tuple[float, ...]]](maxlen=2 * self._half)
        self.restart()

    def restart(self) -> None:
        """Something else hangs now."""
        self._past.clear()
        self.active = False

    @property
    def steady(self) -> bool:
        """Whether the load is known for long enough, and about to stay as it is: only then a squeeze may begin."""
        if self.active or len(self._past) < 2 * self._half:
            return False
        level, slope = self._trends()[0]
        return abs(slope) * BEFORE < STEADY * level

    def begin(self, time: float) -> None:
        """Raise the grip from now on."""
        self.active, self._began = True, time
        self._before = self._trends()
        self._grip = sum(each[0] for each in self._past) / len(self._past)
        self._most = 0.0
        self._rise: tuple[float, float, tuple[float, ...]] | None = None

    def step(self, time: float, loads: Sequence[MeasuredLoad], grip: float) -> Answer | None:
        """Take what hangs, and the sum of the grips [N]; return the answer, once."""
        self._past.append((grip, tuple(load.size for load in loads)))
        if not self.active:
            return None
        n, gone = self._mean, time - self._began
        last = list(self._past)[-n:]
        pressed = sum(each[0] for each in last) / n / self._grip - 1.0
        felt = pressed > FELT
        rose = [self._rose(i, load, last, gone) for i, load in enumerate(loads)]
        if any(share > 1.0 and by > MOST_WITH_GRIP * pressed for share, by in rose):
            self.active = False
            return Answer.NONE
        if felt:
            self._most = max(self._most, *(share for share, _ in rose))
        if self._rise is not None:
            began, grip_then, loads_then = self._rise
            if time < began + CONFIRMED:
                return None
            followed = GOES_ON + MOST_WITH_GRIP * max(pressed - grip_then, 0.0)
            goes_on = any(by - then > followed for (_, by), then in zip(rose, loads_then, strict=True))
            self.active = False
            return Answer.NONE if goes_on else Answer.SLIDES
        if felt and any(share > 1.0 and by > LEAST_WITH_GRIP * pressed for share, by in rose):
            self._rise = time, pressed, tuple(by for _, by in rose)
            return None
        if gone < LASTS:
            return None
        self.active = False
        return Answer.HOLDS if felt and self._most < UNCLEAR else Answer.NONE

    def _rose(
        self, i: int, load: MeasuredLoad, last: Sequence[tuple[float, tuple[float, ...]]], gone: float
    ) -> tuple[float, float]:
        """By how much a load rose, over what it rises where something slides, and as a share of itself."""
        level, slope = self._before[i]
        ahead = gone - 0.5 * MEAN + 0.5 * BEFORE
        rose = sum(each[1][i] for each in last) / len(last) - level - slope * ahead
        # of the mean of the last ones, and of the trend, whose error grows with how far it reaches
        trend = (1.0 + 4.0 * (ahead / (0.5 * BEFORE)) ** 2) / (2 * self._half)
        least = max(self._least * level, DEVIATIONS * load.deviation * math.sqrt(1.0 / self._mean + trend))
        return rose / least, rose / level

    def _trends(self) -> list[tuple[float, float]]:
        """Mean of each past load, and its slope per second."""
        half, out = self._half, []
        for i in range(len(self._past[0][1])):
            values = [each[1][i] for each in self._past]
            first, second = sum(values[:half]) / half, sum(values[half:]) / (len(values) - half)
            out.append((0.5 * (first + second), (second - first) / (half * self._period)))
        return out
