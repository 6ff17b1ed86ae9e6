"""Slip detection on a measured limit surface: the load comes up to it.

The load ratio r is 1 on the limit surface. Page's test decides between "r is at most `safe`" and "r is at least
`slipping`"; how many samples that takes follows from the noise: one or two under a large load, ten where the
torque is near the noise. r is taken as it will be `ahead` from now, by its rate, for what is measured is old.

It tells of a load, not of a motion. What it says is as good as the surface, and nothing to correct that surface
with: for this see `palpate.friction.slip.excited_slip`.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, not_negative, positive
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.kinds import SlipKind, kind_of_slip
from palpate.friction.slip.load_noise import LoadNoise
from palpate.friction.slip.page_test import PageTest

ODD = 0.3
"""By which a load ratio may be off what was predicted; further off it makes no rate before the next is off,
too."""


@dataclass(frozen=True, slots=True)
class MarginParameters:
    """Between what Page's test decides.

    Attributes:
        safe: A load ratio that is none yet: 80 % of what the contact bears, where mu is taken 3 % too small and e
            5 % is 0.85.
        slipping: A load ratio that is one: 1 where mu is taken 3 % too large and e 5 % is 0.95.
        ahead: Age of the samples and what else shall be made good for [s]. Twice as much takes a shaking at 40 Hz
            for slip.
        memory: Over which the rate of the load ratio is estimated [s].
        threshold: Of Page's test; exp(12) samples at 1 kHz are 160 s, and that at `safe` all the time.
    """

    safe: float = 0.85
    slipping: float = 0.95
    ahead: float = 1e-3
    memory: float = 2e-3
    threshold: float = 12.0

    def __post_init__(self) -> None:
        positive("safe", self.safe, "")
        not_negative("ahead", self.ahead, "s")
        positive("memory", self.memory, "s")
        positive("threshold", self.threshold, "")
        if not self.safe < self.slipping < math.inf:
            raise InvalidValueError(f"slipping = {self.slipping:g}: must be finite and above safe = {self.safe:g}")


class MarginCrossing:
    """Tells of one contact whether its load has come up to its limit surface. One call of `step` per period."""

    def __init__(
        self,
        surface: LimitSurface,
        period: float,
        noise: LoadNoise | None = None,
        parameters: MarginParameters | None = None,
    ) -> None:
        """Take what is known.

        Args:
            surface: Best estimate, neither reduced nor a quantile: `MarginParameters` hold the distance.
            period: Between two samples [s].
            noise: Of one sample.
            parameters: Parameters of the detection.

        Raises:
            InvalidValueError: The period is not above 0.
        """
        self.surface = surface
        self._period = positive("period", period, "s")
        self._noise = noise or LoadNoise()
        self._own = own = parameters or MarginParameters()
        # two consistent samples at least, as one may be a glitch
        self._test = PageTest(own.threshold, 0.5 * own.threshold)
        fading = math.exp(-period / own.memory)  # of the critically damped filter of level and rate
        self._alpha, self._beta = 1.0 - fading**2, (1.0 - fading) ** 2
        self._level, self._rate = math.nan, 0.0
        self._odd = False
        self._kind: SlipKind | None = None

    surface: LimitSurface
    """May be replaced at any time by a better one."""

    @property
    def evidence(self) -> float:
        """From 0 to 1: how near it is to an alarm."""
        return self._test.sum / self._own.threshold

    def step(self, load: ContactLoad) -> SlipKind | None:
        """Take one sample; return the kind of slip as long as there is one. A load that is NaN says nothing."""
        normal_force, force, torque = load.normal_force, load.tangential_length, load.spin_torque
        surface, own = self.surface, self._own
        ratio = surface.load_ratio(normal_force, force, torque)
        if math.isnan(ratio):
            self._level = math.nan  # what comes after a gap did not come within one period
            return self._kind  # unchanged: an unknown load gives no kind of slip
        if math.isinf(ratio):
            self._level = math.nan
            return self._tested(load, math.inf)
        if normal_force <= 0.0:
            self._level = math.nan
            self._test.add(-math.inf)
            self._kind = None
            return None
        coming = ratio + self._rate_with(ratio) * own.ahead
        deviation = self._noise.of_ratio(surface, normal_force, force, torque)
        # of two normal distributions of the same width
        log_ratio = (own.slipping - own.safe) / deviation**2 * (coming - 0.5 * (own.slipping + own.safe))
        return self._tested(load, log_ratio)

    def _tested(self, load: ContactLoad, log_ratio: float) -> SlipKind | None:
        self._kind = kind_of_slip(self.surface, load) if self._test.add(log_ratio) else None
        return self._kind

    def _rate_with(self, ratio: float) -> float:
        """Rate of the load ratio [1/s], this sample included."""
        if math.isnan(self._level):
            self._level, self._rate, self._odd = ratio, 0.0, False
            return 0.0
        self._level += self._rate * self._period
        ahead = ratio - self._level
        far = abs(ahead) > ODD
        if far and not self._odd:
            self._odd = True
            return 0.0
        self._odd = far
        self._level += self._alpha * ahead
        self._rate += self._beta * ahead / self._period
        return self._rate
