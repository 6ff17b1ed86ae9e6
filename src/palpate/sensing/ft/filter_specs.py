"""Which filters a sensor's wrench passes, as a sensor file states them.

Each is one second-order section (biquad) from the bilinear transform, prewarped so that the stated frequency is
exact. With K = tan(pi f/fs), f the stated frequency and T = 1/fs, the group delay at zero frequency, which is
the lag behind a steadily changing force, is exactly
    Butterworth          T / (sqrt(2) K)
    critically damped    T sqrt(sqrt(2) - 1) / K
    first order          T / (2 K)
    notch                T / (2 K Q)
(an analogue section 1/(1 + 2 z s/w + s^2/w^2) lags by 2 z/w, and the transform maps w to 2 K/T).
"""

import math
from typing import NamedTuple

import msgspec

from palpate.errors import InvalidValueError, positive

LOWEST_RELATIVE_FREQUENCY = 1e-5
"""Of the sample rate. Lower, the coefficients cancel and the gain at rest loses digits; a tare is meant."""

HIGHEST_RELATIVE_FREQUENCY = 0.49
"""Of the sample rate, just below Nyquist's half, where a filter passes everything or is undefined."""

MIN_QUALITY, MAX_QUALITY = 0.5, 100.0
"""Of a notch: below, it is critically damped and takes the signal out too; above, a drift of half a per cent of
the disturbance leaves the notch, and it rings for a second at 50 Hz."""


class Biquad(NamedTuple):
    """y[n] = b0 x[n] + b1 x[n-1] + b2 x[n-2] - a1 y[n-1] - a2 y[n-2]."""

    b0: float
    b1: float
    b2: float
    a1: float
    a2: float

    @property
    def lag(self) -> float:
        """Group delay at zero frequency [samples]: sum k b_k / sum b_k - sum k a_k / sum a_k."""
        b0, b1, b2, a1, a2 = self
        return (b1 + 2.0 * b2) / (b0 + b1 + b2) - (a1 + 2.0 * a2) / (1.0 + a1 + a2)


class Butterworth(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="butterworth"):
    """Low-pass of second order, flattest; overshoots a step by 4 %.

    Attributes:
        cutoff: Where the power is halved (-3 dB) [Hz].
    """

    cutoff: float = msgspec.field(name="cutoff_Hz")

    def __post_init__(self) -> None:
        positive("cutoff_Hz", self.cutoff, "Hz")

    def section(self, rate: float) -> Biquad:
        """Return its coefficients at `rate` [Hz]."""
        return _low_pass(_warped("cutoff_Hz", self.cutoff, rate), math.sqrt(0.5))


class CriticallyDamped(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="critically_damped"
):
    """Low-pass of second order with a double real pole: never overshoots.

    Attributes:
        cutoff: Where the power is halved (-3 dB) [Hz].
    """

    cutoff: float = msgspec.field(name="cutoff_Hz")

    def __post_init__(self) -> None:
        positive("cutoff_Hz", self.cutoff, "Hz")

    def section(self, rate: float) -> Biquad:
        """Return its coefficients at `rate` [Hz]."""
        # |H|^2 = 1/(1 + (w/p)^2)^2 = 1/2 at w = p sqrt(sqrt(2) - 1), p the pole.
        return _low_pass(_warped("cutoff_Hz", self.cutoff, rate) / math.sqrt(math.sqrt(2.0) - 1.0), 1.0)


class FirstOrder(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="first_order"):
    """Low-pass of first order. For a random walk in white noise the steady Kalman filter is of this kind.

    Attributes:
        cutoff: Where the power is halved (-3 dB) [Hz].
    """

    cutoff: float = msgspec.field(name="cutoff_Hz")

    def __post_init__(self) -> None:
        positive("cutoff_Hz", self.cutoff, "Hz")

    def section(self, rate: float) -> Biquad:
        """Return its coefficients at `rate` [Hz]."""
        K = _warped("cutoff_Hz", self.cutoff, rate)
        b = K / (1.0 + K)
        return Biquad(b, b, 0.0, (K - 1.0) / (K + 1.0), 0.0)


class Notch(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="notch"):
    """Takes out one frequency (mains, a resonance of the arm), leaves slow forces as they are.

    Attributes:
        center: The frequency [Hz].
        quality: Center over width of the notch at -3 dB.
    """

    center: float = msgspec.field(name="center_Hz")
    quality: float

    def __post_init__(self) -> None:
        positive("center_Hz", self.center, "Hz")
        if not MIN_QUALITY <= self.quality <= MAX_QUALITY:
            raise InvalidValueError(f"quality = {self.quality!r}: must be from {MIN_QUALITY:g} to {MAX_QUALITY:g}")

    def section(self, rate: float) -> Biquad:
        """Return its coefficients at `rate` [Hz]."""
        K = _warped("center_Hz", self.center, rate)
        d = 1.0 + K / self.quality + K * K
        b, middle = (1.0 + K * K) / d, 2.0 * (K * K - 1.0) / d
        return Biquad(b, middle, b, middle, (1.0 - K / self.quality + K * K) / d)


FilterSpec = Butterworth | CriticallyDamped | FirstOrder | Notch


def _low_pass(K: float, damping: float) -> Biquad:
    d = 1.0 + 2.0 * damping * K + K * K
    b = K * K / d
    return Biquad(b, 2.0 * b, b, 2.0 * (K * K - 1.0) / d, (1.0 - 2.0 * damping * K + K * K) / d)


def _warped(name: str, frequency: float, rate: float) -> float:
    """Return K = tan(pi f/fs).

    Raises:
        InvalidValueError: The frequency is too near Nyquist's, or to zero.
    """
    positive("sample_rate_Hz", rate, "Hz")
    low, high = LOWEST_RELATIVE_FREQUENCY * rate, HIGHEST_RELATIVE_FREQUENCY * rate
    if not low <= frequency <= high:
        raise InvalidValueError(
            f"{name} = {frequency:g}: must be from {low:g} to {high:g} Hz at a sample rate of {rate:g} Hz (below "
            "Nyquist's half); give another frequency or sample faster"
        )
    return math.tan(math.pi * frequency / rate)
