"""How a robot file says what is wrong with a simulated sensor."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.open_kinds import as_written
from palpate.robots.robot import load_robot
from palpate.robots.robot_file import read_robot_file
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
from palpate.yaml_text import yaml_text

HEAD = """palpate_robot: 1
name: mine
backend: {kind: stage, mass_kg: 5, bandwidth_rad_per_s: 100, following_error_m: 0.0025, time_step_s: 0.0005}
period_s: 0.001
fingers:
  - surface: {kind: sphere, radius_m: 0.008}
    payload: {mass_kg: 0.03}
"""


def finger(lines):
    return read_robot_file(HEAD + "".join(f"    {line}\n" for line in lines)).fingers[0]


def test_left_out_there_is_neither_noise_nor_anything_else():
    found = finger([])
    assert found.noise is None
    assert found.simulated_sensor is None


def test_the_short_form_of_noise_is_as_ever():
    assert finger(["noise: {force_N: 0.01}"]).noise == NoiseEntry(force=0.01, moment=0.0)


def test_every_imperfection_has_a_key_with_its_unit():
    lines = """simulated_sensor:
      preset: nano17
      specimen: 3
      range: {force_N: [12, 12, 17], moment_Nm: [0.12, 0.12, 0.12]}
      cross_talk: 0.02
      bandwidth: {kind: second_order, natural_frequency_Hz: 300, damping: 0.6}
      bias: {force_N: [0, 0, 0.1]}
      drift: {force_N: [0.01, 0, 0], moment_Nm: [0, 0, 1e-4], time_constant_s: 600}
      quantisation: {force_N: 0.003, moment_Nm: 1e-5}
      saturation: {force_N: [13, 13, 18], moment_Nm: [0.13, 0.13, 0.13]}
      sample_rate_Hz: 7000
      latency_s: 0.0003
      lost_share: 0.01
      tare_s: 1"""
    assert finger([lines]).simulated_sensor == SimulatedSensorEntry(
        preset=PresetSensor.NANO17,
        specimen=3,
        range=RangeEntry(force=(12.0, 12.0, 17.0), moment=(0.12, 0.12, 0.12)),
        cross_talk=0.02,
        bandwidth=SecondOrderEntry(natural_frequency=300.0, damping=0.6),
        bias=BiasEntry(force=(0.0, 0.0, 0.1)),
        drift=DriftEntry(force=(0.01, 0.0, 0.0), moment=(0.0, 0.0, 1e-4), time_constant=600.0),
        quantisation=QuantisationEntry(force=0.003, moment=1e-5),
        saturation=SaturationEntry(force=(13.0, 13.0, 18.0), moment=(0.13, 0.13, 0.13)),
        sample_rate=7000.0,
        latency=0.0003,
        lost_share=0.01,
        tare=1.0,
    )


@pytest.mark.slow
@given(
    preset=st.sampled_from(PresetSensor),
    specimen=st.integers(0, 2**31),
    latency=st.none() | st.floats(0.0, 1.0),
    cutoff=st.none() | st.floats(1e-3, 1e6),
    noise=st.none() | st.floats(0.0, 1e3),
)
def test_it_reads_back_from_its_text_to_the_very_same(preset, specimen, latency, cutoff, noise):
    file = load_robot("stage").file
    entry = SimulatedSensorEntry(
        preset=preset,
        specimen=specimen,
        latency=latency,
        bandwidth=cutoff and FirstOrderEntry(cutoff=cutoff),
    )
    one = msgspec.structs.replace(
        file.fingers[0], simulated_sensor=entry, noise=None if noise is None else NoiseEntry(force=noise)
    )
    robot = msgspec.structs.replace(file, fingers=(one,))
    assert read_robot_file(yaml_text(as_written(robot))) == robot


MISTAKES = [
    ("{preset: nano}", ["simulated_sensor.preset = 'nano'", "did you mean nano17?"]),
    ("{preset: nano17, latency_ms: 1}", ["latency_ms: unknown key", "write latency_s"]),
    ("{preset: nano17, latency_s: 2}", ["latency_s = 2.0", "0 to 1 s"]),
    ("{preset: nano17, latency_s: -0.001}", ["latency_s"]),
    ("{preset: nano17, sample_rate_Hz: .inf}", ["sample_rate_Hz"]),
    ("{preset: nano17, cross_talk: 1}", ["cross_talk = 1.0", "0 to 0.2 of a full load"]),
    ("{cross_talk: 0.01}", ["cross_talk = 0.01", "give range, or a preset"]),
    ("{preset: nano17, lost_share: 1}", ["lost_share = 1.0", "of all samples"]),
    ("{preset: nano17, specimen: -1}", ["specimen = -1"]),
    ("{preset: nano17, specimen: 1.5}", ["specimen = 1.5: must be a whole number"]),
    ("{preset: nano17, tare_s: 1000}", ["tare_s = 1000.0", "0.1 to 60 s"]),
    ("{preset: nano17, bias: {force_N: 0.1}}", ["bias.force_N = 0.1: must be a list, as in [0.1]"]),
    ("{preset: nano17, bias: {force_N: [0, 0, 2000]}}", ["force_N = 2000.0"]),
    ("{preset: nano17, quantisation: {force_N: -1}}", ["quantisation.force_N"]),
    ("{preset: nano17, saturation: {force_N: [0, 1, 1], moment_Nm: [1, 1, 1]}}", ["force_N = 0.0", "above 0"]),
    ("{preset: nano17, bandwidth: {cutoff_Hz: 10}}", ["bandwidth.kind: missing"]),
    ("{preset: nano17, bandwidth: {kind: second_order, natural_frequency_Hz: 10, damping: 2}}", ["damping = 2.0"]),
    ("{preset: nano17, drift: {force_N: [1, 1, 1]}}", ["drift.time_constant_s: missing"]),
]


@pytest.mark.parametrize(("text", "words"), MISTAKES)
def test_what_cannot_be_is_refused_with_its_place(text, words):
    with pytest.raises(InvalidValueError) as found:
        finger([f"simulated_sensor: {text}"])
    for word in words:
        assert word in str(found.value)
