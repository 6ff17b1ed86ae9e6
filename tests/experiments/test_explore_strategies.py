"""Every strategy through the command: what it feels, what it marks, what it leaves, and what it refuses."""

import csv
import math
from typing import Any

import numpy as np
import pytest

from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.commands.replay.run import replay_log
from palpate.controllers.paths import Mark, PathEvent
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.exploration import marks_text, missed_marks, write_marks_csv
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.options import specs_of
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.reporting.page import WrittenReport
from palpate.runtime import Ending
from palpate.runtime.log import read_log
from support.explore_runs import carried_out, plan_of

SMALL = {
    "raster": {"width": 0.006, "depth": 0.004},
    "spiral": {"radius": 0.004},
    "taps": {"width": 0.005, "depth": 0.005},
    "contour": {},
    "active": {"width": 0.008, "depth": 0.006},
}
"""As little of each strategy as has all of its kinds of legs."""

BALL = {"object": "sphere", "size": (0.012,), "speed": 0.04}
BOX = {"object": "box", "size": (0.024, 0.016, 0.012)}


def words(fields):
    """Fields of a configuration as people type them."""
    typed = []
    for name, value in fields.items():
        values = value if isinstance(value, tuple) else (value,)
        typed += [f"--{name.replace('_', '-')}", *map(str, values)]
    return typed


@pytest.fixture(scope="module")
def undrawn():
    """Reports are made but not drawn, which takes seconds."""
    with pytest.MonkeyPatch.context() as patch:

        def write(report, path, figures):
            path.write_text(report.outcome)
            return WrittenReport((path,), ())

        patch.setattr("palpate.experiments.kit.recording.write_report", write)
        yield


@pytest.fixture(scope="module", params=list(SMALL))
def done(request, tmp_path_factory, undrawn):
    """A strategy that was carried out by the command, and its folder."""
    out = tmp_path_factory.mktemp(request.param)
    fields = {**BALL, "strategy": request.param, **SMALL[request.param]}
    assert main(["explore", *words(fields), "--out", str(out)]) == 0
    return request.param, out


@pytest.mark.slow
def test_each_strategy_leaves_its_files_and_says_how_it_ended(done):
    strategy, out = done
    names = {path.name for path in out.iterdir()}
    assert {"report.html", "contacts.csv", "contacts.ply", "marks.csv", "height_map.csv"} <= names
    assert (out / "report.html").read_text().startswith("Finished: ")
    assert (out / "marks.csv").read_text() == "x_m,y_m,z_m,event,radius_m,reason\n"
    assert ("map.ply" in names) or strategy == "taps"
    rows = list(csv.DictReader((out / "contacts.csv").read_text().splitlines()))
    distance = [math.hypot(*(float(row[f"{axis}_m"]) for axis in "xyz")) - 0.012 for row in rows]
    assert np.sqrt(np.mean(np.square(distance))) < 3e-6


def test_each_strategy_replays_bit_for_bit_from_its_log(done):
    strategy, out = done
    log = read_log(out / "latest.mcap")
    assert LoggedRun.of(log).config.strategy == strategy
    found = replay_log(log)
    assert found.should_be_identical
    assert found.commands.identical


@pytest.mark.slow
def test_what_was_found_is_found_again_from_the_log_alone(done, tmp_path):
    strategy, out = done
    found: Any = LoggedRun.of(read_log(out / "latest.mcap")).evaluate()
    assert found.config.strategy == strategy
    for name, write in Explore().files(found).items():
        write(tmp_path / name)
        assert (tmp_path / name).read_bytes() == (out / name).read_bytes(), name
    assert Explore().report(found).outcome == (out / "report.html").read_text()


# --- what they feel ---


