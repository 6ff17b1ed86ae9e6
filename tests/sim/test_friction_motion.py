"""Bodies that move by the friction plant, against closed forms and high-accuracy integration of the same law."""

import math
from itertools import pairwise

import mujoco
import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.pairs import FrictionPair
from palpate.sim.friction.plant import FrictionPlant

G = 9.80665
COULOMB = FrictionLaw()
UPRIGHT = """<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
    <joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 0 1"/>"""


def scene(bodies, pairs, inverse_mass=10.0, dt=0.5e-3, gravity=(0.0, 0.0, -G)):
    """Compile bodies (MJCF) with frictionless pairs of 20 kN/m, critically damped on 1/inverse_mass."""
    d, stiffness = 0.5, 20e3
    damping = 2.0 * math.sqrt(stiffness / inverse_mass)
    solref = f"{-(1 - d) * inverse_mass * stiffness} {-(1 - d) * inverse_mass * damping}"
    listed = "".join(
        f'<pair geom1="{a}" geom2="{b}" condim="1" solref="{solref}" solimp="{d} {d} 0.001 0.5 2"/>'
        for a, b in pairs
    )
    x, y, z = gravity
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{dt}" cone="elliptic" integrator="implicitfast" gravity="{x} {y} {z}">
        <flag autoreset="disable"/></option><default><geom contype="0" conaffinity="0"/></default>
        <worldbody><geom name="floor" type="plane" size="1 1 1"/>{bodies}</worldbody>
        <contact>{listed}</contact></mujoco>"""
    )
    return model, mujoco.MjData(model)


def box(joints="<freejoint/>", height=0.025, half="0.025 0.025 0.025", name="box", x=0.0):
    return f"""<body name="{name}" pos="{x} 0 {height}">{joints}
        <geom name="{name}" type="box" size="{half}" mass="0.1"/></body>"""


def plant_of(bodies, *pairs, law=COULOMB, **options):
    """Compile a scene in which all pairs rub by a law."""
    model, data = scene(bodies, pairs, **options)
    return data, FrictionPlant(model, data, [FrictionPair(*pair, law) for pair in pairs])


def settle(plant, steps=400):
    for _ in range(steps):
        plant.advance()


@pytest.mark.parametrize(("friction", "dt"), [(0.1, 1e-3), (0.3, 0.5e-3), (0.8, 1e-3), (0.8, 0.5e-3)])
def test_a_sliding_box_stops_after_v_squared_over_two_mu_g_and_then_stands_still(friction, dt):
    law = FrictionLaw(static_friction=friction, kinetic_friction=friction)
    data, plant = plant_of(box(), ("box", "floor"), law=law, dt=dt)
    settle(plant)
    data.qvel[0] = 0.4
    settle(plant, 4)  # until the bristle is stretched
    start, speed = data.qpos[0], data.qvel[0]
    settle(plant, round((speed / (friction * G) + 0.1) / dt))
    # half a step less (semi-implicit Euler moves with the speed at the end of a step); the bristle springs back
    way = speed**2 / (2 * friction * G) - 0.5 * speed * dt - friction * 0.1 * G / law.stiffness
    assert data.qpos[0] - start == pytest.approx(way, rel=0.005)
    at_rest = data.qpos.copy()
    settle(plant, 2000)
    assert np.abs(data.qpos - at_rest).max() < 1e-9
    assert all(contact.sticking for contact in plant.contacts)
    assert len(plant.contacts) == 4


@pytest.mark.parametrize(("speed", "radius"), [(0.5, 0.02), (4.0, 0.01)])
def test_a_ball_set_sliding_rolls_in_the_end_with_five_sevenths_of_its_speed(speed, radius):
    """Rolling is no slip: the bristle is carried along and neither brakes nor drives."""
    ball = f"""<body name="ball" pos="0 0 {radius}"><freejoint/><geom name="ball" type="sphere" size="{radius}"
        mass="0.1"/></body>"""
    data, plant = plant_of(ball, ("ball", "floor"))
    settle(plant)
    data.qvel[0] = speed
    settle(plant, round(2 / 7 * speed / (0.3 * G) / 0.5e-3) + 100)
    assert data.qvel[0] == pytest.approx(5 / 7 * speed, rel=5e-3)
    rolling = data.qvel[0]
    settle(plant, 2000)
    # at theta a time step the chord of the cycloid passes for slip: theta^2/6 of the speed, 0.3 % of the fast one
    chord = 1e-3 if speed < 1.0 else 5e-3
    assert data.qvel[0] == pytest.approx(rolling, rel=chord)
    (contact,) = plant.contacts
    assert contact.sticking
    assert data.qvel[4] * (radius - 0.5 * (radius - data.qpos[2])) == pytest.approx(data.qvel[0], rel=chord)


STICK_SLIP = FrictionLaw(static_friction=0.5, kinetic_friction=0.3, stribeck_speed=0.02, stiffness=100e3)


PERIODS = [(0.02, 0.7415353, 0.005685554), (0.05, 0.4452959, 0.006686406)]
"""Speed of the belt [m/s], period [s], half the travel [m]; integrated event by event, rigid when stuck."""


@pytest.mark.parametrize(("belt", "period", "amplitude"), PERIODS)
def test_stick_slip_on_a_belt_has_the_period_and_the_amplitude_of_the_law(belt, period, amplitude):
    mass, spring, dt = 0.1, 40.0, 0.5e-3
    bodies = f"""<body name="belt" pos="0 0 -0.01"><joint name="belt" type="slide" axis="1 0 0"/>
        <geom name="belt" type="box" size="2 0.1 0.01" mass="1e4"/></body>
        <body name="puck" pos="0 0 0.01"><joint name="x" type="slide" axis="1 0 0" stiffness="{spring}"/>
        <joint name="z" type="slide" axis="0 0 1"/>
        <geom name="puck" type="sphere" size="0.01" mass="{mass}"/></body>"""
    data, plant = plant_of(bodies, ("puck", "belt"), law=STICK_SLIP, dt=dt)
    data.qvel[0] = belt
    x = []
    for _ in range(round(6.0 / dt)):
        plant.advance()
        x.append(data.qpos[1])
    x = np.array(x[len(x) // 3 :])
    middle = 0.5 * (x.max() + x.min())
    up = np.flatnonzero((x[:-1] < middle) & (x[1:] >= middle))
    crossing = up + (middle - x[up]) / (x[up + 1] - x[up])
    assert len(up) >= 3
    assert np.diff(crossing).mean() * dt == pytest.approx(period, rel=0.01)
    assert 0.5 * np.ptp(x) == pytest.approx(amplitude, rel=0.01)


FINGERS = """<body name="left" pos="-{0} 0 0"><joint name="left" type="slide" axis="1 0 0" damping="20"/>
    <geom name="left" type="sphere" size="0.008" mass="0.5"/></body>
    <body name="right" pos="{0} 0 0"><joint name="right" type="slide" axis="1 0 0" damping="20"/>
    <geom name="right" type="sphere" size="0.008" mass="0.5"/></body>"""
"""Two fingers that slide along x and cannot move up or down."""


def pressed(body, law, grip, dt=0.5e-3, apart=0.033):
    """Two fingers press on a body [N]."""
    pairs = [(name, "held") for name in ("left", "right")]
    data, plant = plant_of(body + FINGERS.format(apart), *pairs, law=law, dt=dt)
    data.qfrc_applied[6:8] = (grip, -grip)
    return data, plant


@pytest.mark.parametrize("dt", [0.5e-3, 1e-3])
def test_a_held_object_neither_creeps_nor_walks(dt):
    """At rest with its centre of mass off the fingers' line, and shaken: LuGre's bristle would drift."""
    law = FrictionLaw(static_friction=0.5, kinetic_friction=0.5)
    body = (
        """<body name="held"><freejoint/><geom name="held" type="box" size="0.025 0.02 0.03" mass="0.2"/></body>"""
    )
    data, plant = pressed(body, law, 5.0, dt)
    settle(plant, round(1.0 / dt))
    data.xfrc_applied[1, 4] = 2e-3  # a moment about the fingers' line, half of what they carry
    settle(plant, round(1.0 / dt))
    before = data.qpos.copy()
    settle(plant, round(2.0 / dt))
    assert np.abs(data.qpos - before).max() / 2.0 < 1e-9  # [m/s]
    assert abs(before[2]) < 1e-3
    carried = sum(contact.tangential_force[2] for contact in plant.contacts)
    assert carried == pytest.approx(-0.2 * G, rel=1e-6)
    for i in range(round(2.0 / dt)):  # 40 Hz, 0.5 N besides the weight of 2 N, of 5 N that the grip carries
        data.xfrc_applied[1, 2] = -0.5 * math.sin(2 * math.pi * 40 * i * dt)
        plant.advance()
        assert all(contact.sticking for contact in plant.contacts)
    data.xfrc_applied[1, 2] = 0.0
    settle(plant, round(1.0 / dt))
    assert np.abs(data.qpos - before).max() < 2e-9


def test_a_box_rides_on_a_fast_belt_on_a_slope_without_slipping():
    """Contacts are found again where the bodies have carried them: here by 10 mm in a time step."""
    belt = """<body name="belt" pos="0 0 -0.01"><joint type="slide" axis="1 0 0"/>
        <geom name="belt" type="box" size="50 0.2 0.01" mass="1e4"/></body>"""
    data, plant = plant_of(belt + box(), ("box", "belt"), gravity=(0.0, 1.0, -G))
    data.qvel[:2] = 20.0
    settle(plant)
    before = data.qpos.copy()
    settle(plant, 1000)
    assert data.qpos[0] - before[0] == pytest.approx(10.0, rel=1e-6)
    assert abs((data.qpos[1] - data.qpos[0]) - (before[1] - before[0])) < 1e-7  # rounding of 10 m
    assert abs(data.qpos[2] - before[2]) < 1e-7  # MuJoCo's box on box rocks by nanometres


def test_no_energy_comes_from_friction_when_a_tumbling_box_comes_to_rest():
    model, data = scene(box(height=0.06), [("box", "floor")])
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    plant = FrictionPlant(model, data, [FrictionPair("box", "floor", FrictionLaw(norm_exponent=1.3))])
    data.qvel[:] = (0.5, 0.2, 0.0, 5.0, -7.0, 9.0)
    mujoco.mj_forward(model, data)
    highest = []
    for _ in range(20):
        settle(plant, 200)
        highest.append(data.energy.sum())
    assert all(later <= earlier + 1e-6 for earlier, later in pairwise(highest))
    assert np.abs(data.qvel).max() < 1e-6


def test_a_rod_held_at_its_end_is_refused_a_bristle_that_its_lever_makes_too_stiff():
    """Unstable, it would buzz and fall; with the advised stiffness spin torque alone holds it."""
    rod = """<body name="held"><freejoint/>
        <geom name="held" type="box" size="0.01 0.15 0.01" pos="0 0.14 0" mass="0.02"/></body>"""

    def hold(stiffness):
        law = FrictionLaw(static_friction=0.6, kinetic_friction=0.6, stiffness=stiffness)
        _, plant = pressed(rod, law, 20.0, apart=0.018)
        settle(plant, 2000)
        return plant

    with pytest.raises(InvalidValueError, match="at these contacts") as refusal:
        hold(20e3)
    plant = hold(float(str(refusal.value).split("stiffness of at most ")[1].split()[0]))
    torques = []
    for _ in range(2000):  # it swings on the bristle's spring for long
        plant.advance()
        assert all(contact.sticking for contact in plant.contacts)
        torques.append(sum(contact.spin_torque * contact.normal[0] for contact in plant.contacts))
    assert abs(np.mean(torques)) == pytest.approx(0.02 * G * 0.14, rel=0.1)


def test_making_room_forgets_no_bristle():
    """Seven boxes stand on a slope, held by their bristles, when two more land: 36 contacts, after room for 32."""
    names = [f"box{i}" for i in range(9)]
    heights = [0.025] * 7 + [0.035] * 2
    bodies = "".join(box(UPRIGHT, name=name, x=0.2 * i, height=heights[i]) for i, name in enumerate(names))
    _, plant = plant_of(bodies, *((name, "floor") for name in names), gravity=(1.0, 0.0, -G))
    most, before = 0, None
    for i in range(2000):
        plant.advance()
        held_back = sum(contact.tangential_force[0] for contact in plant.contacts if contact.pair.first == "box0")
        if most and len(plant.contacts) > most:
            assert held_back == pytest.approx(before, rel=1e-3)
        if i > 50:  # box0 rests
            most, before = max(most, len(plant.contacts)), held_back
    assert most == 36
    assert before == pytest.approx(-0.1, rel=1e-3)
