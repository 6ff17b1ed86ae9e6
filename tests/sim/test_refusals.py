"""Bad inputs of the simulation: each is refused before anything moves, and the message names it."""

import math
import re
from dataclasses import replace
from functools import partial

import mujoco
import numpy as np
import pytest
import trimesh

from palpate.errors import InvalidValueError
from palpate.kinematics import Pose
from palpate.kinematics.servo_model import XM430_W210
from palpate.runtime.data import Command
from palpate.sim import (
    ArmCarrier,
    ArmFile,
    Box,
    ContactLaw,
    CylinderObject,
    EllipsoidObject,
    Fidelity,
    Fixed,
    Integrator,
    Lift,
    Mount,
    MujocoBackend,
    ObjectBody,
    ServoedArm,
    SphereObject,
    SprungTarget,
    Stage,
    Table,
    Tip,
    Torus,
    TurningStage,
    build_scene,
    rollout_presses,
    white_noise,
)
from palpate.sim.carriers.arm_drive import ArmDrive
from palpate.sim.carriers.arm_file import ARMS
from palpate.sim.carriers.carriage import LARGEST_SERVO_STEP
from palpate.sim.carriers.ur5e import ur5e
from palpate.sim.contact_law import pair_parameters
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.texture import FrictionMap, Grating
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.finger import HingeFinger
from palpate.sim.hand.hand import Hand, three_finger_hand, two_finger_hand
from palpate.sim.hand.hand_file import HANDS as HAND_FILES
from palpate.sim.hand.hand_file import HandFile
from palpate.sim.hand.load import LoadDrive, RampLoad, ShakenLoad
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.servo import Servo
from palpate.sim.hand.sideways import SidewaysRack
from palpate.sim.hand.turning_hand import TurningHand, turning_hand
from palpate.sim.objects.fixed_pieces import FixedPieces
from palpate.sim.objects.heights import HeightField, bumps
from palpate.sim.objects.mesh import ConvexMesh, TracedMesh
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp, Sine
from palpate.sim.render.files import write_gif
from palpate.sim.render.place import ScenePlacement
from palpate.sim.render.renderer import SceneRenderer
from palpate.sim.sensor.description import sensor_file
from palpate.sim.sensor.model import SensorModel, noisy_sensor
from palpate.sim.sensor.presets import PresetSensor, nano17, sensor_preset
from palpate.sim.sensor.simulation import ImperfectSensor, PerfectSensor, simulated_sensor
from palpate.sim.sensor.stages import (
    CrossTalk,
    Dropouts,
    FirstOrderLag,
    Quantisation,
    RandomWalk,
    SampleClock,
    Saturation,
    SecondOrderLag,
    WhiteNoise,
    alike,
)
from palpate.sim.sensor.temperature import TemperatureProfile, ThermalDrift, WarmUp
from palpate.surfaces import CompliantTip, Composite, Cylinder, Ellipsoid, Paraboloid, Patch, Sphere
from support.meshes import joined
from support.simulated import started

NAN, INF = math.nan, math.inf
NOT_POSITIVE = (0.0, -1.0, NAN, INF)
TIP, BALL, BOX = Tip(Sphere(0.008)), SphereObject(0.04), Box((0.06, 0.05, 0.06))
SLIDE = DrivenJoint(JointKind.SLIDE, (1, 0, 0), Ramp(0.1))
WEIGHTY = HeldObject(SphereObject(0.01), 0.2)
SITES = ("index_sensor", "left_sensor", "right_sensor")
INDEX_HAND = HandFile(HAND_FILES / "pinch-and-index.xml", SITES).read([TIP] * 3)
TWO_FINGERS, SITE = HAND_FILES / "pinch-and-index.xml", "index_sensor"
LATE = replace(nano17(3), latency=2.3e-3)
UPWARDS_ONLY = Composite((Patch(Cylinder(0.007), np.array([[0.0, 0.0, 1.0, 0.0]])),))
PANDA = ArmFile(ARMS / "panda.xml", "flange").read()
DOWN = np.full((2, 260, 3), (0.0, 0.0, -0.005))
FAST = np.full((2, 600, 3), (0.0, 0.0, -0.001)) * [[[1.0]], [[20.0]]]
FREE_BOX = ObjectBody(Box((0.1, 0.1, 0.04)), 2.0, mount=Mount.FREE, position=(0.0, 0.0, 0.02))
VISCOUS = ContactLaw(stiffness=100.0, smallest_force=20.0, friction=0.05, impedance=0.2)
"""Its friction is too stiff for time steps of a millisecond."""