def check_level(found, sense):
    """A circle on the ball, once round it: 4 mm below the top of the tip's way, 20 mm round the ball's middle."""
    assert found.run.ending is Ending.DONE
    assert found.marks == ()
    touched, height = found.cloud.position, 0.016 * 0.012 / 0.020
    settled = found.cloud.time > found.cloud.time[0] + 0.5
    assert np.abs(touched[settled, 2] - height).max() < 1e-4
    angle = np.unwrap(np.arctan2(touched[:, 1], touched[:, 0]))
    assert sense * (angle[-1] - angle[0]) == pytest.approx(2.0 * math.pi, abs=0.3)
    assert found.map.observed_share > 0.99
    assert not found.map.claimed.any()  # a line claims no surface
    assert len(found.map.mesh.vertices)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "turn"), [(0.02, "left"), (0.04, "right"), (0.05, "left")])
def test_a_level_contour_closes_both_ways_round_and_at_every_speed(speed, turn):
    fields = {**BALL, "speed": speed, "strategy": "contour", "turn": turn}
    check_level(carried_out(plan_of(ExploreConfig(**fields))), {"left": 1.0, "right": -1.0}[turn])


@pytest.mark.slow
def test_an_edge_is_followed_all_the_way_round_a_box_and_its_corners_are_marked():
    found = carried_out(plan_of(ExploreConfig(**BOX, strategy="contour", curve="edge")))
    assert found.run.ending is Ending.DONE
    assert {mark.event for mark in found.marks} == {PathEvent.EDGE}
    corners = np.array([mark.position for mark in found.marks])
    assert len(corners) == 4
    assert np.abs(np.abs(corners) - (0.012, 0.008, 0.006)).max() < 5e-4
    late = found.cloud.position[found.cloud.time > found.cloud.time[0] + 0.5]
    inside = np.maximum(0.012 - np.abs(late[:, 0]), 0.0), np.maximum(0.008 - np.abs(late[:, 1]), 0.0)
    assert np.percentile(np.minimum(*inside), 95) < 2e-4
    assert not missed_marks(found.marks)


@pytest.mark.slow
def test_taps_feel_no_friction_and_their_map_is_a_map():
    found = carried_out(plan_of(ExploreConfig(**BALL, strategy="taps", width=0.01, depth=0.01, period=2e-3)))
    assert found.point_rms < 1e-6
    assert np.isnan(found.map.friction.mean).all()
    assert found.map.covered > 0.95
    assert found.map.observed_share > 0.9
    assert len(np.unique(np.round(found.cloud.position[:, :2], 4), axis=0)) == pytest.approx(9, abs=2)


@pytest.mark.parametrize(
    ("over", "share"),
    [
        ({"width": 0.02, "center": (0.015, 0.0)}, 0.05),  # half of it is a rim: two rows make no map of that
        pytest.param({"width": 0.05}, 0.7, marks=pytest.mark.slow),
    ],
    ids=["one side", "both sides"],
)
def test_beyond_the_object_places_are_marked_and_the_outcome_says_so(over, share):
    region = {"depth": 0.004, "spacing": 0.004, "speed": 0.04, **over}
    with pytest.raises(InvalidValueError, match=r"leaves the part of the box .*\(--beyond\)"):
        plan_of(ExploreConfig(**BOX, **region))
    found = carried_out(plan_of(ExploreConfig(**BOX, **region, beyond=True)))
    assert found.run.ending is Ending.DONE
    assert found.run.at_rest
    assert {mark.event for mark in missed_marks(found.marks)} <= {PathEvent.UNREACHABLE, PathEvent.STEEP}
    assert len(missed_marks(found.marks)) >= 2
    assert all(abs(mark.position[0]) > 0.0115 for mark in found.marks)
    said = Explore().report(found).outcome
    assert f"but {len(missed_marks(found.marks))} places could not be felt" in said
    assert marks_text(missed_marks(found.marks)) in said
    assert found.map.observed_share > share  # what follows a place that could not be followed is left out, too
    assert np.nanmax(found.true_normal_force) < 5.0


@pytest.mark.slow
def test_an_active_exploration_ends_when_its_time_is_over():
    fields = {**BALL, "strategy": "active", "width": 0.012, "depth": 0.012, "accuracy": 1e-6}
    short = RecordedRun(plan_of(ExploreConfig(**fields, time=3.0))).run()
    assert short.ending is Ending.DONE
    assert 1.0 < short.duration < 8.0
    assert RecordedRun(plan_of(ExploreConfig(**fields, time=8.0))).run().duration > short.duration


