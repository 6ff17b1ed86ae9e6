"""`palpate contact`: the sensing layer as a tool, with the files that people and loggers really write."""

import csv
import dataclasses
import io
import json
import os
import select
import signal
import subprocess
import sys
import tracemalloc
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import trimesh

from palpate import ContactStatus, Cylinder, Ellipsoid, Plane, Sphere, contacts_from_wrenches
from palpate.commands.command_result import ExitCode
from palpate.commands.contact.config import ContactConfig
from palpate.commands.contact.tool import contact_result, fingertip, run_contact, wrench_blocks
from palpate.csv_table import MAX_LINE_BYTES
from palpate.errors import InvalidValueError
from palpate.sensing.uncertainty import contacts_uncertainties, white_noise
from support.waiting import until

HEADER = "fx_N,fy_N,fz_N,mx_Nm,my_Nm,mz_Nm"
WRENCHES = np.array([[0.3, 0.1, -2.0, 0.004, 0.008, 0.001], [0.0, -0.2, -1.0, -0.002, 0.001, 0.0005]])
TIP = (0.008, 0.008, 0.012)


def lines_of(wrenches):
    return [",".join(map(repr, row)) for row in np.asarray(wrenches).tolist()]


def file_with(folder, text, name="in.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def convert(folder, text, **options):
    """Run the tool from file to file; returns the rows of the output as dictionaries."""
    options = {"ellipsoid": TIP} | options
    out = folder / "out"
    assert run_contact(ContactConfig(source=file_with(folder, text), out=out, **options)) == 0
    text = out.read_text()
    if options.get("format") == "jsonl":
        return [json.loads(line) for line in text.splitlines()]
    return list(csv.DictReader(io.StringIO(text)))


def numbers(row, *columns):
    return [float(row[column]) for column in columns]


def vector(row, name, unit):
    return numbers(row, *(f"{name}_{axis}{unit}" for axis in "xyz"))


# --- what comes out ----------------------------------------------------------------------------------------------


def test_contacts_are_those_of_the_library_to_the_last_bit(tmp_path):
    rows = convert(tmp_path, "\n".join([HEADER, *lines_of(WRENCHES)]))
    expected = contacts_from_wrenches(Ellipsoid(TIP), WRENCHES)
    assert len(rows) == 2
    for i, row in enumerate(rows):
        assert vector(row, "centroid", "_m") == expected.centroid[i].tolist()
        assert vector(row, "normal", "") == expected.normal[i].tolist()
        assert vector(row, "force", "_N") == WRENCHES[i, :3].tolist()
        assert vector(row, "tangential_force", "_N") == expected.tangential_force[i].tolist()
        found = numbers(row, "normal_force_N", "spin_torque_Nm", "condition")
        assert found == [x[i] for x in (expected.normal_force, expected.spin_torque, expected.condition)]
        assert row["status"] == "OK"


def test_json_lines_say_the_same_as_csv(tmp_path):
    text = "\n".join(["time_s,label," + HEADER, "0.10,a b," + lines_of(WRENCHES)[0], "2,,0,0,0,0,0,0"])
    noise = {"force_noise": 0.01, "moment_noise": 1e-4}
    flat, nested = convert(tmp_path, text, **noise), convert(tmp_path, text, format="jsonl", **noise)
    for a, b in zip(flat, nested, strict=True):
        assert a["status"] == b["status"]
        assert a["uncertainty"] == b["uncertainty"]
        for key, value in b.items():
            if isinstance(value, list):
                stem, _, unit = key.rpartition("_")
                stem, unit = (stem, "_" + unit) if unit in ("m", "N") else (key, "")
                assert [a[f"{stem}_{axis}{unit}"] for axis in "xyz"] == [
                    "" if x is None else repr(x) for x in value
                ]
    assert nested[0]["time_s"] == 0.1
    assert nested[0]["label"] == "a b"
    assert nested[1]["status"] == "NO_FORCE"
    assert nested[1]["centroid_m"] == [None] * 3
    assert flat[1]["centroid_x_m"] == flat[1]["spin_torque_Nm"] == ""


def test_noise_gives_standard_deviations_and_whether_to_trust_them(tmp_path):
    rows = convert(tmp_path, "\n".join([HEADER, *lines_of(WRENCHES)]), force_noise=0.01, moment_noise=1e-4)
    contacts = contacts_from_wrenches(Ellipsoid(TIP), WRENCHES)
    told = contacts_uncertainties(Ellipsoid(TIP), contacts, white_noise(0.01, 1e-4))
    for i, row in enumerate(rows):
        np.testing.assert_allclose(vector(row, "centroid_sd", "_m"), np.sqrt(np.diag(told.centroid[i])))
        np.testing.assert_allclose(numbers(row, "normal_force_sd_N")[0], np.sqrt(told.normal_force[i]))
        np.testing.assert_allclose(numbers(row, "spin_torque_sd_Nm")[0], np.sqrt(told.spin_torque[i]))
        assert row["uncertainty"] == "VALID"
    assert convert(tmp_path, HEADER + "\n0,0,-1,0,0,0", force_noise=3.0)[0]["uncertainty"] != "VALID"


def test_the_fingertip_is_the_one_that_was_described():
    turned = fingertip(ContactConfig(cylinder=0.01, center=(0.0, 0.0, 0.02), rotvec=(np.pi / 2, 0.0, 0.0)))
    assert isinstance(turned, Cylinder)
    np.testing.assert_allclose(turned.rotation @ [0, 0, 1], [0, -1, 0], atol=1e-15)
    assert turned.center.tolist() == [0, 0, 0.02]
    assert isinstance(fingertip(ContactConfig(sphere=0.01)), Sphere)
    plane, ellipsoid = fingertip(ContactConfig(plane=0.01)), fingertip(ContactConfig(ellipsoid=TIP))
    assert isinstance(plane, Plane)
    assert plane.half_lengths == (np.inf, np.inf, 0.01)
    assert isinstance(ellipsoid, Ellipsoid)
    assert ellipsoid.half_lengths == TIP


def test_a_mesh_has_the_size_of_a_fingertip_in_metres_or_by_its_scale(tmp_path):
    def mesh_of(radius):
        trimesh.creation.icosphere(2, radius).export(tmp_path / f"{radius}.stl")
        return {"ellipsoid": None, "mesh": tmp_path / f"{radius}.stl"}

    text = "\n".join([HEADER, *lines_of(WRENCHES)])
    for radius, options in ((12.5, {}), (0.0125, {"scale": 1e-3})):
        with pytest.raises(InvalidValueError, match=r"is .* m long .* must be 0\.0001 to 0\.5 m.*--scale 0\.001"):
            convert(tmp_path, text, **mesh_of(radius), **options)
    metres, millimetres = (
        convert(tmp_path, text, **mesh_of(0.0125)),
        convert(tmp_path, text, **mesh_of(12.5), scale=1e-3),
    )
    for a, b in zip(metres, millimetres, strict=True):
        assert a["status"] == b["status"] == "OK"
        assert np.hypot.reduce(vector(a, "centroid", "_m")) < 0.013
        np.testing.assert_allclose(vector(b, "centroid", "_m"), vector(a, "centroid", "_m"), atol=1e-7)


def test_an_uncertain_fingertip_gives_standard_deviations(tmp_path):
    """Size, place and turn, each by itself; a sphere that is turned about its centre stays itself."""
    text = "\n".join([HEADER, *lines_of(WRENCHES)])
    told = [
        numbers(convert(tmp_path, text, ellipsoid=None, sphere=0.012, tip_sd=sd)[0], "centroid_sd_z_m")[0]
        for sd in ((1e-4, 0.0, 0.0), (0.0, 1e-4, 0.0), (0.0, 0.0, 1e-2))
    ]
    assert 5e-5 < told[0] < 5e-4  # a contact stays on the wrench's axis, here close to z
    assert 5e-5 < told[1] < 5e-4
    assert told[2] < 1e-9


# --- what goes in ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "scale"),
    [
        ("fx,fy,fz,mx,my,mz", 1),
        ("FX,Fy,fZ,MX,My,mZ", 1),
        (" fx , fy,fz ,mx,my,mz", 1),
        ('"fx","fy","fz","mx","my","mz"', 1),
        ("fx [N],fy (N),fz/N,mx [N m],my (N*m),mz/Nm", 1),
        ("fx_mN,fy_mN,fz_mN,mx_mNm,my_mNm,mz_mNm", 1e-3),
        ("fx_kN,fy_kN,fz_kN,mx_kNm,my_kNm,mz_kNm", 1e3),
        ("Fx,Fy,Fz,Tx,Ty,Tz", 1),
        ("Fx (mN),fy_mN,fz_mN,Tx (mNm),ty_mNm,tz_Nmm", 1e-3),
    ],
)
def test_columns_are_found_by_name_and_unit(header, scale, tmp_path):
    (row,) = convert(tmp_path, f"{header}\n{lines_of(WRENCHES)[0]}")
    expected = contacts_from_wrenches(Ellipsoid(TIP), WRENCHES[:1] * scale)
    assert vector(row, "centroid", "_m") == expected.centroid[0].tolist()
    assert vector(row, "force", "_N") == expected.force[0].tolist()


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + HEADER + "\n{}\n{}\n",
        HEADER.replace(",", " , ") + "\r\n{}\r\n{}\r\n",
        "# a comment\n\n" + HEADER + "\n# another, 1, 2\n{}\n   \n{}",
        HEADER + ",\n{},\n{},\n",
    ],
    ids=["byte order mark", "CRLF", "comments and blank lines", "comma at the end"],
)
def test_what_spreadsheets_and_loggers_add(text, tmp_path):
    rows = convert(tmp_path, text.format(*lines_of(WRENCHES)))
    assert [row["status"] for row in rows] == ["OK", "OK"]
    assert [float(row["force_x_N"]) for row in rows] == WRENCHES[:, 0].tolist()


