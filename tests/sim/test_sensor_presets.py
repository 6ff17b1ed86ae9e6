"""Presets keep to their data sheets; what the rest of palpate makes of a simulated sensor's samples."""

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from palpate.runtime.data import ArmSample, Sample
from palpate.runtime.supervision.fresh_samples import FreshSamples
from palpate.runtime.touch import SensorFinger, Touch
from palpate.sensing.compensation import contact_wrench
from palpate.sensing.ft import (
    ContactEntry,
    CriticallyDamped,
    FTPipeline,
    HealthCheck,
    PayloadEntry,
    read_sensor,
    sensor_text,
)
from palpate.sim.sensor.description import sensor_file
from palpate.sim.sensor.model import SensorModel, noisy_sensor
from palpate.sim.sensor.presets import PresetSensor, axia80, ft300s, nano17, sensor_preset, ur5e_sensor
from palpate.sim.sensor.simulation import simulated_sensor
from palpate.sim.sensor.stages import Dropouts, FirstOrderLag, SampleClock, alike
from palpate.spatial import IDENTITY, ZERO
from palpate.surfaces import Sphere
from support.sensor_readings import DT, NOTHING, REST, readings, sampled

REAL = [preset for preset in PresetSensor if preset is not PresetSensor.PERFECT]


@pytest.mark.parametrize("preset", REAL)
def test_a_preset_is_one_specimen_with_its_sources_and_limits(preset):
    one, again, other = (sensor_preset(preset, specimen) for specimen in (4, 4, 5))
    assert one == again
    assert one.cross_talk != other.cross_talk
    assert "ASSUMPTION" in one.source
    assert all(limit > rated for limit, rated in zip(one.saturation.limit, one.rated, strict=True))
    if one.thermal_drift is not None:
        assert one.thermal_drift != other.thermal_drift
        assert np.all(np.abs(one.thermal_drift.per_kelvin) <= 5e-4 * np.array(one.rated))


def ages_of(model):
    """Ages of the samples that a sensor of a model shows [s]."""
    return [DT * k - sample.time for k, sample in enumerate(sampled(simulated_sensor(model, DT), 1000))]


def test_a_nano17_shows_whole_steps_of_its_resolution_288_microseconds_late():
    model = nano17()
    at_once = simulated_sensor(replace(model, clock=None), DT).step(1.0, NOTHING, REST)
    assert 1.0 - at_once.time == pytest.approx(288e-6)
    shown = readings(model, 2000, (1.0, 2.0, -3.0, 0.01, 0.02, -0.03))
    steps = shown * (alike(320.0, 64e3))
    assert np.allclose(steps, np.round(steps), atol=1e-6)
    ages = ages_of(model)
    assert 288e-6 - 1e-9 <= min(ages) <= max(ages) <= 288e-6 + 1 / 7000 + 1e-9


def test_an_ft300s_ends_at_its_16_bits_and_is_old():
    shown = readings(ft300s(), 40, (400.0, -400.0, 0.0, 40.0, 0.0, 0.0))
    assert shown[-1, 0] == pytest.approx(327.67)
    assert shown[-1, 3] == pytest.approx(32.767)
    ages = ages_of(ft300s())
    assert 8.333e-3 - 1e-6 <= min(ages) <= max(ages) <= 18.334e-3


@pytest.mark.parametrize("specimen", [0, 3])
def test_a_ur5e_keeps_to_precision_and_accuracy_of_its_data_sheet(specimen):
    """Any one axis fully loaded: on all six, three sd are within the precision, and with the mean error within the
    accuracy."""
    model = ur5e_sensor(specimen)
    rated = np.array([50.0] * 3 + [10.0] * 3)
    for axis in range(6):
        load = tuple(float(x) for x in np.eye(6)[axis] * rated)
        shown = readings(model, 4000, load)[100::2]
        spread, error = 3.0 * shown.std(axis=0), np.abs(shown.mean(axis=0) - load)
        slack = 1.0 + 5.0 / math.sqrt(2.0 * len(shown))  # of the deviation of so many readings
        assert np.all(spread <= slack * np.array(alike(3.5, 0.2)))
        assert np.all(spread + error <= slack * np.array(alike(4.0, 0.3)))
        assert np.all(spread[np.arange(6) != axis] >= np.array(alike(3.5, 0.2))[np.arange(6) != axis] / slack)


def test_a_fault_free_axia_does_not_jump_by_more_than_its_manual_calls_normal():
    shown = readings(axia80(), 2000)
    assert np.mean(np.abs(shown) <= 5e-4 * np.array([500, 500, 900, 20, 20, 20])) > 0.99