def stage(target=BALL, carrier=None, start=(0.0, 0.0, 0.06), law=None, tip=TIP, **more):
    return build_scene(tip, target, law or ContactLaw(), start, carrier, **more)


def grasp(hand=None, target=None, **more):
    return build_grasp_scene(hand or two_finger_hand(), target or HeldObject(BOX), **more)


def stepped(make, command):
    """Start a back end over a scene and step it once."""
    started(make()).step(command)


def turned(carrier):
    return partial(stepped, partial(grasp, carrier=carrier), Command(angular_velocity_base_tip=(0.0, 0.0, 0.1)))


def moved(carrier, *velocity):
    return partial(stepped, partial(grasp, carrier=carrier), Command(velocity))


def sideways(*velocities, hand=turning_hand):
    return lambda: stepped(
        lambda: grasp(hand(), HeldObject(SphereObject(0.01))), Command(finger_velocity=velocities)
    )


def one_foreign_axis():
    matrix = np.eye(6)
    matrix[2] = matrix[1]
    return CrossTalk(tuple(map(tuple, matrix)))


def blow_at_run(run, period):
    velocity = DOWN.copy()
    velocity[run, period, 0] = NAN
    return velocity


def on_a_cart():
    body = mujoco.MjSpec().worldbody.add_body(name="cart")
    body.add_joint(name="slide", type=mujoco.mjtJoint.mjJNT_SLIDE)
    Torus(0.03, 0.012).add_geom(body, "object")