# --- mistakes ----------------------------------------------------------------------------------------------------

ROW = lines_of(WRENCHES)[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["is empty", "fx_N,fy_N"]),
        ("\n\n# nothing\n", ["is empty"]),
        (ROW, ["line 1", "numbers where the header should be"]),
        (f"fx,fy,fz,mx,my\n{ROW}", ["line 1", "no column mz"]),
        (f"fx,fy,fz,tx,ty\n{ROW}", ["line 1", "no column tz"]),
        (f"fx,fy,fz,tx,ty,mz\n{ROW}", ["line 1", "no column mx, my"]),
        ("fx;fy;fz;mx;my;mz\n1;2;3;4;5;6", ["line 1", "by commas, not ';'"]),
        ("fx\tfy\tfz\tmx\tmy\tmz\n", ["line 1", "commas, not '\\t'"]),
        (f"fx,fy,fz,mx,my,mz,fx_N\n{ROW},1", ["line 1", "fx is there twice"]),
        (f"t,t,{HEADER}\n1,2,{ROW}", ["line 1", "two columns are called 't'"]),
        (f"fx_lbf,fy,fz,mx,my,mz\n{ROW}", ["line 1", "'fx_lbf'", "'lbf'", "N, mN, kN"]),
        (f"fx_Nm,fy,fz,mx,my,mz\n{ROW}", ["line 1", "'Nm' is not known", "for fx are N"]),
        (f"fx,fy,fz,mx_N,my,mz\n{ROW}", ["line 1", "'N' is not known", "Nm"]),
        (f"fx_n,fy,fz,mx,my,mz\n{ROW}", ["line 1", "'n' is not known"]),
        (f"fx_,fy,fz,mx,my,mz\n{ROW}", ["line 1", "'fx_' names no unit"]),
        (f"status,{HEADER}\n1,{ROW}", ["line 1", "'status'", "output column", "rename"]),
        (f"{HEADER}\n{ROW}\n1,2,3,4,5", ["line 3", "has 5 fields: must be 6"]),
        (f"{HEADER}\n{ROW},7", ["line 2", "has 7 fields: must be 6"]),
        (f"{HEADER}\n{ROW}\n1,2,abc,4,5,6", ["line 3", "fz_N = 'abc'", "number"]),
        (f"{HEADER}\n1,2,,4,5,6", ["line 2", "fz_N = ''"]),
        (f"{HEADER}\n1,2,1_0,4,5,6", ["line 2", "fz_N = '1_0'"]),
        (f"{HEADER}\n1,2,٣,4,5,6", ["line 2", "fz"]),
        (f"{HEADER}\n1,2,0x10,4,5,6", ["line 2", "fz_N = '0x10'"]),
        (f"{HEADER}\n{ROW}\n\n# c\n1,2,nan,4,5,6", ["line 5", "fz_N = 'nan'", "finite", "--not-finite mark"]),
        (f"{HEADER}\n1,2,-Infinity,4,5,6", ["line 2", "fz_N = '-Infinity'"]),
        (f"{HEADER}\n1,2,1e999,4,5,6", ["line 2", "fz_N = '1e999'"]),
        (f'{HEADER}\n1,2,"3,4,5,6', ["line 2", "quoted field"]),
        (f'note,{HEADER}\n"a\nb",{ROW}', ["line 2", "closed on its line"]),
        (f"{HEADER}\n{ROW}\x00", ["line 2", "control character '\\x00'"]),
        (f"{HEADER}\r{ROW}\r", ["line 1", "control character '\\r'"]),
        ((f"{HEADER}\n{ROW}").encode("utf-16"), ["line 1", "UTF-16", "UTF-8"]),
        (HEADER.encode() + b"\n1,2,3,4,5,\xff", ["line 2", "not UTF-8"]),
        (bytes(range(128, 256)) * 40, ["line 1"]),
        ("x" * (3 * MAX_LINE_BYTES), ["line 1", "longer than"]),
        (HEADER + "\n" + "1" * (2 * MAX_LINE_BYTES) + "\n", ["line 2", "longer than"]),
    ],
)
@pytest.mark.parametrize("to_file", [True, False])
def test_wrong_files_are_named_with_the_line_and_leave_nothing_behind(
    text, words, to_file, tmp_path, capsysbinary
):
    source = file_with(tmp_path, text)
    out = tmp_path / "out.csv" if to_file else Path("-")
    with pytest.raises(InvalidValueError) as wrong:
        run_contact(ContactConfig(source=source, sphere=0.01, out=out))
    said = str(wrong.value)
    assert said.startswith(str(source))
    assert "\n" not in said
    assert len(said) < len(str(source)) + 250
    assert all(word in said for word in words), said
    assert [path.name for path in tmp_path.iterdir()] == ["in.csv"], "nothing half written"
    assert capsysbinary.readouterr().out == b""


