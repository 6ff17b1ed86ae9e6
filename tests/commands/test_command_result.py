"""What commands answer: names with SI units, strict JSON, and one document whatever happens."""

import json
import math
import re
import subprocess
import sys
from enum import Enum, IntEnum
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.commands.command_result import CommandResult, ExitCode, shown_quantities
from palpate.commands.output_format import document, json_value, run_with_json, run_with_text
from palpate.errors import InvalidValueError, OverrunError
from palpate.reporting.data import Quantity
from palpate.reporting.units import UNITS, quantity_key
from palpate.spatial import norm

NOT_STRICT = {"parse_constant": lambda word: pytest.fail(f"{word} is no JSON")}

# --- metrics ---


@pytest.mark.parametrize(
    ("metric", "name", "value"),
    [
        (Quantity("true normal force, RMS error", 0.5, "N"), "true_normal_force_rms_error_n", 0.5),
        (Quantity("points to true surface, 99 %", 2.0, "mm"), "points_to_true_surface_p99_m", 2e-3),
        (Quantity("stiffness", 14.0, "kN/m"), "stiffness_n_per_m", 14e3),
        (Quantity("force gain", 0.9, "mm/s/N"), "force_gain_m_per_s_per_n", 0.9e-3),
        (Quantity("phase margin", 180.0, "degrees"), "phase_margin_rad", math.pi),
        (Quantity("covered", 50.0, "%"), "covered_share", 0.5),
        (Quantity("commands", "1 234"), "commands", 1234.0),
        (Quantity("slip", "2.8e-05", "mm"), "slip_m", 2.8e-8),
        (Quantity("contact", "never lost"), "contact", "never lost"),
        (Quantity("stable for a stiffness", "0.4 to 2", "times"), "stable_for_a_stiffness", "0.4 to 2 times"),
        (Quantity("speed", 3.0, "furlongs"), "speed", "3 furlongs"),
    ],
)
def test_a_figure_gets_a_name_that_ends_in_its_si_unit(metric, name, value):
    found, _ = shown_quantities([metric])
    assert list(found) == [name]
    assert found[name] == (pytest.approx(value) if isinstance(value, float) else value)


@given(st.lists(st.sampled_from(["a", "a!", "A", "b"]), max_size=6))
def test_no_figure_hides_another(names):
    found, _ = shown_quantities([Quantity(name, float(i)) for i, name in enumerate(names)])
    assert sorted(found.values()) == [float(i) for i in range(len(names))]


@pytest.mark.parametrize("unit", UNITS)
def test_units_in_names_are_plain_words(unit):
    assert quantity_key("x", unit).replace("_", "").isalpha()
    assert quantity_key("x", unit).islower()


# --- JSON ---

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner, inner),
    max_leaves=12,
)


@pytest.mark.slow
@given(values)
def test_any_values_make_strict_json(value):
    text = document("x", CommandResult(facts={"value": value}))
    assert text.isascii()
    assert text.endswith("}\n")
    assert text.count("\n}\n") == 1
    json.loads(text, **NOT_STRICT)


class Colour(Enum):
    RED = "red"


class Level(IntEnum):
    LOW = 1


@pytest.mark.parametrize(
    ("value", "wanted"),
    [
        (math.nan, None),
        (-math.inf, None),
        (np.float64(2.5), 2.5),
        (np.array([[1.0, np.nan]]), [[1.0, None]]),
        (np.int64(3), 3),
        (np.bool_(True), True),
        (Path("a/b"), "a/b"),
        (Colour.RED, "red"),
        (Level.LOW, 1),
        ({1: (2,)}, {"1": [2]}),
    ],
)
def test_values_become_what_json_has(value, wanted):
    found = json_value(value)
    assert found == wanted
    assert type(found) is type(wanted)


# --- manners ---


def raising(error):
    def run():
        sys.stdout.write("words\n")
        raise error

    return run


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (InvalidValueError("a = 1:\n must be 2"), ExitCode.MISTAKE, "a = 1: must be 2"),
        (OverrunError("late"), ExitCode.UNFINISHED, "late; the robot was stopped"),
        (OSError(28, "No space left"), ExitCode.UNFINISHED, "[Errno 28] No space left"),
        (KeyboardInterrupt(), ExitCode.INTERRUPTED, "interrupted; nothing was finished, and nothing is kept"),
    ],
)
def test_whatever_is_raised_one_document_says_it(error, code, said, capsys):
    assert run_with_json(raising(error), "made up") == code
    told = capsys.readouterr()
    found = json.loads(told.out)
    assert (found["command"], found["exit_code"], found["error"]) == ("made up", code, said)
    assert told.err.startswith("words\n")


@pytest.mark.parametrize("run", [run_with_text, partial(run_with_json, command="x")])
def test_an_experiments_own_exception_is_a_sentence_with_its_place(run, capsys):
    assert run(raising(ZeroDivisionError("nobody thought of it"))) == ExitCode.UNFINISHED
    place = (
        r"test_command_result\.py, line \d+, in run, raised ZeroDivisionError: nobody thought of it; mend it there"
    )
    assert re.search(place, capsys.readouterr().err)


def test_an_exception_of_palpates_own_shows_its_traceback():
    with pytest.raises(TypeError):
        run_with_text(lambda: norm(None))


def test_what_other_processes_and_libraries_print_goes_to_standard_error():
    code = (
        "import os, subprocess, sys\n"
        "from palpate.commands.output_format import run_with_json\n"
        "def run():\n"
        "    os.write(1, b'library\\n')\n"
        "    subprocess.run([sys.executable, '-c', 'print(\"child\")'])\n"
        "    print('palpate')\n"
        "    return 0\n"
        "sys.exit(run_with_json(run, 'x'))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert json.loads(done.stdout)["status"] == "done"
    assert set(done.stderr.split()) == {"library", "child", "palpate"}


def test_what_json_cannot_hold_is_an_error_of_ours():
    with pytest.raises(TypeError, match="object cannot be JSON"):
        json_value(object())
