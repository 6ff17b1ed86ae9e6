"""The contact that MuJoCo realises against the one that was asked for, in physical units."""

import numpy as np
import pytest

from palpate.sim import Box, ContactLaw, Fidelity, Stage, Tip, build_scene
from palpate.sim.contact_law import LARGEST_FRICTION_STEP, pair_parameters
from palpate.surfaces import Sphere
from support.simulated import move, started

PLATE = Box((0.3, 0.3, 0.04))


def pressed(law, force, stage=None, time_step=0.5e-3):
    """A sphere tip at rest on a plate, pushed by its servo with `force` [N]."""
    stage, tip = stage or Stage(), Tip(Sphere(0.008))
    backend = started(build_scene(tip, PLATE, law, (0.0, 0.0, 0.028), stage, Fidelity(time_step)))
    depth = force / stage.stiffness(tip.mass) + force / law.stiffness
    move(backend, 100, (0.0, 0.0, -depth / 0.1))
    move(backend, 200)
    return backend


def slide(backend, speed, periods):
    move(backend, periods, (speed, 0.0, 0.0))
    fx, fy, fz = backend.truth().force
    return np.hypot(fx, fy), fz


def depth(backend):
    return -backend._data.contact[0].dist


@pytest.mark.parametrize(
    ("stiffness", "mass", "impedance"),
    [(2e3, 4.0, 0.1), (2e3, 20.0, 0.5), (20e3, 8.0, 0.1), (20e3, 4.0, 0.5), (60e3, 20.0, 0.1), (60e3, 8.0, 0.2)],
)
def test_the_force_at_rest_is_stiffness_times_depth_whatever_mass_and_impedance(stiffness, mass, impedance):
    backend = pressed(ContactLaw(stiffness=stiffness, impedance=impedance), 2.0, Stage(mass=mass))
    assert backend.truth().force[2] == pytest.approx(2.0, rel=1e-3)
    assert backend.truth().force[2] == pytest.approx(stiffness * depth(backend), rel=1e-3)


@pytest.mark.parametrize(("friction", "speed"), [(0.1, 0.005), (0.1, 0.1), (0.3, 0.02), (1.0, 0.005), (1.0, 0.1)])
def test_full_sliding_shows_the_friction_coefficient(friction, speed):
    tangential, normal = slide(pressed(ContactLaw(friction=friction), 2.0), speed, 300)
    assert tangential / normal == pytest.approx(friction, rel=5e-3)


@pytest.mark.parametrize(("force", "impedance"), [(0.5, 0.1), (2.0, 0.2)])
def test_the_creep_speed_is_realised_and_grows_with_the_force(force, impedance):
    """Below it friction is viscous, f_t = mu f_n v / v_creep, with v_creep proportional to f_n."""
    law = ContactLaw(impedance=impedance)
    backend = pressed(law, force)
    speed = 0.3 * law.creep_speed
    slide(backend, speed, 1000)
    drag = [np.divide(*slide(backend, speed, 1)) for _ in range(1500)]
    realised = speed * law.friction / np.mean(drag)
    assert backend.scene.pair.creep_speed == pytest.approx(law.creep_speed)
    assert realised == pytest.approx(law.creep_speed * force / law.smallest_force, rel=0.2)


def test_at_the_smallest_force_friction_is_coulombs_from_the_creep_speed_on():
    law = ContactLaw()
    tangential, normal = slide(pressed(law, law.smallest_force), 1.2 * law.creep_speed, 1000)
    assert tangential / normal == pytest.approx(law.friction, rel=5e-3)


@pytest.mark.parametrize(("speed", "impedance"), [(0.03, 0.5), (0.1, 0.2)])
def test_the_lift_speed_is_realised(speed, impedance):
    """Sliding adds c v to the normal force at the same depth; the tip lifts off where c v is all of it."""
    law = ContactLaw(impedance=impedance)
    backend = pressed(law, 2.0)
    _, normal = slide(backend, speed, 400)
    added = normal - law.stiffness * depth(backend)
    lift_speed = law.smallest_force * speed / added
    assert backend.scene.pair.lift_speed == pytest.approx(law.lift_speed, rel=2e-3)
    assert lift_speed == pytest.approx(law.lift_speed, rel=0.05)


def test_parameters_scale_with_mass_so_that_the_physics_does_not():
    law = ContactLaw()
    light, heavy = (pair_parameters(law, inverse_mass, 0.5e-3) for inverse_mass in (1.0, 0.1))
    assert light.solref[0] / heavy.solref[0] == pytest.approx(10.0)
    assert light.impratio == pytest.approx(heavy.impratio)
    for pair in (light, heavy):
        assert pair.creep_speed == pytest.approx(law.creep_speed)
        assert pair.lift_speed == pytest.approx(law.lift_speed, rel=2e-3)
        assert pair.friction[2] == pytest.approx(law.friction * law.spin_length)
        assert pair.friction_damping * 0.5e-3 <= LARGEST_FRICTION_STEP
