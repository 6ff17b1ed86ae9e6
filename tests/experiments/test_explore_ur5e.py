"""The same exploration by a UR5e: one word is changed."""

import numpy as np
import pytest

from palpate.experiments.explore.config import ExploreConfig
from palpate.runtime import Ending
from support.explore_runs import carried_out, plan_of, planned_again


@pytest.mark.slow
@pytest.mark.parametrize(("name", "size"), [("sphere", ()), ("ellipsoid", ())])
def test_a_ur5e_holds_the_force_and_finds_the_surface(name, size):
    found = carried_out(plan_of(ExploreConfig(robot="ur5e-sim", object=name, size=size, speed=0.02, spacing=0.02)))
    assert found.run.ending is Ending.DONE
    assert found.run.at_rest
    assert found.truth.touching[found.scanning].all()
    assert found.force_rms < 0.06
    assert found.point_rms < 0.01e-3
    assert np.nanmax(found.true_normal_force) < 2.0 + 1.5  # landing included


def test_it_can_be_planned_again_from_its_texts():
    planned = plan_of(ExploreConfig(robot="ur5e-sim", width=0.01, depth=0.004))
    again = planned_again(planned)
    assert again.parameters == planned.parameters
    assert again.limits == planned.limits
