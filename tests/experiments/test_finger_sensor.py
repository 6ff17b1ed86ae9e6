"""Explorations with sensors as they are: what is known of them, what is refused, and the same again from a log."""

import re
from dataclasses import fields, replace

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.cli import main
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.robots.finger_sensor import check_age, model_of_finger, sensor_for
from palpate.robots.in_scene import check
from palpate.robots.known_sensor import check_known, described, known_sensor
from palpate.robots.robot import ROBOT_TEXT, read_robot
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
from palpate.robots.values import values_of
from palpate.runtime import Ending, SensorFinger
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.ft import FTPipeline, read_sensor, sensor_text
from palpate.sim import SeededSensor
from palpate.sim.fidelity import GRAVITY
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.presets import nano17, sensor_preset
from palpate.sim.sensor.simulation import simulated_sensor
from palpate.sim.sensor.stages import FirstOrderLag, SampleClock, SecondOrderLag, alike
from support.explore_runs import carried_out, felt_while_lowered, plan_of, planned_again
from support.run_bounds import below, check_bounds

SMALL = {"width": 0.01, "depth": 0.004, "speed": 0.05}
REAL = [preset for preset in PresetSensor if preset is not PresetSensor.PERFECT]
EVERYTHING = """{preset: nano17, specimen: 3, cross_talk: 0.005, bias: {force_N: [0.05, 0, 0.1]}, lost_share: 0.05,
      bandwidth: {kind: second_order, natural_frequency_Hz: 300}, sample_rate_Hz: 700, latency_s: 0.002,
      drift: {force_N: [0.1, 0, 0.1], time_constant_s: 50}, quantisation: {force_N: 0.004, moment_Nm: 2.0e-5},
      saturation: {force_N: [13, 13, 18], moment_Nm: [0.13, 0.13, 0.13]}, tare_s: 0.5}"""
HEAD = """palpate_robot: 1
name: mine
backend: {kind: stage, mass_kg: 5, bandwidth_rad_per_s: 100, following_error_m: 0.0025, time_step_s: 0.0005}
period_s: 0.001
limits: {impact_force_N: 50}
fingers:
  - surface: {kind: sphere, radius_m: RADIUS}
"""
PAYLOAD = "    payload: {mass_kg: 0.03}\n"


def text_of(sensor, more=PAYLOAD, radius=0.008, limits="{impact_force_N: 50}"):
    head = HEAD.replace("RADIUS", str(radius)).replace("{impact_force_N: 50}", limits)
    return head + more + f"    simulated_sensor: {sensor}\n"


def robot_with(sensor, **options):
    return read_robot({ROBOT_TEXT: text_of(sensor, **options)})


def robot_with_file(sensor, file):
    return read_robot({ROBOT_TEXT: text_of(sensor, "    sensor: x.yaml\n"), "sensor-0.yaml": sensor_text(file)})


def config_of(robot, **values):
    return ExploreConfig(**{**values_of(robot), **SMALL, **values})


def described_of(entry, period=1e-3):
    finger = robot_with(entry).file.fingers[0]
    return described(finger, model_of_finger(finger), period)


# --- what is known ---


@pytest.mark.parametrize("preset", REAL)
@pytest.mark.parametrize("period", [1e-3, 2e-3, 8e-3])
def test_what_is_said_of_a_preset_is_what_it_does(preset, period):
    """Saved as a sensor file it is accepted, and controllers are told its delay."""
    model = sensor_preset(preset, 2)
    known = described_of(f"{{preset: {preset}, specimen: 2}}", period)
    check_known(read_sensor(sensor_text(known)), model, period, tared=False)
    assert FTPipeline(known).delay == pytest.approx(model.delay)
    assert not any(known.bias)


def test_a_bias_is_not_known_unless_it_is_tared():
    finger = robot_with("{preset: nano17, bias: {force_N: [0.1, 0, 0]}}").file.fingers[0]
    sensor = SeededSensor(model_of_finger(finger))
    assert sensor.model.bias[0] == 0.1
    assert not any(known_sensor(finger, None, sensor, 1e-3).bias)


