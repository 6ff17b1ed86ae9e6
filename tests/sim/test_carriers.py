"""One back end, whatever carries the tip: the same seam, the same promises."""

import numpy as np
import pytest

from palpate.runtime.data import Command
from palpate.sim import (
    ArmCarrier,
    Box,
    ContactLaw,
    MujocoBackend,
    SphereObject,
    Stage,
    Tip,
    TurningStage,
    build_scene,
    white_noise,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.spatial import IDENTITY
from palpate.surfaces import Sphere

TIP = Tip(Sphere(0.008))
CARRIERS = {"stage": Stage(), "turning stage": TurningStage(), "arm": ArmCarrier()}
NOISE = white_noise(0.05, 1e-3, seed=3)

RUBBER = FrictionLaw(0.4, 0.3, spin_length=0.003, load_exponent=0.3, norm_exponent=1.4)

carriers = pytest.mark.parametrize("carrier", CARRIERS.values(), ids=CARRIERS.keys())


def backend_of(carrier, height=0.0485, target=None, noise=NOISE, friction=None):
    scene = build_scene(
        TIP, target or SphereObject(0.04), ContactLaw(), (0.0, 0.0, height), carrier, friction=friction
    )
    return MujocoBackend(scene, sensor=noise)


@carriers
def test_it_starts_upright_where_it_was_placed_and_stays_there(carrier):
    backend = backend_of(carrier, height=0.06, noise=None)
    first = backend.start()
    for _ in range(300):
        last = backend.step(Command())
    for sample in (first, last):
        assert sample.arm.position_base_tip == pytest.approx((0.0, 0.0, 0.06), abs=1e-8)
        assert np.allclose(sample.arm.rotation_base_tip, IDENTITY, atol=1e-8)
        # the tip's weight, which hangs on the sensor
        assert sample.wrenches[0].wrench[2] == pytest.approx(-TIP.mass * 9.80665, rel=1e-6)
        assert sample.wrenches[0].acceleration[2] == pytest.approx(9.80665, rel=1e-6)


@carriers
def test_it_moves_as_commanded(carrier):
    backend = backend_of(carrier, height=0.06, noise=None)
    backend.start()
    velocity = (0.02, -0.01, 0.015)
    for _ in range(500):
        before = backend.step(Command(velocity))
    for _ in range(100):
        after = backend.step(Command(velocity))
    moved = np.subtract(after.arm.position_base_tip, before.arm.position_base_tip) / 0.1
    assert moved == pytest.approx(velocity, abs=1e-5)
    assert after.arm.velocity_base_tip == pytest.approx(velocity, abs=1e-4)
    assert np.allclose(after.arm.rotation_base_tip, IDENTITY, atol=1e-4)


frictions = pytest.mark.parametrize("friction", [None, RUBBER], ids=["MuJoCo's friction", "plant"])


@carriers
@frictions
def test_its_sensor_feels_what_truly_happens_at_the_contact(carrier, friction):
    backend = backend_of(carrier, target=Box(), height=0.0285, noise=None, friction=friction)
    backend.start()
    for _ in range(400):
        sample = backend.step(Command((0.002, 0.0, -0.002)))
    truth = backend.truth()
    assert truth.touching
    assert truth.force[0] < -0.1  # it rubs
    given = sample.wrenches[0]
    felt = np.array(given.wrench[:3]) + TIP.mass * np.array(given.acceleration)  # at rest up: weight comes off
    rotation = np.array(sample.arm.rotation_base_tip)
    assert rotation @ felt == pytest.approx(truth.force, abs=1e-3 * np.linalg.norm(truth.force))


def test_the_arm_tells_its_joints_and_keeps_to_their_speed():
    backend = backend_of(CARRIERS["arm"], height=0.1, noise=None)
    samples = [backend.start(), *(backend.step(Command((0.0, 0.25, 0.1))) for _ in range(300))]
    joints = np.array([sample.arm.joint_position for sample in samples])
    assert joints.shape == (301, 6)
    assert np.abs(np.diff(joints, axis=0)).max() < np.pi * 1e-3
