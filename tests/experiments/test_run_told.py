"""What a run tells of itself: changes that took effect or did not, and nothing claimed that is not known."""

import dataclasses
import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.commands.replay.run import replay_log
from palpate.controllers.paths import StopReason
from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.explored_map import rounded_to
from palpate.experiments.explore.surface_figure import contour_figure
from palpate.experiments.explore.tables import layer_rows, map_rows
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.kit.recorded_run import RecordedRun, change_outcomes, change_rows, change_sentences
from palpate.experiments.kit.recording import log_writer, notes_in, tell_log
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import plan_for
from palpate.experiments.regulate.report import outcome as regulation_outcome
from palpate.mapping.layers import VertexLayer
from palpate.reporting.marks import Line
from palpate.runtime import Ending, Trip
from palpate.runtime.live import Change, LiveParameter, LiveParameters, ScheduledChanges
from palpate.runtime.log import log_in, read_log
from palpate.runtime.log.standard.topics import PLAIN_ROBOT
from runtime.log.test_standard_topics import messages, numbers
from support.drawn import panels
from support.explore_runs import pictures, section, untrue
from support.regulate_runs import regulated

BALL = {"object": "sphere", "size": (0.012,), "speed": 0.04}
PERIOD = 1e-3


# --- changes ---


def made_in(asked, first, duration):
    """The changes that a loop makes, as a log keeps them."""
    live = LiveParameters(LiveParameter("force", 2.0, 0.0, 9.0, 1.0, "N", "force"))
    scheduled, made = ScheduledChanges(live, asked), []
    for k in range(round(duration / PERIOD) + 1):
        made += scheduled.step(first + k * PERIOD)
    return made


@given(
    st.lists(st.integers(0, 60).map(lambda k: 0.005 * k), unique=True, max_size=5),
    st.floats(-1e3, 1e3),
    st.integers(1, 200).map(lambda k: k * PERIOD),
)
def test_a_change_took_effect_when_it_was_due_or_the_run_was_over_before(times, first, duration):
    asked = [Change(time, "force", 1.0 + time) for time in times]
    made = made_in(asked, first, duration)
    told = change_outcomes(asked, made, {"force": "N"}, first=first, work=None)
    assert [each.asked.time for each in told] == sorted(times)
    for each in told:
        if each.made is None:
            assert each.asked.time > duration - 1e-9
        else:
            assert each.asked.time - 1e-9 <= each.made <= each.asked.time + PERIOD + 1e-9
    assert len([each for each in told if each.made is not None]) == len(made)


def test_what_was_changed_live_or_before_is_not_what_was_asked_for():
    asked = [Change(0.01, "force", 3.0), Change(0.5, "force", 3.0)]
    made = [Change(0.002, "force", 3.0), Change(0.01, "force", 3.0), Change(0.02, "force", 4.0)]
    told = change_outcomes(asked, made, {"force": "N"}, first=0.0, work=0.0)
    assert [each.made for each in told] == [0.01, None]


def test_what_became_of_changes_is_said():
    asked = [Change(0.01, "force", 4.0), Change(0.1, "force", 3.0), Change(500.0, "force", 2.5)]
    told = change_outcomes(asked, made_in(asked, 0.0, 0.2), {"force": "N"}, first=0.0, work=0.05)
    early, late, never = change_sentences(told, 0.2, "anything was held")
    assert early.startswith("Changed before anything was held: force to 4 N after 0.01 s; times count from")
    assert late == "Changed: force to 3 N after 0.1 s."
    assert never == "NOT changed: force to 2.5 N after 500 s; the run took 0.2 s."
    assert [value for _, value in change_rows(told)][2] == "force to 2.5 N after 500 s: not reached"
    assert change_sentences((), 0.2, "") == ()


# --- nothing is claimed of a line ---


@functools.cache
def edge():
    return explore(
        ExploreConfig(object="box", size=(0.03, 0.02, 0.02), strategy="contour", curve="edge", speed=0.04)
    )


@pytest.mark.slow
def test_of_a_line_no_band_no_share_and_no_curvature_are_told():
    found = edge()
    assert found.map.is_line
    report = Explore().report(found)
    metrics = {metric.name: metric.text for metric in report.metrics}
    assert metrics["map"] == "a line"
    assert metrics["shape"] == "unclear"
    rows = [(metric.name, metric.text, metric.note) for metric in report.metrics]
    told = " ".join(" ".join(row) for row in (*rows, *map_rows(found.map), *layer_rows(found.map)))
    for claim in ("observed", "curvature", "band", "standard deviation", "inside"):
        assert not any(claim in name for name in metrics)
        assert claim not in told
    assert "claims no surface" in told
    assert "friction" in told  # of which the line itself tells


