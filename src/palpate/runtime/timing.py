"""How a run kept time."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.data import Observation
from palpate.runtime.times import Times

_MICRO = 1e6
"""Times of the loop are reported in microseconds."""


@dataclass(frozen=True, slots=True)
class Distribution:
    """What a set of times comes to.

    Attributes:
        count: How many there are; if none, the others are NaN.
        p50: Their median [s].
        p99: Which 99 % of them do not exceed [s].
        largest: [s].
    """

    count: int
    p50: float
    p99: float
    largest: float

    @classmethod
    def of(cls, times: FloatArray | Times) -> Self:
        """Return that of times [s], shape (n,)."""
        if not len(times):
            return cls(0, math.nan, math.nan, math.nan)
        values, counts = (times.values, times.counts) if isinstance(times, Times) else (times, np.ones(len(times)))
        order = np.argsort(values)
        until = np.cumsum(counts[order])
        # the next higher rank: a time that occurred, never one between an ordinary one and a stall
        ranks = np.ceil(np.array([0.5, 0.99]) * (until[-1] - 1))
        p50, p99 = values[order][np.searchsorted(until, ranks, side="right")].tolist()
        return cls(len(times), p50, p99, float(values.max()))

    def __str__(self) -> str:
        """One line for a person."""
        if self.count == 0:
            return "none"
        return (
            f"median {_MICRO * self.p50:.0f} µs, 99 % {_MICRO * self.p99:.0f} µs, "
            f"max {_MICRO * self.largest:.0f} µs ({self.count})"
        )


def oldest_age(now: Observation) -> float:
    """Return the age of the oldest of the samples that a period uses, by their own time stamps [s]."""
    first = now.arm.time
    for finger in now.fingers:
        if finger.time < first:
            first = finger.time
    if now.hand is not None and now.hand.time < first:
        first = now.hand.time
    return now.time - first


@dataclass(frozen=True, slots=True, eq=False)
class RunTiming:
    """Every period's times, on the wall clock.

    Attributes:
        compute: Sensing, control, supervision and recording, without waiting, n of them.
        period_time: From the start of each period to the next one's, n - 1 of them; none if n = 0.
        lateness: From each deadline to the wake-up after it, coming to rest included; none for simulated time.
        age: Of each period's oldest sample, by the devices' time stamps, n of them.
        overruns: Deadlines that had passed before the period's work was done; 0 for simulated time.
        note: What the system granted or refused, for people; empty if there is nothing to say.
        period: That was asked for [s].
    """

    compute: Times
    period_time: Times
    lateness: Times
    age: Times
    overruns: int
    note: str
    period: float

    @property
    def compute_spread(self) -> Distribution:
        """Of `compute`."""
        return Distribution.of(self.compute)

    @property
    def period_spread(self) -> Distribution:
        """Of `period_time`."""
        return Distribution.of(self.period_time)

    @property
    def lateness_spread(self) -> Distribution:
        """Of `lateness`."""
        return Distribution.of(self.lateness)

    @property
    def age_spread(self) -> Distribution:
        """Of `age`."""
        return Distribution.of(self.age)

    @property
    def slow_periods(self) -> int:
        """How many took longer to compute than a period lasts: in simulated time too."""
        return int(self.compute.counts[self.compute.values > self.period].sum())

    def __str__(self) -> str:
        """One line for a person."""
        parts = [f"period {1e3 * self.period:g} ms", f"compute {self.compute_spread}"]
        if len(self.lateness):
            parts += [f"start to start {self.period_spread}", f"lateness {self.lateness_spread}"]
            parts.append(f"overruns {self.overruns}")
        elif self.slow_periods:
            parts.append(f"slower than real time {self.slow_periods}")
        if len(self.age):
            parts.append(f"age of samples {self.age_spread}")
        if self.note:
            parts.append(self.note)
        return "; ".join(parts)
