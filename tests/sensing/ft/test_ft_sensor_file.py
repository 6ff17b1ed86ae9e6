"""Sensor files: what is written reads back, what people write is understood, damage is refused by name."""

import math
import os

import msgspec
import pytest
from fuzz.damage import damaged
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.sensing.ft.filter_specs import Butterworth, Notch
from palpate.sensing.ft.sensor_file import ContactEntry, PayloadEntry, ProductEntry
from palpate.sensing.ft.sensor_reader import load_sensor_file, read_sensor
from palpate.sensing.ft.sensor_writer import save_sensor_file, sensor_text
from sensing.ft.sensor_examples import fingertip

TEXT = sensor_text(fingertip())
LINES = TEXT.splitlines()


def test_a_saved_file_reads_back_as_the_same_sensor_and_explains_itself(tmp_path):
    column = (1e-3, 0.0, -2e-3, 1e-5, 0.0, 1 / 3e5)
    products = (ProductEntry(channels=(0, 0), column=column), ProductEntry(channels=(1, 4), column=column[::-1]))
    bent = msgspec.structs.replace(fingertip().calibration, products=products, temperature=24.5)
    others = [msgspec.structs.replace(fingertip(), calibration=each) for each in (None, bent)]
    for sensor in (fingertip(), fingertip(8), msgspec.structs.replace(fingertip(), filters=()), *others):
        save_sensor_file(tmp_path / "tip.yaml", sensor)
        assert load_sensor_file(tmp_path / "tip.yaml") == sensor
    assert os.listdir(tmp_path) == ["tip.yaml"]
    assert all(key in TEXT for key in ("force_range_N", "noise_moment_Nm", "sample_rate_Hz", "mass_kg"))
    assert TEXT.startswith("# A force/torque sensor, for palpate.")
    assert max(map(len, LINES)) < 200  # one row of the matrix to a line


small = st.floats(-0.05, 0.05)
printable = st.text(min_size=1, max_size=30).filter(lambda s: s.strip() and s.isprintable())


@settings(max_examples=20, deadline=None)
@given(
    text=printable,
    bias=st.tuples(small, small, small),
    mass=st.floats(0.0, 1000.0),
    center=st.tuples(small, small, small),
    rate=st.floats(1e3, 1e6),
    cutoff=st.floats(10.0, 100.0),
    touch=st.floats(5e-324, 1e300),
)
def test_every_number_and_text_reads_back_to_the_same_bits(text, bias, mass, center, rate, cutoff, touch):
    sensor = msgspec.structs.replace(
        fingertip(),
        provenance=text,
        serial_number=text,
        bias_moment=bias,
        payload=PayloadEntry(mass=mass, center_of_mass=center),
        sample_rate=rate,
        filters=(Butterworth(cutoff), Notch(cutoff, 2.0)),
        contact=ContactEntry(touch_force=touch, release_force=touch),
    )
    assert read_sensor(sensor_text(sensor)) == sensor


MINIMAL = """
palpate_sensor: 1
model: ATI Nano17
serial_number: FT12:34
date: 2026-11-21
provenance: no one knows
sample_rate_Hz: 1e3
force_range_N: [12, 12, 17]
moment_range_Nm: [12e-2, 0.12, 0.12]
noise_force_N: [3e-3, 3.e-3, .003]
noise_moment_Nm: [1e-5, 1e-5, 1e-5]
contact: {touch_force_N: 1e-1, release_force_N: 0.05}
"""


def test_usual_spellings_are_read_as_they_are_meant():
    """YAML 1.1 would make 1e-3 a string, the date a date, and 12:34 a number."""
    sensor = read_sensor(MINIMAL)
    assert (sensor.sample_rate, sensor.date, sensor.serial_number) == (1000.0, "2026-11-21", "FT12:34")
    assert sensor.noise_force == (0.003, 0.003, 0.003)
    assert sensor.force_range == (12.0, 12.0, 17.0)
    assert sensor.payload.payload.mass == 0.0
    assert sensor.calibration is None