@settings(max_examples=25, deadline=None)
@given(specimen=st.integers(0, 1000), seed=st.integers(0, 2**63 - 1), bias=st.floats(-1.0, 1.0))
def test_a_tare_finds_the_bias_and_what_cross_talk_makes_of_the_weight(specimen, seed, bias):
    finger = robot_with(
        f"{{preset: nano17, specimen: {specimen}, bias: {{force_N: [0, {bias!r}, 0]}}, tare_s: 1}}"
    )
    finger = finger.file.fingers[0]
    model = model_of_finger(finger)
    known = known_sensor(finger, None, SeededSensor(model, seed), 1e-3)
    weight = -np.array(contact_wrench((0.0,) * 6, (0.0, 0.0, 9.81), SensorPayload(0.03)))
    expected = (np.array(model.cross_talk.matrix) - np.eye(6)) @ weight + model.bias
    # six standard errors of 1000 readings; rounding to a step as large as the noise adds 1e-8 of bias
    assert np.all(np.abs(known.bias - expected) < 6.0 * np.array(model.noise_sd) / np.sqrt(1000))
    assert known.bias == known_sensor(finger, None, SeededSensor(model, seed), 1e-3).bias
    assert known.bias != known_sensor(finger, None, SeededSensor(model, seed ^ 1), 1e-3).bias


def test_white_noise_alone_needs_no_sensor_file():
    assert described_of("{}") is None
    robot = robot_with("{}", more=PAYLOAD + "    noise: {force_N: 0.01}\n")
    assert not isinstance(plan_of(config_of(robot), robot).fingers[0], SensorFinger)


@pytest.mark.parametrize("sensor", ["{latency_s: 0.001}", "{bias: {force_N: [1, 0, 0]}}", "{lost_share: 0.1}"])
def test_more_than_noise_needs_a_range(sensor):
    with pytest.raises(InvalidValueError, match=r"simulated_sensor: no range.*give range"):
        check(robot_with(sensor))
    whole = sensor.replace("{", "{range: {force_N: [9, 9, 9], moment_Nm: [1, 1, 1]}, ", 1)
    check(robot_with(whole, more=PAYLOAD + "    noise: {force_N: 0.01, moment_Nm: 1e-4}\n"))


# --- never a mismatch in silence ---

NANO17 = described_of("{preset: nano17}")


@pytest.mark.parametrize(
    ("changes", "sensor", "words"),
    [
        ({"device_delay": 0.0}, "{preset: nano17}", ["device_delay_s = 0", "0.000359"]),
        ({"device_delay": 0.002}, "{preset: nano17}", ["device_delay_s = 0.002"]),
        ({}, "{preset: nano17, latency_s: 0.005}", ["device_delay_s = 0.000359", "0.00507"]),
        ({"bias_force": (0.0, 0.0, 0.5)}, "{preset: nano17}", ["bias of Fz = 0.5", "shows 0"]),
        ({"bias_force": (0.0, 0.0, 0.5)}, "{preset: nano17, tare_s: 1}", ["bias of Fz = 0.5", "shows 0"]),
        ({}, "{preset: nano17, bias: {moment_Nm: [0, 0.01, 0]}}", ["bias of My = 0", "0.01", "tare_s"]),
        ({"device_rate": 500.0}, "{preset: nano17}", ["device_rate_Hz = 500", "leave it out"]),
        ({"device_delay": 0.001288}, "{preset: nano17, sample_rate_Hz: 500}", ["device_rate_Hz left"]),
        ({"sample_rate": 500.0}, "{preset: nano17}", ["sample_rate_Hz = 500", "write 1000"]),
        ({"force_range": (15.0, 12.0, 17.0)}, "{preset: nano17}", ["range of Fx = 15", "end at 12.6"]),
        ({}, "{preset: nano17, quantisation: {force_N: 0.01}}", ["dead sensor", "some noise"]),
    ],
)  # fmt: skip
def test_a_sensor_file_that_says_otherwise_than_the_simulation_is_refused(changes, sensor, words):
    with pytest.raises(InvalidValueError) as found:
        check(robot_with_file(sensor, msgspec.structs.replace(NANO17, **changes)))
    for word in words:
        assert word in str(found.value)


@pytest.mark.parametrize(
    ("changes", "sensor"),
    [
        ({}, "{preset: nano17}"),
        ({"bias_force": (0.0, 0.0, 0.5)}, "{preset: nano17, bias: {force_N: [0, 0, 0.5]}}"),
        ({}, "{preset: nano17, bias: {force_N: [0, 0, 0.5]}, tare_s: 1}"),
        ({"device_delay": 0.005071}, "{preset: nano17, latency_s: 0.005}"),
        ({"device_delay": 0.001288, "device_rate": 500.0}, "{preset: nano17, sample_rate_Hz: 500}"),
    ],
)
def test_one_that_says_the_same_is_accepted(changes, sensor):
    check(robot_with_file(sensor, msgspec.structs.replace(NANO17, **changes)))


