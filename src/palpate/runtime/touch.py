"""From samples to observations: touch's estimate from what the devices reported."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from palpate.errors import InvalidValueError
from palpate.runtime.data import FingerObservation, Observation, Sample
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.contact import ContactStatus
from palpate.sensing.ft.health import HEALTHY
from palpate.sensing.ft.pipeline import FTPipeline, PipelineOutput
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sensing.ft.touch_detector import ContactDetector
from palpate.sensing.solver import Surface, contact_from_wrench
from palpate.spatial import Vector, Wrench, norm


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

    def pipeline(self) -> WrenchPipeline:
        """Return a fresh pipeline for its sensor."""
        ...


class PlainPipeline:
    """The pipeline of a sensor without flaws: weight and inertia come off, nothing is filtered."""

    delay = 0.0

    def __init__(self, payload: SensorPayload, touch_force: float, release_force: float) -> None:
        """Take what the sensor carries, and the thresholds of a touch [N]."""
        self._payload = payload
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
    """

    surface: Surface
    payload: SensorPayload = field(default_factory=SensorPayload)
    touch_force: float = 0.2
    release_force: float = 0.1

    def __post_init__(self) -> None:
        self.pipeline()  # refuses thresholds that cannot be

    def pipeline(self) -> WrenchPipeline:
        """See `FingerDescription`."""
        return PlainPipeline(self.payload, self.touch_force, self.release_force)


@dataclass(frozen=True, slots=True)
class SensorFinger:
    """A fingertip on a sensor as its file describes it: calibration, bias, payload, filters, limits.

    Attributes:
        surface: The fingertip, in the sensor frame.
        sensor: As loaded by `palpate.sensing.ft.load_sensor_file`.
    """

    surface: Surface
    sensor: SensorFile

    def pipeline(self) -> WrenchPipeline:
        """See `FingerDescription`."""
        return FTPipeline(self.sensor)


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
        for finger in fingers:  # compile what is not yet compiled: never in the loop
            contact_from_wrench(finger.surface, np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]))

    @property
    def delay(self) -> float:
        """From a load to the observation that shows it [s]: the slowest finger's."""
        return max(pipeline.delay for pipeline in self._pipelines)

    def start(self) -> None:
        """Forget all samples so far."""
        for pipeline in self._pipelines:
            pipeline.restart()

    def sense(self, sample: Sample) -> Observation:
        """Return what the sample means.

        Raises:
            InvalidValueError: The sample has another number of wrenches than there are fingers.
        """
        if len(sample.wrenches) != len(self.fingers):
            raise InvalidValueError(
                f"the sample has {len(sample.wrenches)} wrenches: there are {len(self.fingers)} fingers"
            )
        observed = []
        for finger, pipeline, given in zip(self.fingers, self._pipelines, sample.wrenches, strict=True):
            wrench, touching, health = pipeline.step(given.wrench, given.acceleration)
            contact = contact_from_wrench(finger.surface, np.array(wrench))
            touching = touching and contact.status is ContactStatus.OK
            observed.append(FingerObservation(given.time, wrench, contact, touching, health))
        return Observation(sample.time, sample.arm, tuple(observed), sample.hand)
