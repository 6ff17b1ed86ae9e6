"""What comes from outside is bounded before there is room for it, and inert on its way out."""

import io
import math
import os
import struct
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from fuzz.damage import damaged
from fuzz.readers import READERS
from hypothesis import given
from hypothesis import strategies as st

from palpate.atomic_file import replacing
from palpate.bounded_file import Bounds, read_array, read_bytes, read_text
from palpate.csv_table import read_csv_table
from palpate.errors import InvalidValueError, PalpateError
from palpate.experiments.kit.checks import make_folder
from palpate.plain_text import inert, inert_cell
from palpate.strict_yaml import DEEPEST, read_yaml

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))


SMALL = Bounds(size=1000, lines=10, fields=20)
MOST_MEMORY = 300e6


def npy(header):
    text = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(64)


def pipe(path):
    os.mkfifo(path)  # no process writes into it: waiting for one would never end


def sparse(path):
    with path.open("wb") as file:
        file.truncate(20 << 30)


def holding(content):
    """Return what writes a file with this text or these bytes."""
    return lambda path: path.write_bytes(content.encode() if isinstance(content, str) else content)


def claims(descr, shape):
    """Return what writes a numpy file of 64 bytes with a header that claims this type and shape."""
    return holding(npy(f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"))


def read_small_text(path, bounds):
    return read_text(path, bounds, "text")


@pytest.mark.parametrize(
    ("reader", "make", "message"),
    [
        (read_bytes, pipe, "only regular files are read"),
        (read_bytes, lambda path: path.symlink_to("/dev/zero"), "only regular files are read"),
        (read_bytes, sparse, "21474836480 bytes: at most 1000 are read"),
        (read_small_text, holding("\n" * 20), "lines: at most"),
        (read_small_text, holding("," * 30), "fields: at most"),
        (read_small_text, holding("x" * 1001), "bytes: at most"),
        (read_array, claims("<f8", "(1000000, 1000000)"), None),
        (read_array, claims("<f8", "(0, 99999999999999999999999)"), None),
        (read_array, claims("<f8", "(-1, 8)"), None),
        (read_array, claims("|O", "(8,)"), None),
        (read_array, claims("<f8", "(9,)"), None),
        (read_array, holding(npy("(" * 110)), None),
    ],
)
def test_a_file_is_refused_before_there_is_room_for_it(reader, make, message, tmp_path):
    """A file of another kind, too large, or an array that claims more than it holds."""
    make(tmp_path / "a")
    with pytest.raises(InvalidValueError, match=message):
        reader(tmp_path / "a", SMALL)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["f4", ">f8", "i2", "?"])
def test_an_array_comes_back_as_numpy_wrote_it(order, dtype, tmp_path):
    array = np.array([[0, 1, 2], [3, 4, 5]], dtype, order=order)
    np.save(tmp_path / "a.npy", array)
    assert np.array_equal(read_array(tmp_path / "a.npy", SMALL), array.astype(float))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *(
            (opening * 50_000, f"nested too deep.*at most {DEEPEST} levels")
            for opening in ("[", "{", "- ", "{a: ", "? ")
        ),
        ("[" + "[]," * 60_000 + "]", "values"),
    ],
)
def test_a_document_that_is_too_deep_or_too_large_is_refused_before_there_is_stack_for_it(text, message):
    with pytest.raises(InvalidValueError, match=message):
        read_yaml(text)


@pytest.mark.slow
@given(st.text())
def test_what_is_printed_steers_no_terminal(text):
    shown = inert(text)
    assert not any(ord(letter) < 32 or 127 <= ord(letter) < 160 or letter in "\u202e\u2066" for letter in shown)
    assert inert(shown) == shown
    if text.isascii() and text.isprintable():
        assert shown == text


@pytest.mark.slow
@given(st.text(), st.floats())
def test_a_cell_is_no_formula_and_a_number_stays_one(text, number):
    cell = inert_cell(text)
    assert cell in (text, f"'{text}")
    assert inert_cell(f"{number:.17g}") == f"{number:.17g}"
    for first in "=+-@\t\r":
        assert inert_cell(first + "cmd|x").startswith("'")


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_damaged_inputs_are_read_or_refused_in_one_sentence(name, tmp_path):
    """The short form of benchmarks/fuzz."""
    reader = READERS[name](tmp_path)
    for example in reader.examples:
        reader.read(example)
    tracemalloc.start()
    try:
        for number in range(25):
            try:
                reader.read(damaged(reader.kind, reader.examples, (7, number)))
            except PalpateError as error:
                assert "\n" not in str(error)  # noqa: PT017
                assert len(str(error)) < 2000  # noqa: PT017
        assert tracemalloc.get_traced_memory()[1] < MOST_MEMORY
    finally:
        tracemalloc.stop()