def test_rows_that_are_not_finite_are_marked_on_request(tmp_path):
    text = f"t,{HEADER}\n1,{ROW}\n2,1,2,nan,4,5,6\n3,1,2,3,inf,5,6\n4,{ROW}\n"
    rows = convert(tmp_path, text, not_finite="mark", force_noise=0.001)
    assert [row["status"] for row in rows] == ["OK", "INVALID", "INVALID", "OK"]
    assert [row["t"] for row in rows] == ["1", "2", "3", "4"]
    assert rows[1]["force_z_N"] == rows[1]["centroid_x_m"] == rows[1]["normal_force_sd_N"] == ""
    assert rows[1]["uncertainty"] == "NO_CONTACT"
    nested = convert(tmp_path, text, not_finite="mark", format="jsonl")
    assert nested[1]["centroid_m"] == [None] * 3


@pytest.mark.parametrize(
    ("factors", "said"), [((1.0, 1.0), None), ((1e3, 1.0), None), ((20, 20), "2 of 2"), ((20, 0.0), "1 of 1")]
)
def test_wrenches_that_no_contact_explains_are_told_of(factors, said, tmp_path, capsys):
    """A wrench whose axis misses the fingertip: with moments twenty times too large, all do."""
    wrenches = [[*WRENCHES[0, :3], *(factor * WRENCHES[0, 3:])] if factor else [0.0] * 6 for factor in factors]
    source = file_with(tmp_path, "\n".join([HEADER, *(",".join(map(str, row)) for row in wrenches)]))
    config = ContactConfig(source=source, ellipsoid=TIP, out=tmp_path / "out")
    assert run_contact(config) == 0
    warnings = contact_result(config).warnings
    if said is None:
        assert warnings == ()
        assert capsys.readouterr().err == ""
        return
    (warning,) = warnings
    assert warning.startswith(f"{said} rows with force: no contact explains the wrench")
    assert "mx_mNm for mNm" in warning
    assert capsys.readouterr().err == f"Note: {warning}\n"


