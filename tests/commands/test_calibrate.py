"""`palpate calibrate`: from what people measure to a sensor file that makes the pipeline measure right."""

import dataclasses
import math
from contextlib import contextmanager
from typing import Any, get_args

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.cli import COMMANDS, CommandGroup, TypedCommand
from palpate.commands.calibrate.config import (
    MatrixConfig,
    MountingConfig,
    NewSensorConfig,
    PayloadConfig,
    PresetName,
    TareConfig,
)
from palpate.commands.calibrate.measurements import measured_poses, read_measurements, stage_backend, take_readings
from palpate.commands.calibrate.run import preset_sensor
from palpate.commands.typed_options import read_options
from palpate.errors import InvalidValueError
from palpate.runtime import Command
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft import HEALTHY, FTPipeline, PayloadEntry, load_sensor_file, save_sensor_file
from palpate.sensing.ft.preset_sensor import PresetSensor
from palpate.sim.sensor.presets import sensor_preset
from sensing.ft.sensor_examples import fingertip

WRENCH = "fx_N,fy_N,fz_N,mx_Nm,my_Nm,mz_Nm"
G = 9.80665
NANO = preset_sensor("nano17")
NOISE = np.array(NANO.noise)
RANGES = np.array(NANO.axis_limits)
TRUE_PAYLOAD = SensorPayload(0.030, (0.0005, 0.001, 0.018))
BIAS = np.array([0.1, -0.2, 0.3, 1e-3, -2e-3, 5e-4])


def table(header, rows):
    return "\n".join([header, *(",".join(map(repr, row)) for row in np.asarray(rows).tolist())]) + "\n"


