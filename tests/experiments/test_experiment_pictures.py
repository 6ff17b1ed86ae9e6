"""Pictures of experiments: explored surfaces, held forces and grasps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.raster import cloud_of, raster
from palpate.controllers.paths import Mark, PathEvent
from palpate.experiments.explore.surface_figure import (
    ERROR_OF_POINTS,
    HEIGHT_QUANTITY,
    MAX_PATH_POINTS,
    MIN_RELIEF,
    event_look,
    felt_path,
    height_colouring,
    layer_colouring,
    map_colourings,
    surface_figure,
)
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.report import MOMENT_COUNT, held_mesh, moments_figure, over_time, worst_moment
from palpate.experiments.regulate.figures import bode_figure, error_figure, step_figure
from palpate.experiments.regulate.response import FrequencyResponse, StepResponse
from palpate.mapping.layers import VertexLayer
from palpate.reporting.data import TimeSeries
from palpate.reporting.grasp_figures import load_sizes
from palpate.reporting.marks import Band, Line, Moving, Rule
from palpate.reporting.solids import Arrows, Placed, Polyline, Spots, Surface, quantities
from support.drawn import marks as marks_of
from support.drawn import panels
from support.explore_runs import small, unfelt, untrue
from support.grasp_runs import run_grasp

UP = np.array([0.0, 0.0, 1.0])


def marks(found, *kinds):
    return marks_of(panels(surface_figure(found))[0], *kinds)


def test_one_surface_has_all_that_is_known_and_the_truth_over_it():
    felt, true = marks(small(), Surface)
    assert [each.quantity for each in felt.colourings] == [each.quantity for each in map_colourings(small().map)]
    assert len(felt.colourings) == 9, "height, error, sd, band, friction, four curvatures; the force did not vary"
    assert felt.shown
    assert not true.shown, "until it is asked for"
    assert np.abs(small().plan.target.signed_distance(true.vertices)).max() < 1e-6


def test_nothing_is_told_of_the_truth_where_nobody_knows_it():
    (space,) = surface_figure(untrue(small())).panels
    assert not any("error" in each for each in quantities(space.marks))
    assert [mark.name for mark in marks(untrue(small()), Surface)] == ["map"]
    assert "true" not in surface_figure(untrue(small())).caption


def test_without_a_map_there_are_the_points_alone_and_without_points_nothing():
    found = replace(small(), map=None)
    (points,) = marks(found, Spots)
    assert [each.quantity for each in points.colourings] == [HEIGHT_QUANTITY, ERROR_OF_POINTS]
    assert not marks(found, Polyline)
    assert "too few" in surface_figure(found).caption
    assert surface_figure(unfelt(small())) is None


@pytest.mark.parametrize("count", [1, 2, 9, MAX_PATH_POINTS + 1, 5 * MAX_PATH_POINTS + 3])
def test_no_outlier_of_the_path_is_lost(count):
    rng = np.random.default_rng(count)
    cloud = cloud_of(np.cumsum(rng.uniform(0.0, 1e-3, (count, 3)), axis=0), np.tile(UP, (count, 1)))
    error = rng.normal(size=count)
    points, largest = felt_path(cloud, error)
    assert len(points) == len(largest) <= 2 * MAX_PATH_POINTS
    assert np.nanmax(np.abs(largest)) == np.abs(error).max()
    assert (np.nanmin(points, axis=0) >= cloud.position.min(axis=0) - 1e-12).all()


def test_each_event_of_a_mark_looks_different_and_is_named():
    assert len({event_look(event) for event in PathEvent}) == len(PathEvent)
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
    assert colouring.high - colouring.low == pytest.approx(1e3 * max(np.ptp(z), MIN_RELIEF * np.ptp(xy[:, 0])))


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


# --- regulation ---


TIME = np.arange(300) * 1e-2
PHASES = ["approach"] * 100 + ["hold"] * 150 + ["lift"] * 50
LAG = 0.02  # of a force of first order [s]


def series(phases):
    ones = np.ones(300)
    return TimeSeries(TIME, phases, 2.01 * ones, 2.0 * ones, 0.0 * ones, ones, true_force=1.99 * ones)


def steps(each):
    return StepResponse(TIME, each.mean(axis=0), each, len(each), float(each.max()))


def marks_figures(picture, kind):
    return [mark for panel in picture.panels for mark in panel.marks if isinstance(mark, kind)]


def test_the_error_is_shown_while_the_force_is_held_and_no_longer():
    picture = error_figure(series(PHASES))
    lines = {line.name: line for line in marks_figures(picture, Line)}
    for name, error in (("felt", 10.0), ("true", -10.0)):
        assert np.isfinite(lines[name].y).nonzero()[0].tolist() == list(range(100, 250))
        assert lines[name].y[100:250] == pytest.approx(error)  # [mN]
    assert (panels(picture)[0].x.low, panels(picture)[0].x.high) == pytest.approx((1.0, 2.5))
    assert error_figure(series(["approach"] * 300)) is None


def test_single_steps_lie_in_a_band_about_their_mean_whose_rise_is_marked():
    rising = 1.0 - np.exp(-TIME / LAG)
    picture = step_figure(steps(np.array([0.9 * rising, 1.1 * rising])), None)
    (band,), (mean,) = marks_figures(picture, Band), marks_figures(picture, Line)
    assert (band.low <= mean.y).all()
    assert (mean.y <= band.high).all()
    begin, end = (rule.at for rule in marks_figures(picture, Rule) if rule.upright)
    assert end - begin == pytest.approx(1e3 * LAG * np.log(9.0), rel=0.15)  # [ms]
    assert step_figure(None, None) is None


@pytest.mark.parametrize(("corner", "told"), [(4.0, "at 4 Hz"), (1e3, "does not fall below -3 dB")])
def test_the_bandwidth_is_marked_in_gain_and_phase_if_there_is_one(corner, told):
    frequency = np.geomspace(0.5, 16.0, 31)
    picture = bode_figure({"true": FrequencyResponse(frequency, 1.0 / (1.0 + 1j * frequency / corner))})
    assert told in picture.caption
    marked = [rule.at for rule in marks_figures(picture, Rule) if rule.upright]
    assert marked == ([pytest.approx(corner, rel=1e-3)] * 2 if corner < 16.0 else [])
    assert marks_figures(picture, Line)[0].y[0] == pytest.approx(0.0, abs=0.1)


# --- Pictures of a grasp: what is played is what was, forces balance, and what is held has its size ---


@pytest.fixture(scope="module")
def grasp():
    return run_grasp(rise=0.3)


@pytest.mark.slow
def test_what_is_played_begins_with_the_lift_and_shows_the_worst_moment_first(grasp):
    picture = moments_figure(grasp)
    space, *surfaces = picture.panels
    worst, truth = worst_moment(grasp), grasp.truth
    assert MOMENT_COUNT <= len(picture.steps) <= MOMENT_COUNT + 1
    assert picture.steps[picture.step] == f"{truth.time[worst]:.3f} s, hold, the worst"
    borne = grasp.carried & truth.touching.all(axis=1)
    assert load_sizes(grasp.planned.true, truth.loads[worst]).max() == pytest.approx(
        load_sizes(grasp.planned.true, truth.loads[borne]).max()
    )
    rings = [mark for panel in surfaces for mark in panel.marks if isinstance(mark, Moving)]
    assert [len(ring.x) for ring in rings] == [len(picture.steps)] * truth.fingers
    arrows = {mark.name: mark for mark in space.marks if isinstance(mark, Arrows)}
    assert all(len(mark.starts) == len(picture.steps) for mark in arrows.values())


@pytest.mark.slow
def test_forces_in_space_hold_the_object_and_end_at_its_surface(grasp):
    picture = moments_figure(grasp)
    space, step = picture.panels[0], picture.step
    arrows = {mark.name: mark for mark in space.marks if isinstance(mark, Arrows)}
    pushes, loads = arrows["contact force"], arrows["weight and pull"]
    rest = pushes.along[step].sum(axis=0) + loads.along[step].sum(axis=0)
    assert np.linalg.norm(rest) < 0.05 * np.linalg.norm(pushes.along[step], axis=1).max()
    ends = pushes.starts[step] + pushes.along[step]
    moment = np.cross(ends, pushes.along[step]).sum(axis=0) + np.cross(loads.starts[step], loads.along[step]).sum(
        axis=0
    )
    assert np.abs(moment[1:]).max() < 0.05 * np.abs(np.cross(ends, pushes.along[step])).max()
    body = next(mark for mark in space.marks if isinstance(mark, Placed) and mark.surface.name == "object")
    seen = body.at(step).vertices[:, 0]
    assert np.sort(ends[:, 0]) == pytest.approx([seen.min(), seen.max()], abs=5e-4)


@pytest.mark.slow
def test_what_is_seen_over_time_is_seen_on_one_axis(grasp):
    grip, slip, spin = panels(over_time(grasp))
    assert grip.x == slip.x == spin.x
    assert grip.x.run_time
    (largest,) = (mark for mark in slip.marks if isinstance(mark, Line))
    assert np.nanmax(largest.y) == pytest.approx(1e3 * grasp.slip_aloft)
    assert np.isfinite(largest.y).tolist() == grasp.aloft.tolist()


@pytest.mark.parametrize(
    ("held", "half"),
    [
        (GraspConfig(object="box", size=(0.06, 0.05, 0.04)), (0.03, 0.025, 0.02)),
        (GraspConfig(object="cylinder", size=(0.02, 0.05), fingers=3), (0.025, 0.02, 0.02)),
        (GraspConfig(object="sphere", size=(0.03,), fingers=3), (0.03, 0.03, 0.03)),
    ],
)
def test_what_is_held_has_its_size_and_its_outside_out(held, half):
    vertices, triangles = held_mesh(held)
    assert np.abs(vertices).max(axis=0) == pytest.approx(half, rel=0.01)
    a, b, c = vertices[triangles].swapaxes(0, 1)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    assert volume.min() > -1e-12
    assert volume.sum() > 0.0