def test_thresholds_within_the_simulated_noise_are_refused():
    robot = robot_with_file("{preset: nano17}", NANO17)
    plan_of(config_of(robot), robot)
    with pytest.raises(InvalidValueError, match=r"touch_force_N.*at least 0\.05"):
        plan_of(config_of(robot, force_noise=0.01), robot)


@pytest.mark.parametrize(
    ("sensor", "age"),
    [("ft300s", 0.0183), ("ft300s, lost_share: 0.01", 0.0483), ("nano17, latency_s: 0.05", 0.0502)],
)
def test_samples_older_than_the_supervisor_allows_are_refused_before_the_run(sensor, age):
    strict, enough = (f"{{sample_age_s: {x!r}, contact_speed_m_per_s: 0.009}}" for x in (0.99 * age, 1.02 * age))
    with pytest.raises(InvalidValueError, match=r"limits\.sample_age_s") as found:
        check(robot_with(f"{{preset: {sensor}}}", radius=0.025, limits=strict))
    least = re.search(r"give at least ([\d.]+)", str(found.value))
    assert float(least[1]) == pytest.approx(age, rel=0.03)
    check(robot_with(f"{{preset: {sensor}}}", radius=0.025, limits=enough))


@pytest.mark.parametrize("kind", [{"sample_rate": 200.0}, {"latency": 0.004}, {"lost_share": 0.2}])
def test_no_reading_is_ever_older_than_was_reckoned_with(kind):
    robot = robot_with("{preset: nano17}")
    entry = msgspec.structs.replace(SimulatedSensorEntry(preset=PresetSensor.NANO17), **kind)
    finger = msgspec.structs.replace(robot.file.fingers[0], simulated_sensor=entry)
    robot = replace(robot, file=msgspec.structs.replace(robot.file, fingers=(finger,)))
    samples = felt_while_lowered(plan_of(config_of(robot), robot), 2000)
    oldest = max(sample.time - sample.wrenches[0].time for sample in samples)
    least = msgspec.structs.replace(robot.file.limits, sample_age=oldest * (1.0 - 1e-9))
    with pytest.raises(InvalidValueError, match="sample_age_s"):
        check_age(
            replace(robot, file=msgspec.structs.replace(robot.file, limits=least)), model_of_finger(finger), 1e-3
        )


def test_samples_lost_in_a_row_are_reckoned_with_at_the_period_of_the_run():
    """Read every 4 ms instead of 1, as many lost ones in a row are four times as old."""
    robot = robot_with("{preset: nano17, sample_rate_Hz: 0, lost_share: 0.3}")
    plan_of(config_of(robot), robot)
    with pytest.raises(InvalidValueError, match=r"sample_age_s = 0.02: .*up to 0.0483 s old .*samples of 4 ms"):
        plan_of(config_of(robot, period=4e-3), robot)


# --- too coarse ---


@pytest.mark.parametrize("preset", ["axia80", "ft300s"])
def test_a_wrist_sensor_is_too_coarse_for_a_fingertip_and_2_N(preset):
    robot = robot_with(f"{{preset: {preset}}}")
    with pytest.raises(InvalidValueError, match=r"too coarse.*0\.008 m at 2 N.*press with ([\d.]+) N") as found:
        plan_of(config_of(robot), robot)
    least = float(re.search(r"press with ([\d.]+) N", str(found.value))[1])
    config = config_of(robot)
    strong = object.__new__(ExploreConfig)  # beyond what explorations allow, perhaps
    for each in fields(config):
        object.__setattr__(strong, each.name, getattr(config, each.name))
    object.__setattr__(strong, "force", 1.05 * least)
    sensor_for(robot, strong)


def test_what_is_drawn_for_the_tare_is_not_drawn_again_in_the_run():
    """Else the zero would be exactly right for the run's first second, noise and all."""
    finger = robot_with("{preset: nano17, cross_talk: 0, quantisation: {}, tare_s: 1}").file.fingers[0]
    sensor = SeededSensor(replace(model_of_finger(finger), thermal_drift=None), 7)
    device = simulated_sensor(sensor.model, 1e-3, sensor.seed)
    load = (0.0, 0.0, -0.03 * GRAVITY, 0.0, 0.0, 0.0)
    readings = [device.step(1e-3 * k, load, (0.0, 0.0, GRAVITY)).wrench for k in range(1000)]
    average = np.mean(readings, axis=0) - load
    known = known_sensor(finger, None, sensor, 1e-3)
    standard_error = np.array(sensor.model.noise_sd) / np.sqrt(1000)
    assert np.linalg.norm((np.array(known.bias) - average) / standard_error) > 0.5