@pytest.mark.slow
def test_an_outline_shows_what_was_felt_the_truth_and_the_error_along_the_arc():
    found = edge()
    outline, along = panels(contour_figure(found))
    felt, true = (next(mark for mark in outline.marks if mark.name == name) for name in ("felt", "true"))
    np.testing.assert_allclose([felt.x, felt.y], [true.x, true.y], atol=1e3 * np.abs(found.point_error).max())
    error = next(mark for mark in along.marks if isinstance(mark, Line))
    assert np.nanmax(np.abs(error.y)) == pytest.approx(1e6 * np.abs(found.point_error).max())
    assert (np.diff(error.x[np.isfinite(error.x)]) >= 0.0).all()
    assert np.nanmax(error.x) == pytest.approx(1e3 * found.plan.scan.length, rel=0.3)
    (alone,) = panels(contour_figure(untrue(found)))
    assert "true" not in {mark.name for mark in alone.marks}


@pytest.fixture(scope="module")
def raster():
    return explore(ExploreConfig(**BALL, width=0.008, depth=0.006))


@pytest.mark.slow
def test_a_surface_still_claims_its_share_its_band_and_its_curvature(raster):
    assert not raster.map.is_line
    metrics = {metric.name for metric in Explore().report(raster).metrics}
    assert {"observed of the reachable", "true errors inside that band", "mean curvature of the map"} <= metrics
    shown = pictures(Explore().report(raster), "The surface")["Touched surface"]
    assert "% of its true errors are inside it" in shown.caption
    names = [row[0] for row in (*map_rows(raster.map), *layer_rows(raster.map))]
    assert len(set(names)) == len(names), "two rows of one name tell two things"


# --- metrics as they are known ---


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e3))
def test_a_value_is_rounded_by_far_less_than_it_is_known(value, sd):
    rounded = rounded_to(value, sd)
    assert abs(rounded - value) <= 0.051 * sd + 1e-15 * abs(value)
    assert rounded_to(value, math.nan) == value


@pytest.mark.slow
def test_a_deviation_that_nobody_needs_is_not_spelt_out(raster):
    at = len(raster.map.mesh.vertices)
    alike = VertexLayer("friction", np.full(at, 0.3), np.full(at, 9.4e-6))
    row = layer_rows(dataclasses.replace(raster.map, friction=alike))[0]
    assert row[1] == "0.3"
    assert row[3].startswith("scatters by less than 0.1%; known on 100 % of the map; 0.3 all over; ")
    scattered = VertexLayer("friction", np.linspace(0.2, 0.4, at), np.full(at, 0.02))
    said = layer_rows(dataclasses.replace(raster.map, friction=scattered))[0][3]
    assert said.startswith("scatters by 0.02; known on 100 % of the map; 0.21 to 0.39 over")


def test_where_little_was_felt_no_shape_is_ruled_out(raster):
    shape = dataclasses.replace(raster.map.shape, kind=None, possible=(), limit=0.0)
    for share, name in ((0.06, "unclear"), (1.0, "none of these")):
        felt = np.arange(len(raster.map.found)) < share * len(raster.map.found)
        cut = dataclasses.replace(raster, map=dataclasses.replace(raster.map, shape=shape, found=felt))
        report = Explore().report(cut)
        assert {metric.name: metric.value for metric in report.metrics}["shape"] == name
        sentence = section(report, "Which shape it is").parts[0].text
        assert sentence.startswith("Too little") is (name == "unclear")


def test_the_artefact_of_simulated_friction_is_told_only_where_points_are_off(raster):
    for error, told in ((1e-6, False), (5e-6, True)):
        off = np.zeros(len(raster.cloud))
        off[3] = error
        report = Explore().report(dataclasses.replace(raster, point_error=off))
        shown = pictures(report, "Errors of single points")["How large the errors are"]
        assert ("artefact" in shown.caption) is told


# --- how it ended ---


def test_an_interruption_without_marks_speaks_of_none(raster):
    run = dataclasses.replace(raster.run, ending=Ending.INTERRUPTED)
    report = Explore().report(dataclasses.replace(raster, run=run))
    assert report.outcome.startswith("Not finished (interrupted) after ")


def as_if(raster, share, **options):
    """An exploration that observed a share of what it could, by another strategy."""
    count = len(raster.map.found)
    found = dataclasses.replace(raster.map, found=np.arange(count) < share * count)
    plan = dataclasses.replace(raster.plan, config=ExploreConfig(**BALL, **options))
    return dataclasses.replace(raster, map=found, plan=plan)


def test_who_felt_less_than_half_has_not_explored(raster):
    for share, reached in ((0.3, False), (0.7, True)):
        report = Explore().report(as_if(raster, share))
        assert report.reached is reached
        assert ("less than half" in report.outcome) is not reached
        assert "% of what could be felt in" in report.outcome


