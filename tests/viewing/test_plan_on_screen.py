"""The plan: what is behind the tip, what is before it, and that it gets to the view whole."""

import itertools
import math
import multiprocessing
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.experiments.explore.plan import PlanWatch
from palpate.runtime import plan_track
from palpate.runtime.plan_track import STEP, PlanTrack
from palpate.runtime.shown_plan import MOST_CORNERS, MOST_MARKS, PlanDiary, ShownMark, ShownPlan
from palpate.viewing import frames_of_log
from palpate.viewing.plan_board import CAPACITY, PlanBoard, PlanReader, PlanWriter
from palpate.viewing.plan_drawing import LABEL_DISTANCE, places

UP = (0.0, 0.0, 1.0)


def along(points, step=1e-4):
    """Points every `step` along a polygon."""
    found = [np.array(points[:1], float)]
    for a, b in itertools.pairwise(points):
        count = max(math.ceil(math.dist(a, b) / step), 1)
        found.append(np.linspace(a, b, count + 1)[1:])
    return np.concatenate(found)


def length(points):
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def meander(rows, width, apart):
    """Corners of a raster of rows, left to right and back."""
    return [(x, i * apart, 0.0) for i in range(rows) for x in ((0.0, width) if i % 2 == 0 else (width, 0.0))]


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 6),
    st.floats(4e-3, 0.02),
    st.floats(1e-3, 4e-3),
    st.floats(0.0, 1.0),
    st.integers(1, 700),
    st.floats(0.0, 5e-5),
)
def test_done_and_to_go_are_the_path(rows, width, apart, share, batch, wobble):
    """However the positions come in: what is behind and what is ahead have the length of the whole."""
    path = meander(rows, width, apart)
    way = along(path)
    way = way[: 1 + int(share * (len(way) - 1))]
    way = way + np.random.default_rng(0).uniform(-wobble, wobble, way.shape)
    track = PlanTrack()
    track.move(way[:1] + np.array([0.0, 0.0, 5e-3]))
    track.follow(ShownPlan("stroke", tuple(path[1:])))
    for i in range(0, len(way), batch):
        track.move(way[i : i + batch])
    assert track.done[:, 2] == pytest.approx(track.done[0, 2]), "drawn at one height"
    whole, to_go = length(np.array(path)), length(track.rest)
    assert length(track.done) + to_go == pytest.approx(whole, rel=0.05, abs=6.0 * STEP)
    assert to_go == pytest.approx((1.0 - share) * whole, rel=0.02, abs=6.0 * STEP)


def test_rows_close_to_each_other_are_not_mixed_up():
    """On the second row of three, half a millimetre apart, one and a half are still to come."""
    path = meander(3, 0.01, 5e-4)
    way = along([*path[:3], (0.005, 5e-4, 0.0)])
    track = PlanTrack()
    track.follow(ShownPlan("stroke", tuple(path)))
    track.move(way)
    assert length(track.rest) == pytest.approx(0.005 + 5e-4 + 0.01, abs=4.0 * STEP)


def test_there_and_back_is_not_done_at_the_beginning():
    track = PlanTrack()
    track.move(np.zeros((1, 3)))
    track.follow(ShownPlan("stroke", ((0.01, 0.0, 0.0), (0.0, 0.0, 0.0))))
    track.move(along([(0.0, 0.0, 0.0), (0.005, 0.0, 0.0)]))
    assert length(track.rest) == pytest.approx(0.015, abs=2.0 * STEP)
    track.move(along([(0.005, 0.0, 0.0), (0.01, 0.0, 0.0), (0.004, 0.0, 0.0)]))
    assert length(track.rest) == pytest.approx(0.004, abs=4.0 * STEP)


def test_another_mark_does_not_begin_the_leg_anew():
    path = ((0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.01, 0.01, 0.0))
    track = PlanTrack()
    track.follow(ShownPlan("stroke", path))
    track.move(along([*path[:2], (0.01, 0.005, 0.0)]))
    before = track.rest
    track.follow(ShownPlan("stroke", path, UP, (ShownMark("edge", (0.0, 0.0, 0.0)),)))
    assert (track.rest == before).all()