ROW = LINES[1 + next(i for i, line in enumerate(LINES) if line.endswith("# Fx"))]
FIRST_ROW = LINES[LINES.index(ROW) - 1]
WRONG = [  # text, what it becomes, words of the message
    ("mass_kg: 0.03", "mass_g: 30", r"payload\.mass_g: .*write mass_kg, in kg"),
    ("mass_kg", "mas_kg", r"payload\.mas_kg: unknown key; did you mean mass_kg\?"),
    ("moment_range_Nm", "moment_range_Nmm", r"moment_range_Nmm: .*write moment_range_Nm, in Nm"),
    ("sample_rate_Hz", "sample_rate", r"sample_rate: .*write sample_rate_Hz, in Hz"),
    ("contact:", "contacts:", "did you mean contact"),
    ("model:", "zzz: 1\nmodel:", "unknown key; known are palpate_sensor"),
    ("center_Hz: 50.0, quality", "center_Hz: 50.0, qualty", r"filters\[1\]\.qualty: .*did you mean quality"),
    (
        "kind: notch",
        "kind: nocth",
        r"filters\[1\]\.kind = .nocth.: .*butterworth, critically_damped, first_order, notch",
    ),
    ("matrix_N_Nm_per_raw_unit:\n", "matrix:\n", r"calibration\.matrix: .*matrix_N_Nm_per_raw_unit"),
    ("0.12, 0.12, 0.12", "0.12, .nan, 0.12", "moment_range_Nm, y = nan.*finite"),
    ("-0.2", ".inf", "bias_force_N, y, is inf"),
    ("-0.2", "1e999", "bias_force_N, y, is inf"),
    ("mass_kg: 0.03", "mass_kg: -0.03", r"payload\.mass_kg = -0\.03 kg"),
    ("mass_kg: 0.03", "mass_kg: 30 g", r"payload\.mass_kg = '30 g': must be a number"),
    ("mass_kg: 0.03", "mass_kg: true", r"payload\.mass_kg = true: must be a number"),
    ("mass_kg: 0.03", "mass_kg:", r"payload\.mass_kg: no value: must be a number"),
    ("mass_kg: 0.03", "mass_kg: 30000", "at most 1000 kg in size; another unit"),
    ("0.018]", "18]", "center_of_mass_m = 18.*at most 2 m"),
    ("0.018]", "18", "no valid YAML.*line"),
    ("0.018]", "0.018, 0.0]", r"payload\.center_of_mass_m: .*length 3, got 4"),
    ('"0012345"', "0012345", "serial_number = 12345: must be text; put it in quotes"),
    ('"0012345"', '""', "serial_number = ''"),
    ('"2026-11-21"', "21.11.2026", "YYYY-MM-DD"),
    ('"2026-11-21"', "2026-02-30", "YYYY-MM-DD"),
    ("sample_rate_Hz: 1000.0", "sample_rate_Hz: 1.0e+9", "sample_rate_Hz = .*at most 1e.06 Hz"),
    ("sample_rate_Hz: 1000.0", "sample_rate_Hz: 100", r"cutoff_Hz = 100: must be .* 49 Hz at .* 100 Hz"),
    ("quality: 5.0", "quality: 0.1", "quality = 0.1: must be from 0.5"),
    ("noise_force_N: [0.003125", "noise_force_N: [13", "noise_force_N, x, is 13: must be below the range"),
    ("bias_moment_Nm: [0.001", "bias_moment_Nm: [1", "bias_moment_Nm, x, is 1: must be within the range"),
    ("release_force_N: 0.05", "release_force_N: 0.5", "release_force_N = 0.5: must not exceed"),
    ("device_delay_s: 0.0005", "device_delay_s: 5", "device_delay_s = 5.* at most 1 s"),
    ("range_raw_unit: [-5.0, 5.0]", "range_raw_unit: [5, -5]", "the lower one first"),
    ("range_raw_unit: [-5.0, 5.0]", "range_raw_unit: [0.02, 5]", "offset_raw_unit, channel 1"),
    ("condition: 3.7", "condition: 0.5", "condition = 0.5: must be from 1"),
    ("palpate_sensor: 1", "palpate_sensor: 2", "this palpate reads version 1"),
    ("palpate_sensor: 1", "palpate_sensor: true", "this palpate reads version 1"),
    ("palpate_sensor: 1", "sensor: 1", "no sensor file"),
    ("touch_force_N: 0.1", "touch_force_N: 0.1\n  touch_force_N: 0.2", r"appears a second time \(line"),
    ("model:", "extra: &a [1]\nother: *a\nmodel:", "alias|unknown key"),
    ("model:", "extra: !!binary aGVsbG8=\nmodel:", "a tag"),
    ("model: ", 'model: "\\ud83d" # ', "half a character|invalid Unicode"),
    ("model:", "? [1, 2]\n: 3\nmodel:", "a key that is no word"),
    ("model:", "extra: " + "[" * 50 + "]" * 50 + "\nmodel:", "nested too deep"),
    ("model:", "extra: " + "[" * 20000 + "\nmodel:", "nested too deep"),
    ("model:", "---\nmodel:", "no valid YAML"),
    ("model:", "#" * 1_000_000 + "\nmodel:", "characters"),
    ("model:", "\x00model:", "no valid YAML"),
    (ROW, FIRST_ROW, "rank 5"),
    (ROW, "    - [0, 0, 0, 0, 0, 0]", "row 2, is zero"),
    (ROW, "    - [1, 2, 3, 4, 5, 6, 7]", "rows of"),
    (ROW, "    - [1e300, 1e308, 1e308, 1e308, 1e308, 1e308]", "row 2, is zero or far beyond"),
    (ROW, "    - [1, 2, 3]", "length >= 6"),
    (ROW, "    # none", "length >= 6"),
]


