"""Explorations against the simulation's truth: force held, surface found, contact kept."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.experiments.explore import explore
from palpate.experiments.explore_config import ExploreConfig
from palpate.runtime import Ending

ROWS = ExploreConfig(spacing=0.008)


def check_held(found):
    """The run finished, at rest, and never left the surface."""
    assert found.run.ending is Ending.DONE
    assert found.run.stopped
    assert found.truth.touching[found.scanning].all()


@pytest.mark.parametrize("name", ["sphere", "ellipsoid"])
@pytest.mark.parametrize(("speed", "limit"), [(0.02, 0.06), (0.05, 0.12)])
def test_the_force_is_held(name, speed, limit):
    found = explore(replace(ROWS, object=name, size=(), speed=speed))
    check_held(found)
    assert found.force_rms < limit


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "cylinder", "box"])
def test_points_lie_on_the_surface(name):
    found = explore(replace(ROWS, object=name, size=()))
    check_held(found)
    assert found.point_rms < 1e-5


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_radius_is_found_through_noise(seed):
    found = explore(replace(ROWS, force_noise=0.010, moment_noise=1e-4, seed=seed))
    check_held(found)
    assert abs(found.sphere.radius - 0.04) < 3e-5


def test_landing_is_soft():
    """5 mm/s at 20 kN/m: the force on landing stays below the set force plus 1 N."""
    found = explore(ROWS)
    assert np.nanmax(found.true_normal_force[~found.scanning]) < ROWS.force + 1.0


def test_an_ellipsoidal_tip_feels_the_same_surface():
    found = explore(replace(ROWS, tip=(0.010, 0.008, 0.012)))
    check_held(found)
    assert found.point_rms < 1e-5


def test_friction_need_not_be_known():
    for friction in (0.05, 1.0):
        found = explore(replace(ROWS, friction=friction))
        check_held(found)
        assert found.force_rms < 0.15


def test_a_raster_beyond_the_object_is_refused():
    with pytest.raises(InvalidValueError, match=r"(?s)at most .*--size"):
        explore(replace(ROWS, width=0.5))
