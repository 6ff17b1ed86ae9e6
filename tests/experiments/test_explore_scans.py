"""Where strategies go on an object, foreseen from its geometry: curves, regions, paths and their lengths."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.raster import cloud_of, sphere_cap
from palpate.controllers import Raster
from palpate.controllers.paths import Spiral
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.explored_map import points_per_row, tap_distance
from palpate.experiments.explore.explored_object import scene_object
from palpate.experiments.explore.fit import region_on
from palpate.experiments.explore.reachable_surface import ReachableSurface
from palpate.experiments.explore.scan import in_pieces, scan_on
from palpate.experiments.explore.tip_surface import GRID_STEP, TipSurface, predicted_contour
from palpate.sim import Box, SphereObject, bumps

FEW = settings(max_examples=15, deadline=None, derandomize=True)

TIP = (0.008,)
"""Fingertip of a robot that is not asked [m]."""


@FEW
@given(st.floats(0.01, 0.06), st.floats(0.004, 0.012))
def test_a_tip_that_rests_on_a_ball_is_a_ball_larger_by_its_radius(radius, tip):
    surface = TipSurface.of(SphereObject(radius), (tip,))
    x, y = np.meshgrid(surface.x, surface.y)
    above = np.hypot(x, y) < 0.8 * (radius + tip)
    true = np.sqrt((radius + tip) ** 2 - (x**2 + y**2)[above])
    assert np.abs(surface.z[above] - true).max() < 2e-4
    assert (surface.z[above] <= true + 1e-12).all()  # a dilation on a grid misses, never exceeds
    assert surface.met[np.hypot(x, y) < radius].all()
    assert not surface.met[np.hypot(x, y) > radius + tip + 1e-3].any()


@FEW
@given(st.floats(0.012, 0.05), st.floats(0.002, 0.006), st.sampled_from(["left", "right"]))
def test_a_level_curve_round_a_ball_is_a_circle(radius, below, turn):
    config = ExploreConfig(tip=TIP, size=(radius,), strategy="contour", below=below, turn=turn)
    found = predicted_contour(SphereObject(radius), config)
    r = math.sqrt(2.0 * (radius + 0.008) * below - below**2)
    assert np.abs(np.hypot(*found.points.T) - r).max() < 3e-4
    assert found.length == pytest.approx(2.0 * math.pi * r, rel=0.01)
    x, y = found.points.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert (area > 0.0) == (turn == "left")
    assert found.approach_length < 2e-3


@FEW
@given(st.floats(0.02, 0.08), st.floats(0.02, 0.08), st.floats(0.004, 0.012))
def test_along_a_sharp_edge_the_way_is_that_edge_and_quarter_circles(length, width, tip):
    config = ExploreConfig(object="box", size=(length, width, 0.03), strategy="contour", curve="edge", tip=(tip,))
    found = predicted_contour(Box((length, width, 0.03)), config)
    true = 2.0 * (length + width) + 2.0 * math.pi * tip * math.sin(math.radians(45.0))
    # an edge between grid lines is seen up to a step further in, at both ends of four sides; arcs are inscribed
    assert found.length == pytest.approx(true, abs=8.0 * GRID_STEP + 1e-3)
    samples = ReachableSurface.of(Box((length, width, 0.03)), config, scan_on(Box((length, width, 0.03)), config))
    off = np.abs(samples.position) - (length / 2.0, width / 2.0, 0.015)
    assert np.percentile(np.abs(off[:, 2]), 95) < 1e-3  # what is touched is the edge itself
    assert np.percentile(np.abs(off[:, :2]).min(axis=1), 95) < 1e-3
    assert samples.area.sum() == pytest.approx(2.0 * (length + width) * 0.002, rel=0.05)


def test_a_contour_goes_round_the_nearest_peak_and_not_over_the_rim_of_what_is_known():
    config = ExploreConfig(tip=TIP, object="bumps", strategy="contour")
    found = predicted_contour(scene_object(config), config)
    assert found.length < 4.0 * 0.06
    for other in ({"curve": "edge"}, {"below": 0.01}):
        with pytest.raises(InvalidValueError):
            predicted_contour(
                bumps(0.003, 0.06, 0.18), ExploreConfig(tip=TIP, object="bumps", strategy="contour", **other)
            )


# --- regions ---


@FEW
@given(st.sampled_from(["raster", "spiral", "taps", "active"]), st.floats(0.008, 0.06))
def test_what_is_left_out_is_chosen_so_that_it_fits_and_what_is_asked_for_is_not_changed(strategy, radius):
    target = SphereObject(radius)
    config = ExploreConfig(tip=TIP, size=(radius,), strategy=strategy)
    region = region_on(target, config)
    corner = 0.5 * region.width * (1.0 if region.round else math.sqrt(2.0))
    limit = (radius + 0.008) * math.sin(math.radians(60.0))
    assert corner <= limit + 1e-9
    assert region.width == 0.04 or corner > 0.97 * limit  # as large as it may be
    assert region.center == (0.0, 0.0)
    size = {"radius": 0.1} if strategy == "spiral" else {"width": 0.2}
    with pytest.raises(InvalidValueError, match=r"at most .*--beyond"):
        region_on(target, ExploreConfig(tip=TIP, size=(radius,), strategy=strategy, **size))
    asked = region_on(target, ExploreConfig(tip=TIP, size=(radius,), strategy=strategy, beyond=True, **size))
    assert asked.width == 0.2


def test_where_the_middle_is_a_hole_another_place_is_found_unless_it_was_asked_for():
    config = ExploreConfig(tip=TIP, object="torus", size=(0.06, 0.02), center=(0.0, 0.0))
    target = scene_object(config)
    with pytest.raises(InvalidValueError, match="--center"):
        region_on(target, config)
    assert (
        region_on(
            target, ExploreConfig(tip=TIP, object="torus", size=(0.06, 0.02), width=0.02, depth=0.02)
        ).center[0]
        > 0
    )


# --- paths ---


@FEW
@given(st.floats(0.005, 0.05), st.floats(0.004, 0.05), st.floats(1e-3, 4e-3), st.floats(2e-3, 1e-2))
def test_a_path_in_pieces_is_the_same_path_in_short_pieces(width, depth, spacing, cut):
    raster = Raster(width, depth, spacing)
    path = in_pieces(raster.corners(), cut)
    assert max(math.dist(a, b) for a, b in pairwise(path)) <= cut * (1.0 + 1e-9)
    assert sum(math.dist(a, b) for a, b in pairwise(path)) == pytest.approx(raster.length)
    at = -1
    for corner in raster.corners():
        at = next(k for k in range(at + 1, len(path)) if math.dist(path[k], corner) < 1e-12)
    assert at == len(path) - 1


@pytest.mark.slow
@FEW
@given(st.floats(0.004, 0.03), st.floats(5e-4, 3e-3))
def test_a_spiral_passes_what_lies_inside_its_outermost_turn(radius, spacing):
    config = ExploreConfig(tip=TIP, size=(0.1,), strategy="spiral", radius=radius, spacing=spacing)
    scan, spiral = scan_on(SphereObject(0.1), config), Spiral(radius, spacing)
    corners = np.array(scan.corners)[20:-1]  # the very end lies on the rim
    assert scan.passes(0.999 * corners).all()
    outermost = corners[-math.ceil(0.5 * math.pi * radius / spiral.step) :]
    assert not scan.passes(1.001 * outermost + 1e-3 * spacing * outermost / radius).any()
    places = np.random.default_rng(0).uniform(-radius, radius, (4000, 2))
    assert scan.passes(places).mean() * 4.0 == pytest.approx(
        math.pi * (1.0 - spacing / (2 * radius)) ** 2, rel=0.12
    )


# --- what a map is made for ---


def test_taps_are_as_far_apart_as_they_are_and_an_observation_each():
    x, y = np.meshgrid(0.005 * np.arange(5), 0.005 * np.arange(4))
    flat = np.column_stack([x.ravel(), y.ravel(), np.zeros(20)])
    assert tap_distance(cloud_of(flat, np.tile([0.0, 0.0, 1.0], (20, 1))), 0.005) == pytest.approx(0.005)
    stretched = cloud_of(1.3 * flat, np.tile([0.0, 0.0, 1.0], (20, 1)))
    assert tap_distance(stretched, 0.005) == pytest.approx(0.0065)
    assert points_per_row(stretched, 0.005, 0.005) == 1.0


def test_a_row_never_counts_for_more_than_half_of_what_was_felt():
    cap = sphere_cap(half=0.006, step=4e-4)
    assert points_per_row(cap, 1.0, 1e-4) == 0.5 * len(cap)
    assert points_per_row(cap, 1e-3, 1e-4) == pytest.approx(10.0)
    assert points_per_row(cap.select(np.arange(len(cap)) < 1), 1.0, 1e-4) == 1.0
