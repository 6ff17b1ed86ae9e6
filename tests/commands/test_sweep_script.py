"""A script gets what a sweep came to, and nothing is printed; what is finished is not done again."""

import pytest

from palpate.commands.sweep import SweepConfig, sweep
from support.tiny_experiment import TINY

FIXED = ("time=0.02", "surface=soft")


def small(out, **options):
    return SweepConfig(TINY, vary=(("force=1,2",),), set=(FIXED,), out=out, jobs=1, **options)


@pytest.mark.slow
def test_a_script_gets_the_records_and_the_files_are_there(tmp_path, capfd):
    told = []
    result = sweep(small(tmp_path / "a"), told.append)
    assert [record.run for record in result.records] == [0, 1]
    assert not result.failures
    assert told[-1].done == told[-1].cases == 2
    assert {path.name for path in (tmp_path / "a").iterdir()} >= {"runs.csv", "report.html", "summary.png"}
    assert capfd.readouterr().out == ""

    before = [path.stat().st_mtime_ns for path in sorted((tmp_path / "a" / "runs").iterdir())]
    told.clear()
    again = sweep(small(tmp_path / "a"), told.append)
    assert [record.figures for record in again.records] == [record.figures for record in result.records]
    assert [path.stat().st_mtime_ns for path in sorted((tmp_path / "a" / "runs").iterdir())] == before
    assert told == []
