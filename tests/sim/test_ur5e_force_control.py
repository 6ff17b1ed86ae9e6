"""A UR5e that slides: with what was identified the force is held, and the tip turns with the surface."""

import math

import numpy as np
import pytest

from palpate.controllers import (
    Admittance,
    ExploreController,
    ExploreParameters,
    IdentifyController,
    IdentifyParameters,
    NormalAxis,
    Orientation,
    Raster,
)
from palpate.controllers.paths import Follow
from palpate.kinematics import UR5E
from palpate.runtime import Ending, Finger, Limits, Phase, Supervisor, Touch, run
from palpate.sensing.compensation import SensorPayload
from palpate.sim import (
    ArmCarrier,
    Box,
    ContactLaw,
    EllipsoidObject,
    Fidelity,
    MujocoBackend,
    Tip,
    build_scene,
    bumps,
    white_noise,
)
from palpate.surfaces import Sphere
from support.run_bounds import above, check_bounds

PERIOD, FORCE, TIP = 1e-3, 2.0, 0.006
SMALL = Raster(0.012, 0.004, 0.004)


def backend_on(target, law, corner):
    start = (*corner, target.top + TIP + 0.0005)
    scene = build_scene(Tip(Sphere(TIP)), target, law, start, ArmCarrier(), Fidelity(0.5e-3))
    return MujocoBackend(scene, PERIOD, white_noise(3.1e-3, 1.6e-5, seed=1))


def go(backend, controller, observers=(), limits=None):
    finger = Finger(Sphere(TIP - FORCE / 40e3), SensorPayload(backend.scene.tip.mass))
    supervisor = Supervisor((limits or Limits(force=10.0)).allowing(0.05))
    result = run(backend, Touch(finger), controller, supervisor, duration=30.0, observers=observers)
    assert result.ending is Ending.DONE, str(result)


@pytest.fixture(scope="module")
def found():
    """What pressing on a plate of 20 kN/m tells."""
    controller = IdentifyController(IdentifyParameters(), PERIOD)
    go(backend_on(Box((0.1, 0.1, 0.04)), ContactLaw(), (0.0, 0.0)), controller)
    return controller.result()


def swept(target, found, raster=SMALL, friction=0.3, orientation=None):
    """True force errors [N], tilts of the tip against the normal [rad] and joint angles [rad], while it sweeps."""
    backend = backend_on(target, ContactLaw(friction=friction), raster.corners()[0])
    parameters = ExploreParameters(
        FORCE, 0.02, found.admittance.gain, 1.5e-3, acceleration=0.1, landing_speed=0.003
    )
    law = Admittance(found.admittance.body, PERIOD)
    controller = ExploreController(parameters, Follow(raster), PERIOD, law=law, orientation=orientation)
    errors, tilts, joints = [], [], []

    def watch(_, now, command):
        if command.phase is Phase.SCAN:
            rotation = np.array(now.arm.rotation_base_tip)
            normal = rotation @ now.fingers[0].contact.normal
            errors.append(-float(np.dot(backend.truth().force, normal)) - FORCE)
            tilts.append(math.acos(min(1.0, -float(normal @ rotation[:, 2]))))
            joints.append(now.arm.joint_position)

    go(backend, controller, (watch,))
    return np.array(errors), np.array(tilts), np.array(joints)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.slow
def test_what_is_identified_bears_a_contact_three_times_as_stiff(found):
    least = above(gain_margin=3.0, phase_margin_deg=61.0, stiffer_phase_margin_deg=29.0)
    check_bounds(found.admittance, least | above(gain__gain=3.0 * found.gain.gain))


@pytest.mark.slow
@pytest.mark.parametrize(("target", "y"), [(EllipsoidObject(), 0.0), (bumps(), 0.015)], ids=["ellipsoid", "bumps"])
def test_a_tip_that_turns_with_the_surface_holds_the_force_and_stays_in_its_joints_ranges(target, y, found):
    raster = Raster(0.03, 0.004, 0.004, (0.0, y))
    still_errors, still, _ = swept(target, found, raster)
    errors, tilts, joints = swept(target, found, raster, orientation=Orientation(NormalAxis(), PERIOD))
    assert rms(errors) < 0.05
    assert rms(still_errors) < 0.05
    # the lag of a gain of 4/s remains
    assert rms(tilts) < 0.65 * rms(still)
    for angles, limits in zip(joints.T, UR5E.limits, strict=True):
        assert limits.lower + 0.1 < angles.min() <= angles.max() < limits.upper - 0.1
    # far from where the wrist's axes line up
    assert np.abs(np.sin(joints[:, 4])).min() > 0.5
