"""A held box let turn by its own weight: to the angle, by normality no further down, and never dropped."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.hand_motion import MoveAlong
from palpate.controllers.grip.in_turn import InTurn
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.motion_source import HandJoint
from palpate.controllers.grip.pivot import PivotController, PivotParameters
from palpate.controllers.grip.slide import SlideController, SlideParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.errors import InvalidValueError
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import Phase
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import Payload
from palpate.sim import Box, Stage, white_noise
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.passive import SLIDE, TURN, WatchedHand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table

PERIOD, E, MU = 1e-3, 0.004, 0.5
KNOWN = LimitSurface(MU, E)
OFFSET = 0.012
LIFT = LiftParameters(first_grip=8.0, settle_time=0.3, height=0.04, speed=0.1, acceleration=0.5, hold_time=0.1)


@dataclass
class Blind:
    """A source that says nothing from a time on."""

    index: int
    until: float

    def read(self, now):
        return HandJoint(self.index).read(now) if now.time < self.until else None


class Slipping:
    """A box gripped, lifted, and let slip."""

    def __init__(self, make, beside=0.0, above=0.0, believed=KNOWN, seed=3):
        hand = two_finger_hand()
        scene = build_grasp_scene(
            hand,
            HeldObject(Box((0.06, 0.05, 0.06)), 0.1),
            GraspContact(friction=MU, spin_length=E),
            carrier=Stage(),
            table=Table(-0.03),
            palm=(0.0, -beside, above + hand.depth + hand.tip_along),
        )
        self.hand = WatchedHand(HandBackend(scene, PERIOD, sensor=white_noise(0.01, 1e-4, seed=seed)), seed=seed)
        finger = Finger(hand.tip.surface, Payload(hand.tip.mass, hand.tip.center_of_mass))
        self.touch = Touch(finger, finger)
        belief = KnownSurface(believed)
        self.grip = SlipSafeGrip(2, belief, PERIOD)
        rotations = tuple(hand.pose_hand_sensor(i, 0.0).rotation for i in range(2))
        self.slips = make(self.grip, belief, rotations)
        lift = LiftController(self.grip, PERIOD, LIFT)
        self.controller = InTurn(lift, self.slips)
        self.samples, self.commands = [], []
        self.now = self._take(self.hand.start())
        self.controller.start(self.now)

    def _take(self, sample):
        self.samples.append(sample)
        return self.touch.sense(sample)

    def run(self, longest=12.0):
        """Run to the end; return the final phase."""
        command = None
        while self.now.time < longest:
            command = self.controller.step(self.now)
            self.commands.append(command)
            if command.phase.is_final and self.controller.at == 1:
                break
            self.now = self._take(self.hand.step(command))
        return command.phase

    @property
    def held(self):
        return all(each.touching for each in self.hand.backend.truth().fingers)


def pivoting(angle, source=None, along=False, **parameters):
    def make(grip, belief, rotations):
        hand = MoveAlong(belief, rotations) if along else None
        given = PivotParameters(math.radians(angle), **parameters)
        return PivotController(grip, belief, source or HandJoint(TURN), PERIOD, given, hand)

    return make


def sliding(way, **parameters):
    def make(grip, belief, rotations):
        return SlideController(grip, belief, HandJoint(SLIDE), PERIOD, SlideParameters(way, **parameters))

    return make


@pytest.fixture(scope="module")
def pivoted():
    run = Slipping(pivoting(30.0), beside=OFFSET)
    run.run()
    return run


@pytest.mark.slow
def test_a_box_is_pivoted_to_the_angle_and_slips_no_further_than_by_normality(pivoted):
    came = pivoted.hand.in_hand
    assert pivoted.commands[-1].phase is Phase.DONE
    assert pivoted.held
    assert math.degrees(came.turn) == pytest.approx(30.0, abs=1.0)
    by_normality = E**2 / OFFSET * came.turn
    assert 0.7 * by_normality < math.hypot(came.slide, came.across) < 1.3 * by_normality


def test_the_grip_never_goes_below_what_the_weight_alone_needs(pivoted):
    scan = [c.grip_force[0] for c in pivoted.commands if c.phase is Phase.SCAN]
    assert len(scan) > 100
    assert min(scan) > 0.1 * 9.81 / 2.0 / MU


def test_a_recorded_run_replays_bit_for_bit(pivoted):
    """With nothing but the samples: the angle came in them."""
    again = Slipping(pivoting(30.0), beside=OFFSET)
    again.touch.start()
    again.controller.start(again.touch.sense(pivoted.samples[0]))
    again.touch.start()
    replayed = [again.controller.step(again.touch.sense(sample)) for sample in pivoted.samples]
    assert replayed == pivoted.commands


@pytest.mark.slow
def test_the_hand_moves_along_so_that_the_point_stays_where_it_is():
    run = Slipping(pivoting(30.0, along=True), beside=OFFSET)
    height = run.now.arm.position_base_tip[2]
    assert run.run() is Phase.DONE
    came, rose = run.hand.in_hand, run.now.arm.position_base_tip[2] - height - LIFT.height
    assert math.degrees(came.turn) == pytest.approx(30.0, abs=1.0)
    assert rose > 0.4e-3
    assert math.hypot(came.slide - rose, came.across) < 0.3e-3


def test_what_the_weight_turns_the_other_way_is_given_up_and_held():
    run = Slipping(pivoting(-30.0), beside=OFFSET)
    assert run.run() is Phase.LOST
    assert run.held
    assert abs(run.hand.in_hand.turn) < math.radians(0.1)


@pytest.mark.slow
def test_a_wrong_belief_of_friction_costs_no_accuracy():
    run = Slipping(pivoting(30.0), beside=OFFSET, believed=LimitSurface(0.8 * MU, 0.8 * E))
    assert run.run() is Phase.DONE
    assert math.degrees(run.hand.in_hand.turn) == pytest.approx(30.0, abs=1.0)


def test_without_readings_it_brakes_and_gives_up():
    run = Slipping(pivoting(30.0, source=Blind(TURN, 3.0)), beside=OFFSET)
    assert run.run() is Phase.LOST
    assert run.held
    assert any(c.phase is Phase.SCAN for c in run.commands)
    assert math.degrees(run.hand.in_hand.turn) < 29.0


@pytest.mark.slow
def test_a_box_slides_by_the_way_and_does_not_turn():
    run = Slipping(sliding(0.005), above=0.01)
    assert run.run() is Phase.DONE
    came = run.hand.in_hand
    assert run.held
    assert came.slide == pytest.approx(0.005, abs=2e-4)
    assert abs(came.turn) < math.radians(0.2)


@pytest.mark.slow
def test_a_slide_that_would_turn_is_given_up():
    run = Slipping(sliding(0.005, largest_turn=0.05), beside=0.002, above=0.01)
    assert run.run() is Phase.LOST
    assert run.held
    assert abs(run.hand.in_hand.slide) < 0.004


def test_nothing_slides_up():
    run = Slipping(sliding(-0.005), above=0.01)
    assert run.run() is Phase.LOST
    assert abs(run.hand.in_hand.slide) < 1e-4


def test_the_turn_is_told_about_the_first_fingers_normal_with_the_noise_that_was_asked_for(pivoted):
    """The weight beside +y drags that side down: about -x, the way the first finger points, so above 0."""
    turns = np.array([s.hand.joint_position[TURN] for s in pivoted.samples[100:400]])
    times = [s.hand.time for s in pivoted.samples]
    assert pivoted.hand.in_hand.turn > 0.0
    fresh = turns[np.flatnonzero(np.diff(times[99:400]))]
    assert np.std(fresh) == pytest.approx(math.radians(0.2), rel=0.2)


def test_a_hand_of_three_fingers_has_no_line_to_turn_about():
    scene = build_grasp_scene(three_finger_hand(), HeldObject(Box((0.03, 0.03, 0.06)), 0.1), GraspContact())
    with pytest.raises(InvalidValueError, match="take a hand of two"):
        WatchedHand(HandBackend(scene, PERIOD))
