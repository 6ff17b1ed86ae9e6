"""A sensor that is mounted the wrong way round is found at the first touch, and no retreat presses harder."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.runtime import Finger, Limits, Supervisor, Touch, run
from palpate.runtime.data import Command, Phase
from palpate.runtime.result import Ending
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ArmCarrier, Box, ContactLaw, Fidelity, MujocoBackend, Stage, Tip, build_scene, white_noise
from palpate.surfaces import Sphere

PERIOD, TIP, K, LIMIT, SPEED = 1e-3, 0.008, 20e3, 20.0, 0.01
PLATE = Box((0.2, 0.2, 0.04))

ROTATIONS = Rotation.create_group("O").as_matrix()
"""The 24 that map axes to axes."""

FOUND = [matrix for matrix in ROTATIONS if matrix[2, 2] < 0.5]
"""Those that turn the axis of touch: about that axis itself a straight push shows nothing."""

ABOUT_TOUCH = [matrix for matrix in ROTATIONS if matrix[2, 2] > 0.5]
"""The others, the right one among them: friction shows them."""


class TurnedSensor(WrappedBackend):
    """Shows wrenches in axes that are turned against those that are believed."""

    def __init__(self, backend, rotation):
        super().__init__(backend)
        self.rotation = rotation

    def start(self):
        return self.turned(super().start())

    def step(self, command):
        return self.turned(super().step(command))

    def turned(self, sample):
        wrenches = []
        for each in sample.wrenches:
            force, moment = np.reshape(each.wrench, (2, 3)) @ self.rotation.T
            acceleration = tuple((self.rotation @ each.acceleration).tolist())
            wrenches.append(replace(each, wrench=(*force.tolist(), *moment.tolist()), acceleration=acceleration))
        return replace(sample, wrenches=tuple(wrenches))


class Plunge:
    """Goes down with `SPEED`, whatever it feels, or until it feels something."""

    def __init__(self, phase, stops):
        self.phase, self.stops = phase, stops

    def start(self, first):
        pass

    def step(self, now):
        if self.stops and now.fingers[0].touching:
            return Command(phase=Phase.DONE)
        return Command((0.0, 0.0, -SPEED), self.phase)


class Slide(Plunge):
    """Goes down until it feels something and 0.2 mm on, then sideways."""

    def __init__(self):
        super().__init__(Phase.SCAN, stops=True)
        self.floor = None

    def step(self, now):
        x, _, z = now.arm.position_base_tip
        if self.floor is None and now.fingers[0].touching:
            self.floor = z - 2e-4
        if self.floor is None or z > self.floor:
            return Command((0.0, 0.0, -SPEED), Phase.APPROACH)
        return Command(phase=Phase.DONE) if x > 0.01 else Command((SPEED, 0.0, 0.0), Phase.SCAN)


def plunged(rotation, phase, arm, stops=False):
    """Return how a plunge onto a plate ended, and the largest true force [N]."""
    return moved(Plunge(phase, stops), rotation, arm)


def moved(controller, rotation, arm):
    """Return how a motion ended, and the largest true force [N]."""
    carrier = ArmCarrier() if arm else Stage()
    start = (0.0, 0.0, PLATE.top + TIP + 0.001)
    scene = build_scene(Tip(Sphere(TIP)), PLATE, ContactLaw(stiffness=K), start, carrier, Fidelity(0.5e-3))
    backend = MujocoBackend(scene, PERIOD, white_noise(3.1e-3, 1.6e-5, seed=1))
    forces = []

    def watch(sample, now, command):
        forces.append(float(np.linalg.norm(backend.truth().force)))

    # what gravity would show of a wrong mounting at rest is not there: the payload is turned with the sensor
    finger = Finger(Sphere(TIP), SensorPayload(scene.tip.mass))
    turned, supervisor = TurnedSensor(backend, rotation), Supervisor(Limits(force=LIMIT))
    result = run(turned, Touch(finger), controller, supervisor, duration=2.0, observers=(watch,))
    return result, max(forces)


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_a_wrong_mounting_is_named_at_the_first_touch(arm):
    _, touch = plunged(np.eye(3), Phase.APPROACH, arm, stops=True)
    for rotation in FOUND:
        result, force = plunged(rotation, Phase.APPROACH, arm)
        assert result.ending is Ending.TRIPPED
        assert result.at_rest
        assert "angle between approach and first contact force of finger 1 was" in result.why
        assert force < 1.2 * touch


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_no_retreat_presses_harder_whatever_the_mounting(arm):
    """Without an approach that could have shown it. Before, the tip was driven in with 249 N."""
    for rotation in ROTATIONS:
        result, force = plunged(rotation, Phase.SCAN, arm)
        assert result.ending is Ending.TRIPPED
        assert result.at_rest
        assert force < 1.5 * LIMIT


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_a_turn_about_the_axis_of_touch_is_named_within_the_first_millimetres_of_sliding(arm):
    right, force = moved(Slide(), np.eye(3), arm)
    assert right.ending is Ending.DONE
    for rotation in ABOUT_TOUCH:
        if rotation.trace() < 2.9:
            result, wrong = moved(Slide(), rotation, arm)
            assert "angle between sliding and friction was" in result.why
            assert wrong < 1.2 * force
