"""Rows of a view: the same from the loop as from its log, and whole and in order through the ring."""

import multiprocessing
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.runtime import Phase
from palpate.runtime.live import LiveParameters
from palpate.viewing import FrameLayout, Frames, LiveView, Part, RowMaker, TipPlacement, ViewScene, frames_of_log
from palpate.viewing.plan_board import PlanBoard
from palpate.viewing.plots import extremes
from palpate.viewing.request_board import BoardWriter, RequestBoard
from palpate.viewing.row_ring import RingReader, RingWriter, RowRing
from palpate.viewing.rows import SELDOM

CONTEXT = multiprocessing.get_context("spawn")
PLAIN = 28


def observer_without_process(scene, live=None, free_poses=None, capacity=100_000, plan=None):
    """The observer of a live view, what its process would read, and how it would ask."""
    live = live or LiveParameters()
    maker, board = RowMaker(scene, live, free_poses), RequestBoard(CONTEXT, tuple(live.parameters))
    ring, view = RowRing(CONTEXT, maker.layout.width, capacity), object.__new__(LiveView)
    view._take_up(maker, ring, board, live, plan, PlanBoard(CONTEXT))
    read = RingReader(ring).read
    return view.observe, SimpleNamespace(read=lambda: Frames(read(), maker.layout)), BoardWriter(board)


def test_a_live_view_sees_the_rows_of_the_log_and_these_are_the_record(short_run):
    observe, reader, _ = observer_without_process(short_run.scene)
    for period in short_run.periods:
        observe(*period)
    frames, record = frames_of_log(short_run.log), short_run.log.record()
    # numbers are the ring's and the log's own
    np.testing.assert_array_equal(reader.read().rows[:, 1:-1], frames.rows[:, 1:-1])
    np.testing.assert_array_equal(frames.time, record.time)
    known = record.touching & (record.status == 0)
    contact = frames.finger(0)
    np.testing.assert_array_equal(contact.touching, known)
    np.testing.assert_allclose(frames.centroid[known], record.centroid[known], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(contact.normal_force, record.normal_force)
    pushing = -np.sum(frames.force[known] * record.normal[known], axis=1)
    np.testing.assert_allclose(pushing, record.normal_force[known], atol=1e-12)
    np.testing.assert_array_equal(frames.scanning, known & (record.phase == Phase.SCAN.value))
    assert frames.scanning.sum() > 500
    assert frames.phase(len(frames) - 1).value == record.phase[-1]
    # half the compression of 2 N at 20 kN/m, and what friction adds
    assert np.abs(short_run.planned.target.signed_distance(frames.centroid[frames.scanning])).max() < 2e-4


def test_a_robot_that_tells_less_than_it_has_does_not_end_the_run(short_run):
    fingers = ("tip", "tip")
    scene = ViewScene("t", (), TipPlacement(Posture(arm=(0.5,) * 6, hand=(0.1,) * 2)), fingers, None)
    observe, reader, _ = observer_without_process(scene)
    observe(*short_run.periods[0])
    frames = reader.read()
    assert (frames.joint_position == 0.0).all()
    assert frames.posture(0).hand == (0.0, 0.0)
    assert not frames.finger(1).touching.any()


@pytest.mark.slow
@given(st.integers(1, 4), st.integers(0, 7), st.integers(0, 4), st.integers(0, 3), st.integers(0, 3))
def test_every_column_has_one_meaning(fingers, joints, hand_joints, free, live):
    """Numbers that all differ come out of the parts of a row once each, in order."""
    layout = FrameLayout(fingers, joints, hand_joints, free, live)
    frames = Frames(np.arange(float(layout.width))[None], layout)
    seen = [
        frames.rows[0, 0],
        frames.time[0],
        *frames.position[0],
        *frames.rotation[0].ravel(),
        frames.rows[0, 14],
    ]
    for i in range(fingers):
        contact = frames.finger(i)
        seen += [*contact.centroid[0], *contact.force[0], contact.normal_force[0], contact.spin_torque[0]]
        seen += [*contact.normal[0], contact.columns[0, -1]]
    seen += [*frames.joint_position[0], *frames.rows[0, layout.hand_columns], *frames.rows[0, layout.free_columns]]
    seen += [*frames.live_values[0], *frames.live_targets[0], frames.rows[0, -1]]
    assert seen == list(range(layout.width))


turns = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


@given(turns, st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_the_pose_of_a_free_body_comes_out_as_a_rotation(q, position):
    layout = FrameLayout(free=1)
    row = np.zeros((1, layout.width))
    w, x, y, z = np.array(q) / np.linalg.norm(q)
    row[0, 5:14] = np.eye(3).ravel()
    row[0, layout.free_columns] = (*position, w, x, y, z)
    (pose,) = Frames(row, layout).posture(0).free
    v = np.array([0.3, -0.7, 0.5])
    u = np.array([x, y, z])
    # q v q*
    turned = v + 2.0 * w * np.cross(u, v) + 2.0 * np.cross(u, np.cross(u, v))
    assert np.array(pose.rotation) @ v == pytest.approx(turned, abs=1e-12)
    assert pose.position == position


def test_truth_is_looked_up_often_enough_and_not_in_every_period(short_run):
    """The view shows a free body at most `SELDOM` late; controllers get nothing of it."""
    scene = ViewScene("t", (), TipPlacement(Posture(free=(Pose(),))))
    asked = []

    def free_poses():
        asked.append(len(asked))
        return (float(len(asked)), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)

    observe, reader, _ = observer_without_process(scene, free_poses=free_poses)
    periods = short_run.periods[:200]
    for period in periods:
        observe(*period)
    frames = reader.read()
    changes = np.flatnonzero(np.diff(frames.rows[:, frames.layout.free_columns][:, 0]))
    assert np.diff(frames.time[changes]).max() <= SELDOM + 1e-9
    assert len(asked) <= 1 + (frames.time[-1] - frames.time[0]) / SELDOM
    observe(*periods[0])  # the next run begins where the first one began
    assert reader.read().posture(0).free[0].position[0] == len(asked) == len(changes) + 2


ELBOW = Part(np.zeros((3, 3)), np.array([[0, 1, 2]]), (0, 0, 0), "elbow")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda frames: frames.finger(1), "finger = 1: must be from 0 to 0"),
        (lambda _: ViewScene("t", (ELBOW,)), "body = 'elbow': is none that moves in this scene; there are tip"),
        (lambda _: Frames(np.zeros((4, 3)), FrameLayout()), "must be"),
        (lambda _: RowRing(CONTEXT, PLAIN, 1), "at least 2"),
    ],
)
def test_a_missing_finger_or_body_and_wrong_sizes_are_refused(short_run, call, message):
    with pytest.raises(InvalidValueError, match=message):
        call(frames_of_log(short_run.log))


