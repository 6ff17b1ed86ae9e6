"""Step response (rise, overshoot, settling) and frequency response (amplitude ratio, phase, bandwidth)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray

RISE_FROM, RISE_TO = 0.1, 0.9
"""Shares of a step between which its rise time is counted."""

SETTLING_BAND = 0.05
"""Half width of the band in which a step has settled, relative to its height."""

HALF_POWER = math.sqrt(0.5)
"""Amplitude ratio of -3 dB."""

TRANSIENT_SHARE = 1.0 / 3.0
"""Share of each sine that is left out at its start, at least one cycle: the transient."""

MAX_SINGLE_STEPS = 200
"""Number of steps that are kept one by one, for a figure."""


@dataclass(frozen=True, slots=True, eq=False)
class StepResponse:
    """The mean step response, each step scaled to go from 0 to 1.

    Attributes:
        time: Time since the step, shape (n,) [s].
        mean: Mean response, shape (n,).
        each: Responses to the first steps, shape (m, n).
        count: Number of steps.
        highest: Largest value that any step reached.
    """

    time: FloatArray
    mean: FloatArray
    each: FloatArray
    count: int
    highest: float

    @classmethod
    def joined(cls, found: "Sequence[StepResponse]") -> "StepResponse | None":
        """Return the response to the steps of several pieces of a run; None if there are none."""
        if len(found) < 2:
            return found[0] if found else None
        periods = min(len(each.time) for each in found)
        counts = [each.count for each in found]
        mean = np.average([each.mean[:periods] for each in found], axis=0, weights=counts)
        first = found[0].each[:, :periods]
        return cls(found[0].time[:periods], mean, first, sum(counts), max(each.highest for each in found))

    @property
    def rise(self) -> tuple[float, float]:
        """Times at which 10 and 90 % are reached [s]; NaN if they are not."""
        return self._reached(RISE_FROM), self._reached(RISE_TO)

    @property
    def rise_time(self) -> float:
        """Time from 10 to 90 % [s]; NaN if 90 % is not reached."""
        begin, end = self.rise
        return end - begin

    @property
    def overshoot(self) -> float:
        """Overshoot of the mean response, relative to the step's height."""
        return max(0.0, float(self.mean.max()) - 1.0)

    @property
    def largest_overshoot(self) -> float:
        """Overshoot of the worst single step, relative to its height."""
        return max(0.0, self.highest - 1.0)

    @property
    def settling_time(self) -> float:
        """Time after which the response stays within 5 % [s]; NaN if it does not settle."""
        outside = np.flatnonzero(np.abs(self.mean - 1.0) > SETTLING_BAND)
        if not len(outside):
            return 0.0
        return float(self.time[outside[-1] + 1]) if outside[-1] + 1 < len(self.time) else math.nan

    def _reached(self, level: float) -> float:
        above = np.flatnonzero(self.mean >= level)
        if not len(above):
            return math.nan
        i = int(above[0])
        if i == 0:
            return float(self.time[0])
        low, high = float(self.mean[i - 1]), float(self.mean[i])
        share = (level - low) / (high - low)
        return float(self.time[i - 1] + share * (self.time[i] - self.time[i - 1]))


def step_response(
    time: FloatArray, force: FloatArray, steps: Sequence[tuple[float, float, float]], hold: float
) -> StepResponse | None:
    """Return the mean step response; None if no step lies wholly within the times.

    Args:
        time: Evenly spaced times, shape (n,) [s].
        force: Force at these times, shape (n,) [N].
        steps: Time [s], force before and force after [N] of each step.
        hold: Duration of each response [s].
    """
    if len(time) < 2:
        return None
    period = (time[-1] - time[0]) / (len(time) - 1)
    count = math.floor(hold / period + 1e-6)
    rows = []
    for at, before, after in steps:
        first = int(np.searchsorted(time, at - 0.5 * period))
        part = force[first : first + count]
        if len(part) == count and np.isfinite(part).all():
            rows.append((part - before) / (after - before))
    if not rows:
        return None
    each = np.array(rows)
    highest = float(each.max())
    return StepResponse(period * np.arange(count), each.mean(axis=0), each[:MAX_SINGLE_STEPS], len(each), highest)


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """Response of a force to sines of the set force.

    Attributes:
        frequency: Rising frequencies, shape (n,) [Hz].
        ratio: Complex amplitude of the force over the amplitude of the set force, shape (n,).
    """

    frequency: FloatArray
    ratio: np.ndarray[tuple[int], np.dtype[np.complex128]]

    @classmethod
    def joined(cls, found: "Sequence[FrequencyResponse]") -> "FrequencyResponse | None":
        """Return the response to the sines of several pieces of a run; None if there are none."""
        if len(found) < 2:
            return found[0] if found else None
        frequency = np.concatenate([each.frequency for each in found])
        order = np.argsort(frequency, kind="stable")
        return cls(frequency[order], np.concatenate([each.ratio for each in found])[order])

    @property
    def gain(self) -> FloatArray:
        """Amplitude ratio, shape (n,)."""
        return np.asarray(np.abs(self.ratio))

    @property
    def phase_deg(self) -> FloatArray:
        """Phase without jumps, shape (n,) [degrees]."""
        return np.asarray(np.degrees(np.unwrap(np.angle(self.ratio))))

    @property
    def bandwidth(self) -> float | None:
        """Frequency at which the amplitude ratio first falls below -3 dB [Hz]; None if it does not.

        Between two frequencies, the logarithm of the ratio is linear in the logarithm of the frequency.
        """
        gain = self.gain
        below = np.flatnonzero(gain < HALF_POWER)
        if not len(below):
            return None
        i = int(below[0])
        if i == 0:
            return float(self.frequency[0])
        a, b = math.log(gain[i - 1]), math.log(gain[i])
        share = (a - math.log(HALF_POWER)) / (a - b)
        low, high = math.log(self.frequency[i - 1]), math.log(self.frequency[i])
        return math.exp(low + share * (high - low))

    @property
    def peak(self) -> float:
        """Largest amplitude ratio."""
        return float(self.gain.max())


def frequency_response(
    time: FloatArray,
    setpoint: FloatArray,
    force: FloatArray,
    begins: Sequence[float],
    frequencies: Sequence[float],
) -> FrequencyResponse | None:
    """Return the frequency response from consecutive sines; None if no sine was finished.

    Args:
        time: Times, shape (n,) [s].
        setpoint: Set force, shape (n,) [N].
        force: Force that is judged, shape (n,) [N].
        begins: Start of each sine, and end of the last one [s].
        frequencies: Frequency of each sine [Hz].
    """
    found = []
    for begin, end, frequency in zip(begins, begins[1:], frequencies, strict=False):
        cycles = round((end - begin) * frequency)
        skipped = max(1, math.ceil(TRANSIENT_SHARE * cycles))
        inside = (time >= begin + skipped / frequency) & (time < end) & np.isfinite(force)
        if cycles <= skipped or not len(time) or time[-1] < end - 1.5 / frequency or inside.sum() < 8:
            continue
        angle = 2.0 * math.pi * frequency * (time[inside] - begin)
        columns = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
        (set_part, response), *_ = (
            np.linalg.lstsq(columns, np.stack([setpoint[inside], force[inside]], axis=1), rcond=None)[0].T,
        )
        found.append((frequency, complex(response[1], -response[2]) / complex(set_part[1], -set_part[2])))
    if not found:
        return None
    found.sort(key=lambda pair: pair[0])
    return FrequencyResponse(np.array([f for f, _ in found]), np.array([r for _, r in found]))