@pytest.mark.parametrize(("before", "after", "reason"), WRONG)
def test_mistakes_are_named(before, after, reason):
    assert before in TEXT
    with pytest.raises(InvalidValueError, match=reason):
        read_sensor(TEXT.replace(before, after, 1))


def test_errors_name_the_file(tmp_path):
    file = tmp_path / "tip.yaml"
    for data, reason in (
        (b"mass_\xff", r"tip\.yaml: not text \(byte"),
        (b"mas_kg", r"tip\.yaml: payload\.mas_kg"),
    ):
        file.write_bytes(TEXT.encode().replace(b"mass_kg", data))
        with pytest.raises(InvalidValueError, match=reason):
            load_sensor_file(file)
    with pytest.raises(FileNotFoundError):
        load_sensor_file(tmp_path / "none.yaml")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    file = tmp_path / "tip.yaml"
    save_sensor_file(file, fingertip())
    with monkeypatch.context() as patch:
        patch.setattr("os.replace", lambda *_args, **_named: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            save_sensor_file(file, fingertip(8))
    assert file.read_text(encoding="utf-8") == TEXT
    assert os.listdir(tmp_path) == ["tip.yaml"]
    with pytest.raises(FileNotFoundError):
        save_sensor_file(tmp_path / "no" / "tip.yaml", fingertip())


def numbers(value):
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return [x for item in value for x in numbers(item)]
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize("count", [150, pytest.param(2_000, marks=pytest.mark.slow)])
def test_damaged_files_load_to_a_sensor_that_can_be_or_are_refused(tmp_path, count):
    path, loaded = tmp_path / "sensor.yaml", 0
    for i in range(count):
        data = damaged("text", [TEXT.encode()], (count, i))
        path.write_bytes(data)
        try:
            sensor = load_sensor_file(path)
        except InvalidValueError as error:
            str(error).encode()  # can be shown: no lone surrogates
            continue
        assert all(map(math.isfinite, numbers(msgspec.to_builtins(sensor)))), data
        assert read_sensor(sensor_text(sensor)) == sensor, data
        loaded += 1
    assert 0.05 < loaded / count < 0.6  # both must happen, or the fuzzer tries only one side
