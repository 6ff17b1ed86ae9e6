"""When a finger lands and lifts off: force with hysteresis, a shortest duration, and times between samples.

Geometry alone never says "no contact": on a closed surface almost every wrench, noise included, has a centroid.
So a contact begins where the force rises through `touch_force` and ends where it falls through `release_force`,
and both only count if the force then stays beyond for `least_duration`: noise may carry single samples across both
thresholds, but hardly a row of them. The time given is that of the crossing, interpolated between the samples
around it, not that of the decision.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, not_negative, positive


@dataclass(frozen=True, slots=True)
class EventParameters:
    """What counts as a contact.

    Attributes:
        touch_force: A force that rises through this [N] is a landing; seven standard deviations of the noise of
            one axis keep chance out for 1e10 samples.
        release_force: One that falls through this [N] is a lift-off.
        least_duration: For this long [s] it must stay beyond: shorter touches are bumps, shorter gaps chatter.
        peak_window: The peak at landing is the largest force within this time of the crossing [s].
    """

    touch_force: float = 0.2
    release_force: float = 0.1
    least_duration: float = 0.005
    peak_window: float = 0.1

    def __post_init__(self) -> None:
        positive("touch_force", self.touch_force, "N")
        positive("release_force", self.release_force, "N")
        not_negative("least_duration", self.least_duration, "s")
        not_negative("peak_window", self.peak_window, "s")
        if self.release_force > self.touch_force:
            raise InvalidValueError(
                f"release_force = {self.release_force:g} N: must not exceed touch_force = {self.touch_force:g} N"
            )


@dataclass(frozen=True, slots=True)
class Landing:
    """The finger touched something.

    Attributes:
        time: When the force rose through `touch_force` [s].
    """

    time: float


@dataclass(frozen=True, slots=True)
class LandingPeak:
    """The blow of a landing; told when the window is over, or at the lift-off if that comes first.

    Attributes:
        time: When the force was largest [s].
        force: How large [N].
    """

    time: float
    force: float


@dataclass(frozen=True, slots=True)
class LiftOff:
    """The finger came off.

    Attributes:
        time: When the force fell through `release_force` [s].
    """

    time: float


ContactEvent = Landing | LandingPeak | LiftOff


class ContactEvents:
    """Finds events in the force of one finger, sample by sample."""

    def __init__(self, parameters: EventParameters | None = None) -> None:
        """Start without contact."""
        self.parameters = parameters or EventParameters()
        self._touching = False
        self._last: tuple[float, float] | None = None
        self._crossing: float | None = None
        self._landed = 0.0
        self._peak: LandingPeak | None = None

    @property
    def touching(self) -> bool:
        """Whether there is a contact: from the decision on a landing to the decision on a lift-off."""
        return self._touching

    def step(self, time: float, force: float) -> tuple[ContactEvent, ...]:
        """Take one sample; return what it settled, usually nothing.

        Args:
            time: When the force was sampled [s].
            force: |f|, or the normal force where the contact is known [N]. A sample that is not finite says
                nothing: it is passed over, and a crossing in the gap lies on the line across it.

        Raises:
            InvalidValueError: Time did not advance, or is not finite.
        """
        if not (self._last is None or time > self._last[0]) or not math.isfinite(time):
            before = "the first" if self._last is None else f"the one at {self._last[0]:g} s"
            raise InvalidValueError(f"time = {time:g} s: samples must come in order, after {before}")
        if not math.isfinite(force):
            return ()
        events: list[ContactEvent] = []
        if self._touching:
            events += self._follow_peak(time, force)
            events += self._lift_off(time, force)
        else:
            events += self._landing(time, force)
        self._last = (time, force)
        return tuple(events)

    def _landing(self, time: float, force: float) -> list[ContactEvent]:
        own = self.parameters
        if force <= own.touch_force:
            self._crossing = self._peak = None
            return []
        if self._crossing is None:
            self._crossing = self._when(own.touch_force, time, force)
            self._peak = LandingPeak(time, force)
        elif self._peak and force > self._peak.force and time <= self._crossing + own.peak_window:
            self._peak = LandingPeak(time, force)
        if time - self._crossing < own.least_duration:
            return []
        self._touching, self._landed, self._crossing = True, self._crossing, None
        return [Landing(self._landed)]

    def _lift_off(self, time: float, force: float) -> list[ContactEvent]:
        own = self.parameters
        if force >= own.release_force:
            self._crossing = None
            return []
        if self._crossing is None:
            self._crossing = self._when(own.release_force, time, force)
        if time - self._crossing < own.least_duration:
            return []
        lift_off, self._touching, self._crossing = LiftOff(self._crossing), False, None
        return [*self._take_peak(), lift_off]

    def _follow_peak(self, time: float, force: float) -> list[ContactEvent]:
        if self._peak is None:
            return []
        if time > self._landed + self.parameters.peak_window:
            return self._take_peak()
        if force > self._peak.force:
            self._peak = LandingPeak(time, force)
        return []

    def _take_peak(self) -> list[ContactEvent]:
        peak, self._peak = self._peak, None
        return [] if peak is None else [peak]

    def _when(self, threshold: float, time: float, force: float) -> float:
        """Return when the line from the last sample to this one meets the threshold [s]."""
        if self._last is None or self._last[1] == force:
            return time
        before, level = self._last
        share = (threshold - level) / (force - level)
        return before + min(max(share, 0.0), 1.0) * (time - before)