def test_a_long_path_gets_coarser_rather_than_endless(monkeypatch):
    monkeypatch.setattr(plan_track, "MOST_STEPS", 2_000)
    track, angle = PlanTrack(), np.linspace(0.0, 40.0, 12_000)
    track.move(np.column_stack([0.05 * np.cos(angle), 0.05 * np.sin(angle), 0.0 * angle]))
    assert 1_000 <= len(track.done) <= 2_000
    assert length(track.done) == pytest.approx(2.0, rel=0.02)


def test_a_plane_that_stands_upright():
    """Along the axis nothing moves: the line stays in the plane of the tip's beginning."""
    track, axis = PlanTrack(), (1.0, 0.0, 0.0)
    track.follow(ShownPlan("stroke", ((0.0, 0.0, 0.0), (0.0, 0.01, 0.0)), axis))
    track.move(np.array([[0.3, 0.0, 0.0], [0.25, 0.0, 0.0], [0.24, 0.004, 0.0]]))
    assert track.rest[:, 0] == pytest.approx(0.3)
    assert track.rest[-1] == pytest.approx([0.3, 0.01, 0.0])


def plan_of(corners, marks):
    return ShownPlan(
        "stroke",
        tuple((1e-3 * i, 2e-3 * i, 0.0) for i in range(corners)),
        UP,
        tuple(ShownMark("unreachable", (1e-3 * i, 0.1, 0.2)) for i in range(marks)),
    )


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5000), st.integers(0, 1000)), min_size=1, max_size=4))
def test_the_newest_plan_comes_through_and_once(sizes):
    board = PlanBoard(multiprocessing.get_context("spawn"))
    writer, reader = PlanWriter(board), PlanReader(board)
    assert reader.news() is None
    for corners, marks in sizes:
        writer.write(plan_of(corners, marks))
    found, whole = reader.news(), plan_of(*sizes[-1])
    assert len(found.path) <= MOST_CORNERS + 1
    assert found.path[:1] == whole.path[:1]
    assert found.path[-1:] == whole.path[-1:], "a thinned path still ends where it ends"
    assert found.marks == whole.marks[-MOST_MARKS:]
    assert reader.news() is None
    assert len(pickle.dumps(whole.bounded())) < CAPACITY / 2


def test_half_a_plan_is_no_plan():
    """Whatever byte is not written yet, the reader waits."""
    board = PlanBoard(multiprocessing.get_context("spawn"))
    writer, reader = PlanWriter(board), PlanReader(board)
    writer.write(plan_of(20, 3))
    memory = memoryview(board._memory).cast("B")
    memory[24 + 40] ^= 0xFF
    assert reader.news() is None
    memory[24 + 40] ^= 0xFF
    assert reader.news() == plan_of(20, 3)


@pytest.mark.slow
def test_the_plans_of_a_log_are_those_of_the_run(short_run):
    """The controller makes the same legs again: to the corners that it was given."""
    plans = short_run.plans
    assert [change.plan.leg for change in plans] == ["hop", "stroke", ""]
    raster = np.array(plans[1].plan.path)
    tip = frames_of_log(short_run.log).position
    for corner in raster:
        assert np.linalg.norm(tip[:, :2] - corner[:2], axis=1).min() < 3e-4
    assert plans[0].time == short_run.log.record().time[0]
    assert (np.diff([change.time for change in plans]) > 0.0).all()


def test_a_watch_reports_a_leg_once_and_a_diary_keeps_it(short_run):
    controller = short_run.planned.controller()
    diary = PlanDiary(PlanWatch(controller))
    controller.start(short_run.periods[0][1])
    for period in short_run.periods[:50]:
        diary(*period)
    ((time, leg),) = ((change.time, change.plan.leg) for change in diary.changes)
    assert (time, leg) == (short_run.periods[0][1].time, "hop")


def test_words_on_the_screen_are_apart_and_none_is_lost():
    rng = np.random.default_rng(1)
    positions = map(tuple, rng.uniform(0.0, 0.008, (90, 3)).tolist())
    marks = [ShownMark(*each) for each in zip(["edge", "steep", "lost"] * 30, positions, strict=True)]
    found = places(marks)
    positions = np.array([at for at, _ in found])
    apart = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    assert apart[np.triu_indices(len(found), 1)].min() >= LABEL_DISTANCE
    for mark in marks:
        assert any(
            math.dist(at, mark.position) < LABEL_DISTANCE and mark.event in words.split(", ")
            for at, words in found
        )
