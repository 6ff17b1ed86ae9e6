"""After a force trip the tip gives way to a surface that keeps coming, and the run ends with it at rest."""

from dataclasses import dataclass

import numpy as np
import pytest

from palpate.controllers import LandingModel, series_stiffness, tracking_delay
from palpate.runtime import Finger, Limits, Supervisor, Touch, run
from palpate.runtime.data import Command, Phase
from palpate.runtime.result import Ending, RunResult
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ArmCarrier, Box, ContactLaw, Fidelity, MujocoBackend, Stage, Tip, build_scene, white_noise
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget
from palpate.surfaces import Sphere

PERIOD, TIP, K, LIMIT = 1e-3, 0.008, 20e3, 20.0
PLATE = Box((0.2, 0.2, 0.04))
DELAY = tracking_delay(PERIOD, 0.02)
"""[s] From a force to the tip's motion: of both robots, servos of 100 rad/s."""


@dataclass(frozen=True, slots=True)
class Advance:
    """Comes at a rate [m/s] until it has come so far [m], and stays there. A `Motion`."""

    rate: float
    way: float

    def at(self, time):
        moving = self.rate * time < self.way
        return (self.rate * time, self.rate, 0.0) if moving else (self.way, 0.0, 0.0)


class Still:
    """Waits; whatever comes, comes."""

    def start(self, first):
        pass

    def step(self, now):
        return Command(phase=Phase.HOLD)


@dataclass
class Pressed:
    """What came of it: the result, true forces after the trip [N] the tip's heights [m], a landing's model."""

    result: RunResult
    forces: np.ndarray
    heights: np.ndarray
    model: LandingModel


def pressed_by(motion, arm, limits=None):
    """Let a plate come up to a tip that stands still."""
    target = MovingTarget(PLATE, [DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), motion)])
    carrier = ArmCarrier() if arm else Stage()
    start = (0.0, 0.0, PLATE.top + TIP + 0.001)
    scene = build_scene(Tip(Sphere(TIP)), target, ContactLaw(stiffness=K), start, carrier, Fidelity(0.5e-3))
    backend = MujocoBackend(scene, PERIOD, white_noise(3.1e-3, 1.6e-5, seed=1))
    supervisor, forces, heights = Supervisor(limits or Limits(force=LIMIT)), [], []

    def watch(sample, now, command):
        if supervisor.trip is not None:
            forces.append(float(np.linalg.norm(backend.truth().force)))
            heights.append(sample.arm.position_base_tip[2])

    finger = Finger(Sphere(TIP), SensorPayload(scene.tip.mass))
    result = run(backend, Touch(finger), Still(), supervisor, duration=1.0, observers=(watch,))
    if isinstance(carrier, ArmCarrier):
        servo = (
            carrier.arm.push(carrier.joint_start(start), (0.0, 0.0, -1.0))
            / carrier.arm.following_error_limit.distance
        )
        mass = 7.0
    else:
        servo, mass = carrier.stiffness(scene.tip.mass), carrier.mass + scene.tip.mass
    model = LandingModel(series_stiffness(K, servo), DELAY, K, mass)
    return Pressed(result, np.array(forces), np.array(heights), model)


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
@pytest.mark.parametrize("speed", [0.02, 0.05])
def test_a_surface_that_keeps_coming_presses_no_harder_than_the_delay_explains(speed, arm):
    """Then it stops 40 mm farther, and the run ends clear of it. Before, the tip was crushed with 40 to 126 N."""
    came = pressed_by(Advance(speed, 0.04), arm)
    assert came.result.ending is Ending.TRIPPED
    assert came.result.at_rest
    overshoot = came.model.peak(speed)
    assert came.forces.max() <= LIMIT + overshoot
    # ten millimetres on, the first knock is over
    after = came.forces[came.heights > came.heights[0] + 0.01]
    assert len(after) > 100
    assert after.max() <= max(LIMIT, 2.0 + overshoot)
    assert came.forces[-100:].max() == 0.0
    assert came.heights[-1] - TIP > PLATE.top + 0.04 + 0.003
    assert came.result.trip.aftermath.startswith("backed off 4")


def test_at_the_end_of_its_workspace_the_tip_stands_still_and_says_so():
    top = PLATE.top + TIP + 0.02
    came = pressed_by(Advance(0.02, 0.017), arm=False, limits=Limits(force=LIMIT, workspace_upper=(1.0, 1.0, top)))
    assert came.heights.max() <= top
    assert came.result.at_rest
    assert "ended because tip position after a stop" in came.result.trip.aftermath
