"""`palpate compare`: maps against references, and runs side by side."""

import json
import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from mapping.raster import sphere_cap
from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.commands.compare.runs import (
    ComparedMetric,
    MapDifference,
    bars_figure,
    compared_metrics,
    compared_options,
    comparison_report,
    difference_figure,
    option_rows,
    read_runs,
    spread_figure,
)
from palpate.errors import InvalidValueError
from palpate.experiments.kit.comparable import ErrorSample
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import perform
from palpate.mapping import MapSettings, SurfaceMap, TouchCloud, surface_mesh, write_cloud_csv, write_cloud_ply
from palpate.reporting.marks import Bars, Line
from palpate.reporting.plots import plots
from support.drawn import panels
from support.explore_runs import section


@pytest.fixture
def folder(tmp_path):
    """A ball of 20 mm in metres and millimetres, and its upper half felt 0.1 mm too far out."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.02)
    ball.export(tmp_path / "ball.stl")
    upper = ball.vertices[ball.vertices[:, 2] > 0.0] / 0.02
    n = len(upper)
    zero = np.zeros((n, 3))
    cloud = TouchCloud(np.arange(n) * 1e-3, 0.0201 * upper, upper, np.ones(n), zero, np.zeros(n))
    write_cloud_ply(cloud, tmp_path / "contacts.ply")
    write_cloud_csv(cloud, tmp_path / "contacts.csv")
    ball.apply_scale(1e3)
    ball.export(tmp_path / "ball_mm.stl")
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("name", ["contacts.ply", "contacts.csv"])
def test_a_cloud_against_a_mesh(folder, name, capsys):
    out = folder / "new" / "out"
    words = [
        "compare",
        str(folder / name),
        str(folder / "ball_mm.stl"),
        "--reference-unit",
        "mm",
        "--out",
        str(out),
    ]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "reference covered" in said
    found = json.loads((out / "compare.json").read_text())
    assert found["map_to_reference_m"]["rms"] == pytest.approx(1e-4, abs=2e-6)
    assert found["bias_m"] == pytest.approx(1e-4, abs=2e-6)
    assert found["coverage"] == pytest.approx(0.5, abs=0.03)
    assert found["normal_error_rad"]["rms"] < 0.01
    assert found["alignment"] is None
    page = (out / "compare.html").read_text()
    assert "http" not in page.replace("http://www.w3.org", "")
    assert "The map was compared where it is." in page


def test_alignment_is_said(folder, capsys):
    words = ["compare", str(folder / "contacts.ply"), str(folder / "ball.stl"), "--align"]
    assert main(words) == 0
    assert "map was moved by" in capsys.readouterr().out
    assert "first moved onto the reference" in (folder / "compare.html").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["contacts.ply", "ball_mm.stl"], "add --reference-unit mm"),
        (["contacts.ply", "contacts.ply"], "has no triangles"),
        (["none.ply", "ball.stl"], "none.ply"),
    ],
)
def test_mistakes_are_said_in_one_line(folder, words, said, capsys):
    assert main(["compare", *(str(folder / word) for word in words)]) == ExitCode.MISTAKE
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


# --- runs side by side ---


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


def metric(runs, name):
    (found,) = (each for each in compared_metrics(runs) if each.name == name)
    return found


@pytest.mark.slow
def test_a_log_gives_what_the_run_gave(explored):
    runs = read_runs(list(explored))
    assert [run.name for run in runs] == ["light", "firm"]
    for run, found in zip(runs, explored.values(), strict=True):
        assert metrics_of(run.logged.experiment, run.result) == metrics_of(run.logged.experiment, found)
        (errors,) = run.errors
        assert errors.values == pytest.approx(1e6 * found.point_error)
    off = metric(runs, "felt normal force off the set one, RMS").values
    for value, each in zip(off, explored.values(), strict=True):
        error = (each.record.normal_force - each.set_force)[each.scanning]
        assert value == pytest.approx(math.sqrt(np.mean(error**2)), rel=1e-3)
    assert metric(runs, "felt normal force, mean").values == pytest.approx([1.0, 3.0], rel=0.02)
    assert metric(runs, "how it ended").values == ("done", "done")
    names = [each.name for each in compared_metrics(runs)]
    assert len(set(names)) == len(names), "two rows of one name tell two things"


@pytest.mark.slow
def test_only_what_was_asked_differently_is_said_so(explored):
    runs = read_runs(list(explored))
    assert dict(compared_options(runs, differing=True)) == {"force": (1.0, 3.0), "speed": (0.05, 0.04)}
    assert not {"force", "speed", "out"} & set(dict(compared_options(runs, differing=False)))
    assert option_rows(runs) == (("force", "N", "1", "3"), ("speed", "m/s", "0.05", "0.04"))


@pytest.mark.slow
def test_differences_are_to_the_first_and_turn_with_the_order(explored):
    runs = read_runs(list(explored))
    there, back = (metric(each, "felt normal force, mean") for each in (runs, runs[::-1]))
    assert float(there.differences[0]) == pytest.approx(-float(back.differences[0]))
    assert float(there.differences[0]) == pytest.approx(2.0, rel=0.03)
    assert ComparedMetric("x", "", (1.0, 1.0, "word", math.nan)).differences == ("0", "", "")
    small = ComparedMetric("x", "m", (2.5e-6, 3.5e-6))
    assert (small.scale.unit, small.shown, small.differences) == ("µm", ("2.500", "3.500"), ("+1",))


@pytest.mark.slow
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


@pytest.mark.slow
def test_as_people_type_it(explored, regulated, tmp_path, capsys):
    first, second = map(str, explored)
    assert main(["compare", first, second, "--out", str(tmp_path / "new")]) == 0
    said = capsys.readouterr().out
    assert "firm less light" in said
    html = (tmp_path / "new" / "comparison.html").read_text()
    for told in ("Options that differ", "Metrics side by side", "Errors of the surface"):
        assert told in html
    assert main(["compare", first, second, "--out", str(tmp_path / "new"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["metrics"]["felt_normal_force_mean_n"] == pytest.approx([1.0, 3.0], rel=0.02)
    assert told["metrics"]["point_rms_m"][0] < 1e-4, "SI units"
    assert main(["compare", first, str(regulated)]) == ExitCode.MISTAKE
    assert "only runs of the same experiment" in capsys.readouterr().err


@pytest.mark.slow
def test_a_figure_that_cannot_be_drawn_costs_a_comparison_nothing_else(explored, tmp_path, monkeypatch, capsys):
    def failing(*given):
        raise ZeroDivisionError("no time")

    monkeypatch.setattr("palpate.commands.compare.runs._over_time", failing)
    assert main(["compare", *map(str, explored), "--out", str(tmp_path), "--json"]) == ExitCode.UNFINISHED
    told = json.loads(capsys.readouterr().out)
    assert "ZeroDivisionError: no time" in " ".join(told["warnings"])
    assert "Metrics side by side" in (tmp_path / "comparison.html").read_text()


@pytest.mark.slow
def test_what_was_changed_while_it_ran_was_asked_differently_and_moves_what_is_set(tmp_path):
    asked = {"duration": 1.5, "drift": 0.6, "robot": "stage-nano17"}
    performed("regulate", tmp_path / "steady", **asked)
    done = performed("regulate", tmp_path / "changed", change=((1.5, "force", 3.0),), **asked)
    runs = read_runs([tmp_path / "steady", tmp_path / "changed"])
    ((name, (steady, changed)),) = compared_options(runs, differing=True)
    assert (name, steady) == ("change", None)
    assert str(changed).startswith("force 3 at 1.5")
    np.testing.assert_allclose(runs[1].set_force[done.holding], done.set_force[done.holding])
    assert np.nanmax(runs[1].set_force) == pytest.approx(3.0)
    report = comparison_report(runs, tmp_path)
    assert dict(report.settings)["drift"] == "0.6 N/min"
    alike = comparison_report((runs[0], replace(runs[0], name="again")), tmp_path)
    assert section(alike, "Options that differ").parts[0].text == "All options are the same."


@pytest.mark.slow
@pytest.mark.parametrize("typed", [("--align",), ("--within", "0.002"), ("--map-unit", "mm")])
def test_options_that_are_for_maps_are_refused_with_runs(explored, typed, capsys):
    assert main(["compare", *map(str, explored), *typed]) == ExitCode.MISTAKE
    said = capsys.readouterr().err
    assert typed[0] in said
    assert "leave" in said


# --- Pictures of runs side by side: metrics in which they differ, and how far their maps are apart ---


NAMES = ("a", "b", "c")


def test_bars_show_what_differs_in_one_unit():
    metrics = [
        ComparedMetric("error", "m", (2e-6, 3e-6, math.nan)),
        ComparedMetric("alike", "N", (1.0, 1.01, 1.0)),
        ComparedMetric("ending", "", ("done", "lost", "done")),
    ]
    (panel,) = panels(bars_figure(metrics, NAMES))
    assert panel.x.label == "error [µm]"
    assert [(bars.at[0], bars.length[0]) for bars in panel.marks if isinstance(bars, Bars)] == [
        (2.0, 2.0),
        (1.0, 3.0),
    ]
    assert dict(panel.y.ticks) == {2.0: "a", 1.0: "b", 0.0: "c"}
    assert bars_figure(metrics[1:], NAMES) is None


def test_shares_of_errors_are_of_each_runs_own_points():
    samples = [ErrorSample("t", "c", "error", "µm", np.linspace(-1.0, 1.0, count)) for count in (100, 10_000)]
    (panel,) = panels(spread_figure([*samples, None], NAMES))
    lines = [mark for mark in panel.marks if isinstance(mark, Line)]
    assert [line.name for line in lines] == ["a", "b"]
    assert [line.y[1:-1:2].sum() for line in lines] == pytest.approx([100.0, 100.0])


@cache
def felt(up=0.0, aside=0.0):
    """The map of a cap, somewhere else."""
    cloud = sphere_cap(half=0.004, step=4e-4)
    moved = SurfaceMap.learned(
        replace(cloud, position=cloud.position + np.array([aside, 0.0, up])), MapSettings.for_rows(2e-3, bias=1e-6)
    )
    return SimpleNamespace(surface=moved, mesh=surface_mesh(moved, 1e-3))


def test_a_map_that_lies_further_out_by_so_much_is_shown_so():
    found = MapDifference.of(felt(), felt(up=50e-6))
    assert len(found.common) > 0.9 * len(found.height)
    assert found.common == pytest.approx(50e-6 * felt().mesh.normals[np.isfinite(found.height), 2], abs=1e-6)
    picture = difference_figure([felt(), None, felt(up=50e-6)], NAMES)
    assert "c: 49" in picture.caption
    assert "0 % within both bands" in picture.caption
    assert [space.title for space in picture.panels] == ["c less a"]
    assert plots(picture)


def test_maps_of_other_places_are_not_compared():
    assert difference_figure([felt(), felt(aside=0.02)], NAMES[:2]) is None
    assert difference_figure([None, felt()], NAMES[:2]) is None