@pytest.mark.parametrize("count", [1, 10, 999, 5000])
def test_plots_lose_no_peak(count):
    rows = np.column_stack([np.arange(count), np.random.default_rng(count).normal(size=(count, 2))])
    thin = extremes(rows, 200)
    assert len(thin) <= max(400, 0)
    assert (np.diff(thin[:, 0]) >= 0).all()
    assert (thin.max(axis=0) == rows.max(axis=0)).all()
    assert (thin.min(axis=0) == rows.min(axis=0)).all()


@given(st.integers(3, 80), st.integers(2, 40), st.lists(st.integers(0, 60), max_size=8))
def test_rows_come_out_whole_and_in_order_and_the_rest_is_counted(width, capacity, bursts):
    ring = RowRing(CONTEXT, width, capacity)
    writer, reader = RingWriter(ring), RingReader(ring)
    written, read = 0, []
    for burst in bursts:
        for _ in range(burst):
            writer.write([written + 0.5] * (width - 2))
            written += 1
        rows = reader.read()
        # a full ring's oldest row may be the next one that is written over
        assert len(rows) >= min(burst, capacity - 1)
        read += rows.tolist()
    numbers = [row[0] for row in read]
    assert numbers == sorted(set(numbers))
    assert all(row[-1] == row[0] and set(row[1:-1]) == {row[0] + 0.5} for row in read)
    assert reader.lost == written - len(read)


def write_many(ring, count):
    writer, width = RingWriter(ring), ring.width
    for i in range(count):
        writer.write([float(i)] * (width - 2))


@pytest.mark.slow
def test_rows_are_never_torn_between_processes():
    """A ring so small that the writer laps the reader all the time."""
    ring, count = RowRing(CONTEXT, PLAIN, 16), 50_000
    reader, process = RingReader(ring), CONTEXT.Process(target=write_many, args=(ring, count))
    process.start()
    read, last = 0, -1.0
    while process.is_alive():
        rows = reader.read()
        assert (rows == rows[:, :1]).all(), "a row of two periods"
        assert (np.diff(rows[:, 0], prepend=last) > 0.0).all()
        read, last = read + len(rows), max([last, *rows[-1:, 0]])
    process.join()
    read += len(reader.read())
    assert process.exitcode == 0
    assert read + reader.lost == count
    assert read > 0


@pytest.mark.parametrize(
    ("place", "left"),
    [((0, slice(5, -1)), [1, 2, 3, 4, 5, 6, 7]), ((3, 0), [1, 2, 4, 5, 6, 7]), ((3, -1), [1, 2, 4, 5, 6, 7])],
    ids=["oldest row", "begin of another", "end of another"],
)
def test_a_row_that_is_just_being_written_is_left_out(place, left):
    """Ends of the oldest row may still be the old ones while it is written over: the count of rows tells."""
    ring = RowRing(CONTEXT, PLAIN, 8)
    writer, reader = RingWriter(ring), RingReader(ring)
    assert reader.read().shape == (0, PLAIN)
    for _ in range(8):
        writer.write([7.0] * (PLAIN - 2))
    np.frombuffer(ring._memory)[:-1].reshape(8, -1)[place] = 11.0
    rows = reader.read()
    assert rows[:, 0].tolist() == left
    assert (rows[:, 1:-1] == 7.0).all()
    assert reader.lost == 8 - len(left)
