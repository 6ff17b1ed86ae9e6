"""The surface that grows in another process: the map's own, never waited for, and dispensable."""

import math
import multiprocessing
import os
import signal
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from palpate.errors import InvalidValueError
from palpate.mapping import Knowledge
from palpate.mapping.mesh_metrics import MeshMetrics
from palpate.viewing import ANY_PORT, LiveView, Player, SurfaceView, ViewScene, frames_of_log
from palpate.viewing import surface_worker as module
from palpate.viewing.surface_drawing import LATE, late
from palpate.viewing.surface_grower import POSITION, TIME, SurfaceGrower, contacts_of, rim_edges
from palpate.viewing.surface_view import GrownSurface
from palpate.viewing.surface_worker import SurfaceFeed, SurfaceUpdate, SurfaceWorker
from support.waiting import until


@pytest.fixture(scope="module")
def felt(short_run):
    view = short_run.planned.view().surface
    return view, contacts_of(frames_of_log(short_run.log), view)


@pytest.fixture
def fed(short_run):
    view = short_run.planned.view().surface
    worker = SurfaceWorker(multiprocessing.get_context("spawn"), view)
    yield worker, SurfaceFeed(worker.connection, view), frames_of_log(short_run.log)
    worker.close()
    assert not worker.is_alive


@pytest.fixture
def pipe():
    ours, theirs = multiprocessing.get_context("spawn").Pipe()
    yield ours, theirs
    ours.close()
    theirs.close()


@pytest.fixture(scope="module")
def whole(felt):
    """The surface from all contacts."""
    return grown_of(*felt)


def grown_of(view, contacts, parts=1):
    grower = SurfaceGrower(view)
    for part in np.array_split(contacts, parts):
        grower.add(part)
    return grower.grown()


def test_contacts_lie_on_the_object(felt, short_run):
    """Compression taken off: nearer to the truth than the bare centroids, which lie inside."""
    _, contacts = felt
    error = short_run.planned.target.signed_distance(contacts[:, POSITION])
    assert abs(np.median(error)) < 2e-6
    bare = contacts_of(frames_of_log(short_run.log), SurfaceView(rows=2e-3))
    inside = np.median(short_run.planned.target.signed_distance(bare[:, POSITION]))
    assert inside == pytest.approx(-short_run.planned.half_compliance * short_run.planned.config.force, rel=0.1)


def test_the_surface_is_the_object_where_it_was_felt_and_ends_there(felt, whole, short_run):
    (view, contacts), grown = felt, whole
    seen = grown.vertices[np.unique(grown.observed)]
    assert np.abs(short_run.planned.target.signed_distance(seen)).max() < 2e-5
    assert grown.contacts == len(contacts)
    far = np.max(KDTree(contacts[:, POSITION]).query(seen)[0])
    assert far <= 0.75 * view.rows + 1e-4, "nothing is claimed where nothing was felt"
    raster = 0.010 * 0.004  # of the raster; on a convex object contacts lie inside of it
    assert 0.3 * raster < grown.metrics.area < raster
    friction = grown.friction[np.isfinite(grown.friction)]
    assert np.median(friction) == pytest.approx(0.3, abs=0.01)
    assert friction == pytest.approx(0.3, abs=0.05), "at the ends of rows the tip slows down"
    observed, rim = ({tuple(sorted(t)) for t in triangles.tolist()} for triangles in (grown.observed, grown.rim))
    assert rim
    assert not observed & rim
    # a closed line: every corner of the edge is the end of as many sides as it is the beginning of others
    assert (np.bincount(grown.edge.ravel())[np.unique(grown.edge)] % 2 == 0).all()
    everything = grown_of(replace(view, worst=Knowledge.EXTRAPOLATED), contacts)
    assert not len(everything.rim)
    assert everything.metrics.area > grown.metrics.area


