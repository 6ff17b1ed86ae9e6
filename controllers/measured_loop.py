"""A force gain from a measured frequency response, with the margins that it was measured to have.

P(w) is the amplitude of the felt force per amplitude of the commanded displacement. A velocity k times the force
error closes the loop L = k P(w) e^{-iw h/2} / (iw); holding a command for a period h takes the half of it. Between
the measured frequencies, size and phase of P are interpolated over the frequency's logarithm. A law with a lag, as
an admittance has, adds a factor 1 / (1 + iw lag).
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.controllers.gains import LOOP_GAIN
from palpate.errors import FloatArray, InvalidValueError, positive

GRID = 2000
"""Frequencies between the first and the last measured one."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceResponse:
    """Measured force per commanded displacement.

    Attributes:
        angular_frequency: Rising [rad/s], shape (n,).
        response: P [N/m], complex, shape (n,).
        period: Of control [s].
    """

    angular_frequency: FloatArray
    response: np.ndarray[tuple[int], np.dtype[np.complex128]]
    period: float

    def _loop(self, lag: float = 0.0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Frequency [rad/s], size [N/(m/s)] and phase [rad] of P e^{-iwh/2} / (iw (1 + iw lag))."""
        given = np.log(self.angular_frequency)
        w = np.geomspace(self.angular_frequency[0], self.angular_frequency[-1], GRID)
        phase = np.interp(np.log(w), given, np.unwrap(np.angle(self.response)))
        size = np.exp(np.interp(np.log(w), given, np.log(np.abs(self.response)))) / w
        turned = phase - 0.5 * w * self.period - 0.5 * math.pi
        return w, size / np.hypot(1.0, w * lag), turned - np.arctan(w * lag)

    def oscillation(self, lag: float = 0.0) -> tuple[float, float]:
        """Frequency at which force control begins to oscillate [rad/s], and the gain that makes it do so [m/s/N].

        If the phase does not get there within what was measured, the last frequency stands for it: whatever the
        response does beyond, it was no larger there than at the end.
        """
        w, size, phase = self._loop(lag)
        beyond = np.flatnonzero(phase <= -math.pi)
        i = int(beyond[0]) if len(beyond) else len(w) - 1
        # a response that grows again beyond the crossing must not get through
        return float(w[i]), 1.0 / float(size[i:].max())

    def phase_margin_deg(self, gain: float, lag: float = 0.0) -> float:
        """Return the phase margin [degrees] at a gain [m/s/N]; at the highest crossing that was measured."""
        _, size, phase = self._loop(lag)
        over = np.flatnonzero(gain * size >= 1.0)
        i = int(over[-1]) if len(over) else 0  # the crossing lies below all that was measured: the first is later
        return math.degrees(math.pi + float(phase[i]))

    def gain(self, loop_gain: float = LOOP_GAIN, lag: float = 0.0) -> float:
        """Return the gain [m/s/N] with the margins that a delayed integrator has at this k K T.

        That is a gain margin of pi / (2 k K T) at least, and a phase margin of pi/2 - k K T.

        Args:
            loop_gain: k K T.
            lag: Of the law [s].
        """
        positive("loop_gain", loop_gain, "")
        if loop_gain >= 0.5 * math.pi:
            raise InvalidValueError(f"loop_gain = {loop_gain:g}: must be below pi/2, {0.5 * math.pi:.3g}")
        _, critical = self.oscillation(lag)
        gain = critical * loop_gain / (0.5 * math.pi)
        wanted = 90.0 - math.degrees(loop_gain)
        for _ in range(60):
            if self.phase_margin_deg(gain, lag) >= wanted:
                break
            gain *= 0.95
        return gain
