"""The studies of `benchmarks/bench.py`: contacts that are what they claim, a clock that is right, a report."""

import math
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))

import bench
from studies import contact, mapping, simulation, turns
from studies.picture import study_picture
from studies.report import quantity, speed_error_report
from studies.study import Row, Study

from palpate.reporting.page import report_page
from palpate.robots.simulated_stage import StageEntry

NASTY = "<script>alert(1)</script> & more"


def made_up(rows=None):
    rows = rows or (Row("a", f"a {NASTY}", 1e-6, 1e-9, 1e-8), Row("b", "b", 2e-6, math.nan, math.nan, "no answer"))
    return Study(f"Title {NASTY}", "about", "time per contact", "s", "of it", "m", rows)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_built_contact_lies_on_the_tip_is_pushed_and_balances_its_wrench(seed):
    case = contact.built(20, np.random.default_rng(seed))
    c, f, m = case.centroids, case.wrenches[:, :3], case.wrenches[:, 3:]
    on = np.sum((c / case.semi_axes) ** 2, axis=1)
    np.testing.assert_allclose(on, 1.0, atol=1e-12)
    n = c / case.semi_axes**2
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    assert (np.sum(f * n, axis=1) < 0.0).all()
    spin = m - np.cross(c, f)
    # all that the force does not explain turns about the normal
    assert np.abs(spin - np.sum(spin * n, axis=1, keepdims=True) * n).max() < 1e-15
    assert (np.abs(np.sum(spin * n, axis=1)) <= 0.004 * np.linalg.norm(f, axis=1)).all()


def test_without_noise_every_fit_finds_the_sphere(monkeypatch):
    monkeypatch.setattr(mapping, "NOISE", 0.0)
    monkeypatch.setattr(mapping, "TILT", 0.0)
    cloud = mapping.felt_cap(math.radians(45.0), np.random.default_rng(1))
    for name, method in mapping.METHODS.items():
        assert method(cloud) == pytest.approx(mapping.RADIUS, rel=1e-6), name


def test_the_simulated_stage_takes_the_step_that_it_is_given():
    backend = simulation.stage_with_step(1.25e-4).file.backend
    assert isinstance(backend, StageEntry)
    assert backend.time_step == 1.25e-4


def test_what_takes_longer_is_said_to_take_longer(monkeypatch):
    now = 0.0

    def taking(duration):
        def take():
            nonlocal now
            now += duration

        return take

    monkeypatch.setattr(turns, "time", types.SimpleNamespace(perf_counter=lambda: now))
    taken = turns.timed_in_turns({"short": taking(0.002), "long": taking(0.01)}, 3)
    assert taken == pytest.approx({"short": 0.002, "long": 0.01})


def test_a_report_escapes_shows_units_and_is_self_contained():
    text = report_page(speed_error_report([made_up()], f"bench.py {NASTY}"))
    assert "<script>alert" not in text
    assert '<td class="value">1</td><td class="unit">µs</td>' in text
    assert not any(f'{attribute}="http' in text for attribute in ("src", "href"))


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [(5e-8, "s", "50 ns"), (1.5e-3, "m", "1.5 mm"), (0.0, "N", "0 N"), (math.nan, "s", "-"), (2e-16, "", "2e-16")],
)
def test_quantities_are_shown_with_a_prefix(value, unit, shown):
    assert quantity(value, unit) == shown


def test_a_study_without_a_number_has_no_picture():
    assert study_picture(made_up(rows=(Row("a", "a", 1e-6, math.nan, math.nan),))) is None
    assert study_picture(made_up()) is not None


@pytest.mark.parametrize("ending", [KeyboardInterrupt, RuntimeError])
def test_whatever_ends_it_the_studies_that_are_finished_are_in_the_report(ending, tmp_path, monkeypatch):
    def ended(quick, seed, tell):
        raise ending

    monkeypatch.setattr(contact, "measure", lambda quick, seed, tell: made_up())
    monkeypatch.setattr(mapping, "measure", ended)
    with pytest.raises(ending):
        bench.measured(("contact", "mapping"), True, 0, tmp_path, "again")
    assert "alert(1)" in (tmp_path / "bench.html").read_text(encoding="utf-8")


def test_a_study_that_there_is_not_is_refused(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["bench.py", "contakt"])
    with pytest.raises(SystemExit):
        bench.main()
    assert "contakt: no such study; there are contact, mapping" in capsys.readouterr().err


@pytest.mark.slow
def test_every_study_finds_palpate_at_least_as_good_as_the_others(tmp_path):
    done = dict(zip(bench.STUDIES, bench.measured(bench.STUDIES, True, 0, tmp_path, "again"), strict=True))
    worst = {row.series: row.worst for row in done["contact"].rows}
    assert worst["palpate, many at once"] < 1e-13
    assert worst["palpate, one by one"] == worst["palpate, many at once"]
    assert max(row.worst for row in done["grasp"].rows if row.series.startswith("palpate")) < 1e-8
    falling = [row.typical for row in done["simulation"].rows[:-1]]
    assert falling == sorted(falling, reverse=True), "smaller steps are truer"
    assert all(row.typical < 0.02 for row in done["friction"].rows)