@pytest.mark.parametrize(
    "tip", [{"sphere": 0.012}, {"ellipsoid": TIP}, {"cylinder": 0.012}, {"plane": 0.02}, {"capsule": (0.01, 0.03)}]
)
def test_moments_typed_in_mNm_are_refused_for_any_tip(tip, tmp_path):
    """Contacts with spin: in N m as the header has it they are fine, in mN m nothing is written."""
    wrench = np.array([0.3, 0.2, -2.0, 1.2e-3, -2.4e-3, 4e-3])
    out = tmp_path / "out"
    right, wrong = (
        ContactConfig(
            source=file_with(tmp_path, "\n".join([HEADER, *lines_of([given] * 30)]), name), out=out, **tip
        )
        for name, given in (("right.csv", wrench), ("wrong.csv", wrench * np.repeat([1.0, 1e3], 3)))
    )
    run_contact(right)
    out.unlink()
    with pytest.raises(InvalidValueError, match="mx_mNm"):
        run_contact(wrong)
    assert not out.exists()


def test_unreadable_input_and_dangerous_output_are_named(tmp_path):
    source, missing = file_with(tmp_path, f"{HEADER}\n{ROW}"), tmp_path / "missing.csv"
    (tmp_path / "there.csv").touch()
    for given, out, message in (
        (missing, tmp_path / "there.csv", "cannot read"),
        (missing, Path("-"), "cannot read"),
        (tmp_path, Path("-"), "cannot read"),
        (source, source, "is the input"),
    ):
        with pytest.raises(InvalidValueError, match=message):
            run_contact(ContactConfig(source=given, sphere=0.01, out=out))
    assert source.read_text() == f"{HEADER}\n{ROW}"


