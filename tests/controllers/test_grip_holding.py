"""A box in the simulated hand: pulled at off centre, and nudged before the lift within the limits."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.grip_plan import CommonGrip
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.need import NeedWithoutSpin, least_grip_of_two
from palpate.controllers.grip.nudge import NudgeAndLift, NudgeController, NudgedSurface, NudgeParameters, Ramped
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime import Limits
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
from palpate.spatial import ZERO, subtract

PERIOD, MASS = 1e-3, 0.1

BOX = Box((0.06, 0.05, 0.06))

LIFT = LiftParameters(height=0.04, speed=0.06, acceleration=0.3)

BRISTLES = FrictionLaw(0.5, 0.5, spin_length=0.004, stiffness=5e3)

PULLED_FROM = 2.3
"""[s] By then it is lifted."""

KNOWN = LimitSurface(0.5, 0.004)


def sensed(scene, **options):
    """A back end of a grasp scene, and the touch of all its fingers."""
    backend, hand = HandBackend(scene, PERIOD, **options), scene.hand
    return backend, Touch(*[Finger(t.surface, SensorPayload(t.mass, t.center_of_mass)) for t in hand.tips])


class Held:
    """A lift under observation."""

    def __init__(self, load, need=None, hand=None, shape=BOX, friction=None):
        scene = build_grasp_scene(
            hand or two_finger_hand(),
            HeldObject(shape, MASS),
            GraspContact(friction=0.5, spin_length=0.004),
            carrier=Lift(),
            table=Table(-0.03),
            friction=friction,
        )
        self.backend, self.touch = sensed(scene, sensor=white_noise(0.01, 1e-4, seed=1), load=load)
        known, fingers = KnownSurface(KNOWN), scene.hand.fingers
        self.grip = SlipSafeGrip(fingers, known, PERIOD, plan=CommonGrip(fingers, known, PERIOD, need=need))
        self.controller = LiftController(self.grip, PERIOD, LIFT)
        self.now = self.touch.sense(self.backend.start())
        self.controller.start(self.now)

    def until(self, time, watch=lambda: None):
        while self.now.time < time:
            self.now = self.touch.sense(self.backend.step(self.controller.step(self.now)))
            watch()

    def in_hand(self):
        """Height of the object below the hand [m], and how far it has turned [rad]."""
        truth = self.backend.truth()
        turned = 2.0 * math.acos(min(1.0, abs(truth.quat_wxyz[0])))
        return self.now.arm.position_base_tip[2] - truth.position[2], turned

    def grips(self):
        """Mean grip of the two fingers and the least one that holds the load [N]."""
        truth = self.backend.truth()
        a, b, c, *moment = self.backend.pull
        at = (subtract(finger.position, truth.position) for finger in truth.fingers)
        least = least_grip_of_two(KNOWN, (a, b, c - MASS * GRAVITY, *moment), *at)
        return np.mean([abs(finger.force[0]) for finger in truth.fingers]), least


def ramp(offset, after=3.0, duration=0.5):
    return RampLoad((0.0, 0.0, 0.0), (0.0, 0.0, -after), PULLED_FROM, duration, (0.0, offset, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize(("offset", "duration"), [(0.006, 0.5), (0.008, 0.05)], ids=["ramp", "step"])
def test_an_object_pulled_at_beside_the_contacts_neither_slips_nor_spins(offset, duration):
    held, rows = Held(ramp(offset, duration=duration)), []
    held.until(PULLED_FROM)
    before = held.in_hand()
    held.until(PULLED_FROM + 1.0, lambda: rows.append(held.grips()))
    grips, leasts = np.array(rows).T
    sunk, turned = np.abs(np.subtract(held.in_hand(), before))
    assert sunk < 2e-6
    assert turned < math.radians(0.02)
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
    held, slips = Held(pull, friction=BRISTLES), []
    held.until(PULLED_FROM)

    def watch():
        first, second = held.backend.rubbing
        slips.append([(math.hypot(*each.slip_velocity), abs(each.slip_spin)) for each in (first, second)])

    held.until(PULLED_FROM + 1.2, watch)
    way, spin = PERIOD * np.max(slips, axis=1).sum(axis=0)
    assert way < 2e-5
    assert spin < math.radians(0.2)


@pytest.mark.slow
def test_three_fingers_hold_with_the_same_control():
    held = Held(ramp(0.0, 2.0), hand=three_finger_hand(), shape=SphereObject(0.03))
    held.until(PULLED_FROM + 0.2)
    height, _ = held.in_hand()
    held.until(PULLED_FROM + 1.0)
    assert abs(held.in_hand()[0] - height) < 2e-5


def nudged(belief=None, sensor=None, friction=None, contact=None, **parameters):
    """Nudge a box on a table until done; returns the nudge, the way of the box, and rows of (now, command)."""
    hand, rows = two_finger_hand(), []
    scene = build_grasp_scene(
        hand,
        HeldObject(BOX, MASS),
        contact or GraspContact(),
        TurningStage(),
        table=Table(-0.03),
        friction=friction,
    )
    backend, touch = sensed(scene, sensor=sensor)
    options = {"grip": 2.0, "center": (0.0, 0.0, -(hand.depth + hand.tip_along))} | parameters
    nudge, belief = NudgeController(2, PERIOD, NudgeParameters(**options)), belief or NudgedSurface(KNOWN)
    both = NudgeAndLift(nudge, belief, LiftController(SlipSafeGrip(2, belief, PERIOD), PERIOD))
    now = touch.sense(backend.start())
    both.start(now)
    before = backend.truth().position
    while not nudge.done:
        rows.append((now, both.step(now)))
        now = touch.sense(backend.step(rows[-1][1]))
    way = math.dist(backend.truth().position, before)
    return nudge, way, [*rows, (now, both.step(now))]


@pytest.mark.parametrize("friction", [None, "bristles"], ids=["MuJoCo's friction", "friction plant"])
def test_a_nudge_before_the_lift_measures_friction_and_spin_length(friction):
    """mu within 3 %, e within 5 %, while the box stays where it stands."""
    mu, e, belief = 0.4, 0.003, NudgedSurface(LimitSurface(0.35, 0.002))
    plant = friction and replace(BRISTLES, static_friction=mu, kinetic_friction=mu, spin_length=e)
    contact = GraspContact(friction=mu, spin_length=e)
    nudge, way, rows = nudged(belief, sensor=white_noise(0.01, 1e-4), friction=plant, contact=contact)
    assert way < 5e-4
    assert nudge.friction == pytest.approx((mu, mu), rel=0.03)
    assert nudge.spin_length == pytest.approx((e, e), rel=0.05)
    assert rows[-1][1].phase is Phase.APPROACH
    assert belief.surface(1) == LimitSurface(nudge.friction[1], nudge.spin_length[1])


def test_a_nudge_without_slip_measures_nothing():
    """A stroke of a tenth of the elastic travel: the plan keeps the surface that was known before."""
    belief, quiet = NudgedSurface(LimitSurface(0.35, 0.002)), white_noise(1e-3, 1e-5)
    short = {"grip": 3.0, "stroke": 1e-4, "speed": 1e-3, "angle": 0.02, "spin": 0.1}
    nudge, _, _ = nudged(belief, sensor=quiet, friction=BRISTLES, **short)
    assert nudge.friction == nudge.spin_length == (None, None)
    assert belief.surface(0) == LimitSurface(0.35, 0.002)


sizes = st.floats(1e-3, 1e2)


@settings(max_examples=200)
@given(sizes, sizes, sizes, st.floats(0.0, 1.0), st.floats(0.0, 0.5))
def test_the_distance_is_the_integral_of_the_speed(way, speed, acceleration, share, step):
    """By trapezoids, exact on each straight piece; neither speed nor acceleration exceed their limits."""
    motion = Ramped(way, speed, acceleration)
    end, dt = share * motion.duration, step * motion.duration
    corners = (motion.corner, motion.duration - motion.corner)
    times = sorted({0.0, end, *(t for t in corners if 0.0 < t < end)})
    gone = sum(0.5 * (b - a) * (motion.speed(a) + motion.speed(b)) for a, b in pairwise(times))
    assert gone == pytest.approx(way * motion.progress(end), rel=1e-9, abs=1e-12 * way)
    assert motion.progress(motion.duration) == pytest.approx(1.0)
    assert motion.speed(0.0) == 0.0
    assert motion.speed(motion.duration) == pytest.approx(0.0, abs=1e-9 * speed)
    assert 0.0 <= motion.speed(end) <= speed * (1.0 + 1e-12)
    assert abs(motion.speed(end + dt) - motion.speed(end)) <= acceleration * dt + 1e-9 * speed
    # too short for its speed: 2 sqrt(way / acceleration), whatever the speed
    assert Ramped(0.01, 1.0, 1.0).duration == Ramped(0.01, 100.0, 1.0).duration == pytest.approx(0.2)


def test_a_default_nudge_keeps_the_supervisors_limits():
    """Limits of speeds and of their change from period to period, with room to spare; it ends at rest."""
    nudge, _, rows = nudged()
    limits, parameters, rows = Limits(), nudge._parameters, rows[:-1]
    velocity = np.array([command.velocity_base_tip for _, command in rows])
    turning = np.array([command.angular_velocity_base_tip for _, command in rows])
    touched = next(now.time for now, _ in rows if all(each.touching for each in now.fingers))
    speeds, rates = np.linalg.norm(velocity, axis=1), np.linalg.norm(turning, axis=1)
    steps, twists = (np.linalg.norm(np.diff(x, axis=0, prepend=[ZERO]), axis=1).max() for x in (velocity, turning))
    assert steps <= 0.5 * limits.acceleration * PERIOD
    assert twists <= 0.5 * limits.angular_acceleration * PERIOD
    assert speeds.max() <= limits.speed
    assert rates.max() == pytest.approx(parameters.spin, rel=0.02)
    assert np.abs(turning[:, 0]).sum() * PERIOD == pytest.approx(2.0 * parameters.angle, rel=0.01)
    assert -velocity[rates == 0.0, 2].sum() * PERIOD == pytest.approx(parameters.stroke, rel=0.01)
    assert speeds[-1] == rates[-1] == 0.0
    assert rows[-1][0].time + PERIOD - touched == pytest.approx(parameters.duration, abs=0.02)
