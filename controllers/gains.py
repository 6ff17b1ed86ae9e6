"""Gains of force control by velocity, from stiffness and delay.

Model: a commanded normal velocity v reaches the contact after a time T (delay plus servo lag) and presses into
a stiffness K, so dF/dt = K v(t - T). With v = k (F_set - F) the open loop is k K e^{-sT} / s: it is stable for
k K T < pi/2. With k K T = x the phase margin is pi/2 - x and the gain margin pi/(2 x).
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_positive, not_negative, positive
from palpate.runtime.live import LiveParameter

LOOP_GAIN = 0.5
"""Default k K T: phase margin 61 degrees, gain margin 3.1, and next to no overshoot."""

MAX_LIVE_LOOP_GAIN = 0.6
"""Largest k K T that a gain may be changed to while it controls: phase margin 56 degrees, gain margin 2.6, a step
overshoots by 12 %. However fast a gain changes below it, the loop stays stable: dF/dt = -a(t) F(t - T) is stable
while 0 < a T < 3/2 (Yorke 1970, J. Differential Equations 7, 189-202)."""

MIN_LIVE_LOOP_GAIN = 0.05
"""Smallest k K T that a gain may be changed to: a tenth of the default, where the force follows with a time
constant of 20 T. A weaker one loses every surface that is not flat."""

LIVE_LOOP_GAIN_RATE = 0.5
"""How fast k K T may be changed [1/s]: from end to end in about a second. Not for stability, but so that the
push k (F_set - F) does not jump."""


@dataclass(frozen=True, slots=True)
class ForceGain:
    """A force gain with its stability margin.

    Attributes:
        gain: k, commanded normal velocity per force error [m/s/N].
        stiffness: K that it was made for [N/m].
        delay: T that it was made for [s].
    """

    gain: float
    stiffness: float
    delay: float

    def __post_init__(self) -> None:
        check_positive(self, gain="m/s/N", stiffness="N/m", delay="s")
        if self.loop_gain >= math.pi / 2:
            raise InvalidValueError(
                f"force gain = {self.gain:g} m/s/N: with K = {self.stiffness:g} N/m and T = {self.delay:g} s the "
                f"loop gain k K T is {self.loop_gain:.2f}, unstable from pi/2 on; take at most "
                f"{LOOP_GAIN / (self.stiffness * self.delay):.2g} m/s/N"
            )

    @property
    def loop_gain(self) -> float:
        """Loop gain k K T, to be compared with pi/2."""
        return self.gain * self.stiffness * self.delay

    @property
    def live_range(self) -> tuple[float, float]:
        """Smallest and largest gain that it may be changed to while it controls [m/s/N].

        Whoever asked for a gain beyond them at the start may go back to it.
        """
        unit = 1.0 / (self.stiffness * self.delay)
        return min(MIN_LIVE_LOOP_GAIN * unit, self.gain), max(MAX_LIVE_LOOP_GAIN * unit, self.gain)

    @property
    def live(self) -> LiveParameter:
        """The live parameter `force_gain`: bounded by `live_range`, and in its rate of change."""
        (least, most), rate = self.live_range, LIVE_LOOP_GAIN_RATE / (self.stiffness * self.delay)
        what = "normal velocity per force error"
        return LiveParameter("force_gain", self.gain, least, most, rate, "m/s/N", what)

    @property
    def gain_margin(self) -> float:
        """By which factor K or k may grow before the loop oscillates."""
        return math.pi / 2 / self.loop_gain

    @property
    def phase_margin_deg(self) -> float:
        """Phase margin [degrees]."""
        return math.degrees(math.pi / 2 - self.loop_gain)


def force_gain(stiffness: float, delay: float, loop_gain: float = LOOP_GAIN) -> ForceGain:
    """Return the gain that gives a loop gain k K T.

    Args:
        stiffness: K of contact and servo in series [N/m].
        delay: T, all delays plus the lag of the servo [s].
        loop_gain: Wanted k K T, below pi/2.
    """
    return ForceGain(
        loop_gain / (positive("stiffness", stiffness, "N/m") * positive("delay", delay, "s")), stiffness, delay
    )


def series_stiffness(*stiffnesses: float) -> float:
    """Return the stiffness of springs in series [N/m]; infinite ones may be left out."""
    return 1.0 / sum(1.0 / positive("stiffness", stiffness, "N/m") for stiffness in stiffnesses)


def tracking_delay(period: float, servo_lag: float, sensing_delay: float = 0.0) -> float:
    """Return T [s]: sensing delay, one period and a half of sampling and holding, and the servo's lag."""
    not_negative("servo_lag", servo_lag, "s")
    return not_negative("sensing_delay", sensing_delay, "s") + 1.5 * positive("period", period, "s") + servo_lag