def test_contacts_may_come_in_parts_or_at_once(felt, whole):
    view, contacts = felt
    first = contacts[: len(contacts) // 2]
    assert grown_of(view, first).metrics.area < whole.metrics.area
    once, twice = grown_of(view, first[:400], 1), grown_of(view, first[:400], 4)
    assert twice.vertices == pytest.approx(once.vertices, abs=1e-9)
    assert twice.sd == pytest.approx(once.sd, rel=1e-5)


def test_edges_of_a_square_are_its_four_sides():
    sides = rim_edges(np.array([[0, 1, 2], [0, 2, 3]])).tolist()
    assert sorted(map(tuple, sides)) == [(0, 1), (0, 3), (1, 2), (2, 3)]
    assert rim_edges(np.zeros((0, 3), np.int64)).shape == (0, 2)


@pytest.mark.slow
def test_nothing_waits_for_the_process_and_all_that_was_felt_gets_there(fed):
    """While it stands still, contacts gather; the newest answer has them all."""
    worker, feed, frames = fed
    os.kill(worker.pid, signal.SIGSTOP)
    for i in range(0, len(frames), 33):
        feed.add(frames[i : i + 33])
        assert feed.take() is None
    assert feed.waiting > 0
    os.kill(worker.pid, signal.SIGCONT)
    wanted = len(contacts_of(frames, SurfaceView(rows=2e-3)))
    until(lambda: (grown := feed.take()) is not None and grown.contacts == wanted)
    assert feed.waiting == 0


@pytest.mark.slow
def test_winding_back_begins_anew_and_an_old_answer_is_thrown_away(fed):
    _, feed, frames = fed
    half = frames[: len(frames) * 2 // 3]
    feed.add(frames)
    until(lambda: feed.take() is None and feed.waiting == 0)  # sent, and being worked on
    feed.clear()
    feed.add(half)
    assert until(feed.take).contacts == len(contacts_of(half, SurfaceView(rows=2e-3)))


def test_the_number_of_waiting_contacts_is_bounded(pipe, short_run, monkeypatch):
    monkeypatch.setattr(module, "MOST_WAITING", 300)
    feed = SurfaceFeed(pipe[0], short_run.planned.view().surface)
    feed._busy = True  # a process that never answers
    for _ in range(5):
        feed.add(frames_of_log(short_run.log)[500:1500])
        assert feed.take() is None
        assert feed.waiting <= 300 + 1000


def test_a_killed_process_is_told_of_once_and_for_all(fed):
    worker, feed, frames = fed
    os.kill(worker.pid, signal.SIGKILL)
    until(lambda: not worker.is_alive)
    feed.add(frames)
    assert "has ended" in str(until(lambda: feed.take() or feed.failed))
    feed.add(frames)
    assert feed.waiting <= len(frames)
    assert feed.take() is None


@pytest.mark.slow
def test_a_surface_that_cannot_be_made_is_told_of(short_run):
    view = replace(short_run.planned.view().surface, voxel=1e-9)  # coarser ones come from the size of the object
    worker = SurfaceWorker(multiprocessing.get_context("spawn"), view)
    feed = SurfaceFeed(worker.connection, view)
    frames = frames_of_log(short_run.log)
    broken = frames.rows.copy()
    broken[:, 1] = np.nan  # no time
    feed.add(type(frames)(broken, frames.layout))
    feed._waiting[0][:, 4:7] *= 3.0  # no unit normals
    feed._waiting[0][:, 0] = 1.0
    until(lambda: feed.take() is None and feed.failed is not None)
    assert "the map cannot be drawn: InvalidValueError: normal of contact" in feed.failed
    worker.close()


@pytest.mark.slow
def test_the_player_goes_on_without_it(short_run):
    scene = short_run.planned.view()
    with Player(scene, frames_of_log(short_run.log), port=ANY_PORT) as player:
        scene_tree = player.server.scene
        assert not scene_tree.get_handle_by_name("/map").visible
        player.step(1e9)
        until(lambda: player.step(0.0) or scene_tree.get_handle_by_name("/surface/observed") is not None)
        assert scene_tree.get_handle_by_name("/surface/rim") is not None
        os.kill(player._worker.pid, signal.SIGKILL)
        until(lambda: not player._worker.is_alive)
        player._slider.value = 0.5  # winds back
        player.step(0.03)
        player._slider.value = 3.0
        until(lambda: player.step(0.03) or scene_tree.get_handle_by_name("/map").visible)
        assert scene_tree.get_handle_by_name("/surface/observed") is None
        assert "has ended" in player.drawing._surface._status.content
        assert player.time > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("killed", ["_worker", "_process"])
def test_a_process_of_a_live_view_that_dies_does_not_disturb_the_loop(short_run, killed):
    """The surface ends with either process, the view with its own."""
    with LiveView(short_run.planned.view(), port=ANY_PORT) as view:
        assert view.makes_surface
        for number, period in enumerate(short_run.periods[:150]):
            if number == 50:
                os.kill(getattr(view, killed).pid, signal.SIGKILL)
            view.observe(*period)
        until(lambda: not view.makes_surface)
        until(lambda: view.is_alive is (killed == "_worker"))
    assert not view.is_alive


@pytest.mark.parametrize(("name", "value"), [("rows", 0.0), ("voxel", -1e-3), ("half_compliance", -1.0)])
def test_a_surface_needs_a_map_and_possible_lengths(name, value):
    with pytest.raises(InvalidValueError, match=name):
        replace(SurfaceView(rows=2e-3), **{name: value})
    with pytest.raises(InvalidValueError, match="there is none without a map"):
        ViewScene("t", (), map_spacing=None, surface=SurfaceView(rows=2e-3))


NOTHING_GROWN = GrownSurface(
    *[np.zeros((0, 3))] * 2, *[np.zeros((0, 3), np.int64)] * 2, np.zeros((0, 2), np.int64), *[np.zeros(0)] * 2,
    MeshMetrics(0.0, math.nan, math.nan), 1,
)  # fmt: skip


def test_a_surface_is_behind_by_what_was_felt_since_what_it_was_made_from(pipe, short_run):
    """Until the worker answers it grows, then it falls to what came meanwhile."""
    ours, theirs = pipe
    view, frames = short_run.planned.view().surface, frames_of_log(short_run.log)
    times = contacts_of(frames, view)[:, TIME]
    feed = SurfaceFeed(ours, view)
    assert feed.behind == 0.0
    half = len(frames) // 2
    feed.add(frames[:half])
    sent_until = contacts_of(frames[:half], view)[-1, TIME]
    assert feed.take() is None
    assert feed.behind == pytest.approx(sent_until - times[0])
    feed.add(frames[half:])
    assert feed.behind == pytest.approx(times[-1] - times[0])
    for behind in (times[-1] - sent_until, 0.0):
        theirs.recv()
        theirs.send(SurfaceUpdate(0, NOTHING_GROWN))
        assert feed.take() is not None
        assert feed.behind == pytest.approx(behind)
        feed._due = 0.0
        feed.take()
    feed.clear()
    assert feed.behind == 0.0


def test_little_is_not_worth_a_word_and_more_is_told_in_seconds():
    assert late(0.0) == late(0.99 * LATE) == ""
    assert "12 s behind" in late(12.3)
