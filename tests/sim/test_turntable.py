"""Sliding and spinning at once, on a turntable: centroid, spin torque and limit surface against MuJoCo."""

import mujoco
import numpy as np
import pytest

from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sim import Box, ContactLaw, Stage, Tip
from palpate.sim.contact_law import pair_parameters
from palpate.sim.fidelity import GRAVITY
from palpate.sim.scene import OBJECT_GEOM, _add_sensors
from palpate.sim.tip import TIP_GEOM
from palpate.surfaces import Ellipsoid, Sphere

CENTER = (0.001, -0.002, 0.01)
TILT = np.array([[0.8, 0.0, 0.6], [0.36, 0.8, -0.48], [-0.48, 0.6, 0.64]])
STIFF = ContactLaw(stiffness=100e3)
FORCE, DT = 2.0, 0.5e-3
SHAPES = {
    "sphere": lambda less: Sphere(0.008 - less, center=CENTER),
    "ellipsoid": lambda less: Ellipsoid((0.007 - less, 0.008 - less, 0.012 - less), center=CENTER, rotation=TILT),
}
MOTIONS = [(0.02, 1.0), (0.02, 5.0), (0.02, -5.0), (0.0, 3.0), (0.02, 0.0)]
"""Sliding speed of the stage [m/s] and turning rate of the table [rad/s]."""


def turntable_scene(tip, law, stage):
    """The stage scene with a plate that turns about z through the base origin."""
    target = Box((0.2, 0.2, 0.04))
    spec = mujoco.MjSpec()
    spec.option.timestep = DT
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    x, y, z = tip.center_of_mass
    height = np.linalg.norm(tip.surface.rotation[2] * tip.surface.half_lengths)  # of the centre over the plate
    tip.add_to(stage.add_to(spec, (-x, -y, target.top + height - z), tip.mass))
    table = spec.worldbody.add_body(name="table")
    table.explicitinertial = True
    table.mass = 1e3
    table.inertia = [1e3] * 3  # friction does not slow it
    table.add_joint(name="turn", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, 0.0, 1.0))
    target.add_geom(table, OBJECT_GEOM)
    pair = pair_parameters(law, 1.0 / (stage.mass + tip.mass), DT)
    spec.option.impratio = pair.impratio
    spec.add_pair(
        geomname1=TIP_GEOM,
        geomname2=OBJECT_GEOM,
        condim=4,
        friction=pair.friction,
        solref=pair.solref,
        solreffriction=pair.solreffriction,
        solimp=pair.solimp,
    )
    _add_sensors(spec)
    return spec.compile()


def ride(tip, law, speed, rate, steps=500):
    """Slide the tip over the turning plate; arrays of (wrench, contact point, contact wrench in its frame)."""
    stage = Stage()
    model = turntable_scene(tip, law, stage)
    data = mujoco.MjData(model)
    data.qvel[3] = rate
    press = FORCE / stage.stiffness(tip.mass) + FORCE / law.stiffness
    wrenches, points, contacts = [], [], []
    for i in range(steps):
        data.ctrl[:] = (speed * i * DT, 0.0, -press * min(1.0, i / 100))
        mujoco.mj_step(model, data)
        s = data.sensordata.tolist()
        if i < steps // 2:
            continue
        in_contact_frame = np.zeros(6)
        mujoco.mj_contactForce(model, data, 0, in_contact_frame)
        assert data.contact[0].geom[0] == model.geom(TIP_GEOM).id  # so its frame's x points into the object
        load = tuple(-entry for entry in s[6:12])
        wrenches.append(contact_wrench(load, s[12:15], SensorPayload(tip.mass, tip.center_of_mass)))
        points.append(data.contact[0].pos - s[:3])
        contacts.append(in_contact_frame)
    return np.array(wrenches), np.array(points), np.array(contacts)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("speed", "rate"), MOTIONS)
def test_centroid_and_spin_torque_are_those_of_the_contact(shape, speed, rate):
    """At 100 kN/m and 2 N, with the surface shrunk by half the penetration: 99 of 100 within the target."""
    wrenches, points, truth = ride(Tip(SHAPES[shape](0.0)), STIFF, speed, rate)
    found = contacts_from_wrenches(SHAPES[shape](FORCE / (2 * STIFF.stiffness)), wrenches)
    assert not found.status.any()
    assert np.percentile(np.linalg.norm(found.centroid - points, axis=1), 99) < 0.02e-3
    assert np.allclose(found.normal, [0.0, 0.0, -1.0], atol=5e-3)
    # MuJoCo gives what the tip does to the object, about the normal into the object: palpate the opposite
    assert np.percentile(np.abs(found.spin_torque + truth[:, 3]), 99) < 0.01e-3
    assert np.allclose(found.normal_force, truth[:, 0], rtol=1e-3)
    if rate:
        assert np.abs(truth[:, 3]).min() > 0.1e-3  # there is something to measure


@pytest.mark.parametrize("shape", SHAPES)
def test_friction_opposes_the_turn(shape):
    """A plate turning about +z drags the tip along: the torque on the tip is about +z, about n = -z negative."""
    wrenches, _, _ = ride(Tip(SHAPES[shape](0.0)), STIFF, 0.0, 3.0)
    assert np.all(contacts_from_wrenches(SHAPES[shape](0.0), wrenches).spin_torque < 0.0)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("speed", "rate"), MOTIONS)
@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_full_slip_lies_on_the_limit_ellipse(shape, speed, rate, friction):
    law = ContactLaw(stiffness=100e3, friction=friction, spin_length=0.004)
    _, _, truth = ride(Tip(SHAPES[shape](0.0)), law, speed, rate)
    tangential, torque = np.linalg.norm(truth[:, 1:3], axis=1), truth[:, 3]
    most = friction * truth[:, 0]
    assert np.allclose((tangential / most) ** 2 + (torque / (law.spin_length * most)) ** 2, 1.0, atol=1e-4)


def test_more_turning_trades_sliding_friction_for_spin_torque():
    """Maximum dissipation: the slip direction is normal to the ellipse, torque/force = e^2 rate/speed."""
    law = ContactLaw(stiffness=100e3)
    for rate in (0.5, 2.0, 8.0):
        _, _, truth = ride(Tip(SHAPES["sphere"](0.0)), law, 0.02, rate)
        # of the stage: a ramp followed with the servo's lag, from contact on the table's axis
        travelled = 0.02 * ((np.arange(len(truth)) + 250) * DT - Stage().lag)
        slip = np.hypot(0.02, rate * travelled)
        found = np.abs(truth[:, 3]) / np.linalg.norm(truth[:, 1:3], axis=1)
        assert np.allclose(found, law.spin_length**2 * rate / slip, rtol=0.05)
