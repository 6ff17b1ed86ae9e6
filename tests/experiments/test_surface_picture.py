"""What the picture of a surface shows: flat as flat, hollow as hollow, no outlier lost, nothing unknown told."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.raster import cloud_of, raster
from palpate.controllers.paths import Mark, PathEvent
from palpate.experiments.explore.felt_path import MOST_POINTS, felt_path
from palpate.experiments.explore.mark_places import look_of
from palpate.experiments.explore.surface_colours import (
    ERROR_OF_POINTS,
    HEIGHT,
    LEAST_RELIEF,
    height_colouring,
    layer_colouring,
    map_colourings,
)
from palpate.experiments.explore.surface_picture import surface_picture
from palpate.mapping.layers import VertexLayer
from palpate.reporting.solids import Polyline, Spots, Surface, quantities
from support.drawn import marks as marks_of
from support.drawn import panels
from support.explore_runs import small, unfelt, untrue

UP = np.array([0.0, 0.0, 1.0])


def marks(found, *kinds):
    return marks_of(panels(surface_picture(found))[0], *kinds)


def test_one_surface_has_all_that_is_known_and_the_truth_over_it():
    felt, true = marks(small(), Surface)
    assert [each.quantity for each in felt.colourings] == [each.quantity for each in map_colourings(small().map)]
    assert len(felt.colourings) == 9, "height, error, sd, band, friction, four curvatures; the force did not vary"
    assert felt.shown
    assert not true.shown, "until it is asked for"
    assert np.abs(small().plan.target.signed_distance(true.vertices)).max() < 1e-6


def test_nothing_is_told_of_the_truth_where_nobody_knows_it():
    (space,) = surface_picture(untrue(small())).panels
    assert not any("error" in each for each in quantities(space.marks))
    assert [mark.name for mark in marks(untrue(small()), Surface)] == ["map"]
    assert "true" not in surface_picture(untrue(small())).caption


def test_without_a_map_there_are_the_points_alone_and_without_points_nothing():
    found = replace(small(), map=None)
    (points,) = marks(found, Spots)
    assert [each.quantity for each in points.colourings] == [HEIGHT, ERROR_OF_POINTS]
    assert not marks(found, Polyline)
    assert "too few" in surface_picture(found).caption
    assert surface_picture(unfelt(small())) is None


@pytest.mark.parametrize("count", [1, 2, 9, MOST_POINTS + 1, 5 * MOST_POINTS + 3])
def test_no_outlier_of_the_path_is_lost(count):
    rng = np.random.default_rng(count)
    cloud = cloud_of(np.cumsum(rng.uniform(0.0, 1e-3, (count, 3)), axis=0), np.tile(UP, (count, 1)))
    error = rng.normal(size=count)
    path = felt_path(cloud, error)
    assert len(path.points) == len(path.error) <= 2 * MOST_POINTS
    assert np.nanmax(np.abs(path.error)) == np.abs(error).max()
    assert (np.nanmin(path.points, axis=0) >= cloud.position.min(axis=0) - 1e-12).all()


def test_each_event_of_a_mark_looks_different_and_is_named():
    assert len({look_of(event) for event in PathEvent}) == len(PathEvent)
    placed = replace(small(), marks=tuple(Mark(event, (0.0, 0.0, 0.012), "why") for event in PathEvent))
    assert {mark.name for mark in marks(placed, Spots)} >= set(PathEvent)


@pytest.mark.parametrize("relief", [0.0, 8e-6, 1e-3, 0.03])
@pytest.mark.parametrize("height", [0.0, 0.02, 7.0])
def test_colours_of_heights_hold_all_and_make_flat_look_flat(relief, height):
    xy = raster()
    z = height + relief * (xy[:, 0] - xy[0, 0]) / np.ptp(xy[:, 0])
    colouring = height_colouring(np.column_stack([xy, z]))
    assert colouring.low <= 1e3 * z.min() + 1e-9
    assert colouring.high >= 1e3 * z.max() - 1e-9
    assert colouring.high - colouring.low == pytest.approx(1e3 * max(np.ptp(z), LEAST_RELIEF * np.ptp(xy[:, 0])))


# --- layers ---


def layer(name, mean, sd=0.1, count=100):
    return layer_colouring(VertexLayer(name, np.broadcast_to(mean, count), np.full(count, sd)))


@pytest.mark.parametrize(
    ("name", "mean", "label", "shown"),
    [
        ("friction", 0.3, "friction while sliding", 0.3),
        ("stiffness", 4e4, "stiffness of the object [kN/m]", 40.0),
        ("curvature_mean", 25.0, "mean curvature, + is convex [1/m]", 25.0),
        ("warmth", 300.0, "warmth", 300.0),
    ],
)
def test_a_layer_is_told_in_its_own_words_and_unit(name, mean, label, shown):
    colouring = layer(name, mean)
    assert colouring.label == label
    assert colouring.values == pytest.approx(shown)
    assert colouring.low <= shown <= colouring.high


@given(bent=st.floats(-100.0, 100.0))
@settings(max_examples=10)
def test_colours_of_curvature_tell_hollow_from_bulge(bent):
    colouring = layer("curvature_mean", bent)
    assert colouring.low <= bent <= colouring.high
    assert colouring.high - colouring.low >= 10.0 - 1e-9
    assert colouring.low == -colouring.high or not colouring.low < 0.0 < colouring.high


def test_a_ball_is_not_all_of_the_last_colour_and_what_is_no_difference_looks_alike():
    """Its curvature is of one sign: about zero, all of it would lie at one end of the scale."""
    ball = layer("curvature_mean", 25.0 + np.linspace(-2.0, 2.0, 100))
    assert (ball.low, ball.high) == (pytest.approx(20.0), pytest.approx(30.0))
    alike = layer("stiffness", 4e4 + 100.0 * np.sin(np.arange(100)), sd=2e3)
    assert alike.high - alike.low == pytest.approx(4.0)
