"""Runs side by side: what their logs give is what the runs gave, and only runs of one experiment go together."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from palpate.commands.compare.report_data import ComparedFigure
from palpate.commands.run_told import log_writer
from palpate.experiments.regulate.run import carry_out
from palpate.experiments.regulate.run import prepared as pressed

from palpate.cli import main
from palpate.commands.answer import ExitCode
from palpate.commands.compare.runs_compared import changed_fields, common_fields, read_runs
from palpate.commands.compare.runs_compared_report import comparison_report
from palpate.errors import InvalidValueError
from palpate.experiments.explore import Attempt
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.repeat_words import command_line
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.plan import plan as plan_regulation

pytestmark = pytest.mark.slow  # they look at runs that take seconds


@pytest.fixture(scope="module")
def explored(tmp_path_factory):
    """Two short explorations that were asked for other forces and speeds: folder and what was found."""
    found = {}
    for name, force, speed in (("light", 1.0, 0.05), ("firm", 3.0, 0.04)):
        folder = tmp_path_factory.mktemp("runs") / name
        folder.mkdir()
        planned = plan(
            ExploreConfig(object="sphere", width=0.01, depth=0.004, speed=speed, force=force, out=folder)
        )
        attempt = Attempt(planned)
        found[folder] = attempt.found(attempt.run((), (log_writer(planned),)))
    return found


@pytest.fixture(scope="module")
def regulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("held")
    planned, found = pressed(plan_regulation(RegulateConfig(duration=0.5, out=folder)))
    carry_out(planned, found, (), (log_writer(planned),))
    return folder


def figure(report, name):
    return next(each for each in report.figures if each.name == name)


def test_a_log_gives_what_the_run_gave(explored, tmp_path):
    report = comparison_report(read_runs(list(explored)), tmp_path)
    assert report.names == ("light", "firm")
    points = figure(report, "points to true surface, RMS").values
    assert points == pytest.approx([1e3 * each.point_rms for each in explored.values()])
    largest = figure(report, "largest force felt").values
    assert largest == pytest.approx([np.nanmax(each.record.normal_force) for each in explored.values()])
    off = figure(report, "felt normal force off the set one, RMS").values
    for value, each in zip(off, explored.values(), strict=True):
        error = (each.record.normal_force - each.set_force)[each.scanning]
        assert value == pytest.approx(math.sqrt(np.mean(error**2)), rel=1e-3)
    assert figure(report, "felt normal force, mean").values == pytest.approx([1.0, 3.0], rel=0.02)
    assert figure(report, "how it ended").values == ("done", "done")


def test_only_what_was_asked_differently_is_said_so(explored, tmp_path):
    runs = read_runs(list(explored))
    assert dict(changed_fields(runs)) == {"force": (1.0, 3.0), "speed": (0.05, 0.04)}
    assert not {"force", "speed", "out"} & set(dict(common_fields(runs)))
    report = comparison_report(runs, tmp_path)
    assert report.differences == (("force", "N", "1", "3"), ("speed", "m/s", "0.05", "0.04"))


def test_differences_are_to_the_first_and_turn_with_the_order(explored, tmp_path):
    places = list(explored)
    there = figure(comparison_report(read_runs(places), tmp_path), "felt normal force, mean")
    back = figure(comparison_report(read_runs(places[::-1]), tmp_path), "felt normal force, mean")
    assert float(there.differences[0]) == pytest.approx(-float(back.differences[0]))
    assert float(there.differences[0]) == pytest.approx(2.0, rel=0.03)
    assert ComparedFigure("x", "", (1.0, 1.0, "word", math.nan)).differences == ("0", "", "")


def test_other_experiments_the_same_run_and_no_runs_are_refused(explored, regulated, tmp_path):
    first, second = explored
    with pytest.raises(InvalidValueError, match=r"is of `palpate explore` and .* of `palpate regulate`"):
        read_runs([first, regulated])
    with pytest.raises(InvalidValueError, match="are the same run"):
        read_runs([first, second, first / "latest.mcap"])
    (tmp_path / "part.stl").touch()
    with pytest.raises(InvalidValueError, match="is no run, as"):
        read_runs([first, tmp_path / "part.stl"])
    with pytest.raises(InvalidValueError, match=r"no latest.mcap"):
        read_runs([first, tmp_path])


def test_as_people_type_it(explored, regulated, tmp_path, capsys):
    first, second = map(str, explored)
    assert main(["compare", first, second, "--out", str(tmp_path / "new")]) == 0
    said = capsys.readouterr().out
    assert "firm less light" in said
    html = (tmp_path / "new" / "comparison.html").read_text()
    for told in ("What was asked differently", "Figures side by side", "Errors of the surface"):
        assert told in html
    assert main(["compare", first, second, "--out", str(tmp_path / "new"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["figures"]["felt_normal_force_mean_n"] == pytest.approx([1.0, 3.0], rel=0.02)
    assert told["figures"]["points_to_true_surface_rms_m"][0] < 1e-4, "SI units"
    assert main(["compare", first, str(regulated)]) == ExitCode.MISTAKE
    assert "only runs of the same experiment" in capsys.readouterr().err


def test_a_command_is_what_was_not_left_out():
    line = command_line("explore", ExploreConfig(object="box", force=3.0, identify=True, tip=(0.01,)))
    for typed in ("palpate explore --object box", " --force 3.0", " --identify", " --tip 0.01"):
        assert typed in line
    assert "--speed" not in line
    assert command_line("regulate", RegulateConfig()) == "palpate regulate"
    assert "'a $(rm) b'" in command_line("regulate", RegulateConfig(out=Path("a $(rm) b")))


@pytest.mark.parametrize("typed", [("--align",), ("--within", "0.002"), ("--map-unit", "mm")])
def test_options_that_are_for_maps_are_refused_with_runs(explored, typed, capsys):
    assert main(["compare", *map(str, explored), *typed]) == ExitCode.MISTAKE
    said = capsys.readouterr().err
    assert typed[0] in said
    assert "leave" in said


def test_what_was_changed_while_it_ran_was_asked_differently_and_moves_what_is_set(tmp_path):
    places = []
    for name, change in (("steady", ()), ("changed", ((1.5, "force", 3.0),))):
        (tmp_path / name).mkdir()
        asked = RegulateConfig(duration=1.5, drift=0.6, robot="stage-nano17", change=change, out=tmp_path / name)
        planned, found = pressed(plan_regulation(asked))
        done = carry_out(planned, found, (), (log_writer(planned),))
        places.append(tmp_path / name)
    runs = read_runs(places)
    ((name, (steady, changed)),) = changed_fields(runs)
    assert (name, steady) == ("change", None)
    assert str(changed).startswith("force 3 at 1.5")
    np.testing.assert_allclose(runs[1].set_force[done.holding], done.set_force[done.holding])
    assert np.nanmax(runs[1].set_force) == pytest.approx(3.0)
    settings = dict(comparison_report(runs, tmp_path).settings)
    assert settings["drift"] == "0.6 N/min", "of a grasp it is N/s"