def test_a_ur5es_own_sensor_is_refused_with_the_numbers(tmp_path, capsys):
    (tmp_path / "own.yaml").write_text(text_of("{preset: ur5e}"))
    words = ["explore", "--robot", str(tmp_path / "own.yaml"), "--out", str(tmp_path / "o")]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "force = 2 N: must lie between 12.25 and 15 N with a force noise of 1.16667 N" in said
    assert main([*words, "--force", "13"]) == 2
    assert "too coarse for a fingertip of 0.008 m at 13 N" in capsys.readouterr().err


# --- noise: default < robot file < command line ---


def test_noise_of_the_robot_file_is_the_sensors_unless_it_says_another():
    assert values_of(robot_with("{preset: nano17}"))["force_noise"] == nano17().noise.sd[0]
    other = robot_with("{preset: nano17}", more=PAYLOAD + "    noise: {force_N: 0.01, moment_Nm: 1e-4}\n")
    assert values_of(other)["force_noise"] == 0.01
    axia = robot_with("{preset: axia80}", radius=0.03)
    assert sensor_for(axia, config_of(axia, tip=(0.03,), force=9.0)).model == sensor_preset(PresetSensor.AXIA80)


def test_noise_that_is_typed_replaces_the_noise_and_nothing_else():
    robot = robot_with("{preset: nano17}")
    model = sensor_for(robot, config_of(robot, force_noise=0.002)).model
    assert model.noise.sd == (0.002,) * 3 + (nano17().noise.sd[3],) * 3
    assert replace(model, noise=None) == replace(nano17(), noise=None)


# --- it runs ---


@pytest.mark.slow
def test_an_exploration_with_a_sensor_of_100_Hz_runs_to_its_end():
    robot = robot_with("{preset: ft300s, tare_s: 1}", radius=0.025)
    planned = plan_of(config_of(robot, force=8.0, width=0.03, speed=0.02), robot)
    assert planned.fingers[0].pipeline().delay == pytest.approx(0.01333, rel=1e-3)
    check_bounds(carried_out(planned), below(force_rms=1.0), run__ending=Ending.DONE)
    stamps = [sample.wrenches[0].time for sample in felt_while_lowered(planned, 200)]
    assert len(set(stamps)) == pytest.approx(20, abs=2)


def test_with_every_imperfection_on_the_same_seed_gives_the_same_run():
    robot = robot_with(EVERYTHING)
    one, other = (plan_of(config_of(robot, seed=7), robot) for _ in range(2))
    felt, again = felt_while_lowered(one), planned_again(one)
    assert felt_while_lowered(other) == felt_while_lowered(again) == felt
    assert felt_while_lowered(one) == felt
    assert felt_while_lowered(plan_of(config_of(robot, seed=8), robot)) != felt
    assert isinstance(again.fingers[0], SensorFinger)
    assert isinstance(one.fingers[0], SensorFinger)
    assert again.fingers[0].sensor.bias == one.fingers[0].sensor.bias


# --- From a robot file to a simulated sensor: what is written replaces the preset's, nothing else changes ---


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
    check_bounds(
        model_of(entry, NoiseEntry(force=0.1, moment=0.02)),
        {},
        rated=ALL,
        bandwidth=SecondOrderLag(80.0, 0.5),
        clock=SampleClock(250.0),
        latency=0.002,
        dropouts__probability=0.25,
        noise__sd=alike(0.1, 0.02),
    )
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


def test_what_is_known_of_a_preset_can_be_printed_for_a_start(tmp_path, capsys):
    (tmp_path / "r.yaml").write_text(text_of("{preset: ft300s}", radius=0.025))
    assert main(["robot", "show", str(tmp_path / "r.yaml"), "--sensor", "0"]) == 0
    text = capsys.readouterr().out
    assert read_sensor(text).device_rate == 100.0
    (tmp_path / "mine.yaml").write_text(text)
    (tmp_path / "r.yaml").write_text(text_of("{preset: ft300s}", "    sensor: mine.yaml\n", radius=0.025))
    assert main(["robot", "check", str(tmp_path / "r.yaml")]) == 0
    assert "sensor of finger 0: Robotiq FT 300-S" in capsys.readouterr().out
