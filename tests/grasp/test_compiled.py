"""Machine code of CasADi functions: kept, made anew where spoilt, and replaced where there is no compiler."""

from pathlib import Path

import casadi
import pytest

from palpate.grasp.solvers import compiled
from palpate.grasp.solvers.compiled import Compiled, cache_folder


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "palpate" / "grasp"


def square() -> casadi.Function:
    x = casadi.SX.sym("x")
    return casadi.Function("square", [x], [x * x])


def test_machine_code_is_kept(cache: Path) -> None:
    if Compiled().compiler is None:
        pytest.skip("no C compiler here")
    assert cache_folder() == cache
    (quick,) = Compiled().prepare([square()])
    assert quick.class_name() != square().class_name()
    assert float(quick(3.0)) == 9.0
    (library,) = cache.iterdir()
    made = library.stat().st_mtime_ns
    Compiled().prepare([square()])
    assert library.stat().st_mtime_ns == made


@pytest.mark.parametrize("trouble", ["no compiler", "compiler fails", "no room", "spoilt"])
def test_without_machine_code_it_still_works(trouble: str, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    executor = Compiled()
    if trouble == "no compiler":
        executor = Compiled(compiler="no-such-compiler")
    elif trouble == "compiler fails":
        monkeypatch.setattr(compiled, "FLAGS", ("--no-such-flag",))
    elif trouble == "no room":
        cache.parent.write_text("a file where a folder should be")
    elif executor.compiler is not None:
        folder = cache / "made"
        Compiled(folder=folder).prepare([square()])
        (library,) = folder.iterdir()
        cache.joinpath(library.name).write_bytes(library.read_bytes()[:100])
    (found,) = executor.prepare([square()])
    assert float(found(3.0)) == 9.0
    if trouble == "spoilt" and executor.compiler is not None:
        assert cache.joinpath(library.name).read_bytes() == library.read_bytes()
