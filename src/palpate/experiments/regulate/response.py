"""Step response (rise, overshoot, settling) and frequency response (amplitude ratio, phase, bandwidth)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray

RISE_FROM, RISE_TO = 0.1, 0.9
"""Of a step, between which its rise is counted."""

SETTLED = 0.05
"""Within this of a step's height it has settled."""

HALF_POWER = math.sqrt(0.5)
"""-3 dB."""

STEADY_SHARE = 1.0 / 3.0
"""Of each sine that is left out at its beginning, at least one cycle: until it is steady."""


MOST_EACH = 200
"""Steps that are kept one by one, for a figure."""


@dataclass(frozen=True, slots=True, eq=False)
class StepResponse:
    """The mean step response, each step scaled to go from 0 to 1.

    Attributes:
        time: Since the step, shape (n,) [s].
        mean: Shape (n,).
        each: Of the first steps, shape (m, n).
        count: How many steps there were.
        highest: That any of them reached.
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
        """When 10 and 90 % are reached [s]; NaN if they are not."""
        return self._reached(RISE_FROM), self._reached(RISE_TO)

    @property
    def rise_time(self) -> float:
        """From 10 to 90 % [s]; NaN if it does not get there."""
        begin, end = self.rise
        return end - begin

    @property
    def overshoot(self) -> float:
        """How far beyond 1 it goes."""
        return max(0.0, float(self.mean.max()) - 1.0)

    @property
    def largest_overshoot(self) -> float:
        """Likewise of the single worst step."""
        return max(0.0, self.highest - 1.0)

    @property
    def settling_time(self) -> float:
        """After which it stays within 5 % [s]; NaN if it does not before it ends."""
        outside = np.flatnonzero(np.abs(self.mean - 1.0) > SETTLED)
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
    """Return the mean step response; None if none lies wholly within the times.

    Args:
        time: Evenly spaced, shape (n,) [s].
        force: Shape (n,) [N].
        steps: Time [s], force before and after [N] of each.
        hold: How long each is looked at [s].
    """
    if len(time) < 2:
        return None
    period = (time[-1] - time[0]) / (len(time) - 1)
    count = math.floor(hold / period + 1e-6)
    rows = []
    for at, before, after in steps:
        first = int(np.searchsorted(time, at - 0.5 * period))
        if first + count <= len(time) and np.isfinite(force[first : first + count]).all():
            rows.append((force[first : first + count] - before) / (after - before))
    if not rows:
        return None
    each = np.array(rows)
    return StepResponse(
        period * np.arange(count), each.mean(axis=0), each[:MOST_EACH], len(each), float(each.max())
    )


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """Response of a force to sines of the set force.

    Attributes:
        frequency: Rising, shape (n,) [Hz].
        ratio: Complex amplitude over that of the set force, shape (n,).
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
        """Shape (n,) [degrees], without jumps."""
        return np.asarray(np.degrees(np.unwrap(np.angle(self.ratio))))

    @property
    def bandwidth(self) -> float | None:
        """Where the amplitude ratio first falls below -3 dB [Hz]; None if it does not within what was asked.

        Between two frequencies the ratio's logarithm is taken for straight over that of the frequency.
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
    time: FloatArray, wanted: FloatArray, force: FloatArray, begins: Sequence[float], frequencies: Sequence[float]
) -> FrequencyResponse | None:
    """Return the frequency response from sines, one after the other; None if not one was finished.

    Args:
        time: Shape (n,) [s].
        wanted: Shape (n,) [N].
        force: Shape (n,) [N].
        begins: When each sine begins, and the last one ends [s].
        frequencies: Of each [Hz].
    """
    found = []
    for begin, end, frequency in zip(begins, begins[1:], frequencies, strict=False):
        cycles = round((end - begin) * frequency)
        skipped = max(1, math.ceil(STEADY_SHARE * cycles))
        inside = (time >= begin + skipped / frequency) & (time < end) & np.isfinite(force)
        if cycles <= skipped or not len(time) or time[-1] < end - 1.5 / frequency or inside.sum() < 8:
            continue
        angle = 2.0 * math.pi * frequency * (time[inside] - begin)
        columns = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
        (set_part, response), *_ = (
            np.linalg.lstsq(columns, np.stack([wanted[inside], force[inside]], axis=1), rcond=None)[0].T,
        )
        found.append((frequency, complex(response[1], -response[2]) / complex(set_part[1], -set_part[2])))
    if not found:
        return None
    found.sort(key=lambda pair: pair[0])
    return FrequencyResponse(np.array([f for f, _ in found]), np.array([r for _, r in found]))
