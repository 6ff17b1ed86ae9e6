"""From samples to observations: touch's estimate from what the devices reported."""

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from palpate.errors import InvalidValueError
from palpate.runtime.data import FingerObservation, Observation, Sample, WrenchSample
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.contact import ContactStatus
from palpate.sensing.ft.health import HEALTHY, SampleHealth, StillnessWatch
from palpate.sensing.ft.pipeline import FTPipeline, PipelineOutput
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sensing.ft.touch_detector import ContactDetector
from palpate.sensing.solver import Solver, Surface
from palpate.spatial import Vector, Wrench, norm

_SIX = struct.Struct("6d")

NOISELESS: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Of an ideal sensor [N, N m]."""


class WrenchPipeline(Protocol):
    """What stands between a sensor and its contact wrench, and remembers earlier samples."""

    @property
    def delay(self) -> float:
        """From the load to the wrench that it explains [s]; known to controllers."""
        ...

    def restart(self) -> None:
        """Forget all samples so far."""
        ...

    def step(self, reading: Sequence[float], acceleration: Vector) -> PipelineOutput:
        """Return what a sample says."""
        ...


class FingerDescription(Protocol):
    """A fingertip and the sensor behind it."""

    @property
    def surface(self) -> Surface:
        """The fingertip, in the sensor frame."""
        ...

    @property
    def gives_wrenches(self) -> bool:
        """Whether its device's readings are wrenches, not raw channels."""
        ...

    def pipeline(self) -> WrenchPipeline:
        """Return a fresh pipeline for its sensor."""
        ...

    def stillness(self) -> StillnessWatch | None:
        """Return what finds that its readings have ceased to change; None if they may, or if the pipeline does."""
        ...


class PlainPipeline:
    """The pipeline of a sensor without flaws: weight and inertia come off, nothing is filtered."""

    def __init__(
        self, payload: SensorPayload, touch_force: float, release_force: float, delay: float = 0.0
    ) -> None:
        """Take what the sensor carries, the thresholds of a touch [N], and how late its readings are [s]."""
        self._payload, self.delay = payload, delay
        self._detector = ContactDetector(
            touch_force=touch_force, release_force=release_force, noise=0.0, period=1.0
        )

    def restart(self) -> None:
        """Forget whether it touches."""
        self._detector.restart()

    def step(self, reading: Sequence[float], acceleration: Vector) -> PipelineOutput:
        """Return what a sample says."""
        a, b, c, d, e, f = reading
        wrench: Wrench = contact_wrench((a, b, c, d, e, f), acceleration, self._payload)
        return PipelineOutput(wrench, self._detector.step(norm(wrench[:3])), HEALTHY)


@dataclass(frozen=True, slots=True)
class Finger:
    """A fingertip on a sensor without flaws.

    Attributes:
        surface: The fingertip, in the sensor frame.
        payload: What the sensor carries; its weight and inertia are taken off.
        touch_force: A force above this [N] is a touch,
        release_force: and the touch ends below this [N].
        noise: Standard deviation of a reading of each axis [N, N m]. A sensor with noise on all of them never
            repeats itself for long, unless it is dead; without, as in simulation, it may.
    """

    surface: Surface
    payload: SensorPayload = field(default_factory=SensorPayload)
    touch_force: float = 0.2
    release_force: float = 0.1
    noise: Wrench = NOISELESS

    def __post_init__(self) -> None:
        self.pipeline()  # refuses thresholds that cannot be

    @property
    def gives_wrenches(self) -> bool:
        """See `FingerDescription`."""
        return True

    def pipeline(self) -> WrenchPipeline:
        """See `FingerDescription`."""
        return PlainPipeline(self.payload, self.touch_force, self.release_force)

    def stillness(self) -> StillnessWatch | None:
        """See `FingerDescription`."""
        return StillnessWatch() if min(self.noise) > 0.0 else None


