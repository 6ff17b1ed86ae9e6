"""No two lines, and no two sets of points, of one panel look alike, however many there are."""

import itertools

import numpy as np
import pytest

from palpate.commands.compare.runs import spread_figure
from palpate.experiments.friction.figures import stroke_figure, surface_figure
from palpate.experiments.friction.measured import Interval
from palpate.experiments.friction.slip_points import SurfacePoints
from palpate.experiments.friction.stroke_curves import StrokeCurve
from palpate.experiments.kit.comparable import ErrorSample
from palpate.friction import LimitSurface
from palpate.reporting.marks import Line, Points, look_of
from support.drawn import marks, panels

MANY = 25
X = np.linspace(0.0, 1e-3, 5)


def shade(colour):
    return np.array([int(colour.light[i : i + 2], 16) for i in (1, 3, 5)])


def alike(one, other):
    """Whether a reader takes two marks for one another: shades a few levels apart are the same colour."""
    if np.abs(shade(one.colour) - shade(other.colour)).max() > 8:
        return False
    if isinstance(one, Line):
        return (one.dash, one.width) == (other.dash, other.width)
    return (one.symbol, one.size) == (other.symbol, other.size)


def strokes():
    curves = [StrokeCurve(float(load), back, X, X) for load in range(1, MANY) for back in (False, True)]
    return stroke_figure(curves, [Interval(1.0, 0.5, 0.48, 0.51)])


def limit_surface():
    points = np.tile([0.5, 0.5], (MANY, 1))
    loads = np.arange(1.0, MANY + 1.0)
    found = SurfacePoints(
        LimitSurface(0.5, 3e-3), LimitSurface(0.5, 3e-3), True, points, points, loads, (2.0, 2.0)
    )
    return surface_figure(found)


def spreads():
    sample = ErrorSample("Errors", "How far off.", "error", "µm", np.arange(9.0))
    return spread_figure([sample] * MANY, [f"run {i}" for i in range(MANY)])


@pytest.mark.parametrize("figure", [strokes, limit_surface, spreads])
def test_no_two_marks_of_one_panel_look_alike(figure):
    (panel,) = panels(figure())
    for kind in (Line, Points):
        for one, other in itertools.combinations(marks(panel, kind), 2):
            assert not alike(one, other), (one.name, other.name)


def test_a_fitted_line_and_the_points_of_a_load_have_different_colours():
    (panel,) = panels(limit_surface())
    lines, points = marks(panel, Line), marks(panel, Points)
    for line, dots in itertools.product(lines, points):
        assert np.abs(shade(line.colour) - shade(dots.colour)).max() > 8, (line.name, dots.name)


def test_looks_repeat_neither_colour_and_dash_with_width_nor_colour_and_symbol():
    looks = [look_of(i) for i in range(100)]
    assert len({(colour.name, dash, width) for colour, dash, _, width in looks}) == len(looks)
    assert len({(colour.name, symbol) for colour, _, symbol, _ in looks[:48]}) == 48