def written(folder, text, name="in.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def sensor_in(folder, sensor=NANO):
    path = folder / "sensor.yaml"
    save_sensor_file(path, sensor)
    return path


def run(task):
    return task.run().exit_code


@contextmanager
def unchanged(folder):
    """No file of a folder changes in this block."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    yield
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def refused(task, *words):
    """The task is refused in one line with these words, and no file changes."""
    with unchanged(task.sensor.parent), pytest.raises(InvalidValueError) as caught:
        run(task)
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in words), (words, message)


def not_used(task, assumption):
    """The task ends with exit code 1, names the assumption first, and no file changes."""
    with unchanged(task.sensor.parent):
        result = task.run()
    verdict: Any = result.facts["verdict"]
    assert (result.exit_code, verdict["ok"], result.files) == (1, False, ())
    assert verdict["broken"][0]["assumption"] == assumption, result.outcome
    return result.outcome


def load_on(payload, specific_force):
    """Newton: what a payload at rest puts on the sensor's tip side. Written on its own, not by the library."""
    force = -payload.mass * specific_force
    return np.concatenate([force, np.cross(payload.center_of_mass, force)])


# --- simulated measurements --------------------------------------------------------------------------------------

SENSITIVITY = np.linalg.qr(np.random.default_rng(5).normal(size=(8, 6)))[0] * 5.0 / RANGES
"""Of a sensor with eight gauges [V per N or N m]: half the range of 10 V at full load."""

OFFSET = np.linspace(-0.5, 0.7, 8)


def raw_of(load, rng, noise=1e-4):
    return load @ SENSITIVITY.T + OFFSET + noise * rng.normal(size=(len(load), 8))


def loads_csv(rng, n=40, unit="", header=WRENCH, factor=1.0):
    load = rng.uniform(-0.8, 0.8, (n, 6)) * RANGES
    names = ",".join(f"raw_{i}{unit}" for i in range(8))
    return table(f"{names},{header}", np.hstack([raw_of(load, rng), load * factor]))


def poses(rng, n=24):
    """Rotations that map sensor to base coordinates, and the specific forces in the sensor."""
    R = Rotation.random(n, random_state=rng)
    return R, R.inv().apply([0.0, 0.0, G])


def shown(specific_force, rng, payload=TRUE_PAYLOAD, bias=BIAS):
    load = np.array([load_on(payload, a) for a in specific_force])
    return load + bias + NOISE * rng.normal(size=load.shape)


def rest_csv(rng, n=400, mean=BIAS):
    return table(WRENCH, mean + NOISE * rng.normal(size=(n, 6)))


# --- the whole way -----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_from_nothing_to_a_pipeline_that_measures_right(tmp_path, capsys):
    """new -> matrix -> payload -> tare; then a known contact is measured to within the noise."""
    rng = np.random.default_rng(1)
    sensor = tmp_path / "sensor.yaml"
    assert run(NewSensorConfig(file=sensor, preset="nano17", serial_number="FT1")) == 0
    loads = written(tmp_path, loads_csv(rng, unit="_V"))
    assert run(MatrixConfig(loads=loads, sensor=sensor, raw_range=(-10.0, 10.0))) == 0
    R, up = poses(rng)
    raw = raw_of(shown(up, rng), rng)
    names = ",".join(f"raw_{i}" for i in range(8))
    pose = table(f"{names},qw,qx,qy,qz", np.hstack([raw, R.as_quat()[:, [3, 0, 1, 2]]]))
    assert run(PayloadConfig(poses=written(tmp_path, pose), sensor=sensor)) == 0
    down = np.array([0.0, G, 0.0])
    drifted = BIAS + 5e-3 * RANGES
    raw = raw_of(shown(np.tile(down, (400, 1)), rng, bias=drifted), rng)
    rest = written(tmp_path, table(names, raw))
    assert run(TareConfig(sensor=sensor, readings=rest, gravity_direction=(0.0, -1.0, 0.0))) == 0

    pipeline = FTPipeline(load_sensor_file(sensor))
    contact = np.array([0.5, -1.0, -3.0, 0.01, 0.02, -0.005])
    up = np.array([G / math.sqrt(2.0), 0.0, -G / math.sqrt(2.0)])
    load = contact + load_on(TRUE_PAYLOAD, up) + drifted
    felt = pipeline.step(tuple((SENSITIVITY @ load + OFFSET).tolist()), tuple(up.tolist()))
    assert (np.abs(felt.wrench - contact) < NOISE + 3e-4 * RANGES).all()
    assert felt.health is HEALTHY
    told = capsys.readouterr().out
    told += sensor.read_text()
    for word in (
        *("condition number", "left out rms", "centre of mass", "95 %: ", "  error", "OK"),
        *("FT1", "bias: 400 readings", "payload: 24 poses", "matrix: 40 known loads"),
    ):
        assert word in told


def test_a_file_that_cannot_be_written_is_refused_before_anything_is_measured(tmp_path, monkeypatch):
    def never(*asked):
        raise AssertionError("it has measured, or read the data")

    for measures in ("take_readings", "stage_backend", "robot_backend", "read_measurements"):
        monkeypatch.setattr(f"palpate.commands.calibrate.run.{measures}", never)
    sensor, data = sensor_in(tmp_path), tmp_path / "in.csv"
    configs = (
        TareConfig(sensor=sensor, live="stage"),
        TareConfig(sensor=sensor, robot="emulated-ur5e"),
        TareConfig(sensor=sensor, readings=data),
        MatrixConfig(sensor=sensor, loads=data),
        PayloadConfig(sensor=sensor, poses=data),
    )
    out = tmp_path / "nodir" / "new.yaml"
    for config in configs:
        with pytest.raises(
            InvalidValueError, match=rf"out = {out}: there is no such folder; make it, .*\(--out\)"
        ):
            run(dataclasses.replace(config, out=out))
    with pytest.raises(InvalidValueError, match=rf"^file = {out}: there is no such folder; make it"):
        run(NewSensorConfig(out, "nano17"))
    monkeypatch.setattr("os.access", lambda *asked: False)  # who tests as root may write anywhere
    for config in configs:
        with pytest.raises(InvalidValueError, match=rf"{tmp_path} cannot be written; choose another"):
            run(config)
    assert {path.name for path in tmp_path.iterdir()} == {"sensor.yaml"}


# --- matrix ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_calibration_matrix_inverts_the_sensor(tmp_path):
    sensor = sensor_in(tmp_path)
    loads = written(tmp_path, loads_csv(np.random.default_rng(3)))
    run(MatrixConfig(loads=loads, sensor=sensor, raw_unit="V", raw_range=(-10.0, 10.0)))
    found = load_sensor_file(sensor).calibration
    np.testing.assert_allclose(np.array(found.matrix) @ SENSITIVITY, np.eye(6), atol=2e-3)
    np.testing.assert_allclose(found.offset, OFFSET, atol=2e-4)
    assert found.raw_unit == "V"


MATRIX_MISTAKES = {
    "no raw": (lambda t: t.replace("raw_", "v_"), ("no raw channels", "--channels", "'v_0'", "line 1")),
    "a gap": (lambda t: t.replace("raw_3", "x", 1), ("no column raw_3",)),
    "twice": (lambda t: t.replace("raw_3", "raw_4", 1), ("raw channel 4 is there twice",)),
    "no mz": (lambda t: t.replace("mz_Nm", "tz_Nm"), ("line 1: no column mz: there are raw_0, ", "tz_Nm; give")),
    "unknown unit": (lambda t: t.replace("mz_Nm", "mz_lbf"), ("'lbf'", "known for mz are", "mNm")),
    "wrong unit": (lambda t: t.replace("fx_N,", "fx_kN,"), ("beyond the sensor's range of 12", "line 2")),
    "dead": (lambda t: "\n".join(["9" + r[r.index(","):] if r[0] != "r" else r for r in t.split()]), ("dead",)),
    "units differ": (lambda t: t.replace("raw_3", "raw_3_mV", 1), ("different units",)),
    "few": (lambda t: "\n".join(t.split()[:6]), ("5 loads: give 8 or more",)),
}  # fmt: skip


def test_loads_in_other_axes_than_before_give_no_matrix_to_use(tmp_path):
    rows, sensor = loads_csv(np.random.default_rng(3)), sensor_in(tmp_path)
    task = MatrixConfig(written(tmp_path, rows), sensor, raw_unit="V", raw_range=(-10.0, 10.0))
    assert run(task) == 0
    written(tmp_path, rows.replace("fx_N,fy_N", "fy_N,fx_N").replace("mx_Nm,my_Nm", "my_Nm,mx_Nm"))
    assert "(Fy, Fx, Fz, My, Mx, Mz)" in not_used(task, "consistent")


def test_raw_unit_and_range_must_come_from_somewhere(tmp_path):
    loads, sensor = written(tmp_path, loads_csv(np.random.default_rng(3))), sensor_in(tmp_path)
    refused(MatrixConfig(loads, sensor, raw_unit="V"), "--raw-range")
    refused(MatrixConfig(loads, sensor, raw_range=(-10.0, 10.0)), "--raw-unit")
    refused(MatrixConfig(loads, sensor, raw_unit="V", raw_range=(-1.0, 1.0)), "saturated", "line 2")
    loads = written(tmp_path, loads_csv(np.random.default_rng(3), unit="_mV"))
    refused(MatrixConfig(loads, sensor, raw_unit="V", raw_range=(-10.0, 10.0)), "has mV")
    refused(MatrixConfig(loads, sensor, out=loads, raw_unit="mV", raw_range=(-10.0, 10.0)), "is the input")


def weights_csv(rng, n=60, unit=""):
    """Three weights on eight places of a cross, in random poses; a fifth of the rows are without one."""
    R, up = poses(rng, n)
    mass = rng.choice([0.0, 0.2, 0.4, 0.6, 0.8], n)
    center = rng.choice([-0.012, 0.012], (n, 3)) * rng.permutation(np.eye(3))[rng.integers(0, 3, n)]
    force = -mass[:, None] * up
    raw = raw_of(np.hstack([force, np.cross(center, force)]), rng)
    columns = [raw, 1e3 * mass[:, None], 1e3 * center, R.as_quat()[:, [3, 0, 1, 2]]]
    names = ",".join(f"raw_{i}_V" for i in range(8))
    return table(f"{names},mass_g,com_x_mm,com_y_mm,com_z_mm,qw,qx,qy,qz", np.hstack(columns))


def test_weights_in_poses_are_loads(tmp_path):
    sensor = sensor_in(tmp_path)
    path = written(tmp_path, weights_csv(np.random.default_rng(3)))
    assert run(MatrixConfig(path, sensor, raw_range=(-10.0, 10.0))) == 0
    matrix = np.array(load_sensor_file(sensor).calibration.matrix)
    np.testing.assert_allclose(matrix @ SENSITIVITY, np.eye(6), atol=2e-2 * RANGES.max() / 0.12)
    np.testing.assert_allclose(np.diag(matrix @ SENSITIVITY), 1.0, atol=2e-3)
    text = path.read_text()
    short = written(tmp_path, text.replace("com_z_mm", "depth_mm"), "short.csv")
    refused(MatrixConfig(short, sensor, raw_range=(-10.0, 10.0)), "com_z_m", "centre of mass")
    heavy = written(tmp_path, text.replace("mass_g", "mass_kg"), "heavy.csv")
    refused(MatrixConfig(heavy, sensor, raw_range=(-10.0, 10.0)), "grams for kilograms")


def test_rows_of_one_load_count_once_and_a_temperature_is_kept(tmp_path):
    rng = np.random.default_rng(4)
    load = np.repeat(rng.uniform(-0.8, 0.8, (40, 6)) * RANGES, 5, axis=0)
    warmth = np.repeat(25.0 + 2.0 * np.sin(np.arange(40.0)), 5)
    raw = raw_of(load, rng) + 2e-3 * np.outer(warmth - 25.0, np.arange(8))
    names = ",".join(f"raw_{i}_V" for i in range(8))
    path = written(tmp_path, table(f"{names},{WRENCH},temperature_C", np.column_stack([raw, load, warmth])))
    sensor = sensor_in(tmp_path)
    report = tmp_path / "report.html"
    result = MatrixConfig(path, sensor, raw_range=(-10.0, 10.0), temperature=26.0, report=report).run()
    assert (result.exit_code, result.metrics["loads"]) == (0, 40)
    assert "temperature" in result.metrics["model"]
    assert report in result.files
    text = report.read_text()
    for word in ("Contacts on a round tip of 10 mm", "per kelvin", "direct regression", "places at 2 N"):
        assert word in text
    known = load_sensor_file(sensor).calibration
    assert known.temperature == 26.0
    np.testing.assert_allclose(known.map.apply([OFFSET + 2e-3 * np.arange(8)])[0] / RANGES, 0.0, atol=1e-4)
    without = written(tmp_path, loads_csv(rng), "without.csv")
    refused(MatrixConfig(without, sensor, raw_unit="V", temperature=26.0), "no column temperature_C")


# --- payload -----------------------------------------------------------------------------------------------------

POSE_KINDS = ("gravity", "quaternion", "rotation")


def pose_csv(rng, kind, n=24, payload=TRUE_PAYLOAD):
    R, up = poses(rng, n)
    if kind == "gravity":
        header, pose = "gx,gy,gz", -up
    elif kind == "quaternion":
        header, pose = "qw,qx,qy,qz", R.as_quat()[:, [3, 0, 1, 2]]
    else:
        header, pose = ",".join(f"r{i}{j}" for i in range(3) for j in range(3)), R.as_matrix().reshape(-1, 9)
    return table(f"{header},{WRENCH}", np.hstack([pose, shown(up, rng, payload)]))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_the_three_ways_to_give_a_pose_say_the_same(tmp_path_factory, seed):
    folder = tmp_path_factory.mktemp("poses")
    forces = [
        measured_poses(
            read_measurements(written(folder, pose_csv(np.random.default_rng(seed), kind))),
            "base-from-sensor",
            (0.0, 0.0, 1.0),
            G,
        ).specific_force
        for kind in POSE_KINDS
    ]
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-9)
    np.testing.assert_allclose(forces[2], forces[0], atol=1e-9)


