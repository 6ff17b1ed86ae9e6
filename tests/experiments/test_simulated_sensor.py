"""From a robot file to a simulated sensor: what is written replaces the preset's, nothing else changes."""

from dataclasses import fields

import numpy as np
import pytest

from palpate.robots.simulated_sensor import model_of
from palpate.robots.simulated_sensor_entry import (
    BiasEntry,
    DriftEntry,
    FirstOrderEntry,
    NoiseEntry,
    PresetSensor,
    QuantisationEntry,
    RangeEntry,
    SaturationEntry,
    SecondOrderEntry,
    SimulatedSensorEntry,
)
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.presets import sensor_preset
from palpate.sim.sensor.simulation import simulated_sensor
from palpate.sim.sensor.stages import FirstOrderLag, SampleClock, SecondOrderLag, alike

UP = (0.0, 0.0, 9.81)
SIX = {"force": (1.0, 2.0, 3.0), "moment": (0.4, 0.5, 0.6)}
ALL = (1.0, 2.0, 3.0, 0.4, 0.5, 0.6)


def differences(one, other):
    return {f.name for f in fields(SensorModel) if getattr(one, f.name) != getattr(other, f.name)}


@pytest.mark.parametrize("preset", PresetSensor)
def test_a_preset_alone_is_that_specimen(preset):
    assert model_of(SimulatedSensorEntry(preset=preset, specimen=4), None) == sensor_preset(preset, 4)


@pytest.mark.parametrize(
    ("said", "field"),
    [
        ({"range": RangeEntry(**SIX)}, "rated"),
        ({"cross_talk": 0.02}, "cross_talk"),
        ({"bandwidth": FirstOrderEntry(cutoff=50.0)}, "bandwidth"),
        ({"bias": BiasEntry(**SIX)}, "bias"),
        ({"drift": DriftEntry(**SIX, time_constant=5.0)}, "thermal_drift"),
        ({"quantisation": QuantisationEntry(force=0.1, moment=0.01)}, "quantisation"),
        ({"saturation": SaturationEntry(**SIX)}, "saturation"),
        ({"sample_rate": 100.0}, "clock"),
        ({"latency": 0.01}, "latency"),
        ({"lost_share": 0.1}, "dropouts"),
    ],
)
def test_one_key_changes_one_imperfection(said, field):
    plain = sensor_preset(PresetSensor.NANO17, 2)
    entry = SimulatedSensorEntry(preset=PresetSensor.NANO17, specimen=2, **said)
    assert differences(model_of(entry, None), plain) == {field}
    assert differences(model_of(entry, NoiseEntry(force=0.5)), plain) == {field, "noise"}


def test_zeros_take_everything_away():
    nothing = SimulatedSensorEntry(
        preset=PresetSensor.NANO17,
        cross_talk=0.0,
        drift=DriftEntry(time_constant=1.0),
        quantisation=QuantisationEntry(),
        sample_rate=0.0,
        latency=0.0,
        lost_share=0.0,
    )
    model = model_of(nothing, NoiseEntry())
    left = differences(model, SensorModel())
    assert left == {"name", "source", "rated", "saturation"}


def test_what_is_stated_is_what_is_simulated():
    entry = SimulatedSensorEntry(
        range=RangeEntry(**SIX),
        bandwidth=SecondOrderEntry(natural_frequency=80.0, damping=0.5),
        sample_rate=250.0,
        latency=0.002,
        lost_share=0.25,
    )
    model = model_of(entry, NoiseEntry(force=0.1, moment=0.02))
    assert model.rated == ALL
    assert model.bandwidth == SecondOrderLag(80.0, 0.5)
    assert model.clock == SampleClock(250.0)
    assert (model.latency, model.dropouts.probability) == (0.002, 0.25)
    assert model.noise.sd == alike(0.1, 0.02)
    assert model_of(SimulatedSensorEntry(bandwidth=FirstOrderEntry(cutoff=9.0)), None).bandwidth == FirstOrderLag(
        9.0
    )


def test_a_drift_ends_where_it_is_stated_to_and_is_at_63_percent_after_its_time_constant():
    model = model_of(SimulatedSensorEntry(drift=DriftEntry(**SIX, time_constant=2.0)), None)
    sensor = simulated_sensor(model, 1.0)
    shown = [np.array(sensor.step(float(t), (0.0,) * 6, UP).wrench) / ALL for t in range(41)]
    assert shown[0] == pytest.approx(0.0, abs=1e-12)
    assert shown[2] == pytest.approx(1.0 - np.exp(-1.0))
    assert shown[40] == pytest.approx(1.0, abs=1e-8)


def test_cross_talk_is_the_specimens_own_scaled():
    own = []
    for share in (0.01, 0.02):
        entry = SimulatedSensorEntry(preset=PresetSensor.NANO17, specimen=5, cross_talk=share)
        own.append(np.array(model_of(entry, None).cross_talk.matrix) - np.eye(6))
    assert own[1] == pytest.approx(2.0 * own[0])
