"""A map that is behind what was felt says so, and by how much."""

import math
import multiprocessing

import numpy as np
import pytest

from palpate.mapping.mesh_figures import MeshFigures
from palpate.viewing import frames_of_log
from palpate.viewing.surface_drawing import LATE, late
from palpate.viewing.surface_grower import TIME, contacts_of
from palpate.viewing.surface_view import GrownSurface
from palpate.viewing.surface_worker import SurfaceFeed, SurfaceUpdate


@pytest.fixture
def pipe():
    ours, theirs = multiprocessing.get_context("spawn").Pipe()
    yield ours, theirs
    ours.close()
    theirs.close()


def nothing_grown(contacts):
    corners = np.zeros((0, 3))
    triangles, edge = np.zeros((0, 3), np.int64), np.zeros((0, 2), np.int64)
    none = np.zeros(0)
    figures = MeshFigures(0.0, math.nan, math.nan)
    return GrownSurface(corners, corners, triangles, triangles, edge, none, none, figures, contacts)


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
    theirs.recv()
    theirs.send(SurfaceUpdate(0, nothing_grown(1)))
    assert feed.take() is not None
    assert feed.behind == pytest.approx(times[-1] - sent_until)
    feed._due = 0.0
    feed.take()
    theirs.recv()
    theirs.send(SurfaceUpdate(0, nothing_grown(2)))
    assert feed.take() is not None
    assert feed.behind == 0.0
    feed.clear()
    assert feed.behind == 0.0


def test_little_is_not_worth_a_word_and_more_is_told_in_seconds():
    assert late(0.0) == late(0.99 * LATE) == ""
    assert "12 s behind" in late(12.3)
