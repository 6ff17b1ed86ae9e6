"""What the force came to over all periods of a run, which come piece by piece."""

import math

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.regulate.held import Held
from palpate.experiments.regulate.plan import RegulationPlan


class _Squares:
    """Sums of what is finite of some numbers, for their mean, RMS and standard deviation."""

    def __init__(self) -> None:
        self.count, self._sum, self._squares, self._spread = 0, 0.0, 0.0, 0.0
        self._near = math.nan  # subtracted before squares are summed: the mean of the first

    def add(self, values: FloatArray) -> None:
        values = values[np.isfinite(values)]
        if not values.size:
            return
        if not self.count:
            self._near = float(values.mean())
        self.count += values.size
        self._squares += float(np.sum(np.square(values)))
        self._sum += float(np.sum(values - self._near))
        self._spread += float(np.sum(np.square(values - self._near)))

    @property
    def rms(self) -> float:
        return math.sqrt(self._squares / self.count) if self.count else math.nan

    @property
    def deviation(self) -> float:
        return (
            math.sqrt(max(0.0, self._spread / self.count - (self._sum / self.count) ** 2)) if self.count else 0.0
        )


class HeldSums:
    """Takes the pieces of a run in order.

    Attributes:
        peak: Largest true force of the whole run, tangential part included [N]; on a robot the largest sensed one.
        landing_peak: Largest true force from the first touch until the profile begins [N]; NaN if nothing was
            touched.
        counted: Periods that count for errors.
    """

    def __init__(self, planned: RegulationPlan) -> None:
        """Take what was to be done."""
        self.peak, self.landing_peak, self.counted = 0.0, math.nan, 0
        self._last_second = max(1, round(1.0 / planned.period))
        self._true, self._sensed, self._difference = _Squares(), _Squares(), _Squares()
        self._last: FloatArray = np.empty(0)

    def take(self, piece: Held) -> None:
        """Take the next periods."""
        counted, wanted = piece.counted, piece.set_force
        true, sensed = piece.true_force, piece.sensed_force
        self._true.add((true - wanted)[counted])
        self._sensed.add((sensed - wanted)[counted])
        difference = (sensed - true)[counted]
        self._difference.add(difference)
        self._last = np.concatenate([self._last, difference])[-self._last_second :]
        self.counted += int(counted.sum())
        self._take_peaks(piece)

    @property
    def true_rms(self) -> float:
        """RMS error of the true force while the profile is held [N]."""
        return self._true.rms

    @property
    def sensed_rms(self) -> float:
        """Likewise of the sensed force [N]."""
        return self._sensed.rms

    @property
    def sensor_error(self) -> float:
        """Sensed less true force, mean over the last second of holding [N]: what drift has done; NaN without."""
        return float(np.nanmean(self._last)) if np.isfinite(self._last).any() else math.nan

    @property
    def sensor_error_deviation(self) -> float:
        """Standard error of the mean of the difference of sensed and true force [N]."""
        return self._difference.deviation / math.sqrt(max(1, self.counted))

    def _take_peaks(self, piece: Held) -> None:
        force = piece.truth.force if piece.truth.known else piece.record.wrench[:, :3]
        size = np.linalg.norm(force, axis=1)
        self.peak = float(np.nanmax(size, initial=self.peak))
        before = piece.truth.touching.copy()
        if piece.held_since is not None:
            before &= piece.record.time < piece.held_since
        if before.any():
            self.landing_peak = float(np.fmax(self.landing_peak, size[before].max()))
