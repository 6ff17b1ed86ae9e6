"""Loads inside a limit surface: where they are shown, and how often."""

import numpy as np
import pytest

from palpate import LimitSurface
from palpate.errors import InvalidValueError
from palpate.reporting.limit_surface_panel import RIM, limit_surface_panel, load_ratios, load_sizes
from palpate.reporting.marks import Density, Moving, Points
from support.drawn import marks

SURFACE = LimitSurface(0.5, 0.004, load_exponent=0.2, norm_exponent=1.4)
TIME = np.linspace(0.0, 1.0, 50)
LOADS = np.column_stack([np.full(50, 2.0), 0.5 * TIME, 2e-3 * np.sin(6.0 * TIME)])


def mark_of(kind, loads=LOADS, moments=LOADS, worst=-1):
    panel = limit_surface_panel(SURFACE, loads, moments, worst)
    return marks(panel, kind)[0]


def test_ratios_have_the_norm_of_the_surface_and_none_where_nothing_pushes():
    rng = np.random.default_rng(0)
    loads = np.column_stack([rng.uniform(0.5, 3.0, 20), rng.uniform(0.0, 1.0, 20), rng.uniform(-4e-3, 4e-3, 20)])
    loads[3, 0] = 0.0
    assert np.isnan(load_ratios(SURFACE, loads)[3]).all()
    known = np.delete(loads, 3, 0)
    assert load_sizes(SURFACE, known) == pytest.approx([SURFACE.load_ratio(*load) for load in known.tolist()])


def test_density_counts_every_load_that_pushes_where_it_is():
    loads = np.vstack([LOADS, LOADS[:1], np.zeros((3, 3))])
    density = mark_of(Density, loads)
    assert density.shares.sum() == pytest.approx(1.0)
    row, column = (np.searchsorted(edges, 0.0, "right") - 1 for edges in (density.y, density.x))
    assert density.shares[row, column] >= 2 / 51
    assert np.nanmin(density.depth) == 0.0
    assert np.nanmax(density.depth) == 1.0


def test_the_ring_goes_through_all_moments_and_what_is_far_outside_stays_at_the_rim():
    far = np.vstack([LOADS, [1e-6, 1.0, 1.0]])
    ring, worst = mark_of(Moving, far, far), mark_of(Points, far, far)
    spin, force = load_ratios(SURFACE, LOADS).T
    assert ring.x[:-1] == pytest.approx(spin)
    assert ring.y[:-1] == pytest.approx(force)
    assert (worst.x[0], worst.y[0]) == (ring.x[-1], ring.y[-1])
    assert np.hypot(np.abs(ring.x[-1]) ** 0.7, ring.y[-1] ** 0.7) == pytest.approx(RIM**0.7, rel=0.01)


@pytest.mark.parametrize("count", [0, 1, 50])
def test_a_run_that_never_pushed_has_no_density(count):
    density = mark_of(Density, np.zeros((count, 3)), np.zeros((2, 3)))
    assert not density.shares.any()
    assert np.isnan(density.depth).all()


def test_shapes_that_are_no_loads_are_refused():
    with pytest.raises(InvalidValueError, match=r"loads has shape \(50, 2\)"):
        limit_surface_panel(SURFACE, LOADS[:, :2], LOADS, 0)