@dataclass(frozen=True, slots=True)
class SensorFinger:
    """A fingertip on a sensor as its file describes it: calibration, bias, payload, filters, limits.

    Attributes:
        surface: The fingertip, in the sensor frame.
        sensor: As loaded by `palpate.sensing.ft.load_sensor_file`.
    """

    surface: Surface
    sensor: SensorFile

    @property
    def gives_wrenches(self) -> bool:
        """See `FingerDescription`."""
        return self.sensor.calibration is None

    def pipeline(self) -> WrenchPipeline:
        """See `FingerDescription`."""
        return FTPipeline(self.sensor)

    def stillness(self) -> StillnessWatch | None:
        """See `FingerDescription`: the pipeline finds it, by the rates in the file."""
        return None


class _Stamped:
    """Watches the readings of one finger that have a new time stamp: a slow device's are read more than once."""

    def __init__(self, watch: StillnessWatch) -> None:
        self._watch = watch
        self.restart()

    def restart(self) -> None:
        self._watch.restart()
        self._time, self._health = -math.inf, HEALTHY

    def step(self, given: WrenchSample) -> SampleHealth:
        if given.time != self._time:
            self._time, self._health = given.time, self._watch.step(given.wrench)
        return self._health


def _feeling(
    surface: Surface, pipeline: WrenchPipeline, watch: _Stamped | None
) -> Callable[[WrenchSample], FingerObservation]:
    """Return what makes an observation of a finger's sample; compiled by now, never in the loop.

    It is a closure whose variables are its own: a loop that sleeps most of the time finds nothing in the caches,
    and every object that is looked at costs.
    """
    buffer = bytearray(_SIX.size)
    at = np.frombuffer(buffer)
    contact_there, step, pack = Solver(surface).reading(at), pipeline.step, _SIX.pack_into
    explained, healthy, observed = ContactStatus.OK, HEALTHY, FingerObservation
    at[2] = -1.0
    contact_there()

    def feel(given: WrenchSample) -> FingerObservation:
        wrench, touching, health = step(given.wrench, given.acceleration)
        if watch is not None and health is healthy:
            health = watch.step(given)
        pack(buffer, 0, *wrench)
        contact = contact_there()
        return observed(given.time, wrench, contact, touching and contact.status is explained, health)

    return feel


class Touch:
    """Senses with one or more fingers; all that it remembers is in their pipelines."""

    def __init__(self, *fingers: FingerDescription) -> None:
        """Take the fingers, in the order of the sample's wrenches.

        Raises:
            InvalidValueError: No finger given.
        """
        if not fingers:
            raise InvalidValueError("Touch() has no finger: give at least one")
        self.fingers = fingers
        self._pipelines = tuple(finger.pipeline() for finger in fingers)
        watches = [finger.stillness() for finger in fingers]
        self._watches = tuple(None if watch is None else _Stamped(watch) for watch in watches)
        surfaces = [finger.surface for finger in fingers]
        self._feels = tuple(map(_feeling, surfaces, self._pipelines, self._watches))

    @property
    def delay(self) -> float:
        """From a load to the observation that shows it [s]: the slowest finger's."""
        return max(pipeline.delay for pipeline in self._pipelines)

    def start(self) -> None:
        """Forget all samples so far."""
        for pipeline in self._pipelines:
            pipeline.restart()
        for watch in self._watches:
            if watch is not None:
                watch.restart()

    def sense(self, sample: Sample) -> Observation:
        """Return what the sample means.

        Raises:
            InvalidValueError: The sample has another number of wrenches than there are fingers.
        """
        feels, wrenches = self._feels, sample.wrenches
        if len(wrenches) != len(feels):
            raise InvalidValueError(f"the sample has {len(wrenches)} wrenches: there are {len(feels)} fingers")
        observed = tuple([feel(given) for feel, given in zip(feels, wrenches, strict=True)])
        return Observation(sample.time, sample.arm, observed, sample.hand)