def test_an_output_that_cannot_be_written_is_refused_before_anything_is_read(tmp_path, monkeypatch):
    """The input, which is missing, is not even looked for."""

    def refusal(out):
        with pytest.raises(InvalidValueError) as refused:
            run_contact(ContactConfig(source=tmp_path / "missing.csv", sphere=0.01, out=out))
        return str(refused.value)

    nowhere, file = tmp_path / "nowhere" / "c.csv", file_with(tmp_path, "")
    assert refusal(nowhere) == f"out = {nowhere}: there is no such folder; make it, or choose another (--out)"
    assert f"{file} is no folder" in refusal(file / "c.csv")
    assert "is a folder; name a file in it" in refusal(tmp_path)
    monkeypatch.setattr("os.access", lambda *asked: False)  # who tests as root may write anywhere
    assert f"{tmp_path} cannot be written; choose another folder (--out)" in refusal(tmp_path / "c.csv")
    assert list(tmp_path.iterdir()) == [file]


# --- streams -----------------------------------------------------------------------------------------------------

RUN = (
    "import sys\n"
    "from palpate.commands.contact.config import ContactConfig\n"
    "from palpate.commands.contact.tool import run_contact\n"
    "sys.exit(run_contact(ContactConfig(sphere=0.01)))\n"
)


@pytest.mark.slow
def test_a_live_source_is_served_row_by_row():
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with subprocess.Popen(
        [sys.executable, "-c", RUN], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0, env=buffered
    ) as tool:
        tool.stdin.write(f"t,{HEADER}\n".encode())
        for i in range(3):
            tool.stdin.write(f"{i},{ROW}\n".encode())
            if not select.select([tool.stdout], [], [], 30)[0]:
                tool.kill()
                pytest.fail("the row waits for more input")
            if i == 0:
                assert tool.stdout.readline().startswith(b"t,centroid_x_m")
            assert tool.stdout.readline().startswith(b"%d," % i)  # before the next row is there
        tool.stdin.close()
        assert tool.stdout.read() == b""
        assert tool.wait(60) == 0


