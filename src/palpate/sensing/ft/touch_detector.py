"""Detection of contact from the force, with hysteresis."""

import math

from palpate.errors import InvalidValueError, not_negative, positive

MIN_SIGMAS = 5.0
"""Of the noise of one axis that the touch force must exceed: the length of three-dimensional noise exceeds it
once in 65 000 samples (chi law), a minute at 1 kHz; times of a few samples make that hours."""


class ContactDetector:
    """Force threshold with hysteresis and least durations; remembers whether it touches."""

    def __init__(
        self,
        *,
        touch_force: float,
        release_force: float,
        noise: float,
        period: float,
        touch_time: float = 0.0,
        release_time: float = 0.0,
    ) -> None:
        """Take the thresholds.

        Args:
            touch_force: A force above this [N] for `touch_time` [s] is a touch,
            release_force: and it ends below this [N] for `release_time` [s].
            noise: Standard deviation of the (filtered) force, largest axis [N].
            period: Between two samples [s].
            touch_time: See `touch_force`; 0: one sample is enough.
            release_time: See `release_force`; likewise.

        Raises:
            InvalidValueError: Not above zero, the release force above the touch force, or a touch force
                within `MIN_SIGMAS` of the noise.
        """
        self.touch_force = positive("touch_force", touch_force, "N")
        self.release_force = positive("release_force", release_force, "N")
        self.noise = not_negative("noise", noise, "N")
        self.period = positive("period", period, "s")
        if release_force > touch_force:
            raise InvalidValueError(
                f"release_force = {release_force:g} N: must not exceed touch_force = {touch_force:g} N"
            )
        if touch_force < MIN_SIGMAS * noise:
            raise InvalidValueError(
                f"touch_force = {touch_force:g} N: noise of {noise:.3g} N would pass for a touch; give at least "
                f"{MIN_SIGMAS * noise:.3g} N ({MIN_SIGMAS:g} standard deviations), or filter more"
            )
        # So many samples in a row span the time; rounding must not add one.
        self._touch_samples = 1 + math.ceil(not_negative("touch_time", touch_time, "s") / period - 1e-9)
        self._release_samples = 1 + math.ceil(not_negative("release_time", release_time, "s") / period - 1e-9)
        self.restart()

    def restart(self) -> None:
        """Forget: nothing touches."""
        self.touching = False
        self._against = 0

    @property
    def delay(self) -> float:
        """From the first sample of a touch to the one that reports it [s]."""
        return (self._touch_samples - 1) * self.period

    def step(self, force: float) -> bool:
        """Return whether it touches, given the length of this sample's contact force [N].

        A force that is not a number changes nothing.
        """
        if self.touching:
            contrary, needed = force < self.release_force, self._release_samples
        else:
            contrary, needed = force > self.touch_force, self._touch_samples
        self._against = self._against + 1 if contrary else 0
        if self._against >= needed:
            self.touching = not self.touching
            self._against = 0
        return self.touching
