"""The real stage in MuJoCo, sweeping a sphere at 2 N when something goes wrong."""

import math
from dataclasses import replace

import msgspec

from faults.fault_rig import FaultyBackend, Rig, Samples
from palpate.commands.calibrate.run import preset_sensor
from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    Raster,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.paths import Follow
from palpate.runtime.data import Sample
from palpate.runtime.pacing import Pacer
from palpate.runtime.supervision import Limits
from palpate.runtime.touch import Finger, FingerDescription, SensorFinger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.sensor_file import CalibrationEntry, PayloadEntry, SensorFile
from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Stage, Tip, build_scene, white_noise
from palpate.spatial import Vector, norm, scale
from palpate.surfaces import Sphere

RADIUS, FORCE, PERIOD, SPEED = 0.008, 2.0, 1e-3, 0.02
LAW, STAGE, TARGET = ContactLaw(), Stage(), SphereObject()
TIP = Tip(Sphere(RADIUS))
RASTER = Raster(0.02, 0.008, 0.004)
NOISE = white_noise(1 / 320, 1e-3 / 64, seed=4)
"""An ATI Nano17's (its data sheet's resolution)."""
SENSED = Sphere(RADIUS - FORCE / (2 * LAW.stiffness))
AT = 700
"""Index of the first period with the fault: in the middle of the first row."""

_CORNER_X, _CORNER_Y = RASTER.corners()[0]
_START_Z = math.sqrt((TARGET.radius + RADIUS) ** 2 - _CORNER_X**2 - _CORNER_Y**2) + 0.0005
_SCENE = build_scene(TIP, TARGET, LAW, (_CORNER_X, _CORNER_Y, _START_Z), STAGE)


def plain_finger() -> Finger:
    """A sensor that reports what it is given."""
    return Finger(SENSED, SensorPayload(TIP.mass))


def nano17() -> SensorFile:
    """A sensor that carries the tip."""
    return msgspec.structs.replace(preset_sensor("nano17"), payload=PayloadEntry(mass=TIP.mass))


FULL_SCALE = 32767
"""Counts of a 16 bit converter."""


def digitised(sensor: SensorFile, share: float) -> tuple[SensorFile, Samples]:
    """The same sensor, read through a converter that clips at a share of its range."""
    per_count = [share * limit / FULL_SCALE for limit in sensor.axis_limits]
    matrix = tuple(tuple(per_count[i] * (i == j) for j in range(6)) for i in range(6))
    raw = CalibrationEntry(
        raw_unit="counts", matrix=matrix, offset=(0.0,) * 6, raw_range=(-float(FULL_SCALE), float(FULL_SCALE))
    )

    def read(now: Sample, before: Sample) -> Sample:
        (first,) = now.wrenches
        counts = (round(x / unit) for x, unit in zip(first.wrench, per_count, strict=True))
        clipped = tuple(float(min(max(n, -FULL_SCALE), FULL_SCALE)) for n in counts)
        return replace(now, wrenches=(replace(first, wrench=clipped),))

    return msgspec.structs.replace(sensor, calibration=raw), Samples(read)


def sensor_finger() -> SensorFinger:
    """A sensor with ranges, noise and a health monitor."""
    return SensorFinger(SENSED, nano17())


def controller() -> ExploreController:
    """As `palpate explore` builds it."""
    delay = tracking_delay(PERIOD, STAGE.lag)
    gain = force_gain(series_stiffness(LAW.stiffness, STAGE.stiffness(TIP.mass)), delay)
    return ExploreController(
        ExploreParameters(force=FORCE, speed=SPEED, gain=gain, lead=delay), Follow(RASTER), PERIOD
    )


class JointedStage(MujocoBackend):
    """A stage that tells of joints."""

    def _sample(self, time):
        now = super()._sample(time)
        return replace(now, arm=replace(now.arm, joint_position=(0.0, 0.0)))


def stage_rig(finger: FingerDescription, pacer: Pacer | None = None, duration: float = 1.5) -> Rig:
    backend = FaultyBackend(JointedStage(_SCENE, PERIOD, NOISE, pacer))
    return Rig(backend, Touch(finger), controller(), Limits().allowing(0.025), duration)


def away(rig: Rig, index: int) -> Vector:
    """Truly out of the object: both are spheres, the object's centre is the origin."""
    position = rig.backend.truly[min(index, len(rig.backend.truly) - 1)].arm.position_base_tip
    return scale(1.0 / norm(position), position)
