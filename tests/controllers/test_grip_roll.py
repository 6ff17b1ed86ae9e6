"""A fingertip rolled over a plate: its material does not move over the plate, whichever way and however loaded."""

import math

import numpy as np
import pytest

from palpate.controllers.grip.roll import RollController, RollParameters
from palpate.errors import InvalidValueError
from palpate.runtime.data import Phase
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import Payload
from palpate.sensing.contact_motion import ContactMotionKind
from palpate.sim import Box, ContactLaw, MujocoBackend, Tip, TurningStage, build_scene, white_noise
from palpate.sim.friction.law import FrictionLaw
from palpate.spatial import cross
from palpate.surfaces import Sphere

PERIOD, RADIUS, BEFORE = 1e-3, 0.008, 0.012
PLATE = Box((0.2, 0.2, 0.02))


class Rolling:
    """A run: how the tip's material went over the plate, by the true place of contact."""

    def __init__(self, **parameters):
        tip = Tip(Sphere(RADIUS, center=np.array([0.0, 0.0, -BEFORE])), mass=0.015)
        start = (0.0, 0.0, PLATE.top + RADIUS + BEFORE + 5e-4)
        scene = build_scene(
            tip, PLATE, ContactLaw(friction=0.5), start, TurningStage(), friction=FrictionLaw(0.5, 0.5)
        )
        backend = MujocoBackend(scene, PERIOD, white_noise(0.01, 1e-4, seed=4))
        touch = Touch(Finger(tip.surface, Payload(tip.mass, tip.center_of_mass)))
        self.controller = RollController(PERIOD, RollParameters(radius=RADIUS, **parameters))
        now = touch.sense(backend.start())
        self.controller.start(now)
        self.slip, self.sideways, self.kinds, over = 0.0, 0.0, [], np.zeros(3)
        while now.time < 6.0 and not self.controller.phase.is_final:
            now = touch.sense(backend.step(self.controller.step(now)))
            if self.controller.phase not in (Phase.SCAN, Phase.HOLD):
                continue
            truth, arm = backend.truth(), now.arm
            lever = np.subtract(truth.position, arm.position_base_tip)
            over += PERIOD * (np.array(arm.velocity_base_tip) + cross(arm.angular_velocity_base_tip, tuple(lever)))
            self.slip = max(self.slip, math.hypot(over[0], over[1]))
            self.sideways = max(self.sideways, math.hypot(*truth.force[:2]) / truth.force[2])
            self.kinds.append(self.controller.motion.kind)
        self.rotation = np.array(now.arm.rotation_base_tip)
        self.force = truth.force[2]


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_a_tip_rolls_by_the_way_without_slip(heading):
    direction = (math.cos(heading), math.sin(heading), 0.0)
    run = Rolling(way=0.01, direction=direction)
    assert run.controller.phase is Phase.DONE
    assert run.slip < 0.02e-3
    assert run.sideways < 0.1
    assert run.force == pytest.approx(2.0, rel=0.05)
    # R = exp(angle [axis]), axis = direction x (down)
    turned = 0.01 / RADIUS
    axis = np.array(cross(direction, (0.0, 0.0, -1.0)))
    assert np.trace(run.rotation) == pytest.approx(1.0 + 2.0 * math.cos(turned), abs=0.02)
    assert run.rotation @ axis == pytest.approx(axis, abs=0.02)
    sliding = sum(bool(kind & ContactMotionKind.SLIDING) for kind in run.kinds)
    assert sliding < 0.05 * len(run.kinds)


def test_without_giving_way_sideways_it_winds_up():
    """What the gain is for: the control that must fail."""
    still, gives = (Rolling(way=0.01, direction=(1.0, 0.0, 0.0), tangential_gain=gain) for gain in (0.0, 1e-3))
    assert still.sideways > 5.0 * gives.sideways
    assert still.slip > 0.02e-3


def test_a_direction_into_the_object_is_refused():
    with pytest.raises(InvalidValueError, match="towards"):
        RollParameters(way=0.01, direction=(0.0, 0.0, 1.0), radius=RADIUS)
    with pytest.raises(InvalidValueError, match="direction"):
        RollParameters(way=0.01, direction=(0.0, 0.0, 0.0), radius=RADIUS)
