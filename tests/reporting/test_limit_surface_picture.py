"""The picture of a load inside its limit surface: where its points are, and what it refuses."""

import numpy as np
import pytest

from palpate import LimitSurface
from palpate.errors import InvalidValueError
from palpate.reporting.limit_surface_picture import MAX_LOAD_RATIO, limit_surface_picture, load_ratios

SURFACE = LimitSurface(0.5, 0.004, load_exponent=0.2, norm_exponent=1.4)
TIME = np.linspace(0.0, 1.0, 50)


def test_ratios_have_the_norm_of_the_surface_and_none_where_nothing_pushes():
    rng = np.random.default_rng(0)
    loads = np.column_stack([rng.uniform(0.5, 3.0, 20), rng.uniform(0.0, 1.0, 20), rng.uniform(-4e-3, 4e-3, 20)])
    loads[3, 0] = 0.0
    ratios = load_ratios(SURFACE, loads)
    assert np.isnan(ratios[3]).all()
    for ratio, load in zip(np.delete(ratios, 3, 0), np.delete(loads, 3, 0), strict=True):
        size = np.sum(np.abs(ratio) ** 1.4) ** (1 / 1.4)
        assert size == pytest.approx(SURFACE.load_ratio(*load))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_way_slip_and_what_is_far_outside_are_drawn(sign):
    loads = np.column_stack([np.full(50, 2.0), sign * TIME, 4e-3 * np.sin(6.0 * TIME)])
    loads[-1, 0] = 1e-6
    slipping = TIME > 0.9
    figure = limit_surface_picture(SURFACE, TIME, loads, slipping).full
    figure.draw_without_rendering()
    axes = figure.axes[0]
    drawn = {
        line.get_marker(): np.asarray(line.get_xydata())
        for line in axes.lines
        if str(line.get_label()).startswith("_")
    }
    dots, circle = drawn["."], drawn["o"]
    assert np.allclose(np.abs(dots[:-1, 0]), TIME[slipping][:-1])
    assert np.sum(np.abs(dots[-1]) ** 1.4) ** (1 / 1.4) == pytest.approx(MAX_LOAD_RATIO)
    assert np.allclose(np.abs(circle[:, 0]), TIME[slipping][:1])
    assert (axes.get_xlim()[0] < -0.5) == (sign < 0.0)


@pytest.mark.parametrize("count", [0, 1, 50])
def test_a_run_that_never_pushed_is_an_empty_picture(count):
    limit_surface_picture(SURFACE, TIME[:count], np.zeros((count, 3))).full.draw_without_rendering()


def test_shapes_that_do_not_go_together_are_refused():
    with pytest.raises(InvalidValueError, match="loads has shape"):
        limit_surface_picture(SURFACE, TIME, np.zeros((49, 3)))
    with pytest.raises(InvalidValueError, match="slipping"):
        limit_surface_picture(SURFACE, TIME, np.zeros((50, 3)), np.zeros(3, bool))