FLAT = {"width": 0.03, "depth": 0.006, "speed": 0.05}
EXACTLY, ROUGHLY = (0.9, 1.1), (1 / 1.4, 1 / 0.7)
DURATIONS = [
    ({"object": "ellipsoid", "size": (0.05, 0.04, 0.03), **FLAT}, EXACTLY, 3.7),
    ({"object": "sphere", "size": (0.02,), "width": 0.02, "depth": 0.008, "speed": 0.05}, EXACTLY, 3.7),
    ({"object": "box", "size": (0.05, 0.04, 0.03), **FLAT}, EXACTLY, 3.7),
    *(({**BALL, "strategy": name, **SMALL[name]}, ROUGHLY, 2.0) for name in SMALL if name != "active"),
]
"""Options, expected duration over that of the run, and at least how many times as long a run may take."""


@pytest.mark.slow
@pytest.mark.parametrize(("fields", "expected", "longest"), DURATIONS)
def test_a_scan_takes_as_long_as_expected_and_its_limit_leaves_room_for_slopes(fields, expected, longest):
    planned = plan_of(ExploreConfig(**fields))
    took = RecordedRun(planned).run().duration
    assert expected[0] < planned.expected_duration / took < expected[1]
    assert planned.longest_duration > longest * took  # slopes of 60 degrees take twice as long


# --- mistakes ---


@pytest.mark.parametrize("strategy", list(SMALL))
def test_what_belongs_to_another_strategy_is_refused_with_what_does_not(strategy):
    values = {
        "width": 0.02, "depth": 0.02, "center": (0.01, 0.0), "spacing": 0.003, "radius": 0.01, "curve": "edge",
        "below": 0.003, "turn": "right", "accuracy": 1e-5, "measure": "largest", "area": 0.5, "time": 10.0,
        "beyond": True,
    }  # fmt: skip
    owned = {name: said.choices for name, said in specs_of(ExploreConfig).items() if said.choice == "strategy"}
    assert set(owned) == set(values)
    own = {name for name in owned if strategy in owned[name]}
    ExploreConfig(strategy=strategy, **{name: values[name] for name in own if name not in ("below", "curve")})
    for name in set(values) - own:
        with pytest.raises(InvalidValueError, match=rf"^{name} = .*is for --strategy .*{strategy} takes --"):
            ExploreConfig(strategy=strategy, **{name: values[name]})


def test_a_strategy_that_there_is_not_is_answered_with_the_nearest(tmp_path, capsys):
    (tmp_path / "e.yaml").write_text("strategy: contuor\n")
    assert main(["explore", "--config", str(tmp_path / "e.yaml")]) == ExitCode.MISTAKE
    assert "did you mean contour?" in capsys.readouterr().err
    with pytest.raises(InvalidValueError, match="strategy = 'zigzag': must be one of raster, spiral"):
        ExploreConfig(strategy="zigzag")


# --- marks ---


def test_marks_are_counted_and_read_back(tmp_path):
    marks = (
        Mark(PathEvent.STEEP, (0.1, -0.2, 0.3), 'steep, "very"'),
        Mark(PathEvent.EDGE, (0.0, 0.0, 0.0), "edge"),
        Mark(PathEvent.STEEP, (0.0, 0.0, 1e-5), "steep"),
    )
    assert marks_text(marks) == "2 steep, 1 edge"
    assert marks_text(()) == "none"
    assert missed_marks(marks) == (marks[0], marks[2])
    write_marks_csv(marks, tmp_path / "marks.csv")
    rows = list(csv.DictReader((tmp_path / "marks.csv").read_text().splitlines()))
    assert [row["event"] for row in rows] == ["steep", "edge", "steep"]
    assert [row["reason"] for row in rows] == [mark.reason for mark in marks]
    assert [tuple(float(row[f"{axis}_m"]) for axis in "xyz") for row in rows] == [mark.position for mark in marks]
