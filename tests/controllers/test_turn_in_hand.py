"""Turning an object in the hand: touch tells how far, every contact rolls, nothing slips, nothing is dropped."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.need import NeedWithoutSpin
from palpate.controllers.grip.turn import HoldingGrip, TurnInHand, TurnParameters
from palpate.controllers.grip.turn_meter import TurnMeter
from palpate.errors import InvalidValueError
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.runtime.data import ArmSample, FingerObservation, HandSample, Observation, Phase
from palpate.runtime.live import LiveParameters
from palpate.sensing.contact import Contact, ContactStatus
from palpate.sim.hand.load import RampLoad
from palpate.sim.hand.turning_hand import turning_hand
from palpate.spatial import IDENTITY, ZERO
from support.turned_object import CYLINDER, SPHERE, Turned

ANGLE, STEP = math.radians(15.0), 2e-3

PULLS = {
    "nothing pulls": None,
    "1 N down": (ZERO, (0.0, 0.0, -1.0), ZERO),
    "1 N across": (ZERO, (0.0, 1.0, 0.0), ZERO),
    "1 N aslant, off the middle": (ZERO, (0.6, 0.0, -0.8), (0.0, 0.01, 0.0)),
}


def spun(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def turned_by_rolling(points, turn, way, migration, tilts, steps=50):
    """The meter of tips that roll on a body which turns and moves; contacts migrate by a share of the turn."""
    meter, points = TurnMeter(), np.array(points)
    middles = np.add(points, (0.01, -0.02, 0.03))
    rotations = np.array([rotation_from_rotvec(tilt) for tilt in tilts])

    def report(call, share):
        places = points @ spun(migration * turn * share).T + np.multiply(way, share)
        poses = [Pose(tuple(m), tuple(map(tuple, r))) for m, r in zip(middles, rotations, strict=True)]
        call(poses, [tuple(r.T @ (p - m)) for m, r, p in zip(middles, rotations, places, strict=True)])

    report(meter.start, 0.0)
    for k in range(steps):
        # the contact halfway through the step, in the frame of the body
        half = (k + 0.5) / steps
        at_body = points @ spun((migration - 1.0) * turn * half).T
        middles = middles + at_body @ (spun(turn * (k + 1) / steps) - spun(turn * k / steps)).T
        middles = middles + np.multiply(way, 1.0 / steps)
        report(meter.step, (k + 1) / steps)
    return meter


@st.composite
def around(draw):
    """Two to four contacts, not all in one place."""
    radii = draw(st.lists(st.floats(0.01, 0.05), min_size=2, max_size=4))
    angles = 2.0 * math.pi * np.arange(len(radii)) / len(radii)
    heights = [draw(st.floats(-0.02, 0.02)) for _ in radii]
    return np.transpose([radii * np.cos(angles), radii * np.sin(angles), heights])


turns = st.floats(-0.6, 0.6)

ways = st.tuples(st.floats(-0.01, 0.01), st.floats(-0.01, 0.01), st.just(0.0))

tilts = st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=4, max_size=4)


@settings(max_examples=25, deadline=None)
@given(around(), turns, ways, st.floats(0.0, 1.2), tilts, st.permutations(range(4)))
def test_touch_measures_the_motion_of_a_rigid_body_however_its_contacts_migrate(
    points, turn, way, share, tilts, order
):
    """The order of the fingers does not matter."""
    order = [i for i in order if i < len(points)]
    meter = turned_by_rolling(points, turn, way, share, tilts[: len(points)])
    other = turned_by_rolling(points[order], turn, way, share, [tilts[i] for i in order])
    assert meter.turn == pytest.approx(turn, abs=1e-4)
    assert meter.moved == pytest.approx(way, abs=2e-6)
    assert other.turn == pytest.approx(meter.turn, abs=1e-12)


def test_rounded_joints_are_wrong_once_and_not_with_every_turn():
    """Back and forth thirty times with positions in steps of 15 um: the error stays that of one rounding."""
    meter, step, rng = TurnMeter(), 15e-6, np.random.default_rng(0)
    points = [(0.03 * math.cos(a), 0.03 * math.sin(a), 0.0) for a in (0.0, 2.1, 4.2)]

    def poses(turn):
        ways = [turn * np.array([-y, x, 0.0]) for x, y, _ in points]
        return [Pose(tuple(step * np.round((w + 5e-6 * rng.standard_normal(3)) / step))) for w in ways]

    meter.start(poses(0.0), points)
    for k in range(6001):
        meter.step(poses(0.2 * math.sin(2.0 * math.pi * k / 200.0)), points)
    assert abs(meter.turn) < 2.0 * step / 0.03


class Puppet:
    """A grip that always presses with 2 N, and fails when it is told."""

    def __init__(self):
        self.live, self.faulty, self.targets = LiveParameters(), False, (2.0,) * 3

    def step(self, now):
        return (1.5,) * 3


class Rolling:
    """The turning hand on a rigid cylinder or sphere, without any force: tips move as commanded, and roll."""

    def __init__(
        self, *angles, radius=0.03, offset=(0.0, 0.0), lag=0.0, moves=1.0, fails_at=math.inf, **parameters
    ):
        self.hand, self.grip, self.time = turning_hand(), Puppet(), 0.0
        self.tip, self.radius, self.moves, self.share = 0.008, radius, moves, STEP / lag if lag else 1.0
        self.center, self.turn = np.array([*offset, 0.0]), 0.0
        self.sideways, self.speed = np.zeros(3), np.zeros(3)
        frames = [self.hand.pose_hand_sensor(i, 0.0) for i in range(3)]
        self.places = np.array([frame.position for frame in frames])
        self.frames = np.array([frame.rotation for frame in frames])
        controller: HoldingGrip = self.grip
        self.controller = TurnInHand(controller, self.hand, STEP, TurnParameters(angles, **parameters))
        self.controller.start(self.seen())
        self.commands = []
        while not self.controller.phase.is_final and self.time < 60.0:
            self.grip.faulty = self.time >= fails_at
            self.commands.append(self.controller.step(self.seen()))
            self.move(np.array(self.commands[-1].finger_velocity or (ZERO,) * 3)[:, 1])
        self.phases = [command.phase for command in self.commands]

    def seen(self):
        """Closed onto the object as it stands, with the contact of each finger."""
        closed, fingers = [], []
        for i, frame in enumerate(self.frames):
            at = self.places[i, :2] + self.sideways[i] * frame[:2, 1] - self.center[:2]
            # how far inwards until the tip's middle is a radius of both from the object's
            along, square = at @ frame[:2, 0], at @ at - (self.tip + self.radius) ** 2
            closed.append(-along - math.sqrt(along**2 - square))
            middle = at + closed[i] * frame[:2, 0]
            normal = np.array([*(-middle / np.linalg.norm(middle)), 0.0])
            centroid = frame.T @ (self.tip * normal) + (0.0, 0.0, self.hand.tip_along)
            felt = (frame.T @ normal, np.zeros(3), 2.0, np.zeros(3), 0.0, 1.0, ContactStatus.OK)
            fingers.append(FingerObservation(self.time, (0.0,) * 6, Contact(centroid, *felt), True))
        joints = (*closed, *self.sideways.tolist())
        self.middles = [np.array(pose.position) for pose in self.hand.sensor_poses(joints)]
        arm = ArmSample(self.time, ZERO, IDENTITY, ZERO)
        return Observation(self.time, arm, tuple(fingers), HandSample(self.time, joints))

    def move(self, wanted):
        """One period: three sideways velocities are the velocity and the rate of the object, by rolling."""
        self.speed = self.speed + self.share * (self.moves * wanted - self.speed)
        # tangential velocity of each tip is that of the object's material: t.(v + w x p) = t.u, u = s y + q x
        rows, right = [], []
        for speed, frame, middle in zip(self.speed, self.frames, self.middles, strict=True):
            out = (middle - self.center)[:2] / np.linalg.norm((middle - self.center)[:2])
            tangent = np.array([-out[1], out[0]])
            # the tip follows inwards so that its middle stays as far from the object's: out.(u - v) = 0
            ratio = (tangent @ frame[:2, 0]) / (out @ frame[:2, 0])
            rows.append([*(tangent - ratio * out), self.radius])
            right.append(speed * (tangent @ frame[:2, 1] - ratio * (out @ frame[:2, 1])))
        vx, vy, rate = np.linalg.solve(np.array(rows), np.array(right))
        self.center = self.center + STEP * np.array([vx, vy, 0.0])
        self.turn += STEP * rate
        self.sideways = self.sideways + STEP * self.speed
        self.time += STEP


ROLLED = {
    "on the axis": ({}, 0.15),
    "small, with lag": ({"radius": 0.015, "lag": 0.04}, 0.15),
    "beside the axis": ({"offset": (0.002, -0.001), "lag": 0.04}, 0.15),
    "small, geometry alone": ({"radius": 0.015, "offset": (0.002, -0.001), "gain": 0.0}, 0.05),
    "geometry alone": ({"offset": (0.002, -0.001), "gain": 0.0}, 0.05),
    "fingers that fall short": ({"moves": 0.9, "lag": 0.04}, 0.15),
}


@pytest.mark.parametrize("name", ROLLED)
def test_a_rolling_body_is_turned_by_the_angle_whatever_its_radius_and_place(name):
    """Geometry alone sends every finger as fast as its contact moves; touch corrects fingers that fall short."""
    options, bound = ROLLED[name]
    rolling = Rolling(ANGLE, **options)
    assert rolling.phases[-1] is Phase.DONE
    assert rolling.turn == pytest.approx(ANGLE, abs=math.radians(bound))
    assert rolling.controller.turn == pytest.approx(rolling.turn, abs=math.radians(0.02))
    # about the hand's axis: an object beside it goes round it
    offset = options.get("offset", (0.0, 0.0))
    assert rolling.center == pytest.approx(spun(rolling.turn) @ (*offset, 0.0), abs=1e-4)


def test_its_motion_is_smooth_and_no_faster_than_allowed():
    rolling = Rolling(ANGLE, rate=0.4, acceleration=0.6, finger_speed=0.006, gain=0.0)
    speeds = np.array([c.finger_velocity for c in rolling.commands if c.finger_velocity])[:, :, 1]
    assert 0.95 * 0.006 < np.abs(speeds).max() <= 0.006 * 1.001
    # the last two periods of a turn may end it at once
    assert np.abs(np.diff(speeds, axis=0)).max() / STEP < 2.0 * 0.6 * rolling.radius


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_infinite_angle_turns_to_the_end_of_travel_and_not_beyond(sign):
    rolling = Rolling(sign * math.inf, lag=0.04)
    assert rolling.phases[-1] is Phase.DONE
    assert rolling.controller.travel_ended
    assert np.abs(rolling.sideways).max() == pytest.approx(0.011, abs=5e-4)
    # the tip moves 11 mm across, which is a = asin(11 / 38) about the object: no slip says R turn = (R + r) a
    assert rolling.turn == pytest.approx(sign * 38.0 / 30.0 * math.asin(11.0 / 38.0), abs=math.radians(1.0))


def test_one_angle_after_the_other_with_never_less_than_the_grips_force():
    """The puppet commands 1.5 N where it wants 2: gears that held it up for a moment take it away the next."""
    rolling = Rolling(0.05, -0.05, 0.0, lag=0.04)
    assert rolling.phases[-1] is Phase.DONE
    assert rolling.turn == pytest.approx(0.0, abs=math.radians(0.15))
    assert rolling.phases.count(Phase.HOLD) >= 3 * round(0.3 / STEP) - 3
    assert {command.grip_force for command in rolling.commands} == {(2.0,) * 3}


def test_an_angle_beyond_the_travel_is_lost_at_its_end_with_the_grip_as_it_is():
    """At once: no patience makes the travel longer. A finger that fails ends the turn after the patience."""
    rolling = Rolling(math.radians(40.0), lag=0.04, patience=20.0)
    assert rolling.phases[-1] is Phase.LOST
    assert rolling.time < 5.0
    assert rolling.controller.travel_ended
    assert rolling.commands[-1].finger_velocity is None
    assert rolling.commands[-1].grip_force == (2.0,) * 3
    assert np.abs(rolling.sideways).max() < 0.0115
    failed = Rolling(ANGLE, fails_at=0.4, patience=0.2)
    assert failed.phases[-1] is Phase.LOST
    assert failed.time == pytest.approx(0.6, abs=5e-3)
    # neither a hand that is not there nor a loose finger can turn
    seen = failed.seen()
    loose = (replace(seen.fingers[0], touching=False), *seen.fingers[1:])
    for changed, message in ({"hand": None}, "no hand"), ({"fingers": loose}, "finger 0"):
        with pytest.raises(InvalidValueError, match=message):
            failed.controller.start(replace(seen, **changed))


def through(change, target):
    """A run whose hand does something else than it is commanded."""
    run = Turned(target)
    step = run.backend.step
    run.backend.step = lambda command: step(change(command) if command.finger_velocity else command)
    return run


@pytest.mark.slow
def test_a_finger_that_stands_still_is_noticed_by_touch():
    run = through(lambda command: replace(command, finger_velocity=(ZERO, *command.finger_velocity[1:])), SPHERE)
    run.turn(ANGLE)
    assert run.commands[-1].phase is Phase.LOST
    assert abs(run.true - ANGLE) > math.radians(2.0)
    assert run.controller.turn == pytest.approx(run.true, abs=math.radians(0.1))
    assert run.slip < 0.02e-3


@pytest.mark.slow
def test_the_check_detects_a_grip_that_is_too_weak():
    """The control that must fail: the hand presses with half of the commanded force."""

    def watch(run):
        if run.moved > 0.5e-3:
            raise StopIteration

    run = through(lambda c: replace(c, grip_force=tuple(0.5 * force for force in c.grip_force)), CYLINDER)
    with pytest.raises(StopIteration):
        run.turn(ANGLE, watch=watch)


BACK_AND_FORTH = (ANGLE, -ANGLE, ANGLE, 0.0)

HELD = {
    "common grip": ({}, BACK_AND_FORTH),
    "shared grip": ({"shared": True}, BACK_AND_FORTH),
    "to the end of travel": ({}, (math.inf,)),
    "to the other end": ({}, (-math.inf,)),
    "beside the axis": ({"offset": 0.001}, (ANGLE,)),
    "farther beside the axis": ({"offset": 0.003}, (ANGLE,)),
} | {
    f"{name}, {friction}": (options | {"load": pull and RampLoad(*pull[:2], 3.8, 0.2, pull[2])}, (ANGLE,))
    for name, pull in PULLS.items()
    for friction, options in {
        "friction plant": {},
        "MuJoCo's friction": {"friction": None, "need": NeedWithoutSpin()},
    }.items()
}


@pytest.mark.slow
@pytest.mark.parametrize("target", [CYLINDER, SPHERE], ids=["cylinder", "sphere"])
@pytest.mark.parametrize("name", HELD)
def test_held_objects_are_turned_and_nothing_slips(target, name):
    """Half a degree, 0.02 mm, 0.2 degrees, and touch that reports the truth; nothing drops."""
    options, angles = HELD[name]
    run, end = Turned(target, **options), angles[-1]
    run.turn(*angles)
    assert run.commands[-1].phase is Phase.DONE
    assert run.true == pytest.approx(run.controller.turn if math.isinf(end) else end, abs=math.radians(0.5))
    assert math.isfinite(end) or math.copysign(1.0, end) * run.true > math.radians(20.0)
    assert run.slip < 0.02e-3
    assert run.spin < math.radians(0.2)
    assert run.off < math.radians(0.2)
    assert abs(run.sunk) < 0.2e-3  # a contact that carries 0.7 N yields elastically by 0.13 mm
    assert all(finger.touching for finger in run.backend.truth().fingers)