class Endless:
    """Megabytes of rows, never all in memory."""

    def __init__(self, rows):
        self.left = rows
        self.start = (HEADER + "\n").encode()
        self.block = (ROW + "\n").encode() * 500

    def read1(self, size=-1):
        if self.start:
            start, self.start = self.start, b""
            return start
        self.left -= 500
        return self.block if self.left >= 0 else b""


def test_memory_does_not_grow_with_the_input():
    peaks = []
    for rows in (2_000, 10_000):
        tracemalloc.start()
        count = sum(len(block.texts) for block in wrench_blocks(Endless(rows), "rows"))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert count == rows
    assert peaks[1] < 1.5 * peaks[0]


@pytest.mark.parametrize("size", [1, 7, 64])
def test_how_the_bytes_arrive_does_not_matter(size):
    """Lines, numbers and characters may be torn anywhere."""

    class Drip(io.BytesIO):
        def read1(self, _: int | None = -1, /):
            return super().read1(size)

    text = f"\ufeffµ,{HEADER}\r\n1,{ROW}\r\n# ü\r\n2,{ROW}".encode()
    blocks = list(wrench_blocks(Drip(text), "drip"))
    assert [text for block in blocks for text in block.texts] == [("1",), ("2",)]
    np.testing.assert_array_equal(np.vstack([block.wrenches for block in blocks]), WRENCHES[[0, 0]])


# --- fuzz --------------------------------------------------------------------------------------------------------

SEED_TEXT = (
    "t," + HEADER + ",note\n" + "".join(f"{i},{line},x\n" for i, line in enumerate(lines_of([*WRENCHES] * 3)))
).encode()
TOKENS = [
    *[b"nan", b"inf", b"-inf", b"abc", b",", b",,", b"\n", b"\r\n", b"\r", b"\x00", b"\xff", b'"', b'""', b"#"],
    *["é".encode(), b"\xef\xbb\xbf", b"1e999", b"1e-400", b"-0", b";", b"\t", b" ", b"_N", b"fx", b"mz_mNm"],
    *[b"status", b"0" * 400, b"1e308", b"5e-324", b"'", b"{}", b"%s", b"\x1a", b"\xf0\x9f\x98\x80"],
]


def fuzzed(rng):
    text = bytearray(SEED_TEXT)
    if rng.random() < 0.05:
        return rng.bytes(int(rng.integers(0, 3000)))
    for _ in range(int(rng.integers(1, 3))):
        at, length = int(rng.integers(0, len(text) + 1)), int(rng.integers(0, 12))
        match int(rng.integers(0, 8)):
            case 0:
                text[at:at] = TOKENS[rng.integers(len(TOKENS))]
            case 1:
                text[at : at + length] = TOKENS[rng.integers(len(TOKENS))]
            case 2:
                del text[at : at + length]
            case 3:
                text[at : at + 1] = rng.bytes(1)
            case 4:
                del text[at:]
            case 5 | 6:
                digits = [i for i, character in enumerate(text) if 48 <= character <= 57]
                if digits:
                    text[digits[int(rng.integers(len(digits)))]] = int(rng.integers(48, 58))
            case _:
                text[at:at] = text[at : at + 20 * length]
    return bytes(text)


def check_output(text, form, data):
    if form == "jsonl":
        rows = [json.loads(line, parse_constant=pytest.fail) for line in text.splitlines()]
        rows = [
            (row["status"], [*row["centroid_m"], row["normal_force_N"], row["spin_torque_Nm"]]) for row in rows
        ]
    else:
        table = list(csv.DictReader(io.StringIO(text, newline=""), strict=True))
        names = ["centroid_x_m", "centroid_y_m", "centroid_z_m", "normal_force_N", "spin_torque_Nm"]
        rows = [(row["status"], [float(row[n]) if row[n] else None for n in names]) for row in table]
    for status, values in rows:
        if status == "OK":
            assert np.isfinite(np.array(values, dtype=np.float64)).all(), data
        else:
            assert status in ContactStatus.__members__
            assert values == [None] * 5, data