@pytest.mark.parametrize(
    ("options", "told", "unheard"),
    [
        ({}, "--spacing", "--radius"),
        ({"strategy": "spiral"}, "closer turns (--spacing)", "rows"),
        ({"strategy": "taps"}, "closer taps (--spacing)", "rows"),
        ({"strategy": "contour"}, "", "--spacing"),
    ],
)
def test_advice_names_options_of_the_strategy(raster, options, told, unheard):
    some = as_if(raster, 0.7, **options)
    nothing = dataclasses.replace(some, cloud=some.cloud.select(np.zeros(len(some.cloud), bool)), map=None)
    advice = " ".join(Explore().report(some).advice)
    assert told in advice
    assert unheard not in advice
    aim = " ".join(Explore().report(nothing).advice)
    assert "--center" in aim
    assert ("--width" in aim) is (options.get("strategy", "raster") in ("raster", "taps"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "enough"),
    [
        ({"time": 0.5}, StopReason.SPENT),
        ({"accuracy": 1e-3}, StopReason.REACHED),
        ({"accuracy": 1e-7}, StopReason.EXHAUSTED),
    ],
)
def test_an_active_exploration_says_why_it_ended_and_what_was_asked_for(given, enough):
    found = explore(ExploreConfig(**BALL, strategy="active", width=0.005, depth=0.004, **given))
    assert found.stop_reason is enough
    assert Explore().report(found).outcome.startswith("Finished: ")
    assert f"; {enough.value}; the robot is at rest." in Explore().report(found).outcome
    if found.map.claimed.any():
        metrics = {metric.name: metric.value for metric in Explore().report(found).metrics}
        assert metrics["target accuracy of the map"] == pytest.approx(1e3 * given.get("accuracy", 2e-5))


# --- What became of a retreat is told wherever a trip is ---


AFTER = "backed off 5.0 mm within 0.31 s, felt at most 31 N and 0 N at the end"
TRIP = Trip(1.25, "contact force", "31 N", "20 N")


@pytest.mark.slow
@pytest.mark.parametrize("aftermath", ["", AFTER], ids=["stood still", "retreated"])
def test_a_result_and_its_reports_tell_of_the_retreat(aftermath):
    exploration = explore(ExploreConfig(width=0.006, depth=0.002))
    regulation = regulated(duration=0.2)
    trip = replace(TRIP, aftermath=aftermath)
    run = replace(exploration.run, ending=Ending.TRIPPED, trip=trip)
    said = f"{TRIP}; {AFTER}" if aftermath else str(TRIP)
    assert run.why == said
    assert str(run).startswith(f"stopped by the supervisor ({said}) after ")
    for told in (
        Explore().report(replace(exploration, run=run)).outcome,
        regulation_outcome(replace(regulation, run=run)),
    ):
        assert told.startswith(f"Stopped by the supervisor: {said}; the robot is at rest.")
    assert replace(run, trip=None).why == ""


# --- Logs of experiments as other tools see them once a run is over; palpate replays them as before ---


def carried_out(name, config, folder) -> Any:
    """A run, its log told to all; returns what was found."""
    experiment = experiment_named(name)
    plan = plan_for(experiment, config).prepared()
    run = RecordedRun(plan)
    result = run.run(sinks=(log_writer(experiment, plan, folder),))
    before = read_log(log_in(folder))
    found = experiment.evaluate(plan, run.recorded(result))
    tell_log(plan, result, experiment.cloud(found))
    after = read_log(log_in(folder))
    assert after.rows.tobytes() == before.rows.tobytes()
    return found


@pytest.mark.slow
def test_an_exploration_has_its_map_and_is_replayed_bit_for_bit(tmp_path):
    found = carried_out("explore", ExploreConfig(width=0.01, depth=0.004, force_noise=0.01), tmp_path)
    told = messages(log_in(tmp_path))
    ((_, cloud),) = told["/map"]
    points = np.frombuffer(bytes(cloud.data), "<f4").reshape(cloud.width, -1)
    assert points[:, :3] == pytest.approx(found.map.mesh.vertices, abs=1e-7)
    assert [field.name for field in cloud.fields][3:7] == ["normal_x", "normal_y", "normal_z", "band"]
    assert len(told["/finger_0/contact"]) > 100
    again = replay_log(tmp_path)
    assert again.identical
    assert again.commands.count > 1000


@pytest.mark.slow
def test_the_fingers_of_a_hand_are_where_its_geometry_says(tmp_path):
    found = carried_out("grasp", GraspConfig(), tmp_path)
    hand = plan_for(experiment_named("grasp"), GraspConfig()).hand_kinematics
    log, told = read_log(log_in(tmp_path)), messages(log_in(tmp_path))
    rows = log.rows[log.sequence % 10 == 0][:, log.codec.columns["hand.joint_position"]]
    for joints, (_, message) in zip(rows[::50].tolist(), told["/tf"][::50], strict=True):
        poses = hand.sensor_poses(tuple(joints))
        for pose, transform in zip(poses, message.transforms[1:], strict=True):
            assert transform.header.frame_id == "hand"
            assert tuple(numbers(transform.transform.translation)) == pose.position
    assert "/map" not in told
    assert found.run.done


def test_of_a_log_of_no_experiment_nothing_is_noted():
    assert notes_in({}) is PLAIN_ROBOT
    assert notes_in({"experiment.yaml": "experiment: nothing_like_that\n"}) is PLAIN_ROBOT
