"""Machine code of CasADi functions: kept, made anew where spoilt, and replaced where there is no compiler."""

import shutil
from pathlib import Path

import casadi
import pytest

from palpate.grasp.solvers import compiled
from palpate.grasp.solvers.compiled import machine_code

pytestmark = pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler here")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "palpate" / "grasp"


def square() -> casadi.Function:
    x = casadi.SX.sym("x")
    return casadi.Function("square", [x], [x * x])


def test_machine_code_is_kept(cache: Path) -> None:
    quick = machine_code(square())
    assert quick.class_name() != square().class_name()
    assert float(quick(3.0)) == 9.0
    (library,) = cache.iterdir()
    made = library.stat().st_mtime_ns
    machine_code(square())
    assert library.stat().st_mtime_ns == made


@pytest.mark.parametrize("trouble", ["no compiler", "compiler fails", "no room", "spoilt"])
def test_without_machine_code_it_still_works(trouble: str, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = "no-such-compiler" if trouble == "no compiler" else None
    if trouble == "compiler fails":
        monkeypatch.setattr(compiled, "FLAGS", ("--no-such-flag",))
    elif trouble == "no room":
        cache.parent.write_text("a file where a folder should be")
    elif trouble == "spoilt":
        machine_code(square())
        (library,) = cache.iterdir()
        whole = library.read_bytes()
        library.unlink()  # not written over: this process has loaded it
        library.write_bytes(whole[:100])
    assert float(machine_code(square(), compiler)(3.0)) == 9.0
    if trouble == "spoilt":
        assert library.read_bytes() == whole
