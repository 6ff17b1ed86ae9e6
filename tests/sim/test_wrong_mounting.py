"""A sensor that is mounted the wrong way round is found at the first touch, and no retreat presses harder."""

from dataclasses import replace

import numpy as np
import pytest

from faults.mountings import LIMIT, PLATE, ROTATIONS, Slide, TurnedSensor, moved, plunged
from palpate.runtime import Finger, Limits, Supervisor, Touch, run
from palpate.runtime.data import Command, Phase
from palpate.runtime.result import Ending
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ContactLaw, Fidelity, MujocoBackend, Tip, TurningStage, build_scene, white_noise
from palpate.surfaces import Sphere

FOUND = [matrix for matrix in ROTATIONS if matrix[2, 2] < 0.5]
"""Those that turn the axis of touch: about that axis itself a straight push shows nothing."""

ABOUT_TOUCH = [matrix for matrix in ROTATIONS if matrix[2, 2] > 0.5]
"""The others, the right one among them: friction shows them."""


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


class Tared(TurnedSensor):
    """Shows what it should before the tip moves; the axes are turned all the same."""

    def start(self):
        sample = self.backend.start()
        self.offset = np.subtract(sample.wrenches[0].wrench, self.turned(sample).wrenches[0].wrench)
        return self.tared(sample)

    def step(self, command):
        return self.tared(self.backend.step(command))

    def tared(self, sample):
        wrong = self.turned(sample).wrenches[0].wrench + self.offset
        return replace(sample, wrenches=(replace(sample.wrenches[0], wrench=tuple(wrong.tolist())),))


class TurnInTheAir:
    """Turns about x, then about y, far from everything."""

    def start(self, first):
        pass

    def step(self, now):
        if now.time > 4.0:
            return Command(phase=Phase.DONE)
        x = now.time < 2.0
        return Command(phase=Phase.APPROACH, angular_velocity_base_tip=(0.15 * x, 0.15 * (not x), 0.0))


@pytest.mark.slow
def test_weight_must_turn_with_the_arm_whatever_was_tared():
    """A sensor that is tared shows no weight, and the wrong one as soon as the tip turns."""
    for rotation in ROTATIONS:
        tip = Tip(Sphere(0.008), 0.3)
        scene = build_scene(
            tip, PLATE, ContactLaw(stiffness=20e3), (0.0, 0.0, 0.5), TurningStage(), Fidelity(0.5e-3)
        )
        backend = Tared(MujocoBackend(scene, 1e-3, white_noise(3.1e-3, 1.6e-5, seed=1)), rotation)
        finger = Finger(tip.surface, SensorPayload(tip.mass, tip.center_of_mass))
        result = run(backend, Touch(finger), TurnInTheAir(), Supervisor(Limits(force=LIMIT)), duration=5.0)
        right = np.allclose(rotation, np.eye(3))
        assert result.ending is (Ending.DONE if right else Ending.TRIPPED), rotation
        assert right or "while the tip turned in the air" in result.why


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
