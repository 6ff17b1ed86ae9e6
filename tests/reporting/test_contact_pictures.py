"""Pictures of friction, of loads inside a limit surface, and of grasp forces."""

from dataclasses import replace

import numpy as np
import pytest

from palpate import LimitSurface
from palpate.errors import InvalidValueError
from palpate.experiments.friction.figures import length_figure, speed_figure, stroke_figure, surface_figure
from palpate.experiments.friction.measured import Interval
from palpate.experiments.friction.slip_points import SurfacePoints
from palpate.experiments.friction.stroke_curves import StrokeCurve
from palpate.grasp.problem.contacts import GraspContacts
from palpate.reporting.grasp_figures import (
    MAX_RATIO,
    grasp_force_figure,
    limit_shares,
    limit_surface_panel,
    load_ratios,
    load_sizes,
)
from palpate.reporting.marks import Bars, Density, Moving, Points, Polygon, Rule, Span
from palpate.reporting.solids import Arrows, Surface
from support.drawn import marks, panels

ASSUMED = SurfacePoints(
    surface=LimitSurface(0.5, 0.003, norm_exponent=1.7),
    true=None,
    exponent_measured=False,
    points=np.array([[1.0, 0.0], [0.0, 1.0]]),
    errors=np.full((2, 2), 0.02),
    loads=np.array([1.0, 4.0]),
    exponents=(1.0, 2.0),
)
LEVEL = (Interval(1.0, 0.5, 0.48, 0.51), Interval(4.0, 0.5, 0.49, 0.53))


STROKE = StrokeCurve(1.0, False, np.linspace(0.0, 4e-3, 50), np.full(50, 0.5))


def first_marks(picture, kind):
    return marks(panels(picture)[0], kind)


def test_an_assumed_exponent_draws_the_region_from_the_diamond_to_the_ellipse_and_a_measured_one_no_region():
    picture = surface_figure(ASSUMED)
    (between,) = first_marks(picture, Polygon)
    total, squares = between.x + between.y, between.x**2 + between.y**2
    assert np.all(np.isclose(total, 1.0) | np.isclose(squares, 1.0))  # its two edges alone
    assert "p was assumed" in picture.caption
    assert between.name == "p from 1 to 2"
    dots = {mark.name: mark for mark in first_marks(picture, Points)}
    assert list(dots) == ["at 1 N", "at 4 N"]
    assert (dots["at 4 N"].x, dots["at 4 N"].y) == (0.0, 1.0)
    assert dots["at 4 N"].y_error == pytest.approx(0.02)
    measured = surface_figure(replace(ASSUMED, exponent_measured=True))
    assert first_marks(measured, Polygon) == []
    assert "assumed" not in measured.caption


def test_a_lower_bound_has_no_interval():
    bound = replace(LEVEL[1], upper=np.inf, bound=True)
    measured, least = first_marks(length_figure((LEVEL[0], bound), None), Points)
    assert measured.y_error.ravel() == pytest.approx([20.0, 10.0])  # mm
    assert (least.name, least.y_error) == ("at least", None)


@pytest.mark.parametrize(("gamma", "law"), [(0.0, "at all loads."), (1.5e-4, "at all loads."), (0.2, "^0.20.")])
def test_a_length_that_does_not_grow_with_load_has_no_power_law(gamma, law):
    caption = length_figure(LEVEL, (0.003, gamma)).caption
    assert caption.endswith(law)
    assert ("^" in caption) == (gamma > 0.1)


def test_captions_mention_creep_and_turning_normals_only_where_they_occur():
    speeds = tuple(replace(each, at=1e-2 * each.at) for each in LEVEL)
    for creeping in (False, True):
        assert ("grease" in speed_figure(speeds, None, creeping=creeping).caption) is creeping
    for bent in (False, True):
        assert ("normal turns along the stroke" in stroke_figure([STROKE], LEVEL, bent=bent).caption) is bent


def test_the_band_of_mu_holds_the_interval_of_each_load_and_names_it():
    for levels, name in ((LEVEL, "95 %, load by load: 0.480 to 0.530"), (LEVEL[:1], "95 %: 0.480 to 0.510")):
        picture = stroke_figure([STROKE], levels)
        (band,) = first_marks(picture, Span)
        assert (band.low, band.high, band.name) == (0.48, levels[-1].upper, name)
        assert ("at each load; that of all loads together" in picture.caption) is (levels is LEVEL)


SURFACE = LimitSurface(0.5, 0.004, load_exponent=0.2, norm_exponent=1.4)
TIME = np.linspace(0.0, 1.0, 50)
LOADS = np.column_stack([np.full(50, 2.0), 0.5 * TIME, 2e-3 * np.sin(6.0 * TIME)])


def mark_of(kind, loads, moments=LOADS):
    return marks(limit_surface_panel(SURFACE, loads, moments, -1), kind)[0]


