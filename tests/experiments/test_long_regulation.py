"""A run longer than what is kept in memory: its figures are of all periods, read from its log in pieces."""

import numpy as np
import pytest

from palpate.experiments.kit import recorded_periods, recorded_run
from palpate.experiments.kit.figure import figures_of
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.regulate.report import series_of
from palpate.experiments.regulate.result import write_forces
from palpate.experiments.regulate.words import outcome
from palpate.runtime.live import LONGEST_ELAPSED, ScheduledChanges, live_parameters_of
from palpate.runtime.log import Change, LogWriter, log_writer
from support.regulate_runs import REGULATE, planned

PROFILES = {
    "step": {"profile": "step", "duration": 3.0},
    "sine": {"profile": "sine", "frequencies": (2.0, 5.0)},
    "live": {"duration": 2.0},
}


def regulated_with(log, **config):
    plan = planned(force_noise=0.01, seed=3, **config)
    run = RecordedRun(plan)
    live = ScheduledChanges(live_parameters_of(run.controller), [Change(1.5, "force", 2.5)])
    result = run.run(sinks=() if log is None else (LogWriter(log),), live=live)
    return REGULATE.found(plan, run.recorded(result))


@pytest.fixture
def short_of_memory(monkeypatch):
    monkeypatch.setattr(recorded_run, "BESIDE_A_LOG", 300)
    monkeypatch.setattr(recorded_periods, "MOST_PERIODS", 500)
    monkeypatch.setattr(recorded_periods, "AT_ONCE", 700)
    monkeypatch.setattr(log_writer, "LARGEST_CHUNK", 2**17)


@pytest.mark.parametrize("name", PROFILES)
def test_piece_by_piece_it_comes_to_the_same(name, tmp_path, short_of_memory):
    found = regulated_with(tmp_path / "a.mcap", **PROFILES[name])
    assert len(found.record) <= 500
    assert sum(1 for _ in found.pieces()) > 3
    with pytest.MonkeyPatch.context() as roomy:
        roomy.setattr(recorded_run, "BESIDE_A_LOG", 2**16)
        whole = regulated_with(tmp_path / "b.mcap", **PROFILES[name])
    assert len(list(whole.pieces())) == 1
    ours, theirs = figures_of(REGULATE, found), figures_of(REGULATE, whole)
    assert ours.keys() == theirs.keys()
    for figure, value in theirs.items():
        if isinstance(value, float):
            np.testing.assert_allclose(ours[figure], value, rtol=1e-9, atol=1e-12, err_msg=figure)
        else:
            assert ours[figure] == value
    assert outcome(found) == outcome(whole)
    write_forces(found, tmp_path / "a.csv")
    write_forces(whole, tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_text().split() == (tmp_path / "b.csv").read_text().split()
    shown = np.isin(whole.record.time, found.record.time)
    ramped = LONGEST_ELAPSED * live_parameters_of(found.planned.controller()).parameters["force"].rate
    np.testing.assert_allclose(series_of(found).set_force, whole.set_force[shown], atol=1.001 * ramped)


def test_without_a_log_it_says_what_its_figures_are_of(monkeypatch, short_of_memory):
    monkeypatch.setattr(recorded_run, "MemoryLog", lambda: recorded_periods.MemoryLog(500))
    found = regulated_with(None, **PROFILES["step"])
    assert found.judged_steps is None
    assert f"every {found.every}th period" in outcome(found)
