"""A folder that a run is to write into, and what an earlier run has left there."""

import pytest

from palpate.cli import main
from palpate.commands.earlier_run import earlier_run
from palpate.errors import InvalidValueError

NAMES = ("forces.csv",)


def left(folder, *names):
    for name in names:
        (folder / name).touch()
    return folder


def test_a_sweep_is_never_written_over(tmp_path):
    with pytest.raises(InvalidValueError, match=r"holds a run of `palpate sweep.*another folder \(--out\)"):
        earlier_run(left(tmp_path, "report.html", "sweep.json"), "regulate", NAMES)


def test_the_files_that_go_are_counted(tmp_path):
    (said,) = earlier_run(left(tmp_path, "report.html", *NAMES, "mine.txt"), "regulate", NAMES)
    assert said == f"{tmp_path / 'report.html'} and 1 more file are overwritten."


@pytest.mark.slow
def test_a_log_tells_whose_folder_it_is(tmp_path, capsys):
    out = ["--out", str(tmp_path)]
    assert main(["regulate", "--duration", "0.2", *out]) == 0
    capsys.readouterr()
    assert main(["regulate", "--dry-run", *out]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Note: " in said
    assert "report.html and 1 more file of an earlier run are overwritten; its log stays." in said
    for name in ("report.html", *NAMES):
        (tmp_path / name).unlink()
    assert earlier_run(tmp_path, "regulate", NAMES) == ()
    for typed in (["explore", *out], ["friction", "--dry-run", *out]):
        assert main(typed) == 2
        assert "holds a run of `palpate regulate`" in capsys.readouterr().err
