"""Pictures of what rubbing found: what they draw, and that their captions say no more than that."""

from dataclasses import replace

import numpy as np
import pytest

from palpate import LimitSurface
from palpate.experiments.friction.measured import Interval
from palpate.experiments.friction.pictures import length_picture, speed_picture, stroke_picture, surface_picture
from palpate.experiments.friction.slip_points import SurfacePoints
from palpate.experiments.friction.stroke_curves import StrokeCurve

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


def labels(picture):
    return [text.get_text() for text in picture.full.legends[0].get_texts()]


def band(picture):
    """Vertices of what is filled with a label."""
    patches = picture.full.axes[0].patches
    return [patch.get_xy() for patch in patches if str(patch.get_label()).startswith("p from")]


def test_a_surface_whose_p_was_assumed_may_be_any_from_the_diamond_to_the_ellipse():
    picture = surface_picture(ASSUMED)
    picture.full.draw_without_rendering()
    (drawn,) = band(picture)
    total, squares = drawn.sum(axis=1), (drawn**2).sum(axis=1)
    assert total.min() == pytest.approx(1.0)
    assert squares.max() == pytest.approx(1.0)
    assert np.all(np.isclose(total, 1.0) | np.isclose(squares, 1.0))  # its two edges, and nothing else
    assert "p was assumed" in picture.caption
    assert "p from 1 to 2" in labels(picture)


def test_a_surface_whose_p_was_measured_has_one_line():
    picture = surface_picture(replace(ASSUMED, exponent_measured=True))
    assert band(picture) == []
    assert "assumed" not in picture.caption


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
    assert "95 %, load by load: 0.480 to 0.530" in labels(picture)
    assert "at each load; that of all loads together" in picture.caption
    assert "turns" not in picture.caption
    assert "normal turns along the stroke" in stroke_picture([stroke], LEVEL, bent=True).caption
    alone = stroke_picture([stroke], LEVEL[:1])
    assert any(text.startswith("95 %: ") for text in labels(alone))
    assert "together" not in alone.caption
