"""Elements of the model of a force/torque sensor, one effect each.

The order of the pieces in the chain is explained in `palpate.sim.sensor.model`. Axes are Fx Fy Fz Mx My Mz, of
the sensor frame.
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import InvalidValueError, not_negative, positive
from palpate.sensing.ft.arrays import AXES
from palpate.spatial import Wrench

WORST_CROSS_TALK = 1e-6
"""Smallest over largest singular value of M: below, some load is as good as lost. Errors of 10 % leave 1e-2."""


def alike(force: float, moment: float) -> Wrench:
    """Return one value for the three forces and one for the three moments."""
    return (force, force, force, moment, moment, moment)


def checked_axes(name: str, values: Wrench) -> None:
    """Check that there are six values, finite and 0 or above.

    Raises:
        InvalidValueError: Otherwise; the axis is named.
    """
    _six(name, values)
    for axis, value in zip(AXES, values, strict=True):
        not_negative(f"{name}, {axis}", value, "N" if axis[0] == "F" else "N m")


def checked_limits(name: str, values: Wrench) -> None:
    """Check that there are six values, finite and above 0.

    Raises:
        InvalidValueError: Otherwise; the axis is named.
    """
    _six(name, values)
    for axis, value in zip(AXES, values, strict=True):
        positive(f"{name}, {axis}", value, "N" if axis[0] == "F" else "N m")


@dataclass(frozen=True, slots=True)
class CrossTalk:
    """An error of the device's calibration matrix: a load w is shown as M w.

    Attributes:
        matrix: M, six rows of six, near the identity. Force from moment is in 1/m, moment from force in m.
    """

    matrix: tuple[Wrench, ...]

    def __post_init__(self) -> None:
        array = np.array(self.matrix, dtype=np.float64)
        if array.shape != (6, 6) or not np.isfinite(array).all():
            raise InvalidValueError(
                f"cross-talk matrix of shape {array.shape}: must be 6 rows of 6 finite numbers"
            )
        singular = np.linalg.svd(array, compute_uv=False)
        if not singular[-1] > WORST_CROSS_TALK * singular[0]:
            raise InvalidValueError(
                f"cross-talk: smallest singular value {singular[-1]:.3g} against {singular[0]:.3g}: must be "
                "near the identity; this sensor would not feel some load"
            )


def drawn_cross_talk(rated: Wrench, share: Wrench, specimen: int) -> CrossTalk:
    """Return the calibration error of one specimen of a kind of sensor.

    A full load on any one axis shifts axis i by at most `share[i]` of its own full load, evenly distributed: so
    makers state it, one axis loaded at a time.

    Args:
        rated: Full load per axis [N, N m].
        share: Largest error per axis, over `rated`.
        specimen: Which one; the same number gives the same matrix.
    """
    checked_limits("rated load", rated)
    checked_axes("share of cross-talk", share)
    size = np.array(rated)
    error = np.random.default_rng(_specimen(specimen)).uniform(-1.0, 1.0, (6, 6))
    matrix = np.eye(6) + np.array(share)[:, None] * error * size[:, None] / size
    return CrossTalk(tuple((a, b, c, d, e, f) for a, b, c, d, e, f in matrix.tolist()))


@dataclass(frozen=True, slots=True)
class FirstOrderLag:
    """1 / (1 + s/w): a single pole.

    Attributes:
        cutoff: w / 2 pi, where the power is halved (-3 dB) [Hz].
    """

    cutoff: float

    def __post_init__(self) -> None:
        positive("cutoff", self.cutoff, "Hz")

    @property
    def lag(self) -> float:
        """By how much it lags a steadily changing load [s]."""
        return 1.0 / (2.0 * math.pi * self.cutoff)


@dataclass(frozen=True, slots=True)
class SecondOrderLag:
    """1 / (1 + 2 z s/w + s^2/w^2): a sensor's own resonance, or a filter of second order.

    Attributes:
        natural_frequency: w / 2 pi [Hz].
        damping: z, up to 1. sqrt(1/2) is Butterworth's, and w is then where the power is halved.
    """

    natural_frequency: float
    damping: float = math.sqrt(0.5)

    def __post_init__(self) -> None:
        positive("natural_frequency", self.natural_frequency, "Hz")
        if not 0.0 < self.damping <= 1.0:
            raise InvalidValueError(
                f"damping = {self.damping!r}: must be above 0, at most 1; a slower sensor has a lower frequency"
            )

    @property
    def lag(self) -> float:
        """By how much it lags a steadily changing load [s]."""
        return 2.0 * self.damping / (2.0 * math.pi * self.natural_frequency)


@dataclass(frozen=True, slots=True)
class RandomWalk:
    """A bias that wanders: its change over a time T has the standard deviation rate * sqrt(T), without bound.

    Attributes:
        rate: Per axis [N/sqrt(s), N m/sqrt(s)].
    """

    rate: Wrench

    def __post_init__(self) -> None:
        checked_axes("random walk", self.rate)


@dataclass(frozen=True, slots=True)
class WhiteNoise:
    """Independent Gaussian noise of each sample and axis.

    Attributes:
        sd: Standard deviation per axis [N, N m].
    """

    sd: Wrench

    def __post_init__(self) -> None:
        checked_axes("noise", self.sd)


@dataclass(frozen=True, slots=True)
class Quantisation:
    """Readings come in whole steps, rounded to the nearest.

    Attributes:
        step: Per axis [N, N m]; 0: none.
    """

    step: Wrench

    def __post_init__(self) -> None:
        checked_axes("step of quantisation", self.step)

    @property
    def sd(self) -> Wrench:
        """What it adds to noise of half a step or more, step / sqrt(12) [N, N m]: an even spread over a step."""
        a, b, c, d, e, f = (step / math.sqrt(12.0) for step in self.step)
        return (a, b, c, d, e, f)


@dataclass(frozen=True, slots=True)
class Saturation:
    """Readings end at a limit.

    A limit at the rated load exactly would hide an overload: `HealthMonitor` finds fault with what is beyond the
    range of a sensor file. Real devices go on above it: they flag, show, and end somewhat higher.

    Attributes:
        limit: Largest reading per axis [N, N m].
    """

    limit: Wrench

    def __post_init__(self) -> None:
        checked_limits("limit of saturation", self.limit)


@dataclass(frozen=True, slots=True)
class SampleClock:
    """The device samples by itself, at `offset + n / rate`; whoever reads it gets the newest sample that is ready.

    Attributes:
        rate: [Hz].
        offset: Of one of its samples from time 0 [s]: two devices' clocks are never in step.
    """

    rate: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        positive("sample rate", self.rate, "Hz")
        if not math.isfinite(self.offset):
            raise InvalidValueError(f"offset = {self.offset!r} s: must be finite")


@dataclass(frozen=True, slots=True)
class Dropouts:
    """Samples lost independently in transmission; the reader keeps the last one with its time stamp.

    Attributes:
        probability: That a sample is lost, below 1.
    """

    probability: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability < 1.0:
            raise InvalidValueError(f"probability = {self.probability!r}: must be 0 or above, below 1")


def _six(name: str, values: Wrench) -> None:
    if len(values) != len(AXES):
        raise InvalidValueError(f"{name} has {len(values)} entries: must be 6, {' '.join(AXES)}")


def _specimen(specimen: int) -> int:
    if specimen < 0:
        raise InvalidValueError(f"specimen = {specimen}: must be a whole number, 0 or above")
    return specimen
