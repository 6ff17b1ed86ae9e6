"""A fingertip on a sensor as its file describes it, in the loop: biased, noisy, filtered, and its delay known."""

import numpy as np
import pytest

from palpate import Sphere
from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    Raster,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.paths import Follow
from palpate.runtime import Ending, Limits, MemoryLog, Recorder, SensorFinger, Supervisor, Touch, run
from palpate.sensing.ft import read_sensor
from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Stage, Tip, build_scene, white_noise

FORCE, STIFFNESS, PERIOD = 2.0, 20e3, 1e-3
SENSOR = """
palpate_sensor: 1
model: simulated
serial_number: "1"
date: 2026-01-01
provenance: made for this test
sample_rate_Hz: 1000
force_range_N: [17, 17, 17]
moment_range_Nm: [0.12, 0.12, 0.12]
noise_force_N: [0.003, 0.003, 0.003]
noise_moment_Nm: [1.6e-05, 1.6e-05, 1.6e-05]
filters: [{kind: critically_damped, cutoff_Hz: 60}]
payload: {mass_kg: 0.03, center_of_mass_m: [0, 0, 0]}
contact: {touch_force_N: 0.2, release_force_N: 0.1}
"""


def explored(finger, delay):
    """Sweep two rows over a sphere, with the delay that the controller knows."""
    tip, stage = Tip(Sphere(0.008)), Stage()
    raster = Raster(0.02, 0.004, 0.004)
    x, y = raster.corners()[0]
    scene = build_scene(tip, SphereObject(), ContactLaw(), (x, y, 0.0505), stage)
    backend = MujocoBackend(scene, PERIOD, white_noise(0.003, 1.6e-5))
    lag = tracking_delay(PERIOD, stage.lag, delay)
    gain = force_gain(series_stiffness(STIFFNESS, stage.stiffness(tip.mass)), lag)
    memory, true_force = MemoryLog(), []

    def truth(sample, now, command):
        true_force.append(np.linalg.norm(backend.truth().force))

    parameters = ExploreParameters(force=FORCE, speed=0.02, gain=gain, lead=lag)
    result = run(
        backend,
        Touch(finger),
        ExploreController(parameters, Follow(raster), PERIOD),
        Supervisor(Limits().allowing(0.025)),
        duration=20.0,
        recorder=Recorder(memory),
        observers=(truth,),
    )
    record = memory.record()
    scan = record.phase == "scan"
    normal = np.array(true_force)[scan] / np.sqrt(1.0 + 0.3**2)
    return result, float(np.sqrt(np.mean(np.square(normal - FORCE))))


@pytest.fixture(scope="module")
def sensor():
    return read_sensor(SENSOR)


def test_the_delay_of_the_filter_reaches_the_controllers(sensor):
    touch = Touch(SensorFinger(Sphere(0.008), sensor))
    # two equal poles; 3 dB of both together at 60 Hz puts each at 60 Hz / sqrt(sqrt(2) - 1)
    pole = 60.0 / np.sqrt(np.sqrt(2.0) - 1.0)
    assert touch.delay == pytest.approx(2.0 / (2 * np.pi * pole), rel=0.02)
    assert Touch(SensorFinger(Sphere(0.008), sensor), SensorFinger(Sphere(0.008), sensor)).delay == touch.delay


def test_an_exploration_through_a_filtered_sensor_holds_its_force(sensor):
    finger = SensorFinger(Sphere(0.008 - FORCE / (2 * STIFFNESS)), sensor)
    result, error = explored(finger, Touch(finger).delay)
    assert result.ending is Ending.DONE, result.trip
    assert error < 0.06
