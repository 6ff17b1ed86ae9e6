"""What is said of compiling, and what is kept: by what is logged, never by a clock."""

import os
import subprocess
import sys
import textwrap

import pytest
from numba.core import config

from palpate import compiling as module
from palpate.compiling import EACH_TIME, ONCE, compiling, keep_closure, kept_name, name_for_people
from palpate.sensing.kernels.composite import solve_composite
from palpate.sensing.kernels.projective import solve_projective
from palpate.sensing.kernels.quadric import solve_quadric
from palpate.surfaces.implicit import evaluate_superellipsoid
from palpate.surfaces.mesh import evaluate_mesh
from support.waiting import until

NEVER = 3600.0


@pytest.fixture
def kept_before():
    return list(module.KEPT_KERNELS)


@pytest.mark.parametrize("how", [ONCE, EACH_TIME])
def test_a_long_compilation_is_reported_once_and_counts_as_kept_if_it_is(how, caplog, kept_before):
    with compiling("a thing", how, warn_after=0.0):
        until(lambda: caplog.messages)
    assert caplog.messages == [f"palpate: compiling a thing ({how})"]
    assert kept_before + ["a thing"] * (how is ONCE) == module.KEPT_KERNELS


def test_nothing_is_reported_after_an_error_and_nothing_counts_as_kept(caplog, kept_before):
    with pytest.raises(ValueError, match="no"), compiling("a thing", warn_after=NEVER):
        raise ValueError("no")
    assert caplog.messages == []
    assert kept_before == module.KEPT_KERNELS


@pytest.mark.parametrize(
    ("kernel", "words"),
    [
        (solve_quadric, "code for the contact centroid on a centred quadric"),
        (solve_projective, "code for the contact centroid on a paraboloid or a hyperboloid's sheet"),
        (solve_composite, "code for the contact centroid on a tip made of patches"),
        (evaluate_mesh, "code for a fingertip from a triangle mesh"),
    ],
)
def test_a_kernel_has_a_name_for_people(kernel, words):
    assert name_for_people(kernel.py_func) == words


def test_closures_over_different_functions_have_different_names_in_memory_and_in_files():
    """Two of one name, compiled by two processes and loaded by a third, would be called for one another."""
    names = {kept_name(evaluate_mesh), kept_name(evaluate_superellipsoid)}
    assert len(names) == 2
    assert "" not in names
    assert kept_name(textwrap.dedent) == ""


TINY = """
import logging, sys
from palpate import compiling
compiling.FIRST_MESSAGE_AFTER = compiling.NEXT_MESSAGE_AFTER = 0.0
class Timer:  # says at once what a clock would let wait for
    def __init__(self, after, say, words): self.say, self.words = say, words
    def start(self): self.say(*self.words)
    def cancel(self): pass
compiling.threading.Timer = Timer
from tiny import twice
print(twice(3.0), twice(4.0), compiling.KEPT_KERNELS)
"""


@pytest.fixture
def tiny(tmp_path):
    """Runs a program with one tiny kernel in a fresh process; returns what it printed and what was said."""
    (tmp_path / "tiny.py").write_text(
        '"""A tiny kernel."""\nfrom palpate.compiling import njit\n\n'
        "@njit(cache=True)\ndef once(x):\n    return x\n\n"
        "@njit(cache=True)\ndef twice(x):\n    return 2.0 * once(x)\n"
    )
    (tmp_path / "main.py").write_text(TINY)

    def run(**environment):
        done = subprocess.run(
            [sys.executable, "main.py"],
            cwd=tmp_path,
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kept")} | environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.strip(), done.stderr.splitlines()

    return run


@pytest.mark.slow
def test_a_kernel_is_told_once_with_what_it_calls_and_from_the_cache_not_at_all(tiny):
    assert tiny() == ("6.0 8.0 ['tiny.twice']", [f"palpate: compiling tiny.twice ({ONCE})"])
    assert tiny() == ("6.0 8.0 []", [])


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(config, "CACHE_LOCATOR_CLASSES"), reason="numba has no such setting yet")
def test_where_no_folder_can_be_written_it_goes_on_and_says_what_to_do(tiny):
    printed, lines = tiny(NUMBA_CACHE_LOCATOR_CLASSES="ZipCacheLocator")  # none that would do
    assert printed == "6.0 8.0 []"
    assert len(lines) == 1
    assert "set NUMBA_CACHE_DIR" in lines[0]
    assert "kept;" not in lines[0]


def test_a_closure_that_is_kept_is_still_a_kernel():
    scale = 3.0

    def scaled(x):
        return scale * x

    kernel = keep_closure(module.njit(scaled), "scaled 1")
    assert kernel(2.0) == 6.0
    assert kernel.stats.cache_path


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [lambda kept: b"", lambda kept: kept[:-9], lambda kept: bytes(len(kept))])
def test_what_is_damaged_is_compiled_again(tiny, tmp_path, ending, damage):
    printed, _ = tiny()
    for path in (tmp_path / "kept").rglob(f"*.{ending}"):
        path.write_bytes(damage(path.read_bytes()))
    assert tiny()[0] == printed
    assert "[]" in tiny()[0]
