"""Pictures of what rubbing found: what they draw, and that their captions say no more than that."""

from dataclasses import replace

import numpy as np
import pytest

from palpate import LimitSurface
from palpate.experiments.friction.measured import Interval
from palpate.experiments.friction.pictures import length_picture, speed_picture, stroke_picture, surface_picture
from palpate.experiments.friction.slip_points import SurfacePoints
from palpate.experiments.friction.stroke_curves import StrokeCurve
from palpate.reporting.marks import Points, Polygon, Span

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


def marks(picture, kind):
    return [mark for mark in picture.panels[0].marks if isinstance(mark, kind)]


def test_a_surface_whose_p_was_assumed_may_be_any_from_the_diamond_to_the_ellipse():
    picture = surface_picture(ASSUMED)
    (between,) = marks(picture, Polygon)
    total, squares = between.x + between.y, between.x**2 + between.y**2
    assert np.all(np.isclose(total, 1.0) | np.isclose(squares, 1.0))  # its two edges, and nothing else
    assert "p was assumed" in picture.caption
    assert between.name == "p from 1 to 2"


def test_a_surface_whose_p_was_measured_has_one_line():
    picture = surface_picture(replace(ASSUMED, exponent_measured=True))
    assert marks(picture, Polygon) == []
    assert "assumed" not in picture.caption


def test_each_load_has_its_dots_with_their_intervals():
    dots = {mark.name: mark for mark in marks(surface_picture(ASSUMED), Points)}
    assert list(dots) == ["at 1 N", "at 4 N"]
    assert (dots["at 4 N"].x, dots["at 4 N"].y) == (0.0, 1.0)
    assert dots["at 4 N"].y_error == pytest.approx(0.02)


def test_what_is_only_a_bound_has_no_interval():
    bound = replace(LEVEL[1], upper=np.inf, bound=True)
    measured, least = marks(length_picture((LEVEL[0], bound), None), Points)
    assert measured.y_error.ravel() == pytest.approx([20.0, 10.0])  # mm
    assert (least.name, least.y_error) == ("at least", None)


@pytest.mark.parametrize(("gamma", "law"), [(0.0, "at all loads."), (1.5e-4, "at all loads."), (0.2, "^0.20.")])
def test_e_that_does_not_grow_is_no_power_law(gamma, law):
    caption = length_picture(LEVEL, (0.003, gamma)).caption
    assert caption.endswith(law)
    assert ("^" in caption) == (gamma > 0.1)


def test_creep_is_told_only_of_what_creeps():
    speeds = tuple(replace(each, at=1e-2 * each.at) for each in LEVEL)
    assert "grease" not in speed_picture(speeds, None).caption
    assert "grease" in speed_picture(speeds, None, creeping=True).caption


def test_the_band_of_mu_holds_each_loads_interval_and_is_named_so():
    stroke = StrokeCurve(1.0, False, np.linspace(0.0, 4e-3, 50), np.full(50, 0.5))
    picture = stroke_picture([stroke], LEVEL)
    (band,) = marks(picture, Span)
    assert (band.low, band.high, band.name) == (0.48, 0.53, "95 %, load by load: 0.480 to 0.530")
    assert "at each load; that of all loads together" in picture.caption
    assert "turns" not in picture.caption
    assert "normal turns along the stroke" in stroke_picture([stroke], LEVEL, bent=True).caption
    alone = stroke_picture([stroke], LEVEL[:1])
    assert marks(alone, Span)[0].name.startswith("95 %: ")
    assert "together" not in alone.caption
