"""A box held by the simulated hand, off centre and pulled at: nothing slips, unless spin is ignored."""

import math
from dataclasses import replace

import numpy as np
import pytest

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.grip_plan import CommonGrip
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.need import NeedWithoutSpin, least_grip_of_two
from palpate.controllers.grip.nudge import NudgeAndLift, NudgeController, NudgedSurface, NudgeParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import Phase
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, Lift, SphereObject, TurningStage, white_noise
from palpate.sim.fidelity import GRAVITY
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.load import RampLoad, ShakenLoad, SumOfLoads
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.spatial import subtract

PERIOD, MASS = 1e-3, 0.1
BOX = Box((0.06, 0.05, 0.06))
KNOWN = LimitSurface(0.5, 0.004)
LIFT = LiftParameters(height=0.04, speed=0.06, acceleration=0.3)
BRISTLES = FrictionLaw(0.5, 0.5, spin_length=0.004, stiffness=5e3)
PULLED_FROM = 2.3
"""[s] By then it is lifted."""


class Held:
    """A run, watched."""

    def __init__(self, load, need=None, hand=None, shape=BOX, friction=None, seed=1):
        scene = build_grasp_scene(
            hand or two_finger_hand(),
            HeldObject(shape, MASS),
            GraspContact(friction=0.5, spin_length=0.004),
            carrier=Lift(),
            table=Table(-0.03),
            friction=friction,
        )
        self.backend = HandBackend(scene, PERIOD, sensor=white_noise(0.01, 1e-4, seed=seed), load=load)
        hand = scene.hand
        carried = hand.tips[0]
        tip = Finger(carried.surface, SensorPayload(carried.mass, carried.center_of_mass))
        self.touch = Touch(*[tip] * hand.fingers)
        known = KnownSurface(KNOWN)
        plan = CommonGrip(hand.fingers, known, PERIOD, need=need)
        self.grip = SlipSafeGrip(hand.fingers, known, PERIOD, plan=plan)
        self.controller = LiftController(self.grip, PERIOD, LIFT)
        self.now = self.touch.sense(self.backend.start())
        self.controller.start(self.now)

    def until(self, time):
        grips, leasts = [], []
        while self.now.time < time:
            command = self.controller.step(self.now)
            self.now = self.touch.sense(self.backend.step(command))
            truth = self.backend.truth()
            if len(truth.fingers) == 2 and self.now.time > PULLED_FROM:
                a, b, c, d, e, f = self.backend.pull
                at = (subtract(finger.position, truth.position) for finger in truth.fingers)
                leasts.append(least_grip_of_two(KNOWN, (a, b, c - MASS * GRAVITY, d, e, f), *at))
                grips.append(np.mean([abs(finger.force[0]) for finger in truth.fingers]))
        return np.array(grips), np.array(leasts)

    def in_hand(self):
        """Height of the object below the hand [m], and how far it has turned [rad]."""
        truth = self.backend.truth()
        turned = 2.0 * math.acos(min(1.0, abs(truth.quat_wxyz[0])))
        return self.now.arm.position_base_tip[2] - truth.position[2], turned


