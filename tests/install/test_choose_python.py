"""Of several Pythons `make` takes one that can do everything; one that is too old never."""

import subprocess
import sys
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from install.choose_python import OLDEST, UR, best, version

FOUND = st.dictionaries(st.text(min_size=1), st.tuples(st.tuples(st.just(3), st.integers(6, 16)), st.just("")))


@given(FOUND)
def test_the_best_is_new_enough_and_drives_a_ur_if_any_does(found):
    chosen, able = best(found), {name for name in found if found[name][0] >= OLDEST}
    assert (chosen in able) if able else chosen is None
    assert chosen is None or (found[chosen][0] in UR) == any(found[name][0] in UR for name in able)


def test_what_is_no_python_is_not_found():
    assert version("no-such-python") is None
    assert version(sys.executable)[0] == sys.version_info[:2]


def test_a_python_that_is_named_and_is_none_is_refused_with_the_way_to_name_another(tmp_path):
    command = [
        sys.executable,
        str(Path(__file__).parent / "choose_python.py"),
        str(tmp_path / "venv"),
        "no-such-python",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert "none of no-such-python runs" in done.stderr
    assert "make PYTHON=" in done.stderr
    assert not (tmp_path / "venv").exists()
