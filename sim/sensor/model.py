"""The model of an imperfect force/torque sensor, in the order of the signal chain.

    load -> cross-talk -> bandwidth -> bias and drift -> noise -> quantisation -> saturation
         -> sampled by the device's clock -> delayed by `latency` -> lost, or read

- The structure and its strain gauges mix the axes (cross-talk) and follow with their own dynamics (bandwidth).
  Both are linear and the dynamics are the same for every axis, so that which comes first makes no difference.
- A warm bridge adds its drift to what the gauges say, whatever the load: after cross-talk, and not slowed down.
- Noise is stated by data sheets for readings: it is added behind the bandwidth, one fresh value per sample.
- Rounding follows noise, never precedes it: noise of a step or more makes the rounding error an even spread, and
  less lets readings stick to a step. Saturation is last, so that nothing is ever shown beyond its limit.
- All this happens when the device samples; that is what the time stamp says. Latency only keeps the sample from
  the reader. As nothing before it knows what time it is, but for drift, which the stamp's time decides, the delay
  may be worked out anywhere: here it is the load that is looked at so much earlier, exactly, also between two
  periods of the reader.
- A lost sample leaves the reader with the one before, whose stamp is old. So does reading faster than the device
  samples.

Every piece may be missing, and costs nothing then. The load is taken to change steadily between the times at
which it is given, and the bandwidth is exact for that.

The acceleration in a sample passes bandwidth, clock and latency as the load does, and nothing else: it belongs to
the same instant, and weight and inertia come off as exactly as from an ideal sensor.
"""

import math
from dataclasses import dataclass, field

from palpate.errors import InvalidValueError, not_negative
from palpate.sensing.ft.arrays import AXES
from palpate.sim.sensor.stages import (
    CrossTalk,
    Dropouts,
    FirstOrderLag,
    Quantisation,
    RandomWalk,
    SampleClock,
    Saturation,
    SecondOrderLag,
    WhiteNoise,
    alike,
    checked_limits,
)
from palpate.sim.sensor.temperature import ThermalDrift
from palpate.spatial import Wrench

NO_BIAS: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

LARGEST_LATENCY = 1.0
"""[s]. More is a number in milliseconds, as in `palpate.sensing.ft.sensor_file`."""


LEAST_DITHER = 0.4
"""Noise over a digital step. In the middle of a step, 0.79 of all readings then are the same: that all six are so
for 20 samples, by which a dead sensor is known (`palpate.sensing.ft.health`), happens once in 1e12."""


@dataclass(frozen=True, slots=True)
class SensorModel:
    """A force/torque sensor with its imperfections; by itself a perfect one.

    Attributes:
        name: Maker and model.
        source: Where its metrics come from, and which are assumed.
        rated: Full load per axis [N, N m]; None if it is not limited.
        cross_talk: Error of its calibration.
        bandwidth: Of structure and filters in the device.
        bias: What it shows without load [N, N m].
        thermal_drift: How that moves with the temperature.
        random_walk: How it wanders besides.
        noise: Of each sample.
        quantisation: Steps of its readings.
        saturation: Where its readings end.
        clock: When it samples; None: whenever it is read.
        latency: From sampling until it can be read [s].
        dropouts: Samples lost in transmission.
    """

    name: str = "perfect sensor"
    source: str = "no imperfections"
    rated: Wrench | None = None
    cross_talk: CrossTalk | None = None
    bandwidth: FirstOrderLag | SecondOrderLag | None = None
    bias: Wrench = NO_BIAS
    thermal_drift: ThermalDrift | None = None
    random_walk: RandomWalk | None = None
    noise: WhiteNoise | None = None
    quantisation: Quantisation | None = None
    saturation: Saturation | None = None
    clock: SampleClock | None = None
    latency: float = 0.0
    dropouts: Dropouts | None = None

    def __post_init__(self) -> None:
        if self.rated is not None:
            checked_limits("rated load", self.rated)
        if len(self.bias) != len(AXES) or not all(math.isfinite(x) for x in self.bias):
            raise InvalidValueError(f"bias = {self.bias!r}: must be 6 finite numbers [N, N m]")
        not_negative("latency", self.latency, "s")
        if self.latency > LARGEST_LATENCY:
            raise InvalidValueError(
                f"latency = {self.latency:g} s: must be at most {LARGEST_LATENCY:g} s; another unit?"
            )

    @property
    def is_perfect(self) -> bool:
        """Whether it shows every load as it is, at once."""
        stages = (
            self.cross_talk,
            self.bandwidth,
            self.thermal_drift,
            self.random_walk,
            self.noise,
            self.quantisation,
            self.saturation,
            self.clock,
            self.dropouts,
        )
        return not any(self.bias) and self.latency == 0.0 and all(stage is None for stage in stages)

    @property
    def lag(self) -> float:
        """From a steadily changing load to the stamp of the sample that shows it [s]: the bandwidth's."""
        return 0.0 if self.bandwidth is None else self.bandwidth.lag

    @property
    def delay(self) -> float:
        """From a steadily changing load until its sample is what is read, on the average [s].

        Lag, latency, and half a sample of the clock's if it has one: how old the newest one is at a random moment.
        """
        waiting = 0.0 if self.clock is None else 0.5 / self.clock.rate
        return self.lag + self.latency + waiting

    @property
    def dithering(self) -> Wrench:
        """Noise that changes a reading all the time, per axis [N, N m]; 0 where digital steps are too coarse."""
        noise = NO_BIAS if self.noise is None else self.noise.sd
        steps = NO_BIAS if self.quantisation is None else self.quantisation.step
        pairs = zip(noise, steps, strict=True)
        a, b, c, d, e, f = (sd if sd >= LEAST_DITHER * step else 0.0 for sd, step in pairs)
        return (a, b, c, d, e, f)

    @property
    def noise_sd(self) -> Wrench:
        """Standard deviation of a reading at rest per axis [N, N m]: noise and rounding, no drift."""
        noise = NO_BIAS if self.noise is None else self.noise.sd
        rounding = NO_BIAS if self.quantisation is None else self.quantisation.sd
        a, b, c, d, e, f = (math.hypot(x, y) for x, y in zip(noise, rounding, strict=True))
        return (a, b, c, d, e, f)


@dataclass(frozen=True, slots=True)
class SeededSensor:
    """A sensor for a run.

    Attributes:
        model: What it is made of.
        seed: Of its random numbers: the same seed gives the same run.
    """

    model: SensorModel = field(default_factory=SensorModel)
    seed: int = 0

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise InvalidValueError(f"seed = {self.seed}: must be a whole number, 0 or above")


def white_noise(force: float = 0.0, moment: float = 0.0, seed: int = 0) -> SeededSensor:
    """Return a sensor with nothing but white noise, of these standard deviations [N, N m]; none at all at 0."""
    not_negative("force noise", force, "N")
    not_negative("moment noise", moment, "N m")
    return SeededSensor(noisy_sensor(force, moment) if force or moment else SensorModel(), seed)


def noisy_sensor(force: float, moment: float) -> SensorModel:
    """Return a sensor with nothing but white noise, of these standard deviations [N, N m]."""
    return SensorModel(name="noisy sensor", source="white noise as given", noise=WhiteNoise(alike(force, moment)))