def test_load_ratios_have_the_norm_of_the_surface_and_are_nan_without_normal_force():
    rng = np.random.default_rng(0)
    loads = np.column_stack([rng.uniform(0.5, 3.0, 20), rng.uniform(0.0, 1.0, 20), rng.uniform(-4e-3, 4e-3, 20)])
    loads[3, 0] = 0.0
    assert np.isnan(load_ratios(SURFACE, loads)[3]).all()
    known = np.delete(loads, 3, 0)
    assert load_sizes(SURFACE, known) == pytest.approx([SURFACE.load_ratio(*load) for load in known.tolist()])


def test_density_counts_every_pressing_load_at_its_place_and_no_other():
    density = mark_of(Density, np.vstack([LOADS, LOADS[:1], np.zeros((3, 3))]))
    assert density.shares.sum() == pytest.approx(1.0)
    row, column = (np.searchsorted(edges, 0.0, "right") - 1 for edges in (density.y, density.x))
    assert density.shares[row, column] >= 2 / 51
    assert (np.nanmin(density.depth), np.nanmax(density.depth)) == (0.0, 1.0)
    for count in (0, 1, 50):
        empty = mark_of(Density, np.zeros((count, 3)), np.zeros((2, 3)))
        assert not empty.shares.any()
        assert np.isnan(empty.depth).all()


def test_the_ring_passes_through_all_moments_and_far_loads_stay_at_the_rim():
    far = np.vstack([LOADS, [1e-6, 1.0, 1.0]])
    ring, worst = mark_of(Moving, far, far), mark_of(Points, far, far)
    spin, force = load_ratios(SURFACE, LOADS).T
    assert ring.x[:-1] == pytest.approx(spin)
    assert ring.y[:-1] == pytest.approx(force)
    assert (worst.x[0], worst.y[0]) == (ring.x[-1], ring.y[-1])
    assert np.hypot(np.abs(ring.x[-1]) ** 0.7, ring.y[-1] ** 0.7) == pytest.approx(MAX_RATIO**0.7, rel=0.01)


PAIR = GraspContacts(
    [[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]], [np.eye(3), np.diag([-1.0, -1.0, 1.0])], [0.5, 0.8], [0.005, 0.005]
)
FORCES = np.array([[10.0, 3.0, 0.0, 0.02], [10.0, 0.0, 0.0, 0.0]])
LOAD = np.array([0.0, 3.0, 0.0, 0.02, 0.0, 0.0])


def test_shares_are_relative_to_the_friction_limit():
    """3 N and 20 mN m of mu f = 5 N with e = 5 mm: 3 and 4 of 5, which is the whole limit."""
    assert limit_shares(PAIR, FORCES) == pytest.approx(np.array([[1.0, 0.6, 0.8], [0.0, 0.0, 0.0]]))
    assert np.isnan(limit_shares(PAIR, np.zeros((2, 4)))).all()


def test_arrows_end_at_contacts_cones_open_by_friction_and_bars_stand_beside_the_limit():
    space, bars = panels(grasp_force_figure(PAIR, FORCES, LOAD, np.array([0, 0, 0, 0.03, 0, 0.0])))
    arrows = {mark.name: mark for mark in marks(space, Arrows)}
    assert set(arrows) == {"contact force", "load", "worst moment"}
    pushes, load = arrows["contact force"], arrows["load"]
    assert pushes.starts + pushes.along == pytest.approx(PAIR.positions)
    # both on the same scale
    assert np.linalg.norm(load.along) / np.linalg.norm(pushes.along[1]) == pytest.approx(0.3)
    (cones,) = marks(space, Surface)
    apex, *rim = cones.vertices[: len(cones.vertices) // 2]
    along = np.array(rim) - apex
    assert np.hypot(along[:, 1], along[:, 2]) == pytest.approx(0.5 * along[:, 0])
    assert marks(bars, Bars)[0].length == pytest.approx([1.0, 0.0])
    assert [mark.at for mark in marks(bars, Rule)] == [1.0]
    assert [name for _, name in bars.y.ticks] == ["1: 10.00 N", "2: 10.00 N"]
    alone, _ = panels(grasp_force_figure(PAIR.chosen([0]), np.zeros((1, 4)), np.zeros(6)))
    assert all(np.isfinite(mark.along).all() for mark in marks(alone, Arrows)), "one contact without load"


@pytest.mark.parametrize(
    ("picture", "inputs", "message"),
    [
        (grasp_force_figure, (PAIR, np.zeros((3, 4)), LOAD), r"forces has shape \(3, 4\): must be \(2, 4\)"),
        (grasp_force_figure, (PAIR, FORCES, LOAD, np.zeros(3)), r"disturbance has shape \(3,\)"),
        (limit_surface_panel, (SURFACE, LOADS[:, :2], LOADS, 0), r"loads has shape \(50, 2\)"),
    ],
)
def test_arrays_of_another_shape_are_refused(picture, inputs, message):
    with pytest.raises(InvalidValueError, match=message):
        picture(*inputs)
