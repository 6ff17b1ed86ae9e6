"""The growing map: thinned out evenly, bounded, and the same however it came."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.viewing import touch_map
from palpate.viewing.touch_map import TouchMap

SPACING = 1e-3


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(0, 50), max_size=6))
def test_one_point_per_cube_and_none_far_from_what_was_touched(seed, sizes):
    points, found, begin = np.random.default_rng(seed).uniform(-0.01, 0.01, (sum(sizes), 3)), TouchMap(SPACING), 0
    for size in sizes:
        found.add(points[begin : begin + size])
        begin += size
    kept = found.points
    cubes = np.floor(kept / SPACING).astype(int)
    assert len(np.unique(cubes, axis=0)) == len(kept) == len(found)
    assert {tuple(p) for p in kept.tolist()} <= {tuple(p) for p in points.tolist()}
    for point in points:
        assert np.abs(kept - point).max(axis=1).min() < SPACING, "every touch has a point of the map in its cube"
    whole = TouchMap(SPACING)
    whole.add(points)
    assert (whole.points == kept).all(), "in parts or at once"


def test_a_map_gets_coarser_rather_than_endless(monkeypatch):
    monkeypatch.setattr(touch_map, "MOST_POINTS", 500)
    found = TouchMap(SPACING)
    for _ in range(5):
        found.add(np.random.default_rng(0).uniform(0.0, 0.05, (2000, 3)))
        assert len(found) <= 500
    assert found.coarsened >= 1
    assert found.spacing == SPACING * 2.0**found.coarsened
    found.clear()
    assert (len(found), found.spacing, found.chunks) == (0, SPACING, 0)


def test_chunks_are_the_map():
    found = TouchMap(1e-4)
    found.add(np.random.default_rng(0).uniform(0.0, 0.1, (4500, 3)))
    assert found.chunks == -(-len(found) // touch_map.CHUNK)
    assert np.concatenate([found.chunk(i) for i in range(found.chunks)]) == pytest.approx(found.points)
