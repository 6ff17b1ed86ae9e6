"""`palpate sweep` as it is typed: every run once, whatever comes between; the same numbers whoever does them."""

import copy
import csv
import json
import os
import pickle
import signal
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import psutil
import pytest

from palpate.cli import main
from palpate.commands.sweep import SweepConfig, figure, run, sweep
from palpate.commands.sweep.attempt import attempt
from palpate.commands.sweep.store import RunStatus, read_record
from palpate.errors import InvalidValueError
from palpate.experiments.explore import exploration, map_growth
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.registry import experiment_named
from palpate.reporting import page
from palpate.robots.values import load_named_robot
from palpate.runtime.batch import Workers, quiet, results_of, run_batch
from palpate.runtime.log import log_in, read_log
from palpate.sim import ContactLaw, SphereObject, Tip, Torus, build_scene
from palpate.surfaces import Sphere
from support.logged_runs import into, logged
from support.sweep_runs import NOT_FIGURES, TYPED, InProcess, config_of, planned
from support.tiny_experiment import TINY
from support.waiting import until

PROCESS_TIMEOUT = 240.0
"""For a sweep as a process of its own, on a machine that is busy [s]."""


@pytest.fixture
def here(monkeypatch):
    """Runs are done in this process; returns what does them."""
    runner = InProcess()
    monkeypatch.setattr(run, "runner_for", lambda config: runner)
    return runner