def ramp(offset, after=3.0, duration=0.5):
    return RampLoad((0.0, 0.0, 0.0), (0.0, 0.0, -after), PULLED_FROM, duration, (0.0, offset, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize(("offset", "duration"), [(0.006, 0.5), (0.008, 0.05)], ids=["ramp", "step"])
def test_an_object_pulled_at_beside_the_contacts_neither_slips_nor_spins(offset, duration):
    held = Held(ramp(offset, duration=duration))
    held.until(PULLED_FROM)
    height, turned = held.in_hand()
    grips, leasts = held.until(PULLED_FROM + 1.0)
    after, turned_after = held.in_hand()
    assert abs(after - height) < 2e-6
    assert abs(turned_after - turned) < math.radians(0.02)
    assert (grips / leasts).min() > 0.97
    assert grips.mean() / leasts.mean() < 1.3
    assert not held.grip.faulty


def test_ignoring_spin_lets_it_spin():
    held = Held(ramp(0.006), NeedWithoutSpin())
    held.until(PULLED_FROM + 1.0)
    assert held.in_hand()[1] > math.radians(20.0)


@pytest.mark.slow
def test_by_the_friction_plant_no_contact_slips_under_load_and_shaking():
    pull = SumOfLoads((ramp(0.004, 2.0), ShakenLoad((0.0, 0.5, 0.5), 5.0, begin=PULLED_FROM + 0.5)))
    held = Held(pull, friction=BRISTLES)
    held.until(PULLED_FROM)
    way = spin = 0.0
    for _ in range(1200):
        held.until(held.now.time + 0.5 * PERIOD)
        assert len(held.backend.rubbing) == 2
        way += max(math.hypot(*contact.slip_velocity) for contact in held.backend.rubbing) * PERIOD
        spin += max(abs(contact.slip_spin) for contact in held.backend.rubbing) * PERIOD
    assert way < 2e-5
    assert spin < math.radians(0.2)


@pytest.mark.slow
def test_three_fingers_hold_with_the_same_control():
    held = Held(ramp(0.0, 2.0), hand=three_finger_hand(), shape=SphereObject(0.03))
    held.until(PULLED_FROM + 0.2)
    height, _ = held.in_hand()
    held.until(PULLED_FROM + 1.0)
    assert abs(held.in_hand()[0] - height) < 2e-5


@pytest.mark.parametrize("friction", [None, "bristles"], ids=["MuJoCo's friction", "friction plant"])
def test_a_nudge_before_the_lift_tells_friction_and_spin_length(friction):
    """mu within 3 %, e within 5 %, while the box stays where it stands."""
    mu, e, hand = 0.4, 0.003, two_finger_hand()
    scene = build_grasp_scene(
        hand,
        HeldObject(BOX, MASS),
        GraspContact(friction=mu, spin_length=e),
        carrier=TurningStage(),
        table=Table(-0.03),
        friction=friction and replace(BRISTLES, static_friction=mu, kinetic_friction=mu, spin_length=e),
    )
    backend = HandBackend(scene, PERIOD, sensor=white_noise(0.01, 1e-4))
    finger = Finger(hand.tip.surface, SensorPayload(hand.tip.mass, hand.tip.center_of_mass))
    touch, belief = Touch(finger, finger), NudgedSurface(LimitSurface(0.35, 0.002))
    nudge = NudgeController(2, PERIOD, NudgeParameters(2.0, (0.0, 0.0, -(hand.depth + hand.tip_along))))
    both = NudgeAndLift(nudge, belief, LiftController(SlipSafeGrip(2, belief, PERIOD), PERIOD))
    now = touch.sense(backend.start())
    both.start(now)
    before = backend.truth().position
    while not nudge.done:
        now = touch.sense(backend.step(both.step(now)))
    assert math.dist(backend.truth().position, before) < 5e-4
    assert nudge.friction == pytest.approx((mu, mu), rel=0.03)
    assert nudge.spin_length == pytest.approx((e, e), rel=0.05)
    command = both.step(now)
    assert command.phase is Phase.APPROACH
    assert belief.surface(1) == LimitSurface(nudge.friction[1], nudge.spin_length[1])


def test_what_does_not_slip_tells_nothing():
    """A stroke of a tenth of the elastic travel: the least that was known before stays what is planned with."""
    hand = two_finger_hand()
    scene = build_grasp_scene(
        hand, HeldObject(BOX, MASS), carrier=TurningStage(), table=Table(-0.03), friction=BRISTLES
    )
    backend = HandBackend(scene, PERIOD, sensor=white_noise(1e-3, 1e-5))
    finger = Finger(hand.tip.surface, SensorPayload(hand.tip.mass, hand.tip.center_of_mass))
    touch, center = Touch(finger, finger), (0.0, 0.0, -(hand.depth + hand.tip_along))
    nudge = NudgeController(2, PERIOD, NudgeParameters(3.0, center, stroke=1e-4, speed=1e-3, angle=0.02, spin=0.1))
    now = touch.sense(backend.start())
    nudge.start(now)
    while not nudge.done:
        now = touch.sense(backend.step(nudge.step(now)))
    assert nudge.friction == nudge.spin_length == (None, None)
    belief = NudgedSurface(LimitSurface(0.35, 0.002))
    belief.learn(0, nudge.friction[0], nudge.spin_length[0])
    assert belief.surface(0) == LimitSurface(0.35, 0.002)
