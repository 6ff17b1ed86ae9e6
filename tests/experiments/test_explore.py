"""Explorations against the simulation's truth: force held, surface found, contact kept."""

import re
from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.runtime import Ending
from support.explore_runs import plan_of

ROWS = ExploreConfig(spacing=0.008)


def check_held(found):
    """The run finished, at rest, and never left the surface."""
    assert found.run.ending is Ending.DONE
    assert found.run.at_rest
    assert found.truth.touching[found.scanning].all()


@pytest.mark.parametrize(
    ("name", "speed", "limit"),
    [
        ("sphere", 0.02, 0.06),
        ("ellipsoid", 0.05, 0.12),
        pytest.param("ellipsoid", 0.02, 0.06, marks=pytest.mark.slow),
        pytest.param("sphere", 0.05, 0.12, marks=pytest.mark.slow),
    ],
)
def test_the_force_is_held(name, speed, limit):
    found = explore(replace(ROWS, object=name, size=(), speed=speed))
    check_held(found)
    assert found.force_rms < limit


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "cylinder", "box"])
def test_points_lie_on_the_surface(name):
    found = explore(replace(ROWS, object=name, size=()))
    check_held(found)
    assert found.point_rms < 1e-5


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_the_radius_is_found_through_noise(seed):
    found = explore(replace(ROWS, force_noise=0.010, moment_noise=1e-4, seed=seed))
    check_held(found)
    assert abs(found.sphere.radius - 0.04) < 3e-5


@pytest.mark.slow
def test_landing_is_soft():
    """5 mm/s at 20 kN/m: the force on landing stays below the set force plus 1 N."""
    found = explore(ROWS)
    assert np.nanmax(found.true_normal_force[~found.scanning]) < ROWS.force + 1.0


@pytest.mark.slow
def test_an_ellipsoidal_tip_feels_the_same_surface():
    found = explore(replace(ROWS, tip=(0.010, 0.008, 0.012)))
    check_held(found)
    assert found.point_rms < 1e-5


@pytest.mark.slow
def test_friction_need_not_be_known():
    for friction in (0.05, 1.0):
        found = explore(replace(ROWS, friction=friction))
        check_held(found)
        assert found.force_rms < 0.15


def test_a_raster_beyond_the_object_is_refused():
    with pytest.raises(InvalidValueError, match=r"(?s)at most .*--size"):
        explore(replace(ROWS, width=0.5))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ((5.0, "force", 300.0), "change after 5 s: force = 300 N: must lie between 0.3 and 15 N"),
        ((5.0, "fource", 3.0), "did you mean force?"),
    ],
)
def test_a_change_that_cannot_be_is_refused_before_anything_moves(change, words):
    with pytest.raises(InvalidValueError, match=re.escape(words)):
        plan_of(ExploreConfig(change=(change,)))


@pytest.mark.slow
def test_force_and_speed_follow_changes_while_it_runs_and_points_stay_on_the_surface():
    """The tip is compressed more by a larger force: the map must not show it."""
    found = explore(ExploreConfig(width=0.03, depth=0.004, change=((1.0, "force", 4.0), (1.5, "speed", 0.03))))
    assert found.run.ending is Ending.DONE
    late = found.scanning & (found.record.time > 2.0)
    assert np.all(found.set_force[late] == 4.0)
    assert np.median(found.true_normal_force[late]) == pytest.approx(4.0, abs=0.1)
    assert np.median(np.linalg.norm(found.record.velocity[late], axis=1)) == pytest.approx(0.03, rel=0.05)
    assert found.point_rms < 0.005e-3
