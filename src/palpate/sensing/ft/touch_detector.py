"""Detection of contact from the force, with hysteresis."""

import math
from functools import partial

import numpy as np

from palpate.compiling import machine_code
from palpate.errors import InvalidValueError, not_negative, positive
from palpate.sensing.ft.compiled_state import TOUCH_SAMPLES, TOUCHING, touches

MIN_SIGMAS = 5.0
"""Of the noise of one axis that the touch force must exceed: the length of three-dimensional noise exceeds it
once in 65 000 samples (chi law), a minute at 1 kHz; times of a few samples make that hours."""


class ContactDetector:
    """Force threshold with hysteresis and least durations; remembers whether it touches.

    Attributes:
        touch_force: See the constructor; so are release_force, noise and period.
        numbers: What it compares with,
        memory: and what it remembers: see `palpate.sensing.ft.compiled_state.touches`.
    """

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
        times = {"touch_time": touch_time, "release_time": release_time}
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
        samples = (1.0 + math.ceil(not_negative(name, x, "s") / period - 1e-9) for name, x in times.items())
        self.numbers, self.memory = np.array([touch_force, release_force, *samples]), np.zeros(2)
        given = (self.numbers, self.memory)
        self._touches = partial(machine_code(touches, *given, 0.0, 0.0, 0.0), *given)

    def restart(self) -> None:
        """Forget: nothing touches."""
        self.memory[:] = 0.0

    @property
    def touching(self) -> bool:
        """Whether it touches."""
        return bool(self.memory[TOUCHING])

    @property
    def delay(self) -> float:
        """From the first sample of a touch to the one that reports it [s]."""
        return (float(self.numbers[TOUCH_SAMPLES]) - 1.0) * self.period

    def step(self, force: float) -> bool:
        """Return whether it touches, given the length of this sample's contact force [N].

        A force that is not a number changes nothing.
        """
        touching: bool = self._touches(force, 0.0, 0.0)
        return touching