def test_fuzzed_files_give_contacts_or_one_line_never_a_crash(tmp_path):
    rng, accepted = np.random.default_rng(1), 0
    config = ContactConfig(sphere=0.01, source=tmp_path / "in.csv", out=tmp_path / "out")
    for i in range(500):
        data = fuzzed(rng)
        config.source.write_bytes(data)
        options = {
            "not_finite": ("refuse", "mark")[i % 2],
            "format": ("csv", "jsonl")[i // 2 % 2],
            "force_noise": (0.0, 0.01)[i // 4 % 2],
        }
        try:
            assert run_contact(dataclasses.replace(config, **options)) == 0
        except InvalidValueError as error:
            if "\n" in str(error) or not str(error).startswith(str(config.source)):
                raise AssertionError(data) from error
        else:
            accepted += 1
            check_output(config.out.read_text(), options["format"], data)
            config.out.unlink()
        assert [path.name for path in tmp_path.iterdir()] == ["in.csv"], data
    assert 25 < accepted < 450, "the fuzzer must see both outcomes"


def written_by(pid, folder):
    """Whether a process has written to a file in a folder, whose name it may not have yet."""
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):  # closed meanwhile
            if os.readlink(descriptor).startswith(str(folder)) and descriptor.stat().st_size:
                return True
    return False


@pytest.mark.slow
@pytest.mark.parametrize("form", [(), ("--json",)])
def test_ctrl_c_ends_a_live_source_and_its_file_has_what_came(tmp_path, form):
    out = tmp_path / "contacts.csv"
    typed = ["contact", "-", "--sphere", "0.01", "--out", str(out), *form]
    tool = subprocess.Popen(
        [sys.executable, "-m", "palpate", *typed],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    tool.stdin.write(f"{HEADER}\n{ROW}\n{ROW}\n".encode())
    tool.stdin.flush()
    until(lambda: written_by(tool.pid, tmp_path), within=60.0)
    tool.send_signal(signal.SIGINT)
    said, err = tool.communicate(timeout=60)
    assert tool.returncode == ExitCode.INTERRUPTED
    assert b"Traceback" not in err
    assert len(out.read_text().splitlines()) == 3
    if form:
        assert json.loads(said)["files"] == [str(out)]


@pytest.mark.parametrize(
    ("unit", "value"),
    [("Nm", 1.0), ("mNm", 1e-3), ("uNm", 1e-6), ("µNm", 1e-6), ("Nmm", 1e-3), ("Ncm", 1e-2), ("N·m", 1.0)],
)
def test_units_of_moment(unit, value, tmp_path):
    given = WRENCHES[0] / np.repeat([1.0, value], 3)
    columns = ",".join(["fx", "fy", "fz"] + [f"m{axis}_{unit}" for axis in "xyz"])
    (row,) = convert(tmp_path, f"{columns}\n{lines_of([given])[0]}")
    expected = contacts_from_wrenches(Ellipsoid(TIP), WRENCHES[:1])
    np.testing.assert_allclose(vector(row, "centroid", "_m"), expected.centroid[0], rtol=1e-12)


def test_columns_stand_in_any_order_and_a_translation_is_no_torque(tmp_path):
    values = dict(zip(("fx", "fy", "fz", "mx", "my", "mz"), ROW.split(","), strict=True)) | {"tx": "7"}
    names = ("tx", "mz", "fy", "fx", "my", "fz", "mx")
    (row,) = convert(tmp_path, f"{','.join(names)}\n{','.join(values[name] for name in names)}", model="hard")
    expected = contacts_from_wrenches(Ellipsoid(TIP), WRENCHES[:1], "hard")
    assert (row["tx"], row["status"]) == ("7", "OK")
    assert vector(row, "centroid", "_m") == expected.centroid[0].tolist()
