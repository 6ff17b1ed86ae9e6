"""Runs side by side: what their logs give is what the runs gave, and only runs of one experiment go together."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.commands.compare.runs_compared import changed_fields, common_fields, read_runs
from palpate.commands.compare.runs_compared_report import (
    ComparedFigure,
    changed_options,
    compared_figures,
    comparison_report,
)
from palpate.errors import InvalidValueError
from palpate.experiments.kit.figure import figures_of
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import perform
from support.explore_runs import section

pytestmark = pytest.mark.slow  # they look at runs that take seconds


def performed(name, folder, **options):
    """What came of a run that was recorded in a folder."""
    experiment = experiment_named(name)
    folder.mkdir(parents=True)
    return perform(experiment, experiment.Config(**options), folder)


@pytest.fixture(scope="module")
def explored(tmp_path_factory):
    """Two short explorations that were asked for other forces and speeds: folder and what was found."""
    runs, size = tmp_path_factory.mktemp("runs"), {"object": "sphere", "width": 0.01, "depth": 0.004}
    asked = {"light": {"force": 1.0, "speed": 0.05}, "firm": {"force": 3.0, "speed": 0.04}}
    return {runs / name: performed("explore", runs / name, **size, **each) for name, each in asked.items()}


@pytest.fixture(scope="module")
def regulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "held"
    performed("regulate", folder, duration=0.5)
    return folder


def figure(runs, name):
    (found,) = (each for each in compared_figures(runs) if each.name == name)
    return found


def test_a_log_gives_what_the_run_gave(explored):
    runs = read_runs(list(explored))
    assert [run.name for run in runs] == ["light", "firm"]
    for run, found in zip(runs, explored.values(), strict=True):
        assert figures_of(run.experiment, run.result) == figures_of(run.experiment, found)
        (errors,) = run.errors
        assert errors.values == pytest.approx(1e6 * found.point_error)
    off = figure(runs, "felt normal force off the set one, RMS").values
    for value, each in zip(off, explored.values(), strict=True):
        error = (each.record.normal_force - each.set_force)[each.scanning]
        assert value == pytest.approx(math.sqrt(np.mean(error**2)), rel=1e-3)
    assert figure(runs, "felt normal force, mean").values == pytest.approx([1.0, 3.0], rel=0.02)
    assert figure(runs, "how it ended").values == ("done", "done")
    names = [each.name for each in compared_figures(runs)]
    assert len(set(names)) == len(names), "two rows of one name tell two things"


def test_only_what_was_asked_differently_is_said_so(explored):
    runs = read_runs(list(explored))
    assert dict(changed_fields(runs)) == {"force": (1.0, 3.0), "speed": (0.05, 0.04)}
    assert not {"force", "speed", "out"} & set(dict(common_fields(runs)))
    assert changed_options(runs) == (("force", "N", "1", "3"), ("speed", "m/s", "0.05", "0.04"))


def test_differences_are_to_the_first_and_turn_with_the_order(explored):
    runs = read_runs(list(explored))
    there, back = (figure(each, "felt normal force, mean") for each in (runs, runs[::-1]))
    assert float(there.differences[0]) == pytest.approx(-float(back.differences[0]))
    assert float(there.differences[0]) == pytest.approx(2.0, rel=0.03)
    assert ComparedFigure("x", "", (1.0, 1.0, "word", math.nan)).differences == ("0", "", "")
    small = ComparedFigure("x", "m", (2.5e-6, 3.5e-6))
    assert (small.scale.unit, small.shown, small.differences) == ("µm", ("2.500", "3.500"), ("+1",))


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
    for told in ("Options that differ", "Figures side by side", "Errors of the surface"):
        assert told in html
    assert main(["compare", first, second, "--out", str(tmp_path / "new"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["figures"]["felt_normal_force_mean_n"] == pytest.approx([1.0, 3.0], rel=0.02)
    assert told["figures"]["point_rms_m"][0] < 1e-4, "SI units"
    assert main(["compare", first, str(regulated)]) == ExitCode.MISTAKE
    assert "only runs of the same experiment" in capsys.readouterr().err


def test_what_was_changed_while_it_ran_was_asked_differently_and_moves_what_is_set(tmp_path):
    asked = {"duration": 1.5, "drift": 0.6, "robot": "stage-nano17"}
    performed("regulate", tmp_path / "steady", **asked)
    done = performed("regulate", tmp_path / "changed", change=((1.5, "force", 3.0),), **asked)
    runs = read_runs([tmp_path / "steady", tmp_path / "changed"])
    ((name, (steady, changed)),) = changed_fields(runs)
    assert (name, steady) == ("change", None)
    assert str(changed).startswith("force 3 at 1.5")
    np.testing.assert_allclose(runs[1].set_force[done.holding], done.set_force[done.holding])
    assert np.nanmax(runs[1].set_force) == pytest.approx(3.0)
    report = comparison_report(runs, tmp_path)
    assert dict(report.settings)["drift"] == "0.6 N/min", "of a grasp it is N/s"
    alike = comparison_report((runs[0], replace(runs[0], name="again")), tmp_path)
    assert section(alike, "Options that differ").parts[0].text == "All options are the same."


@pytest.mark.parametrize("typed", [("--align",), ("--within", "0.002"), ("--map-unit", "mm")])
def test_options_that_are_for_maps_are_refused_with_runs(explored, typed, capsys):
    assert main(["compare", *map(str, explored), *typed]) == ExitCode.MISTAKE
    said = capsys.readouterr().err
    assert typed[0] in said
    assert "leave" in said
