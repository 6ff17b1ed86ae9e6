"""A servo that the time step cannot follow is refused; the fastest that is taken stands still when told to."""

import pytest

from palpate.runtime.data import Command
from palpate.sim import Box, ContactLaw, Fidelity, Integrator, MujocoBackend, Stage, Tip, build_scene
from palpate.sim.carriers.carriage import LARGEST_SERVO_STEP
from palpate.surfaces import Sphere

STEP = 0.5e-3


def scene(bandwidth, integrator=Integrator.EULER):
    stage, fidelity = Stage(bandwidth=bandwidth), Fidelity(STEP, integrator)
    return build_scene(
        Tip(Sphere(0.008)), Box((0.08, 0.08, 0.04)), ContactLaw(), (0.0, 0.0, 0.06), stage, fidelity
    )


def test_the_fastest_servo_follows_without_ringing():
    """Critically damped: the tip never overtakes what a start from rest asks for."""
    backend = MujocoBackend(scene(LARGEST_SERVO_STEP / STEP))
    backend.start()
    speeds = [backend.step(Command((0.05, 0.0, 0.0))).arm.velocity_base_tip[0] for _ in range(100)]
    assert max(speeds) <= 0.05 * 1.001
    assert speeds[-1] == pytest.approx(0.05, rel=1e-6)
