"""Filters for wrenches, one sample at a time, that know their delay.

A controller that acts on a filtered force acts on the force of `delay` seconds ago: every filter here states
that delay exactly (the group delay at zero frequency: by how much the output lags a steadily changing force).

There is no Kalman filter, because it does not earn its keep. A force that wanders (random walk) in white noise
is the case made for it, and there its gain converges within a few time constants to a constant: it *is* the
first-order low-pass, which is here. At equal delay d all three low-passes let exactly the same white noise
through (variance T/(2 d) of the input's, for d >> T), and against a random walk the RMS error, at the Kalman
filter's optimum and in units of its error, is 1 (first order), sqrt(9/8) = 1.061 (critically damped) and
sqrt(5/4) = 1.118 (Butterworth) in theory; measured at d = 20 samples: 1.006, 1.072 and 1.127
(`tests/sensing/ft/test_ft_filters.py`). Those 12 % are what
the second order pays for cutting vibration by 40 instead of 20 dB per decade. A complementary filter would need a
second sensor of the same force; the accelerometer is used exactly, in the compensation.
"""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from palpate.compiling import machine_code
from palpate.errors import positive
from palpate.sensing.ft.compiled import filtered
from palpate.sensing.ft.filter_specs import Biquad, FilterSpec
from palpate.spatial import Wrench

_ANY: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class WrenchFilter:
    """Filters in series, the same for each of the six entries; none at all passes wrenches as they are.

    Attributes:
        coefficients: Of the sections, shape (n, 5),
        states: and what they remember, shape (n, 2, 6): see `palpate.sensing.ft.compiled.filtered`.
        started: Whether they have begun.
    """

    def __init__(self, filters: Sequence[FilterSpec], rate: float) -> None:
        """Take the filters, in order, and the sample rate [Hz].

        Raises:
            InvalidValueError: A frequency is too near Nyquist's, or to zero.
        """
        self.rate = positive("rate", rate, "Hz")
        self.sections = tuple(spec.section(rate) for spec in filters)
        self.coefficients = np.array(self.sections, float).reshape(-1, 5)
        self.states = np.zeros((len(self.sections), 2, 6))
        self.started = False
        self._filtered = partial(
            machine_code(filtered, self.coefficients, self.states, _ANY), self.coefficients, self.states
        )
        self.noise_gain = _noise_gain(self.sections)
        """Standard deviation of filtered over unfiltered white noise."""

    @property
    def delay(self) -> float:
        """Group delay at zero frequency [s], exact."""
        return sum(section.lag for section in self.sections) / self.rate

    def held_noise_gain(self, repeats: int) -> float:
        """Return the most that filtered white noise has over unfiltered, if every value comes `repeats` times.

        The sum of an impulse response over a held value is at most sqrt(repeats) times its length over it (Cauchy
        and Schwarz), and low-passes let no noise grow.
        """
        return self.noise_gain if repeats == 1 else min(1.0, math.sqrt(repeats) * self.noise_gain)

    def start(self, wrench: Wrench) -> None:
        """Take `wrench` for what has been there for ever: no transient follows."""
        for (b0, _, b2, _, a2), state in zip(self.sections, self.states, strict=True):
            state[0] = [(1.0 - b0) * x for x in wrench]
            state[1] = [(b2 - a2) * x for x in wrench]
        self.started = True

    def restart(self) -> None:
        """Forget everything: the next sample is taken for what has been there for ever."""
        self.started = False

    def step(self, wrench: Wrench) -> Wrench:
        """Return the filtered wrench of this sample. The first one starts the filter.

        A wrench that is not finite stays in the filter for good: keep it out.
        """
        if not self.started:
            self.start(wrench)
        now: Wrench = self._filtered(wrench)
        return now


def _noise_gain(sections: Sequence[Biquad]) -> float:
    """Return sqrt(sum h^2), h the impulse response of the cascade, from its stationary covariance."""
    size = 2 * len(sections)
    if not size:
        return 1.0
    A, B = np.zeros((size, size)), np.zeros(size)
    # The signal between the stages, as a function of states and input.
    C, D = np.zeros(size), 1.0
    for i, (b0, b1, b2, a1, a2) in enumerate(sections):
        first, second = 2 * i, 2 * i + 1
        out = b0 * C
        out[first] += 1.0
        A[first] = b1 * C - a1 * out
        A[first, second] += 1.0
        A[second] = b2 * C - a2 * out
        B[first], B[second] = (b1 - a1 * b0) * D, (b2 - a2 * b0) * D
        C, D = out, b0 * D
    covariance = solve_discrete_lyapunov(A, np.outer(B, B))
    return float(np.sqrt(C @ covariance @ C + D * D))
