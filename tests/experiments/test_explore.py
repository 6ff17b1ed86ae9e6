"""Explorations against the simulation's truth: force held, surface found, contact kept."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.runtime import Ending

ROWS = ExploreConfig(spacing=0.008)


def check_held(found):
    """The run finished, at rest, and never left the surface."""
    assert found.run.ending is Ending.DONE
    assert found.run.at_rest
    assert found.truth.touching[found.scanning].all()


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_the_radius_is_found_through_noise(seed):
    found = explore(replace(ROWS, force_noise=0.010, moment_noise=1e-4, seed=seed))
    check_held(found)
    assert abs(found.sphere.radius - 0.04) < 3e-5


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