PAYLOAD_MISTAKES = {
    "no pose": (lambda t: t.replace("gx,gy,gz", "a,b,c"), ("no column of a pose: there are a, b, c", "qw,qx")),
    "half a pose": (lambda t: t.replace("gz,", "c,"), ("no column gz",)),
    "two kinds": (lambda t: t.replace("gx,gy,gz", "gx,gy,qw"), ("more than one kind",)),
    "a gyroscope": (lambda t: t.replace("gx,", "gx_rad/s,"), ("unit 'rad/s'", "known for gx are g, m/s^2")),
    "up, not down": (lambda t: "\n".join(flipped(r) for r in t.split()), ("below zero", "wrong sign")),
    "zero": (lambda t: "\n".join([*t.split(), "0,0,0,0,0,0,0,0,0"]), ("line 26", "direction")),
    "no mz": (lambda t: t.replace("mz_Nm", "z"), ("no column mz", "my_Nm, z; give")),
}


def flipped(row):
    fields = row.split(",")
    return row if row[0] == "g" else ",".join([*(repr(-float(x)) for x in fields[:3]), *fields[3:]])


def mixed_up(name, R, wrench):
    """Quaternions (w, x, y, z) and wrenches, as who mixes something up writes them."""
    w_first = R.as_quat()[:, [3, 0, 1, 2]]
    if name == "real part last":
        return R.as_quat(), wrench
    if name == "inverse":
        return w_first * [1.0, -1.0, -1.0, -1.0], wrench
    return w_first, np.hstack([R.apply(wrench[:, :3]), R.apply(wrench[:, 3:])])


