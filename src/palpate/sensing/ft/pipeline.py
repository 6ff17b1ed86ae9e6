"""From a device's reading to the contact wrench, once per sample.

    reading -> calibration -> bias -> compensation -> filter -> contact wrench -> touching?
                     `-> health

Weight and inertia come off before the filter, not after it: so the acceleration, which is taken at the same
instant as the load, is delayed by exactly as much.

A device slower than its reader repeats itself. That is held to be so by the sensor file (`device_rate_Hz`), not
guessed from readings that are alike: filters run on, which smooths the steps; only what counts samples, and what
takes them for independent, knows better.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from palpate.compiling import machine_code
from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.ft.compiled import BROKEN, NEARLY, PENDING, RESTING, SOUND, sample, touched
from palpate.sensing.ft.filters import WrenchFilter
from palpate.sensing.ft.health import HEALTHY, DriftWatch, HealthCheck, HealthLimits, HealthMonitor, SampleHealth
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sensing.ft.touch_detector import ContactDetector
from palpate.spatial import Vector, Wrench

DRIFT_TIME = 5.0
"""[s] over which the unloaded mean is taken."""

IMPOSSIBLE_RATIO = 1000.0
"""Of a contact wrench to the range: no load but a broken message. It is kept out of the filter, where it would
linger for many time constants, or overflow."""

NO_WRENCH: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Before the first sample."""


class PipelineOutput(NamedTuple):
    """What a sample says.

    Attributes:
        wrench: What the object exerts on the finger, filtered, sensor frame [N, N m]. When the reading or the
            acceleration is not finite or absurd (`health` says so) it is that of the last good sample.
        touching: Whether the force says that there is a contact.
        health: What is wrong, if anything.
    """

    wrench: Wrench
    touching: bool
    health: SampleHealth


class FTPipeline:
    """A force/torque sensor as its file describes it. One object per sensor, one `step` per sample."""

    def __init__(self, sensor: SensorFile) -> None:
        """Build it; everything slow happens here.

        Raises:
            InvalidValueError: The touch force is within the noise that the filters leave.
        """
        self.sensor = sensor
        entry = sensor.calibration
        self.channels = 6 if entry is None else entry.map.channels
        self._limits = sensor.axis_limits
        self._filter = WrenchFilter(sensor.filters, sensor.sample_rate)
        raw = (-math.inf, math.inf) if entry is None else entry.raw_range
        limits = HealthLimits(sensor.axis_limits, raw=raw).of_readings(sensor.repeats)
        self._monitor = HealthMonitor(limits, self.channels)
        period = 1.0 / sensor.sample_rate
        contact = sensor.contact
        self._detector = ContactDetector(
            touch_force=contact.touch_force,
            release_force=contact.release_force,
            noise=max(sensor.noise_force) * self._filter.held_noise_gain(sensor.repeats),
            period=period,
            touch_time=contact.touch_time,
            release_time=contact.release_time,
        )
        # Half of what would already pass for a touch; moments in the same proportion to their noise.
        drift = 0.5 * contact.touch_force / max(sensor.noise_force)
        a, b, c, d, e, f = (drift * sd for sd in sensor.noise)
        self._drift = DriftWatch((a, b, c, d, e, f), max(DRIFT_TIME, 10.0 * period), period)
        self._load = np.zeros(6)
        self._wrench = NO_WRENCH
        self._bind(_numbers(sensor, limits), limits.frozen_samples)

    def _bind(self, sensor: tuple[FloatArray, npt.NDArray[np.int64]], frozen: int) -> None:
        """Bind all that stays where it is to what is compiled."""
        filters, still = self._filter, self._monitor.stillness
        watched = (self._detector.numbers, self._detector.memory, self._drift.limits, self._drift.memory)
        resting = (still.last, still.unchanged, float(frozen), self._load)
        fixed = (*sensor, filters.coefficients, filters.states, *resting, *watched)
        given = (True, (0.0,) * self.channels, (0.0, 0.0, 0.0))
        self._sample = partial(machine_code(sample, *fixed, *given), *fixed)
        self._touched = partial(machine_code(touched, *watched, NO_WRENCH), *watched)

    @property
    def delay(self) -> float:
        """From the load to the wrench that `step` returns [s]: device and filters, for slow changes."""
        return self.sensor.device_delay + self._filter.delay

    def restart(self) -> None:
        """Forget all samples so far."""
        self._filter.restart()
        self._monitor.restart()
        self._detector.restart()
        self._drift.restart()
        self._wrench = NO_WRENCH

    def step(self, reading: Sequence[float], acceleration: Vector) -> PipelineOutput:
        """Return what a sample says.

        Args:
            reading: Raw channels, or the wrench if the sensor file has no calibration.
            acceleration: Specific force at the sensor, sensor frame [m/s^2] (at rest up, length g).

        Raises:
            InvalidValueError: Another number of channels than the sensor has.
        """
        if len(reading) != self.channels:
            raise InvalidValueError(
                f"the reading has {len(reading)} channels: sensor {self._named} has {self.channels}"
            )
        what, wrench, touching, axis = self._sample(self._filter.started, tuple(reading), tuple(acceleration))
        health = HEALTHY if what & ~PENDING == SOUND else self._health(what, reading)
        if what & PENDING:
            ratio = math.hypot(*[x / y for x, y in zip(wrench, self._limits, strict=True)])
            if not ratio < IMPOSSIBLE_RATIO:
                if health is HEALTHY:
                    # The load is in order, so it is the acceleration that is not.
                    health = SampleHealth(HealthCheck.IMPOSSIBLE, "acceleration", ratio, IMPOSSIBLE_RATIO)
                return PipelineOutput(self._wrench, self._detector.touching, health)
            wrench = self._filter.step(wrench)
            touching, axis = self._touched(wrench)
        self._wrench = wrench
        if axis >= 0 and health is HEALTHY:
            health = self._drift.verdict(axis)
        return PipelineOutput(wrench, touching, health)

    def _health(self, what: int, reading: Sequence[float]) -> SampleHealth:
        """Say what is wrong with the last reading."""
        a, b, c, d, e, f = self._load.tolist()
        verdict = self._monitor.judge(reading, (a, b, c, d, e, f)) if what & BROKEN else HEALTHY
        return self._monitor.stillness.verdict() if verdict is HEALTHY and what & RESTING else verdict

    @property
    def _named(self) -> str:
        return f"{self.sensor.model} {self.sensor.serial_number}"


def _numbers(sensor: SensorFile, limits: HealthLimits) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return a sensor's numbers, and the products of its calibration, as `sample` takes them."""
    payload = sensor.payload.payload
    numbers: list[float] = [*sensor.bias, payload.mass, *payload.center_of_mass, *limits.axis, *limits.raw]
    numbers += [NEARLY * min(1.0, limits.combined) ** 2, NEARLY * IMPOSSIBLE_RATIO**2]
    products: tuple[tuple[int, int], ...] = ()
    if sensor.calibration is not None:
        known = sensor.calibration.map
        products = known.products
        numbers += known.offset
        for row in known.matrix:
            numbers += row
    return np.array(numbers), np.array(products, np.int64).reshape(-1, 2)
