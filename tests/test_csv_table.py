"""Numbers from CSV text: what is read, to the bit, and mistakes by line."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.csv_table import read_csv_table
from palpate.errors import InvalidValueError

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
    ],
)
def test_mistakes_are_named_with_their_line_and_what_it_must_hold(text, told):
    with pytest.raises(InvalidValueError, match=told):
        read(text).numbers()