@pytest.mark.parametrize(
    ("name", "remedy"),
    [("real part last", "real part last"), ("inverse", "--rotation"), ("base frame", "in the sensor's frame")],
)
def test_what_was_mixed_up_is_named(name, remedy, tmp_path):
    rng = np.random.default_rng(8)
    R, up = poses(rng)
    quaternions, rows = mixed_up(name, R, shown(up, rng, bias=0.2 * BIAS))
    path = written(tmp_path, table(f"qw,qx,qy,qz,{WRENCH}", np.hstack([quaternions, rows])))
    sensor = sensor_in(tmp_path)
    try:
        outcome = not_used(PayloadConfig(path, sensor), "unique")
    except InvalidValueError as error:  # a mass below zero
        outcome = str(error)
    assert remedy in outcome


def mounted_csv(rng, change=lambda wrench: wrench):
    """Twelve poses of the flange, opposite ones in turn, of a sensor turned by 30 degrees."""
    turn = Rotation.from_euler("xyz", [2.0, -1.0, 30.0], degrees=True)
    half = Rotation.random(6, rng=rng)
    flange = Rotation.concatenate([r for each in half for r in (each, each * Rotation.from_rotvec([np.pi, 0, 0]))])
    up = turn.apply(flange.inv().apply([0.0, 0.0, G]))
    rows = np.array([load_on(TRUE_PAYLOAD, each) for each in up]) + 0.2 * BIAS
    rows = rows + NOISE / np.sqrt(500.0) * rng.normal(size=rows.shape)
    quaternions = flange.as_quat()[:, [3, 0, 1, 2]]
    return table(f"qw,qx,qy,qz,{WRENCH}", np.hstack([quaternions, change(rows)])), turn.inv()


