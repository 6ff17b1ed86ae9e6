"""Samples of a device at rest: their age, their regularity, and faults that the device reports."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.hw.devices import DeviceError
from palpate.hw.finding import DeviceFinding, FindingVerdict, judged
from palpate.robots.robot import Robot

GLANCE = 2e-4
"""[s] between two looks at a device: as short as the fastest sensor's records are apart."""

SLOW_SHARE = 0.9
"""Of the rate that it should have: less, and records are missing, not clocks apart."""


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """Samples of a device over some time.

    Attributes:
        time: When each new sample was taken, shape (n,) [s].
        age: Of the newest sample at each look, shape (k,) [s].
        values: Of each new sample, shape (n, m).
    """

    time: FloatArray
    age: FloatArray
    values: FloatArray

    @property
    def rate(self) -> float:
        """Of new samples [1/s]."""
        n = len(self.time)
        return (n - 1) / float(self.time[-1] - self.time[0]) if n > 1 else 0.0

    @property
    def gaps(self) -> FloatArray:
        """Between samples [s]."""
        return np.diff(self.time)


def timing_findings(robot: Robot, name: str, watched: Watched) -> Iterator[DeviceFinding]:
    """Yield the findings on age and regularity of samples."""
    half, most = (1e3 * float(x) for x in np.percentile(watched.age, [50.0, 99.0]))
    oldest = 1e3 * robot.file.limits.sample_age
    fix = "check the network and what else runs here, or allow more (limits.sample_age_s)"
    yield DeviceFinding(name, "age, median", half, "ms")
    yield judged(name, "age, 99 %", most, "ms", f"at most {oldest:g}", most <= oldest, fix)
    if len(watched.time) > 2:
        yield DeviceFinding(name, "jitter of samples", 1e3 * float(watched.gaps.std()), "ms")
        yield DeviceFinding(name, "largest gap between samples", 1e3 * float(watched.gaps.max()), "ms")


def failure(device: str, error: DeviceError) -> DeviceFinding:
    """Return the finding on a device that has failed."""
    return DeviceFinding(device, "connection", error.problem, "", "", FindingVerdict.BAD, error.remedy)
