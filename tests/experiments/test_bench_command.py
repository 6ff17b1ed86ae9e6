"""`palpate bench`: contacts and grasps that are what they claim, and what is left after a Ctrl-C."""

import json
import math
import sys
import types

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.commands.answer import ExitCode
from palpate.errors import InvalidValueError
from palpate.experiments.bench import contact, grasp, mapping, simulation, turns
from palpate.experiments.bench.command import STUDIES, run_bench
from palpate.experiments.bench.config import BenchConfig
from palpate.experiments.bench.picture import study_picture
from palpate.experiments.bench.report import bench_html, quantity
from palpate.experiments.bench.study import Row, Study
from palpate.grasp import GraspForceOptimizer
from palpate.runtime.robot_backend import StageEntry

NASTY = "<script>alert(1)</script> & more"


def made_up(name="contact", rows=None):
    rows = rows or (Row("a", f"a {NASTY}", 1e-6, 1e-9, 1e-8), Row("b", "b", 2e-6, math.nan, math.nan, "no answer"))
    return Study(name, f"Title {NASTY}", "about", "time per contact", "s", "of it", "m", rows)


# --- truth ---


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


def test_each_formula_is_right_where_it_claims_to_be():
    case = contact.built(300, np.random.default_rng(5))
    c, f, m = case.centroids, case.wrenches[:, :3], case.wrenches[:, 3:]
    with np.errstate(all="ignore"):  # without spin the paper's formula divides by what is nearly 0
        away = {
            make: np.linalg.norm(make(case.semi_axes)(case.wrenches) - c, axis=1) / np.linalg.norm(c, axis=1)
            for make in (contact.one_formula, contact.paper, contact.wrench_axis)
        }
    spun = np.abs(np.sum(f * m, axis=1)) > 1e-6
    assert spun.any()
    assert not spun.all()
    assert away[contact.one_formula].max() < 1e-12
    assert np.nanmax(away[contact.paper][spun]) < 1e-9
    assert np.nanmax(away[contact.wrench_axis][~spun]) < 1e-9
    assert np.nanmedian(away[contact.wrench_axis][spun]) > 1e-4, "it knows nothing of spin"


def test_without_noise_every_fit_finds_the_sphere(monkeypatch):
    monkeypatch.setattr(mapping, "NOISE", 0.0)
    monkeypatch.setattr(mapping, "TILT", 0.0)
    cloud = mapping.felt_cap(math.radians(45.0), np.random.default_rng(1))
    for name, method in mapping.METHODS.items():
        assert method(cloud) == pytest.approx(mapping.RADIUS, rel=1e-6), name


@pytest.mark.parametrize("fingers", [3, 5])
def test_violation_is_of_equilibrium_friction_and_pushing(fingers):
    held = grasp.ball_grasp(fingers, np.random.default_rng(2))
    load = np.array(grasp.LOAD)
    forces = GraspForceOptimizer(held).solve(load).forces
    assert grasp.violation(held, load, forces) < 1e-9
    size = np.linalg.norm(load[:3])
    assert grasp.violation(held, load + 0.1 * np.eye(6)[0], forces) > 0.05 / size
    pulled = forces.copy()
    pulled[0, 0] = -1.0
    assert grasp.violation(held, load, pulled) >= 1.0 / size
    slack = forces.copy()
    slack[:, 0] *= 0.5
    assert grasp.violation(held, load, slack) > 0.0
    # equilibrium alone: the least forces of all, some of them beyond friction
    bare = grasp.least_norm(held)(load)
    assert np.abs(held.grasp_map @ bare.ravel() + load).max() < 1e-12


def test_the_simulated_stage_takes_the_step_that_it_is_given():
    backend = simulation.stage_with_step(1.25e-4).file.backend
    assert isinstance(backend, StageEntry)
    assert backend.time_step == 1.25e-4


# --- time ---


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


# --- report ---


def test_a_report_escapes_shows_units_and_is_self_contained():
    text = bench_html([made_up()], "palpate bench", ("grasp",))
    assert "<script" not in text
    assert "interrupted before: grasp" in text
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


# --- command ---


@pytest.fixture
def studies(monkeypatch):
    """Two studies of which the second is interrupted."""

    def interrupted(quick, seed, tell):
        raise KeyboardInterrupt

    for name, measure in (("first", lambda quick, seed, tell: made_up("contact")), ("second", interrupted)):
        monkeypatch.setitem(sys.modules, f"made_up_{name}", types.SimpleNamespace(measure=measure))
    return {"contact": "made_up_first", "mapping": "made_up_second"}


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_finished(studies, tmp_path):
    answer = run_bench(BenchConfig(out=tmp_path), studies)
    assert answer.exit_code == ExitCode.INTERRUPTED
    assert answer.facts["left_out"] == ("mapping",)
    found = json.loads((tmp_path / "bench.json").read_text())
    assert list(found["studies"]) == ["contact"]
    rows = found["studies"]["contact"]["rows"]
    assert rows[0]["cost_s"] == 1e-6
    assert rows[0]["error_typical_m"] == 1e-9
    assert rows[1]["error_typical_m"] is None
    assert "interrupted before: mapping" in (tmp_path / "bench.html").read_text()


def test_a_study_that_breaks_down_costs_none_that_is_finished(studies, tmp_path, monkeypatch):
    def broken(quick, seed, tell):
        raise RuntimeError("no convergence")

    monkeypatch.setattr(sys.modules["made_up_second"], "measure", broken)
    with pytest.raises(RuntimeError):
        run_bench(BenchConfig(out=tmp_path), studies)
    assert list(json.loads((tmp_path / "bench.json").read_text())["studies"]) == ["contact"]


def test_ctrl_c_before_any_is_finished_leaves_the_last_report_as_it_was(studies, tmp_path):
    run_bench(BenchConfig(studies=("contact",), out=tmp_path), studies)
    before = (tmp_path / "bench.html").read_bytes()
    with pytest.raises(KeyboardInterrupt):
        run_bench(BenchConfig(studies=("mapping",), out=tmp_path), studies)
    assert (tmp_path / "bench.html").read_bytes() == before


def test_studies_are_chosen_by_name_and_done_once(studies, tmp_path):
    answer = run_bench(BenchConfig(studies=("contact", "contact"), out=tmp_path), studies)
    assert answer.exit_code == ExitCode.DONE
    assert list(json.loads((tmp_path / "bench.json").read_text())["studies"]) == ["contact"]


def test_a_seed_is_refused_that_no_file_keeps():
    with pytest.raises(InvalidValueError, match="seed = -1"):
        BenchConfig(seed=-1)


@pytest.mark.slow
def test_every_study_finds_palpate_at_least_as_good_as_the_others(tmp_path):
    answer = run_bench(BenchConfig(quick=True, out=tmp_path))
    assert answer.exit_code == ExitCode.DONE
    found = json.loads((tmp_path / "bench.json").read_text())["studies"]
    rows = {name: study["rows"] for name, study in found.items()}
    assert set(rows) == set(STUDIES)
    errors = {row["series"]: row["error_largest"] for row in rows["contact"]}
    assert errors["palpate, many at once"] < 1e-13
    assert errors["palpate, one by one"] == errors["palpate, many at once"]
    assert max(row["error_largest"] for row in rows["grasp"] if row["series"].startswith("palpate")) < 1e-8
    falling = [row["error_typical_n"] for row in rows["simulation"][:-1]]
    assert falling == sorted(falling, reverse=True), "smaller steps are truer"
    assert all(row["error_typical"] < 0.02 for row in rows["friction"])