def table(folder):
    with (folder / "runs.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def metrics(folder):
    """The rows, without what depends on who did a run."""
    return [{name: value for name, value in row.items() if name not in NOT_FIGURES} for row in table(folder)]


def kept(folder):
    """When each run was written, by number [ns]."""
    return {int(path.stem): path.stat().st_mtime_ns for path in (folder / "runs").glob("*.json")}


@pytest.fixture
def undrawn(monkeypatch):
    """Pictures take longer than these runs: where nobody looks at them, they are left out."""
    monkeypatch.setattr(figure, "write_summary", lambda result, path: path.touch())

    def write(report, path, figures):
        path.touch()
        return page.WrittenReport((path,), ())

    monkeypatch.setattr(page, "write_report", write)


# --- what it leaves


def test_a_sweep_leaves_a_row_per_run_with_the_figures_of_the_experiment_itself(here, tmp_path, capsys):
    assert main([*TYPED, "--out", str(tmp_path)]) == 0
    rows = table(tmp_path)
    asked = [(1.0, 0.01), (1.0, 0.02), (2.0, 0.01), (2.0, 0.02)]
    assert [(float(r["force"]), float(r["speed"]), int(r["seed"])) for r in rows] == [
        (*pair, seed) for pair in asked for seed in (0, 1)
    ]
    assert {row["status"] for row in rows} == {"done"}
    tap, config = experiment_named(TINY), config_of(planned("force=1,2", "speed=0.01,0.02", seeds=2).runs[5])
    plan = tap.plan(config, load_named_robot(config.robot), {})
    alone = metrics_of(tap, tap.evaluate(plan, carry_out(plan)))
    assert {name: rows[5][name] for name in alone} == {
        name: str(value).lower() if isinstance(value, bool) else str(value) for name, value in alone.items()
    }
    names = {path.name for path in tmp_path.iterdir() if not path.name.startswith(".")}
    assert names == {"runs", "sweep.json", "runs.csv", "runs.parquet", "summary.png", "report.html"}
    assert (tmp_path / "summary.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "sweep.json").read_text())["varied"] == {
        "force": ["1", "2"],
        "speed": ["0.01", "0.02"],
    }
    said = capsys.readouterr().out
    for word in ("8 runs: 2 force x 2 speed x 2 seeds", "All 8 runs got to their end", "report.html"):
        assert word in said


@pytest.mark.slow
def test_an_interrupted_sweep_goes_on_where_it_was_and_repeats_nothing(here, undrawn, tmp_path, capsys):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    main([*TYPED, "--out", str(whole)])
    here.done.clear()
    here.interrupted_after = 3
    assert main([*TYPED, "--out", str(parts)]) == 130
    assert "3 of 8 runs are kept" in capsys.readouterr().err
    assert not (parts / "runs.csv").exists()
    before, here.interrupted_after = kept(parts), None
    assert main([*TYPED, "--out", str(parts)]) == 0
    assert "3 of them are there already" in capsys.readouterr().out
    assert main([*TYPED, "--keep-reports", "--out", str(parts)]) == 0
    assert "8 of them are there already; --keep-reports is for those still to be done" in capsys.readouterr().out
    assert here.done == list(range(8)), "each once, over both"
    assert {number: kept(parts)[number] for number in before} == before
    assert metrics(parts) == metrics(whole)
    assert main([*TYPED, "--json", "--out", str(parts)]) == 0
    assert len(here.done) == 8, "nothing is left to do"
    told = json.loads(capsys.readouterr().out)
    by_hand = [float(row["force_mean_n"]) for row in table(parts)[:2]]
    assert told["metrics"]["runs_done"] == 8
    assert told["combinations"][0]["force_mean_n"]["median"] == pytest.approx(sum(by_hand) / 2.0, rel=1e-12)


@pytest.mark.slow
def test_a_run_that_fails_is_a_row_that_says_why_and_disturbs_no_other(
    here, undrawn, tmp_path, monkeypatch, capsys
):
    whole, out = tmp_path / "whole", tmp_path / "out"
    main([*TYPED, "--out", str(whole)])
    tap = type(experiment_named(TINY))
    evaluate = tap.evaluate

    def failing(self, plan, recorded):
        config = plan.config
        if (config.force, config.speed, config.seed) == (2.0, 0.01, 1):
            raise ZeroDivisionError("on [purpose]")
        return evaluate(self, plan, recorded)

    monkeypatch.setattr(tap, "evaluate", failing)
    assert main([*TYPED, "--out", str(out)]) == 1
    said = capsys.readouterr().out
    for word in ("7 of 8 runs got to their end", "run 5:", "on [purpose]", "--repeat-failed"):
        assert word in said
    rows = metrics(out)
    assert rows.pop(5)["message"] == "ZeroDivisionError: on [purpose]"
    others = metrics(whole)
    others.pop(5)
    assert rows == others
    record = read_record((out / "runs" / "000005.json").read_bytes())
    assert record.status is RunStatus.FAILED
    assert "in failing" in record.traceback
    # going on leaves it as it is, unless it is to be done again
    monkeypatch.setattr(tap, "evaluate", evaluate)
    here.done.clear()
    assert main([*TYPED, "--out", str(out)]) == 1
    assert here.done == []
    assert main([*TYPED, "--repeat-failed", "--out", str(out)]) == 0
    assert here.done == [5]
    assert metrics(out) == metrics(whole)


@pytest.mark.slow
def test_a_run_can_leave_its_own_report_and_log(here, undrawn, tmp_path):
    typed = ["sweep", TINY, "--vary", "force=1,2", "--keep-reports", "--out", str(tmp_path)]
    assert main(typed) == 0
    kept = tmp_path / "reports" / "000001"
    assert {"report.html", "forces.txt", "latest.mcap"} <= {path.name for path in kept.iterdir()}
    logged = LoggedRun.of(read_log(log_in(kept)))
    assert (logged.config.force, logged.config.out) == (2.0, kept)
    metrics = metrics_of(logged.experiment, logged.evaluate())
    assert metrics["force_mean_n"] == float(table(tmp_path)[1]["force_mean_n"])


def test_a_dry_run_lists_the_runs_and_leaves_nothing(here, tmp_path, capsys):
    assert main([*TYPED, "--dry-run", "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "force=2, speed=0.02, seed=1" in said
    assert "8 runs to do, about" in said
    assert here.done == []
    assert not (tmp_path / "out").exists()


# --- processes


ELSEWHERE = """
import pickle, sys
from palpate.commands.sweep.attempt import attempt
print(attempt(pickle.load(sys.stdin.buffer)).status.value)
"""


@pytest.mark.slow
def test_a_worker_in_another_folder_finds_an_experiment_that_was_typed_as_a_file(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(Path(TINY.removesuffix(":Tap")).read_text())
    monkeypatch.chdir(tmp_path)
    (run,) = planned(experiment="mine.py:Tap").runs
    words, other = [sys.executable, "-c", ELSEWHERE], tmp_path / "other"
    other.mkdir()
    said = subprocess.run(words, input=pickle.dumps(run.case), cwd=other, capture_output=True, check=True).stdout
    assert said.decode().split() == ["done"]


LONG = ["sweep", TINY, "--vary", "force=1:3:6", "--set", "time=10", "noise=0.01", "--jobs", "2"]
"""Six runs of a second or more."""


def started(typed, folder):
    words = [sys.executable, "-m", "palpate", *typed, "--out", str(folder)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def wait_for(condition):
    return until(condition, PROCESS_TIMEOUT)


def working(process):
    """The workers of a sweep that have computed for a second at least: past their imports, or nearly so."""
    children = [
        child
        for child in psutil.Process(process.pid).children()
        if "resource_tracker" not in "".join(child.cmdline())
    ]
    return [child for child in children if sum(child.cpu_times()[:2]) > 1.0]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """What the long sweep gives if nothing happens to it."""
    folder = tmp_path_factory.mktemp("undisturbed")
    process = started(LONG, folder)
    said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
    assert process.returncode == 0, said
    return folder


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_sweep_that_is_killed_in_the_middle_goes_on_and_repeats_nothing(undisturbed, tmp_path):
    process = started(LONG, tmp_path)
    wait_for(lambda: len(kept(tmp_path)) >= 2)
    children = psutil.Process(process.pid).children()
    process.kill()
    process.communicate()
    before = kept(tmp_path)
    assert 2 <= len(before) < 6
    psutil.wait_procs(children, timeout=PROCESS_TIMEOUT)
    assert not any(child.is_running() for child in children), "nobody works on for a sweep that is dead"
    process = started(LONG, tmp_path)
    said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
    assert process.returncode == 0, said
    assert f"{len(before)} of them are there already" in said
    after = kept(tmp_path)
    assert {number: after[number] for number in before} == before, "what was finished was not done again"
    assert metrics(tmp_path) == metrics(undisturbed)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_worker_that_is_killed_costs_no_run(undisturbed, tmp_path):
    process = started(LONG, tmp_path)
    wait_for(lambda: len(kept(tmp_path)) >= 1)
    os.kill(wait_for(lambda: working(process))[0].pid, signal.SIGKILL)
    said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
    assert process.returncode == 0, said
    assert sorted(kept(tmp_path)) == list(range(6))
    assert metrics(tmp_path) == metrics(undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize(
    "typed",
    [
        ["explore", "--vary", "speed=0.03,0.05", "--set", "width=0.01", "depth=0.004", "force_noise=0.01"],
        ["friction", "--vary", "friction=0.3,0.6", "--set", "quick=true", "force_noise=0.01"],
        ["grasp", "--vary", "offset=0,0.004", "--set", "rise=0.4", "lift_height=0.02"],
    ],
)
def test_every_experiment_gives_the_same_in_one_process_and_in_two(typed, tmp_path):
    for jobs in ("1", "2"):
        process = started(["sweep", *typed, "--seeds", "2", "--jobs", jobs], tmp_path / jobs)
        said, _ = process.communicate(timeout=PROCESS_TIMEOUT)
        assert process.returncode == 0, said
    assert metrics(tmp_path / "1") == metrics(tmp_path / "2")
    first, second = ({**row, "run": "", "seed": ""} for row in metrics(tmp_path / "1")[:2])
    assert first != second, "seeds matter"


# --- A script gets what a sweep came to, and nothing is printed; what is finished is not done again ---


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
    assert [record.metrics for record in again.records] == [record.metrics for record in result.records]
    assert [path.stat().st_mtime_ns for path in sorted((tmp_path / "a" / "runs").iterdir())] == before
    assert told == []


# --- A worker keeps scenes, arms and kernels from run to run, and no run can tell ---


SMALL = ("width=0.004", "depth=0.002", "speed=0.05", "force_noise=0.01")


@pytest.mark.slow
@pytest.mark.parametrize("vary", [("object=sphere,torus,bumps",), ("robot=ur5e-sim,panda-sim",)])
def test_a_run_after_others_in_one_worker_is_the_run_alone_bit_for_bit(vary, tmp_path):
    cases = [run.case for run in planned(*vary, fixed=SMALL, experiment="explore").runs]
    # there and back: each after every other, and all but the last twice
    order = [*range(len(cases)), *reversed(range(len(cases)))]
    with Workers(1) as one:
        warm = results_of(
            run_batch(logged, [into(cases[i], tmp_path / f"warm-{k}") for k, i in enumerate(order)], one, quiet)
        )
    for i, case in enumerate(cases):
        (alone,) = results_of(run_batch(logged, [into(case, tmp_path / f"alone-{i}")], 1, quiet))
        assert all(found == alone for found, of in zip(warm, order, strict=True) if of == i)


def test_a_run_of_a_sweep_does_without_what_no_table_shows(monkeypatch):
    def unasked(*given, **options):
        raise AssertionError("no metric of merit needs it")

    monkeypatch.setattr(map_growth, "map_growth", unasked)
    for name in ("fit_primitive", "HeightMap"):
        monkeypatch.setattr(exploration, name, unasked)
    (run,) = planned(fixed=SMALL, experiment="explore").runs
    found = attempt(run.case)
    assert (found.status, found.message) == (RunStatus.DONE, "")
    assert None not in {found.metrics[name] for name in ("map_rms_m", "force_rms_n", "contacts")}


def scene(target=None, stiffness=20e3):
    law = ContactLaw(stiffness=stiffness)
    return build_scene(Tip(Sphere(0.008)), target or SphereObject(0.04), law, (0.0, 0.0, 0.1))


def bytes_of(model):
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


@pytest.mark.parametrize("target", [None, Torus()], ids=["sphere", "torus"])
def test_a_scene_that_was_compiled_before_is_a_copy_that_nobody_else_has(target):
    first = scene(target)
    fresh = bytes_of(first.model)
    first.model.opt.gravity[2] = 7.0
    again = scene(copy.copy(target))
    assert again.model is not first.model
    assert bytes_of(again.model) == fresh
    assert bytes_of(scene(target, 10e3).model) != fresh


def test_a_kind_of_object_that_is_defined_anew_is_compiled_anew():
    """As in a notebook: the same name and the same values, but other code."""

    def defined(radius):
        class Ball(SphereObject):
            def add_geom(self, body, name):
                SphereObject(radius).add_geom(body, name)

        Ball.__qualname__ = "Ball"
        return Ball(0.04)

    small, large = (scene(defined(radius)).model.geom("object").size[0] for radius in (0.03, 0.05))
    assert (small, large) == (0.03, 0.05)


def test_a_mistake_leaves_nothing(tmp_path):
    with pytest.raises(InvalidValueError, match="force"):
        sweep(SweepConfig(TINY, vary=(("force=1,-2",),), out=tmp_path / "b"), quiet)
    assert not (tmp_path / "b").exists()


def test_a_run_that_does_not_get_to_its_end_does_not_count(here, undrawn, tmp_path, capsys):
    assert main(["sweep", TINY, "--vary", "reach=0.01,0.0005", "--out", str(tmp_path)]) == 1
    there, missing = table(tmp_path)
    assert (there["status"], missing["status"]) == ("done", "unfinished")
    assert missing["message"]
    assert missing["contact"] == "nothing was there"
    assert "1 of 2 runs" in capsys.readouterr().out