@pytest.mark.slow
def test_the_sensor_on_the_flange_is_found_and_the_file_has_its_payload(tmp_path):
    sensor = sensor_in(tmp_path)
    text, turn = mounted_csv(np.random.default_rng(2))
    result = MountingConfig(written(tmp_path, text), sensor, averaged=500).run()
    assert result.exit_code == 0
    off = turn.inv() * Rotation.from_rotvec(result.metrics["rotvec_rad"])
    assert np.degrees(off.magnitude()) < 0.1
    assert load_sensor_file(sensor).payload.mass == pytest.approx(0.030, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "words"),
    [
        ([1, 0, 2, 4, 3, 5], ("left-handed", "(y, x, z)")),
        ([1, 0, 2, 3, 4, 5], ("forces are in other axes", "(y, x, z)")),
        ([0, 1, 2, 4, 3, 5], ("moments are in other axes", "(y, x, z)")),
    ],
)
def test_a_sensor_with_swapped_axes_is_refused_by_name(order, words, tmp_path):
    text, _ = mounted_csv(np.random.default_rng(2), lambda rows: rows[:, order])
    refused(MountingConfig(written(tmp_path, text), sensor_in(tmp_path), averaged=500), *words)


def test_bad_poses_are_left_out_and_named_by_their_line(tmp_path):
    sensor = sensor_in(tmp_path)
    text = pose_csv(np.random.default_rng(4), "gravity").replace("\n", "\n0,0,-9.8,3,0,0,0,0.01,0\n", 1)
    result = PayloadConfig(written(tmp_path, text), sensor).run()
    assert result.exit_code == 0
    assert any("line 2 of in.csv" in warning for warning in result.warnings)
    assert load_sensor_file(sensor).payload.mass == pytest.approx(0.030, rel=0.02)


# --- tare --------------------------------------------------------------------------------------------------------


def test_the_weight_of_the_payload_is_taken_off_the_bias(tmp_path):
    rng = np.random.default_rng(6)
    sensor = sensor_in(
        tmp_path,
        msgspec.structs.replace(NANO, payload=PayloadEntry(mass=0.03, center_of_mass=(0.0005, 0.001, 0.018))),
    )
    rows = shown(np.tile([G, 0.0, 0.0], (400, 1)), rng)
    rest = written(tmp_path, table(WRENCH, rows))
    refused(TareConfig(sensor=sensor, readings=rest), "--gravity-direction", "0.03 kg")
    assert run(TareConfig(sensor=sensor, readings=rest, gravity_direction=(-2.0, 0.0, 0.0))) == 0
    # four standard errors
    assert (np.abs(np.subtract(load_sensor_file(sensor).bias, BIAS)) < 4.0 * NOISE / 20.0).all()


def test_noise_can_be_learned_but_a_trend_is_still_refused(tmp_path):
    sensor = sensor_in(tmp_path)
    rows = BIAS + 4.0 * NOISE * np.random.default_rng(8).normal(size=(1000, 6))
    rest = written(tmp_path, table(WRENCH, rows))
    refused(TareConfig(sensor=sensor, readings=rest), "standard deviation")
    drifting = written(
        tmp_path, table(WRENCH, rows + 30.0 * NOISE * np.linspace(0.0, 1.0, 1000)[:, None]), "drift.csv"
    )
    refused(TareConfig(sensor=sensor, readings=drifting, learn_noise=True), "changed by")
    dead = written(tmp_path, table(WRENCH, rows * [1, 1, 0, 1, 1, 1]), "dead.csv")
    refused(TareConfig(sensor=sensor, readings=dead, learn_noise=True), "Fz", "alive")
    assert run(TareConfig(sensor=sensor, readings=rest, learn_noise=True)) == 0
    np.testing.assert_allclose(load_sensor_file(sensor).noise, 4.0 * NOISE, rtol=0.1)