def pulled(body):
    text = """<mujoco><worldbody><body name="fixed"><geom size="0.01"/></body>
        <body name="hinged"><joint type="hinge"/><geom size="0.01"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    return LoadDrive(RampLoad((0.0,) * 3, (0.0, 0.0, -1.0), 0.0, 1.0), model, mujoco.MjData(model), body)


def torus_mesh(kind):
    return kind(joined(trimesh.creation.torus(0.03, 0.012)))


def of_another_sensor(state_of, sensor):
    return lambda: sensor.set_state(ImperfectSensor(state_of, 1e-3).state())


def quantities(make, bad, *names):
    """Rows of quantities that must be positive."""
    return [(partial(make, **{name: value}), name) for name in names for value in bad]


SENSORS = [
    (lambda: WhiteNoise(alike(-0.1, 0.0)), "noise, Fx"),
    (lambda: WhiteNoise(alike(0.1, NAN)), "noise, Mx"),
    (lambda: WhiteNoise((0.1, 0.1)), "2 entries"),
    (lambda: RandomWalk(alike(INF, 0.0)), "random walk"),
    (lambda: Quantisation(alike(0.1, -1.0)), "step of quantisation, Mx"),
    (lambda: Saturation(alike(0.0, 1.0)), "saturation, Fx"),
    (lambda: SampleClock(0.0), "sample rate"),
    (lambda: SampleClock(100.0, NAN), "offset"),
    (lambda: Dropouts(1.0), "probability"),
    (lambda: Dropouts(-0.1), "probability"),
    (lambda: WarmUp(5.0, 0.0), "time_constant"),
    (lambda: WarmUp(NAN, 1.0), "rise"),
    (lambda: TemperatureProfile((), ()), "1 or more"),
    (lambda: TemperatureProfile((0.0, 1.0), (1.0,)), "as many"),
    (lambda: TemperatureProfile((0.0, 0.0), (1.0, 2.0)), "must rise"),
    (lambda: ThermalDrift((1.0, 2.0), WarmUp(1.0, 1.0)), "per_kelvin"),
    (lambda: SensorModel(bias=(NAN,) * 6), "bias"),
    (lambda: SensorModel(rated=(0.0,) * 6), "rated load"),
    (one_foreign_axis, "singular"),
    (lambda: CrossTalk(tuple(map(tuple, np.eye(5)))), "6 rows"),
    *((partial(FirstOrderLag, bad), "cutoff") for bad in NOT_POSITIVE),
    *((partial(SecondOrderLag, bad), "natural_frequency") for bad in NOT_POSITIVE),
    *((partial(SecondOrderLag, 10.0, bad), "damping") for bad in (0.0, -1.0, 1.5)),
    *((partial(SensorModel, latency=bad), "latency") for bad in (-1e-3, NAN, 2.0)),
    *((partial(simulated_sensor, nano17(3), bad), "period") for bad in (0.0, -1.0, NAN)),
    (lambda: simulated_sensor(nano17(3), 1e-3, -1), "seed"),
    (of_another_sensor(nano17(3), ImperfectSensor(noisy_sensor(0.1, 1e-3), 1e-3)), "another sensor"),
    (of_another_sensor(nano17(3), PerfectSensor()), "another sensor"),
    (of_another_sensor(LATE, ImperfectSensor(LATE, 1e-2)), "same period"),
    *((partial(sensor_preset, preset, -1), "specimen") for preset in PresetSensor if preset != "perfect"),
    (lambda: sensor_file(noisy_sensor(0.1, 1e-3), 1e-3), "rated"),
    (lambda: sensor_file(SensorModel(rated=alike(10.0, 1.0)), 1e-3), "dead sensor"),
    *((partial(white_noise, force=bad), "force noise") for bad in (-0.1, NAN, INF)),
    *((partial(white_noise, moment=bad), "moment noise") for bad in (-0.1, NAN, INF)),
]

CONTACTS = [
    *quantities(
        ContactLaw,
        NOT_POSITIVE,
        *("stiffness", "friction", "spin_length", "damping_ratio", "smallest_force", "lift_speed", "creep_speed"),
    ),
    *((partial(ContactLaw, impedance=bad), "impedance") for bad in (0.0, 1.0, -0.5, NAN)),
    *quantities(FrictionLaw, (0.0,), "static_friction", "stribeck_speed", "spin_length", "stiffness"),
    *quantities(FrictionLaw, (NAN, 0.4), "kinetic_friction"),
    *quantities(FrictionLaw, (-0.1, 0.5), "load_exponent"),
    *quantities(FrictionLaw, (0.9, 2.1, NAN), "norm_exponent"),
    *quantities(FrictionLaw, (-0.3,), "viscous_friction", "damping_ratio"),
    (lambda: Grating(1e-3, 1.0), "amplitude"),
    (lambda: Grating(0.0, 0.1), "wavelength"),
    (lambda: Grating(1e-3, 0.1, (0.0, 0.0, 0.0)), "direction"),
    (lambda: FrictionMap([1.0, 2.0], 0.01), "shape"),
    (lambda: FrictionMap([[1.0, 0.0], [1.0, 1.0]], 0.01), "above 0"),
]

OBJECTS = [
    *((partial(SphereObject, bad), "radius") for bad in NOT_POSITIVE),
    *((partial(EllipsoidObject, (0.05, bad, 0.03)), r"semi_axes\[1\]") for bad in NOT_POSITIVE),
    *((partial(Box, (0.05, 0.05, bad)), r"size\[2\]") for bad in NOT_POSITIVE),
    *((partial(CylinderObject, 0.03, bad), "length") for bad in NOT_POSITIVE),
    (lambda: ObjectBody(Torus(), mount=Mount.FREE), "shape is a Torus: must be fixed"),
    (lambda: ObjectBody(Torus()).inertia(), "Torus is fixed"),
    (lambda: ObjectBody(Box(), mass=0.0), "mass"),
    (lambda: ObjectBody(Box(), colour=(0.0, 2.0, 0.0, 1.0)), r"colour\[1\] = 2"),
    (lambda: ObjectBody(Box(), mount=Mount.DRIVEN), r"mount = Mount\.DRIVEN.*MovingTarget"),
    (lambda: MovingTarget(Box(), []), "joints"),
    (lambda: MovingTarget(Torus(), [SLIDE]), "shape is a Torus"),
    (lambda: DrivenJoint(JointKind.SLIDE, (0, 0, 0), Ramp(0.1)), "axis"),
    (lambda: Sine(0.0, 1.0), "amplitude"),
    (lambda: Table(NAN), "top"),
    (lambda: Table(friction=0.0), "friction"),
    (lambda: FixedPieces(()), "there are none"),
    (lambda: Torus(0.01, 0.02), "tube = 0.02 m"),
    (lambda: HeightField(np.zeros((3, 5)), 0.1, 0.1), r"heights has shape \(3, 5\)"),
    (lambda: HeightField([[0.0, 0.0, 0.0, NAN]] * 4, 0.1, 0.1), r"heights\[0, 3\] = nan"),
    (lambda: HeightField(np.eye(5) * 3.0, 0.1, 0.1), "millimetres"),
    (lambda: HeightField(np.zeros((5, 5)), 0.0, 0.1), "width"),
    (lambda: bumps(wavelength=-1.0), "wavelength"),
    (lambda: torus_mesh(ConvexMesh), r"not convex.*TracedMesh"),
    (lambda: SprungTarget(BOX, stiffness=0.0), "stiffness = 0.0 N/m"),
    (lambda: SprungTarget(BOX, damping=-1.0), "damping"),
    (lambda: SprungTarget(BOX, axis=(0.0, 0.0, 0.0)), "length of axis"),
    (lambda: SprungTarget(Torus()), "take a convex object"),
    (on_a_cart, r"'cart': must be fixed in the world"),
]

TIPS = [
    (lambda: Tip(CompliantTip(Sphere(0.008), 1e4)), "CompliantTip: in a simulation the contact"),
    (lambda: Tip(Ellipsoid((0.007, 0.008, INF))), "endless elliptic cylinder"),
    (lambda: Tip("sphere"), "surface is a str"),
    (lambda: Tip(UPWARDS_ONLY), "no end along"),
    *quantities(partial(Tip, Sphere(0.008)), (0.0,), "mass", "reach"),
    (lambda: MujocoBackend(stage(Torus(0.03, 0.012), tip=Tip(Sphere(0.02)))), r"tip radius = 0\.02 m.*hole"),
    (lambda: MujocoBackend(stage(bumps(), tip=Tip(Sphere(0.05)))), r"tip radius = 0\.05 m.*tightest hollow"),
    (
        lambda: MujocoBackend(stage(torus_mesh(TracedMesh), tip=Tip(Sphere(0.03)))),
        r"tip radius = 0\.03 m.*too hollow",
    ),
    (lambda: MujocoBackend(stage(Torus(), tip=Tip(Ellipsoid((0.008, 0.009, 0.01))))), "kind ellipsoid: Torus"),
]

CARRIERS = [
    *quantities(Stage, (0.0,), "mass", "bandwidth", "following_error_limit"),
    *quantities(TurningStage, NOT_POSITIVE, "mass", "bandwidth", "inertia"),
    (lambda: ur5e(bandwidth=0.0), "bandwidth"),
    (lambda: ur5e(pose_flange_tip=Pose((INF, 0.0, 0.0))), "pose_flange_tip"),
    (lambda: ur5e().add_to(mujoco.MjSpec(), (0.0, 7.0, 0.0, 0.0, 0.0, 0.0)), "joint_start, joint 2"),
    (lambda: ArmDrive(ur5e(), stage(carrier=ArmCarrier()).model, None, 0.7e-3), "whole number of time steps"),
    (lambda: ServoedArm(PANDA, bandwidth=0.0), "bandwidth"),
    (lambda: ServoedArm(PANDA).add_to(mujoco.MjSpec(), (0.0,) * 7), "joint_start, joint 4"),
    (lambda: ArmFile(ARMS / "panda.xml", "flange", home=(0.0, 9.0, *(0.0,) * 5)).read(), "home, joint 2"),
    (lambda: ArmFile(ARMS / "none.xml", "flange").read(), r"none\.xml: cannot be opened: .*; give"),
    (lambda: stage(carrier=ArmCarrier(), start=(0.0, 0.0, 2.0)), "reach"),
    (lambda: stage(start=(0.0, 0.0, 0.03)), r"start = .*0.01 m inside the object.*highest point is at z = 0.04 m"),
    (lambda: stage(carrier=Fixed()), r"neither can move.*take a carrier that moves, or an object"),
    (
        lambda: stage(carrier=Fixed(), friction=FrictionLaw()),
        r"neither can move.*take a carrier that moves, or an object",
    ),
    *(
        (
            partial(stepped, partial(stage, carrier=carrier), Command(angular_velocity_base_tip=(0.0, 1e-6, 0.0))),
            r"angular_velocity_base_tip = .*cannot turn.*take a robot that can",
        )
        for carrier in (Stage(), Lift())
    ),
    *((partial(MujocoBackend, stage(), bad), "period") for bad in (0.75e-3, 0.1e-3, 0.0, -1e-3, NAN, INF)),
    (
        lambda: stage(ObjectBody(SphereObject(), mass=0.02, mount=Mount.FREE), start=(0.0, 0.0, 0.1)),
        r"contact stiffness = 20000 N/m.*at most",
    ),
    (lambda: ScenePlacement(mujoco.MjSpec().compile()), "nothing to place"),
]

HANDS = [
    *((turned(carrier), "take a robot that can") for carrier in (Fixed(), Lift(), Stage())),
    (moved(Fixed(), 0.0, 0.01, 0.0), "take a robot that can"),
    (moved(Fixed(), 0.0, 0.0, 0.01), "nothing"),
    (moved(Lift(), 0.0, 0.01, 0.0), "z only"),
    (moved(Lift(), -0.01, 0.0, 0.0), "z only"),
    *(
        (partial(stepped, grasp, Command(grip_force=force)), "grip_force")
        for force in ((1.0,), (1.0,) * 3, (-1.0, 1.0), (1.0, NAN), (INF, 1.0))
    ),
    *((partial(HandBackend, grasp(), bad), "period") for bad in (0.5e-3, 1.5e-3, 0.0, -1e-3, NAN, INF)),
    (sideways((0.0, 0.001, 0.0), (0.0, 0.001, 0.0)), "finger_velocity"),
    (sideways((0.0, 0.001, 0.0), (0.0, NAN, 0.0), (0.0,) * 3), "finger_velocity"),
    (sideways((0.0, 0.001, 0.0), (0.0, INF, 0.0), (0.0,) * 3), "finger_velocity"),
    (sideways(*((0.001, 0.0, 0.0),) * 3), "finger_velocity"),
    (sideways((0.0,) * 3, (0.0,) * 3, hand=two_finger_hand), "turning_hand"),
    (lambda: TurningHand(fingers=2).sensor_poses((0.0,) * 3), "4 entries"),
    *((partial(hand.sensor_poses, (0.0,)), "joint_position") for hand in (two_finger_hand(), three_finger_hand())),
    *(
        (partial(stepped, lambda: grasp(INDEX_HAND, WEIGHTY), Command(grip_force=force)), "grip_force")
        for force in ((1.0, 1.0), (1.0, -1.0, 1.0))
    ),
    *(
        (partial(stepped, lambda: grasp(INDEX_HAND, WEIGHTY), Command(finger_velocity=each)), "finger_velocity")
        for each in (((0.0,) * 3,) * 2, ((NAN, 0.0, 0.0), None, None))
    ),
    (lambda: HandFile(TWO_FINGERS, (SITE, SITE)).read([TIP] * 2), "moves two fingers"),
    *quantities(Hand, (0.0,), "opening", "bus_period", "housing_mass"),
    *quantities(Hand, (-1.0,), "closing_speed"),
    (lambda: Hand(fingers=1), "fingers"),
    (lambda: Hand(tip=Tip(Sphere(0.008, center=(0.001, 0.0, 0.01)))), "z axis"),
    (lambda: Hand(finger=HingeFinger(length=0.02)), "length"),
    (lambda: SidewaysRack(pinion=0.0), "pinion"),
    (lambda: SidewaysRack(mass=-1.0), "mass"),
    (lambda: SidewaysRack(travel=NAN), "travel"),
    (lambda: grasp(target=HeldObject(Box((0.09, 0.05, 0.06)))), "start clear"),
    (lambda: grasp(carrier=ArmCarrier(), palm=(0.0, 0.0, 3.0)), "reach"),
    (lambda: HeldObject(Torus()), "Torus: its simulated surface follows one tip"),
    (
        lambda: HandBackend(grasp(law=GraspContact(stiffness=5e3), carrier=TurningStage(inertia=2e-4))),
        "give the stage more",
    ),
    (lambda: grasp(texture=Grating(0.01, 0.1)), "texture without friction"),
    (
        lambda: HandBackend(
            grasp(friction=FrictionLaw(stiffness=5e3), fidelity=Fidelity(1e-3, Integrator.RK4), carrier=Lift())
        ),
        "RK4",
    ),
    (lambda: RampLoad((0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 1.0), "before"),
    (lambda: RampLoad((0.0, 0.0, NAN), (0.0, 0.0, 0.0), 0.0, 1.0), "before"),
    (lambda: RampLoad((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), -1.0, 1.0), "begin"),
    (lambda: RampLoad((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, INF), "duration"),
    (lambda: ShakenLoad((0.0, 0.0, 1.0), 0.0), "frequency"),
    (lambda: ShakenLoad((0.0, 0.0, 1.0), 1.0, begin=2.0, end=1.0), "end"),
    (lambda: pulled("fixed"), "body = 'fixed'"),
    (lambda: pulled("hinged"), "body = 'hinged'"),
    *quantities(
        partial(replace, XM430_W210),
        (0.0,),
        *("voltage", "stall_torque", "stall_current", "inertia", "current_unit", "mass"),
    ),
    (lambda: replace(XM430_W210, viscous=10.0), "no-load speed"),
    (lambda: Servo(XM430_W210, 0.05), "time_step"),
]

PRESSES = [
    (lambda: rollout_presses(stage(Torus()), DOWN), r"target = .*Torus.*\(Trace\).*MujocoBackend"),
    (
        lambda: rollout_presses(stage(tip=Tip(Paraboloid((0.008, 0.01))), start=(0.0, 0.0, 0.1)), DOWN),
        r"tip = .*\(RollingSphere\).*MujocoBackend",
    ),
    (lambda: rollout_presses(stage(friction=FrictionLaw()), DOWN), "in each time step; leave it to MuJoCo"),
    (lambda: rollout_presses(stage(carrier=ArmCarrier()), DOWN), "depends on where it is; take a Stage"),
    (lambda: rollout_presses(stage(carrier=TurningStage()), DOWN), "depends on where it is; take a Stage"),
    (lambda: rollout_presses(stage(), DOWN[0]), r"shape \(260, 3\): must be \(runs, periods, 3\)"),
    (lambda: rollout_presses(stage(), blow_at_run(1, 7)), r"velocity\[1, 7\] = \[nan"),
    (lambda: rollout_presses([stage()] * 3, DOWN), "3 scenes for 2 runs"),
    (lambda: rollout_presses([stage(), stage(FREE_BOX, table=Table())], DOWN), "differ in what there is"),
    (lambda: rollout_presses(stage(), DOWN, period=0.75e-3), r"period = 0\.00075 s: must be a whole number"),
    (lambda: rollout_presses(stage(start=(0.0, 0.0, 0.0485)), FAST), r"run 1: in period \d+ the tip lags behind"),
    *((partial(SceneRenderer, stage().model, *size), "pixels") for size in ((0, 480), (640, -1), (10_000, 480))),
    (lambda: write_gif([], "never.gif", 0.05), "no pictures to write"),
    (lambda: write_gif([np.zeros((2, 2, 3), np.uint8)], "never.gif", 0.01), "interval = 0.01 s"),
]

ROWS = [*SENSORS, *CONTACTS, *OBJECTS, *TIPS, *CARRIERS, *HANDS, *PRESSES]


@pytest.mark.slow
@pytest.mark.parametrize(("call", "message"), ROWS, ids=[f"{i}-{row[1]}" for i, row in enumerate(ROWS)])
def test_a_bad_input_is_refused_by_name(call, message):
    with pytest.raises(InvalidValueError, match=message):
        call()


def contact_step(time_step):
    pair_parameters(ContactLaw(stiffness=500e3), 0.2, 0.99 * time_step)


def creep(speed):
    pair_parameters(ContactLaw(creep_speed=0.99 * speed), 0.2, 0.5e-3)


def servo(integrator, bandwidth):
    stage(carrier=Stage(bandwidth=bandwidth), fidelity=Fidelity(0.5e-3, integrator))


def rubbing(friction):
    pair_parameters(replace(VISCOUS, friction=friction), 2.0, 1e-3)


def pressing(stiffness):
    stage(law=ContactLaw(stiffness=stiffness))


def sprung(mass):
    stage(SprungTarget(Box((0.2, 0.2, 0.04)), mass=mass))


def gripped(stiffness):
    grasp(target=HeldObject(BOX, 0.01), law=GraspContact(stiffness=stiffness))


TOO_FAST = 1.01 * LARGEST_SERVO_STEP / 0.5e-3
ADVICE = [
    (contact_step, 0.51e-3, r"time step of at most (\S+)", 1.1),
    (creep, 0.5, r"creep_speed.* at most (\S+)", 1.1),
    (rubbing, 0.05, r"friction damping.*friction of at least ([\d.]+)", 0.9),
    (pressing, 1e6, r"contact stiffness.*?at most (\S+)", 1.1),
    (partial(servo, Integrator.EULER), TOO_FAST, r"bandwidth dt.*?at most (\S+)", 1.1),
    (partial(servo, Integrator.RK4), TOO_FAST, r"bandwidth dt.*?at most (\S+)", 1.1),
    (sprung, 0.02, r"mount_mass = .* kg: .*take at least ([\d.]+) kg", 0.9),
    (gripped, 20e3, r"contact stiffness.*?at most (\S+)", 1.1),
]


@pytest.mark.parametrize(("make", "bad", "message", "beyond"), ADVICE)
def test_a_refusal_advises_the_last_value_that_is_accepted(make, bad, message, beyond):
    with pytest.raises(InvalidValueError, match=message) as refusal:
        make(bad)
    advised = float(re.search(message, str(refusal.value))[1])
    make(advised)
    with pytest.raises(InvalidValueError, match=message):
        make(beyond * advised)