@pytest.mark.slow
@pytest.mark.parametrize("preset", REAL)
def test_the_sensor_file_of_a_preset_reads_back_and_its_pipeline_finds_overloads_only(preset):
    model = sensor_preset(preset)
    file = sensor_file(model, DT, filters=(CriticallyDamped(60.0),), date="2026-11-21")
    assert read_sensor(sensor_text(file)) == file
    pipeline, sensor = FTPipeline(file), simulated_sensor(model, DT, 2)
    felt = [pipeline.step(sensor.step(DT * k, NOTHING, REST).wrench, REST) for k in range(3000)]
    assert not any(f.touching for f in felt)
    assert all(f.health.ok for f in felt)
    undelayed = FTPipeline(msgspec.structs.replace(file, device_delay=0.0))
    assert pipeline.delay == pytest.approx(model.delay + undelayed.delay)
    load = (2.0 * model.rated[0], 0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(3000, 3050):
        last = pipeline.step(sensor.step(DT * k, load, REST).wrench, REST)
    assert (last.health.measure, last.health.where) == (HealthCheck.OVERLOAD_AXIS, "Fx")


def test_the_sensor_file_says_what_is_known_of_the_sensor():
    bias = (0.1, 0.2, 0.3, 1e-3, 2e-3, 3e-3)
    model, payload = replace(nano17(), bias=bias), PayloadEntry(mass=0.03)
    file = sensor_file(model, DT, payload=payload, serial_number="FT1", date="2026-11-21")
    assert (file.model, file.provenance, file.serial_number) == (model.name, model.source, "FT1")
    assert (file.axis_limits, file.noise, file.bias, file.payload) == (model.rated, model.noise_sd, bias, payload)
    assert file.sample_rate == pytest.approx(1000.0)
    assert file.calibration is None


def test_the_touch_thresholds_are_of_the_devices_own_samples():
    """What a filter takes off fresh noise, it does not take off a reading that is repeated ten times."""
    filters, gain = (CriticallyDamped(60.0),), 6.0 * 0.1
    fast = sensor_file(replace(ft300s(), clock=None, quantisation=None), DT, filters=filters).contact
    slow = sensor_file(replace(ft300s(), quantisation=None), DT, filters=filters).contact
    assert slow.touch_force == pytest.approx(gain)
    assert fast.touch_force < 0.5 * gain
    assert (fast.touch_time, slow.touch_time) == pytest.approx((0.002, 0.02))
    own = ContactEntry(touch_force=3.0, release_force=1.0)
    assert sensor_file(ft300s(), DT, contact=own).contact == own


def test_the_delay_of_the_file_is_that_of_a_growing_load():
    model = SensorModel(
        rated=alike(10.0, 1.0),
        bandwidth=FirstOrderLag(50.0),
        latency=1.7e-3,
        clock=SampleClock(410.0, 0.1e-3),
        noise=noisy_sensor(1e-6, 1e-6).noise,
    )
    sensor, late = simulated_sensor(model, DT), []
    for k in range(10_000):
        t = DT * k
        late.append(t - sensor.step(t, (t, 0.0, 0.0, 0.0, 0.0, 0.0), REST).wrench[0])
    assert np.mean(late[1000:]) == pytest.approx(sensor_file(model, DT).device_delay, rel=0.01)


def observed(model, count, seed=3):
    """Observations through the whole of touch, and the samples."""
    payload = PayloadEntry(mass=0.03)
    file = sensor_file(model, DT, payload=payload)
    touch, sensor = Touch(SensorFinger(Sphere(0.008), file)), simulated_sensor(model, DT, seed)
    load = (-x for x in contact_wrench(NOTHING, REST, payload.payload))
    wrench = tuple(load)
    for k in range(count):
        shown = sensor.step(DT * k, wrench, REST)
        yield touch.sense(Sample(DT * k, ArmSample(DT * k, ZERO, IDENTITY, ZERO), (shown,))), shown


def test_the_supervisor_sees_lost_samples_by_their_stamps_and_only_those():
    healthy, losing = nano17(), replace(nano17(), dropouts=Dropouts(0.98))
    fresh, findings, before = FreshSamples(5e-3), [], None
    for now, _ in observed(healthy, 500):
        assert fresh.broken(now, before) is None
        before = now
    before = None
    for now, sample in observed(losing, 2000):
        finding = fresh.broken(now, before)
        assert (finding is not None) == (now.time - sample.time > 5e-3 + 1e-9)
        findings.append(finding)
        before = now
    assert 0 < sum(f is not None for f in findings) < 2000
    assert any(f is not None and "force/torque sensor 1" in f.measure for f in findings)