@pytest.mark.parametrize("payload", [PayloadEntry(), PayloadEntry(mass=0.05, center_of_mass=(0.0, 0.002, 0.02))])
def test_live_the_stage_shows_the_bias_that_it_was_given(payload, tmp_path):
    sensor = sensor_in(tmp_path, msgspec.structs.replace(NANO, payload=payload))
    assert run(TareConfig(sensor=sensor, live="stage", duration=1.0, unknown_bias=tuple(BIAS.tolist()))) == 0
    # five standard errors, and the 10 uN that a tip without a payload weighs
    assert (np.abs(np.subtract(load_sensor_file(sensor).bias, BIAS)) < 5.0 * NOISE / math.sqrt(1000) + 1e-5).all()


def test_live_refuses_noise_that_the_sensor_does_not_have_and_overload(tmp_path):
    sensor = sensor_in(tmp_path)
    refused(TareConfig(sensor=sensor, live="stage", duration=0.5, force_noise=0.1), "readings moved")
    overload = (13.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    refused(TareConfig(sensor=sensor, live="stage", duration=0.5, unknown_bias=overload), "Fx", "range of 12")
    refused(TareConfig(sensor=sensor, live="stage", duration=0.05), "50 readings: give 100")


class SlowSensor(WrappedBackend):
    """A back end whose sensor answers every third period only."""

    def __init__(self, backend):
        super().__init__(backend)
        self.commands, self.closed = [], False

    def start(self):
        self.kept = super().start()
        return self.kept

    def step(self, command):
        self.commands.append(command)
        sample = super().step(command)
        if len(self.commands) % 3 == 0:
            self.kept = sample
        return dataclasses.replace(sample, wrenches=self.kept.wrenches)

    def close(self):
        self.closed = True


def test_a_stale_sample_counts_once_and_the_back_end_stands_still_and_is_closed(tmp_path):
    config = TareConfig(sensor=tmp_path, live="stage")
    slow = SlowSensor(stage_backend(config, NANO))
    rows, up = take_readings(slow, 0.3)
    assert len(rows) == 100
    assert len(np.unique(rows[:, 0])) == 100
    np.testing.assert_allclose(up, (0.0, 0.0, G), atol=1e-6)
    assert slow.closed
    assert all(command == Command() for command in slow.commands)


# --- a first file ------------------------------------------------------------------------------------------------


def test_first_files_and_robot_files_know_the_same_sensors():
    assert list(get_args(PresetName)) == [preset for preset in PresetSensor if preset != PresetSensor.PERFECT]


@pytest.mark.parametrize("preset", get_args(PresetName))
def test_a_first_file_loads_says_where_it_comes_from_and_makes_a_pipeline(preset, tmp_path):
    path = tmp_path / "sensor.yaml"
    assert run(NewSensorConfig(file=path, preset=preset)) == 0
    sensor = load_sensor_file(path)
    assert "template" in sensor.provenance
    assert "#" in path.read_text()
    FTPipeline(sensor)
    model = sensor_preset(PresetSensor(preset))
    assert f"{sensor.model}, simulated" == model.name
    assert (*sensor.force_range, *sensor.moment_range) == model.rated
    before = path.read_bytes()
    with pytest.raises(InvalidValueError, match="is there already"):
        run(NewSensorConfig(file=path, preset=preset))
    assert path.read_bytes() == before


# --- mistakes in files ------------------------------------------------------------------------------------------

FILES = {
    "missing": (None, ("cannot read",)),
    "empty": (b"", ("no line with numbers; write columns by name",)),
    "header only": (WRENCH, ("no line with numbers",)),
    "no header": ("1,2,3,4,5,6\n", ("line 1", "numbers where the header")),
    "nan": (WRENCH + "\n\n1,2,nan,0,0,0", ("line 3", "fz_N = 'nan'", "finite")),
    "inf": (WRENCH + "\n1,2,1e999,0,0,0", ("line 2", "1e999", "finite")),
    "string": (WRENCH + "\n# remark\n1,2,zero,0,0,0", ("line 3", "'zero'", "a number")),
    "empty field": (WRENCH + "\n1,2,,0,0,0", ("line 2", "''")),
    "ragged": (WRENCH + "\n1,2,0,0,0,0\n1,2,0,0,0", ("line 3", "has 5 fields: must be 6")),
    "semicolons": (WRENCH.replace(",", ";"), ("commas",)),
    "binary": (bytes(range(256)), ("byte 128", "UTF-8")),
    "utf-16": (WRENCH.encode("utf-16"), ("UTF-8",)),
    "a sensor file": (b"palpate_sensor: 1\nmodel: x\n", ("no column fx", "there are palpate_sensor: 1; give")),
    "quote": ('"fx,fy\n', ("quoted",)),
    "twice": (WRENCH + ",FX\n0,0,0,0,0,0,0", ("fx is there twice",)),
    "no unit": (WRENCH.replace("fx_N", "fx_") + "\n0,0,0,0,0,0", ("names no unit",)),
}


RAW_READINGS = table("raw_0,raw_1", np.zeros((200, 2)))
KNOWN = {"raw_unit": "V", "raw_range": (-10.0, 10.0)}
TASKS = {
    "loads": (lambda: loads_csv(np.random.default_rng(3)), lambda p, s: MatrixConfig(p, s, **KNOWN)),
    "poses": (lambda: pose_csv(np.random.default_rng(4), "gravity"), PayloadConfig),
    "flange": (
        lambda: mounted_csv(np.random.default_rng(2))[0],
        lambda p, s: MountingConfig(p, s, averaged=500),
    ),
    "turned flange": (
        lambda: mounted_csv(np.random.default_rng(2))[0],
        lambda p, s: MountingConfig(p, s, averaged=500, rotation="flange-from-base"),
    ),
    "readings": (lambda: None, lambda p, s: TareConfig(sensor=s, readings=p)),
}
"""How the right text of each kind of file is made, and the task that reads it."""


def gravity_csv(tilts):
    down = np.array(tilts)
    return table(f"gx,gy,gz,{WRENCH}", np.hstack([down, shown(-G * down, np.random.default_rng(4))]))


def moving_csv(motion):
    rows = BIAS + NOISE * np.random.default_rng(7).normal(size=(400, 6))
    rows[:, 1] += motion * NOISE[1]
    return table(WRENCH, rows)


ROTATION_NAMES = ",".join(f"r{i}{j}" for i in range(3) for j in range(3))
NO_ROTATIONS = (
    (f"{ROTATION_NAMES},{WRENCH}\n1,0,0,0,1,0,0,0,-1", ("reflection",)),
    (f"{ROTATION_NAMES},{WRENCH}\n1,0,0,0,1,0,0,0.01,1", ("not orthonormal",)),
    (f"qw,qx,qy,qz,{WRENCH}\n0.5,0,0,0", ("length 0.5",)),
    (f"qw,qx,qy,qz,{WRENCH}\n1e300,0,0,0", ("larger than 1",)),
)
SINGULAR = (
    ([(0.0, 0.0, -1.0)] * 6, "same direction of gravity"),
    ([(math.sin(x), 0.0, -math.cos(x)) for x in (0.0, 0.0, 0.5, 0.5)], "centre of mass along that direction"),
    ([(0.0, 0.0, -1.0)] * 3, "3 poses: give 4 or more"),
)
MOVED = (
    (np.sin(np.linspace(0.0, 40.0, 400)) * 10.0, "standard deviation"),
    (np.linspace(0.0, 5.0, 400), "changed by"),
    (np.where(np.arange(400) < 200, 0.0, 3.9), "moved"),
)
MISTAKES = [
    *(("loads", change, ("in.csv", *words)) for change, words in MATRIX_MISTAKES.values()),
    *(("poses", change, ("in.csv", *words)) for change, words in PAYLOAD_MISTAKES.values()),
    *(("readings", lambda t, text=text: text, ("in.csv", *words)) for text, words in FILES.values()),
    *(("poses", lambda t, x=x: f"{x},0,0,0,0,0,0\n", (*words, "line 2")) for x, words in NO_ROTATIONS),
    *(("poses", lambda t, x=x: gravity_csv(x), (reason,)) for x, reason in SINGULAR),
    *(("readings", lambda t, x=x: moving_csv(x), ("Fy", word, "in.csv")) for x, word in MOVED),
    ("turned flange", lambda t: t, ("--rotation",)),
    ("flange", lambda t: "\n".join(t.split("\n")[:12]), ("12 or more",)),
    ("flange", lambda t: pose_csv(np.random.default_rng(4), "gravity"), ("the flange's orientation",)),
    ("readings", lambda t: RAW_READINGS, ("no calibration", "calibrate matrix")),
]
"""Task, what becomes of the right text of its file, and the words of the refusal."""


@pytest.mark.parametrize(("name", "change", "words"), MISTAKES)
def test_a_file_that_is_wrong_is_refused_with_its_place(name, change, words, tmp_path):
    make, config = TASKS[name]
    text = change(make())
    path = tmp_path / "in.csv" if text is None else written(tmp_path, text)
    refused(config(path, sensor_in(tmp_path)), *words)


def test_raw_channels_of_another_number_than_calibrated_are_refused(tmp_path):
    rest, sensor = written(tmp_path, RAW_READINGS), sensor_in(tmp_path, fingertip())
    refused(TareConfig(sensor=sensor, readings=rest, gravity_direction=(1, 0, 0)), "6")


# --- the command line --------------------------------------------------------------------------------------------


def parsed(name, *arguments):
    group = COMMANDS["calibrate"]
    assert isinstance(group, CommandGroup)
    command = group.commands[name]
    assert isinstance(command, TypedCommand)
    return read_options(command.config, f"palpate calibrate {name}", arguments)[0]


def test_the_examples_in_the_help_texts_are_understood():
    """Every example parses to the task it stands with."""
    count = 0
    for kind in (NewSensorConfig, MatrixConfig, PayloadConfig, MountingConfig, TareConfig):
        for line in " ".join(kind.__doc__.split()).split("Example: palpate calibrate ")[1:]:
            assert isinstance(parsed(*line.split()), kind)
            count += 1
    assert count == 8


def test_the_old_file_is_kept_or_left_alone(tmp_path):
    rng = np.random.default_rng(2)
    sensor, rest = sensor_in(tmp_path), written(tmp_path, rest_csv(rng))
    before = sensor.read_bytes()
    assert run(TareConfig(sensor=sensor, readings=rest, out=tmp_path / "new.yaml")) == 0
    assert sensor.read_bytes() == before
    assert not (tmp_path / "sensor.yaml.bak").exists()
    assert run(TareConfig(sensor=sensor, readings=rest)) == 0
    assert (tmp_path / "sensor.yaml.bak").read_bytes() == before
    assert sensor.read_bytes() == (tmp_path / "new.yaml").read_bytes() != before
    assert {path.name for path in tmp_path.iterdir()} == {"sensor.yaml", "sensor.yaml.bak", "new.yaml", "in.csv"}


def other_sign(row):
    fields = row.split(",")
    return ",".join([*fields[:-6], *(repr(-float(x)) for x in fields[-6:])])


def test_data_that_contradict_the_sensor_are_not_used(tmp_path):
    """A load of the wrong sign, rows too noisy for averages, and poses taken the wrong way round."""
    sensor, rng = sensor_in(tmp_path), np.random.default_rng(3)
    rows = loads_csv(rng).split()
    loads = written(tmp_path, "\n".join([*rows[:-1], other_sign(rows[-1])]))
    task = MatrixConfig(loads, sensor, raw_unit="V", raw_range=(-10.0, 10.0))
    assert "load 39" in not_used(task, "noise_level")
    path = written(tmp_path, pose_csv(np.random.default_rng(4), "rotation"))
    not_used(PayloadConfig(path, sensor, averaged=100), "noise_level")
    assert "--rotation" in not_used(PayloadConfig(path, sensor, rotation="sensor-from-base"), "unique")


def test_a_sensor_without_payload_is_calibrated_as_such(tmp_path):
    sensor = sensor_in(tmp_path)
    text = pose_csv(np.random.default_rng(4), "gravity", payload=SensorPayload())
    assert run(PayloadConfig(written(tmp_path, text), sensor)) == 0
    assert load_sensor_file(sensor).payload.mass == 0.0


def test_channels_by_name_in_the_order_given(tmp_path):
    text = loads_csv(np.random.default_rng(3))
    for i in range(8):
        text = text.replace(f"raw_{i}", f"gauge {7 - i}", 1)
    names = tuple(f"gauge {7 - i}" for i in range(8))
    sensor = sensor_in(tmp_path)
    loads = written(tmp_path, text)
    run(MatrixConfig(loads, sensor, channels=names, raw_unit="V", raw_range=(-10.0, 10.0)))
    np.testing.assert_allclose(load_sensor_file(sensor).calibration.offset, OFFSET, atol=2e-4)
    wrong = MatrixConfig(loads, sensor, channels=("gauge 9", *names), **KNOWN)
    refused(wrong, "no column gauge 9: there are gauge 7, ", ", gauge 0, ")


def test_a_missing_or_wrong_sensor_file_is_said(tmp_path):
    rest = written(tmp_path, rest_csv(np.random.default_rng(2)))
    refused(TareConfig(sensor=tmp_path / "no.yaml", readings=rest), "no.yaml", "calibrate new")
    refused(TareConfig(sensor=rest, readings=rest), "in.csv")
    with pytest.raises(InvalidValueError, match="directory"):
        run(TareConfig(sensor=tmp_path, readings=rest))
