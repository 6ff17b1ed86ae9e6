"""A sensor whose zero has moved: what it makes of free air must not drive a tip into what lies below."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.controllers import ExploreController, ExploreParameters, force_gain
from palpate.controllers.explore import MIN_TOUCH_IN_FLIGHT
from palpate.controllers.paths import Hop, LegEnd, PathPlane, Stroke
from palpate.runtime.data import Phase
from support.spring_world import PERIOD, RADIUS, STIFFNESS, Explored, Script, SpringWorld

FORCE = 2.0
WANTED = ExploreParameters(
    force=FORCE,
    speed=0.02,
    gain=force_gain(STIFFNESS, 0.0215),
    lead=0.002,
    approach_distance=0.008,
    settle_time=0.1,
)
LANDED = 0.4
"""When the tip has landed for certain [s]."""


class Drifted(SpringWorld):
    """From some time on the sensor shows a force that there is not; what there is, is kept."""

    def __init__(self, zero):
        super().__init__(lambda p: p[2], (0.0, 0.0, RADIUS + 1e-3))
        self.zero, self.true = np.array(zero), []

    def sample(self):
        given = super().sample()
        self.true.append(float(np.linalg.norm(self.force())))
        if self.time < LANDED:
            return given
        (wrench,) = given.wrenches
        f = tuple((np.array(wrench.wrench[:3]) + self.zero).tolist())
        return replace(given, wrenches=(replace(wrench, wrench=(*f, *wrench.wrench[3:])),))


@pytest.mark.parametrize("zero", [(0.0, 0.0, -0.15), (0.0, 0.0, 0.15), (0.1, -0.1, -0.05)])
def test_a_lift_leads_up_whatever_the_zero_says(zero):
    """0.15 N are 45 s of 0.2 N/min, more than a touch of this finger is, and no touch at 2 N."""
    assert np.linalg.norm(zero) < MIN_TOUCH_IN_FLIGHT * FORCE
    world = Drifted(zero)
    script = Script(PathPlane(), Hop((0.0, 0.0)), Stroke(((0.004, 0.0),)), Hop((0.008, 0.0)))
    e = Explored(ExploreController(WANTED, script, PERIOD), world, 6.0)
    off = e.at(Phase.LIFT) | e.at(Phase.TRAVEL)
    assert off.any()
    assert e.velocity[off, 2].min() > -1e-9 - WANTED.slew * PERIOD
    height = e.position[off, 2]
    assert height.max() > RADIUS + 1e-3 - 2e-4  # it arrives above, and comes down only to land
    assert max(world.true) < FORCE + 1.0
    assert script.how[0] is LegEnd.REACHED
    assert LegEnd.BLOCKED not in script.how