# --- Numbers from CSV text: what is read, to the bit, and mistakes by line ---


NUMBERS = st.lists(st.lists(st.floats(), min_size=2, max_size=2), min_size=1, max_size=20)
HOLDS = "two numbers, time [s] and force [N]"


def read(text, width=None):
    return read_csv_table(text, "a.csv", HOLDS, width)


@given(NUMBERS, st.booleans(), st.sampled_from(["\n", "\r\n"]))
def test_numbers_read_back_to_the_same_bits(rows, named, end):
    lines = (["time_s,force_N"] if named else []) + [f"{a!r},{b!r}" for a, b in rows]
    table = read(end.join(lines))
    assert table.columns == (("time_s", "force_N") if named else ())
    assert np.array_equal(table.numbers(), np.array(rows), equal_nan=True)


def test_comments_empty_lines_spaces_quotes_and_byte_order_marks_are_passed_over():
    table = read('\ufeff# measured\n\n "time, s", b \n1, "2.5"\r\n  # more\n -.5e1,+INF\n')
    assert table.columns == ("time, s", "b")
    assert table.lines == [4, 6]
    assert table.numbers().tolist() == [[1.0, 2.5], [-5.0, math.inf]]


def test_columns_are_taken_by_name_whatever_the_others_hold():
    table = read("kind,z,x\nedge,3,1\nface,4,2\n")
    assert table.numbers("x", "z").tolist() == [[1.0, 3.0], [2.0, 4.0]]
    with pytest.raises(InvalidValueError, match=r"a\.csv: no column y: there are kind, z, x; give two numbers"):
        table.numbers("x", "y")
    with pytest.raises(InvalidValueError, match=r"a\.csv, line 2: 'edge' is no number: must hold two numbers"):
        table.numbers()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "a.csv: no line with numbers; write two numbers"),
        ("# nothing\n\n", "a.csv: no line with numbers"),
        ("time,force\n", "a.csv: no line with numbers"),
        ("1,2\n3\n", "a.csv, line 2, '3': has 1 fields: must be 2, two numbers, time"),
        ("a,b\n1,2,3\n", "line 2, '1,2,3': has 3 fields: must be 2"),
        ("a,1\n1,2\n", "line 1: 'a' is no number"),
        ("1,2\n1,\n", "line 2: '' is no number"),
        ("1,2\n1,1_0\n", "line 2: '1_0' is no number"),
        ("1,2\n1,٣\n", "line 2: '٣' is no number"),
        ('1,2\n"1,2\n', "line 2: .*; a quoted field must be closed on its line"),
        ("1,2\n\0,2\n", r"line 2: holds the control character '\\x00'; this is not CSV text"),
        ("1;2\n3;4\n5,6", "line 3, '5,6': has 2 fields: must be 1"),
        ("1," * 20_000, "more than 10000 columns"),
    ],
)
def test_mistakes_are_named_with_their_line_and_what_it_must_hold(text, told):
    with pytest.raises(InvalidValueError, match=told):
        read(text).numbers()


# --- Files that appear whole or not at all ---


@pytest.mark.parametrize("unnamed", [True, False])
def test_a_file_is_replaced_when_it_is_whole_and_nothing_else_is_left(unnamed, tmp_path, monkeypatch):
    if not unnamed:
        monkeypatch.setattr(os, "O_TMPFILE", 0, raising=False)
    path = tmp_path / "a"
    for text in ("one", "two"):
        with replacing(path) as file, io.TextIOWrapper(file) as words:  # which closes the file under it
            words.write(text)
        assert path.read_text() == text
    with pytest.raises(TypeError), replacing(path) as file:
        file.write("three")
    assert path.read_text() == "two"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_is_tried_without_touching_what_is_in_it(tmp_path):
    (tmp_path / ".writable").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    make_folder(tmp_path)
    assert (tmp_path / ".writable").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == [".writable", "link"]
