"""Plausibility checks of a sensor's readings, sample by sample."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from typing import Self

import numpy as np

from palpate.compiling import machine_code
from palpate.errors import InvalidValueError, positive
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.compiled_state import drifting_axis, longest_rest
from palpate.spatial import Wrench


class HealthCheck(Enum):
    """What is watched, gravest first."""

    NON_FINITE = "not a finite number"
    IMPOSSIBLE = "far beyond anything that the sensor could show or bear"
    SATURATED = "raw reading at the end of its range"
    OVERLOAD_AXIS = "load beyond the range of an axis"
    OVERLOAD_COMBINED = "combined load beyond the limit"
    FROZEN = "no channel has changed for too many samples"
    STUCK = "a channel has not changed for too many samples"
    DRIFT = "mean load without contact beyond the limit"
    HEALTHY = "nothing wrong"


@dataclass(frozen=True, slots=True)
class SampleHealth:
    """What is wrong with a sample, if anything.

    Attributes:
        measure: What was exceeded.
        where: Axis ("Fx") or channel ("channel 3"); empty if it concerns all.
        value: What was found [N, N m, raw unit, samples; a ratio for the combined load].
        limit: What is allowed, likewise.
    """

    measure: HealthCheck
    where: str = ""
    value: float = 0.0
    limit: float = math.inf

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return self.measure is HealthCheck.HEALTHY

    def __str__(self) -> str:
        """One line for people."""
        if self.ok:
            return self.measure.value
        where = f" ({self.where})" if self.where else ""
        return f"{self.measure.value}{where}: {self.value:.6g}, limit {self.limit:.6g}"


HEALTHY = SampleHealth(HealthCheck.HEALTHY)
"""The usual verdict, made once."""


FROZEN_SAMPLES, STUCK_SAMPLES = 20, 200
"""See `HealthLimits`. Where a channel repeats itself with a chance of 0.79, the worst at a noise of 0.4 digital
steps, all six of them do so 20 times in a row once in 1e12."""


@dataclass(frozen=True, slots=True)
class HealthLimits:
    """What a sensor's samples must keep to.

    Attributes:
        axis: Largest load per axis [N, N m].
        combined: Largest Euclidean norm of (load / axis limit): the strains of several loads add up. 1 is an
            ellipsoid through the axis limits; sqrt(6) or more leaves only the axes.
        raw: Lowest and highest reading that is not saturated [raw unit]; infinite for devices that give wrenches.
        frozen_samples: So many samples in a row with no channel changed mean a dead device. Of a device that is
            slower than its reader, give so many times as many: see `HealthLimits.of_readings`.
        stuck_samples: So many with one channel unchanged mean that it is stuck. The noise of a healthy channel
            must exceed about a fifth of its digital step: below, it may rightly rest that long.
    """

    axis: Wrench
    combined: float = 1.0
    raw: tuple[float, float] = (-math.inf, math.inf)
    frozen_samples: int = FROZEN_SAMPLES
    stuck_samples: int = STUCK_SAMPLES

    def __post_init__(self) -> None:
        for name, limit in zip(AXES, self.axis, strict=True):
            positive(f"axis limit {name}", limit, "")
        positive("combined", self.combined, "")
        if not self.raw[0] < self.raw[1]:
            raise InvalidValueError(f"raw = {self.raw}: the lower limit must come first")
        for name, samples in (("frozen_samples", self.frozen_samples), ("stuck_samples", self.stuck_samples)):
            if samples < 2:
                raise InvalidValueError(f"{name} = {samples}: must be 2 or more")

    def of_readings(self, repeats: int) -> Self:
        """Return the same for a reader that finds every sample `repeats` times."""
        return replace(
            self,
            frozen_samples=repeats * self.frozen_samples,
            stuck_samples=repeats * self.stuck_samples,
        )


class HealthMonitor:
    """Judges samples one by one.

    Attributes:
        limits: What they must keep to.
        stillness: What counts how long channels rest.
    """

    def __init__(self, limits: HealthLimits, channels: int = 6) -> None:
        """Take the limits, and how many channels there are."""
        self.limits = limits
        self._inverse = tuple(1.0 / x for x in limits.axis)
        self.stillness = StillnessWatch(limits.frozen_samples, limits.stuck_samples, channels)

    def restart(self) -> None:
        """Forget the samples so far."""
        self.stillness.restart()

    def step(self, reading: Sequence[float], load: Wrench) -> SampleHealth:
        """Return the gravest thing wrong with a sample.

        Args:
            reading: What the device gave: raw channels, or the wrench itself.
            load: The same, calibrated [N, N m].
        """
        verdict = self.judge(reading, load)
        if verdict.measure is HealthCheck.NON_FINITE:
            return verdict
        still = self.stillness.step(reading)
        return still if verdict is HEALTHY else verdict

    def judge(self, reading: Sequence[float], load: Wrench) -> SampleHealth:
        """Return what is wrong with a sample by itself, whatever came before; arguments as of `step`."""
        if not math.isfinite(sum(reading)):  # one of them is not, or the sum overflows
            for i, x in enumerate(reading):
                if not math.isfinite(x):
                    return SampleHealth(HealthCheck.NON_FINITE, f"channel {i + 1}", x)
        return self._overloaded(reading, load)

    def _overloaded(self, reading: Sequence[float], load: Wrench) -> SampleHealth:
        low, high = self.limits.raw
        if min(reading) <= low or max(reading) >= high:
            i, x = next((i, x) for i, x in enumerate(reading) if x <= low or x >= high)
            return SampleHealth(HealthCheck.SATURATED, f"channel {i + 1}", x, low if x <= low else high)
        u, v, w, p, q, r = self._inverse
        a, b, c, d, e, f = load
        ratio = math.hypot(a * u, b * v, c * w, d * p, e * q, f * r)
        if ratio < 1.0 and ratio <= self.limits.combined:
            return HEALTHY
        shares = [abs(x) * y for x, y in zip(load, self._inverse, strict=True)]
        worst = shares.index(max(shares))
        if shares[worst] > 1.0:
            return SampleHealth(HealthCheck.OVERLOAD_AXIS, AXES[worst], load[worst], self.limits.axis[worst])
        if not ratio <= self.limits.combined:
            return SampleHealth(HealthCheck.OVERLOAD_COMBINED, "", ratio, self.limits.combined)
        return HEALTHY


class StillnessWatch:
    """Counts since when each channel of a noisy sensor has not changed.

    Attributes:
        last: The last reading, shape (channels,),
        unchanged: and the counts: see `palpate.sensing.ft.compiled_state.longest_rest`.
    """

    def __init__(
        self, frozen_samples: int = FROZEN_SAMPLES, stuck_samples: int = STUCK_SAMPLES, channels: int = 6
    ) -> None:
        """Take after how many samples it is frozen, or a channel stuck: see `HealthLimits`."""
        self._frozen, self._stuck = frozen_samples, stuck_samples
        self._take(channels)

    def _take(self, channels: int) -> None:
        self.last, self.unchanged = np.full(channels, np.nan), np.zeros(channels)
        given = (self.last, self.unchanged)
        self._longest = partial(machine_code(longest_rest, *given, (0.0,) * channels), *given)

    def restart(self) -> None:
        """Forget the samples so far."""
        self.last[:] = np.nan

    def step(self, reading: Sequence[float]) -> SampleHealth:
        """Take a sample of finite numbers."""
        if len(reading) != len(self.last):
            self._take(len(reading))
        return HEALTHY if self._longest(tuple(reading)) < self._frozen else self.verdict()

    def verdict(self) -> SampleHealth:
        """Return what is wrong with the last sample."""
        least, longest = float(self.unchanged.min()), float(self.unchanged.max())
        if least >= self._frozen:
            return SampleHealth(HealthCheck.FROZEN, "", least, float(self._frozen))
        if longest >= self._stuck:
            channel = int(self.unchanged.argmax())
            return SampleHealth(HealthCheck.STUCK, f"channel {channel + 1}", longest, float(self._stuck))
        return HEALTHY


class DriftWatch:
    """Watches the slow mean of the contact wrench while nothing touches: it should be zero.

    A drift faster than its limit within the averaging time can pass for a touch; the mean then stands still.

    Attributes:
        limit: Per axis [N, N m].
        limits: See `palpate.sensing.ft.compiled_state.drifting_axis`,
        memory: likewise.
    """

    def __init__(self, limit: Wrench, averaging_time: float, period: float) -> None:
        """Take the limits per axis [N, N m], the time constant of the mean [s] and the period [s].

        Raises:
            InvalidValueError: Not above zero, or an averaging time below ten periods.
        """
        self.limit = limit
        for name, x in zip(AXES, limit, strict=True):
            positive(f"drift limit {name}", x, "")
        positive("averaging_time", averaging_time, "s")
        positive("period", period, "s")
        if averaging_time < 10.0 * period:
            raise InvalidValueError(
                f"averaging_time = {averaging_time:g} s: must be 10 periods of {period:g} s or more"
            )
        self.limits, self.memory = np.array([*limit, averaging_time / period]), np.zeros(7)
        given = (self.limits, self.memory)
        self._axis = partial(machine_code(drifting_axis, *given, self.mean), *given)

    @property
    def mean(self) -> Wrench:
        """Of the contact wrench [N, N m]."""
        a, b, c, d, e, f, _ = self.memory.tolist()
        return (a, b, c, d, e, f)

    def restart(self) -> None:
        """Begin anew, as after a tare."""
        self.memory[:] = 0.0

    def step(self, contact_wrench: Wrench) -> SampleHealth:
        """Take the contact wrench of a sample without touch [N, N m]."""
        axis = self._axis(tuple(contact_wrench))
        return HEALTHY if axis < 0 else self.verdict(axis)

    def verdict(self, axis: int) -> SampleHealth:
        """Return what is wrong where the mean of an axis is beyond its limit."""
        return SampleHealth(HealthCheck.DRIFT, AXES[axis], float(self.memory[axis]), self.limit[axis])
