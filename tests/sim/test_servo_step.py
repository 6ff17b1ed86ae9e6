"""A servo that the time step cannot follow is refused; the fastest that is taken stands still when told to."""

import pytest

from palpate.errors import InvalidValueError
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


@pytest.mark.parametrize("integrator", [Integrator.EULER, Integrator.RK4])
def test_too_fast_a_servo_is_refused_with_one_that_would_do(integrator):
    with pytest.raises(InvalidValueError, match="bandwidth dt") as refusal:
        scene(1.01 * LARGEST_SERVO_STEP / STEP, integrator)
    advised = float(str(refusal.value).split("at most ")[1].split()[0])
    scene(advised, integrator)


def test_the_fastest_servo_follows_without_ringing():
    """Critically damped: the tip never overtakes what a start from rest asks for."""
    backend = MujocoBackend(scene(LARGEST_SERVO_STEP / STEP))
    backend.start()
    speeds = [backend.step(Command((0.05, 0.0, 0.0))).arm.velocity_base_tip[0] for _ in range(100)]
    assert max(speeds) <= 0.05 * 1.001
    assert speeds[-1] == pytest.approx(0.05, rel=1e-6)
