"""A grip that is told something wrong, or nothing: one odd sample, a frozen sensor, a finger that fails."""

import math

import numpy as np
import pytest

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.load_ahead import ODD_FORCE, LoadAhead
from palpate.controllers.grip.nudge import NudgeController, NudgeParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.belief import FrictionBelief
from palpate.friction.slip.fingers import LearntSurface
from palpate.runtime.data import ArmSample, Observation, Phase
from palpate.sensing.ft.health import HealthCheck, SampleHealth
from palpate.spatial import IDENTITY, ZERO
from support.felt_finger import finger

PERIOD = 1e-3
SURFACE = LimitSurface(0.5, 0.004)
ARM = ArmSample(0.0, ZERO, IDENTITY, ZERO)


def observed(time, *fingers):
    return Observation(time, ARM, fingers)


BROKEN = finger(0.5, health=SampleHealth(HealthCheck.FROZEN))
ABSENT = finger(0.0, 0.0, 0.0, touching=False)


# --- one odd sample


@pytest.mark.parametrize(("force", "torque"), [(2.0, 0.0), (20.0, 0.0), (-1e3, 0.0), (1.0, 0.1)])
def test_one_odd_sample_neither_raises_the_grip_nor_passes_for_slip(force, torque):
    grip = SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD)
    grip.start(3.0)
    targets = []
    for k in range(2000):
        odd = finger(force, torque, grip.target) if k == 1500 else finger(1.0, 0.0, grip.target)
        grip.step(observed(k * PERIOD, odd, finger(1.0, 0.0, grip.target)))
        targets.append(grip.target)
    assert max(targets[1500:]) <= targets[1499] * 1.001
    assert grip.regrips == 0


def test_a_load_that_jumps_and_stays_is_followed_one_sample_later():
    ahead = LoadAhead(0.004, PERIOD)
    for k in range(200):
        ahead.step(ContactLoad(3.0, (1.0 if k < 100 else 1.0 + 10.0 * ODD_FORCE, 0.0, 0.0), 0.0))
        if k == 100:
            assert ahead.ahead(0.0)[0] == pytest.approx(1.0)
        if k == 101:
            assert ahead.ahead(0.0)[0] > 1.0 + 3.0 * ODD_FORCE
    assert ahead.ahead(0.0)[0] == pytest.approx(1.0 + 10.0 * ODD_FORCE)


# --- slips that go on


class Slipping:
    """A `SlipWatch` to which the first finger slips from a period on until another."""

    def __init__(self, first, last):
        self.first, self.last, self.k, self.slipping = first, last, -1, False

    def start(self):
        """Nothing to do."""

    def step(self, time, loads):
        self.k += 1
        before, self.slipping = self.slipping, self.first <= self.k < self.last
        return (self.slipping and not before, False)


def test_a_load_under_which_it_goes_on_slipping_is_not_taken_for_held():
    """Heavier by half than what began to slip, for long enough for many blocks."""
    learnt = LearntSurface(lambda: FrictionBelief(0.6, 0.004, friction_deviation=0.3, spin_length_deviation=0.4))
    grip = SlipSafeGrip(2, learnt, PERIOD, watch=Slipping(100, 600))
    grip.start(3.0)
    for k in range(600):
        force = 0.5 if k < 100 else 1.5 if k == 100 else 2.2
        grip.step(observed(k * PERIOD, finger(force), finger(force)))
        if k == 101:
            told = learnt.surface(0).friction
    assert learnt.surface(0).friction == told < 0.5


# --- a finger that fails while it lifts

QUICK = LiftParameters(settle_time=0.05, height=0.002, hold_time=0.2, close_time=1.0, patience=0.3)


def lifted(fingers_at, seconds):
    lift = LiftController(SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD), PERIOD, QUICK)
    lift.start(observed(0.0, *fingers_at(0.0)))
    commands = []
    for k in range(round(seconds / PERIOD)):
        commands.append(lift.step(observed(k * PERIOD, *fingers_at(k * PERIOD))))
        if commands[-1].phase.is_final:
            break
    return commands


def test_a_healthy_lift_is_done():
    assert lifted(lambda t: (finger(0.5), finger(0.5)), 3.0)[-1].phase is Phase.DONE


def test_fingers_that_find_nothing_give_up():
    commands = lifted(lambda t: (finger(0.5), ABSENT), 3.0)
    assert commands[-1].phase is Phase.LOST
    assert len(commands) * PERIOD == pytest.approx(QUICK.close_time, abs=0.01)


def test_a_nudge_that_finds_nothing_gives_up():
    nudge = NudgeController(2, PERIOD, NudgeParameters(2.0, ZERO, close_time=0.5))
    nudge.start(observed(0.0, finger(0.5), ABSENT))
    phases = [nudge.step(observed(k * PERIOD, finger(0.5), ABSENT)).phase for k in range(600)]
    assert phases.index(Phase.LOST) * PERIOD == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("fails", [0.08, 0.25, 0.4, 0.45])
@pytest.mark.parametrize("failed", [BROKEN, ABSENT], ids=["sensor", "contact"])
def test_a_lift_ends_held_where_a_finger_fails_and_is_never_done_then(fails, failed):
    commands = lifted(lambda t: (finger(0.5), finger(0.5) if t < fails else failed), 3.0)
    last = commands[-1]
    assert last.phase is Phase.LOST
    assert last.velocity_base_tip == ZERO
    assert min(last.grip_force) >= min(commands[round(fails / PERIOD) - 1].grip_force)


def test_a_finger_that_fails_for_a_moment_ends_nothing():
    commands = lifted(lambda t: (finger(0.5), BROKEN if 0.4 < t < 0.6 else finger(0.5)), 3.0)
    assert commands[-1].phase is Phase.DONE


# --- a nudge


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_sensor_that_stands_still_is_no_plateau(noise):
    """What it shows is a load like any other, and believed."""
    rng = np.random.default_rng(2)
    nudge = NudgeController(2, PERIOD, NudgeParameters(2.0, ZERO))
    nudge.start(observed(0.0, finger(0.5), finger(0.5)))
    for k in range(10000):
        a, b = noise * rng.standard_normal(2)
        shown = finger(1.0 + a, 2e-3 * (1.0 + b), 2.0)
        nudge.step(observed(k * PERIOD, shown, shown))
        if nudge.done:
            break
    assert nudge.done
    assert nudge.friction == nudge.spin_length == (None, None)


def test_what_was_loaded_a_little_before_is_found_all_the_same():
    """A third of mu f_n from closing, 0.4 mm of elastic travel, and a twist that turns back as far as it went."""
    mu, e, grip = 0.6, 0.003, 2.0
    nudge = NudgeController(1, PERIOD, NudgeParameters(grip, ZERO))
    pull, twist = 0.33 * mu * grip, 0.0
    shown = finger(pull, twist, grip)
    nudge.start(observed(0.0, shown))
    for k in range(10000):
        command = nudge.step(observed(k * PERIOD, shown))
        if nudge.done:
            break
        pull = min(pull - command.velocity_base_tip[2] * PERIOD * mu * grip / 4e-4, mu * grip)
        twist += command.angular_velocity_base_tip[0] * PERIOD * mu * e * grip / 0.05
        twist = math.copysign(min(abs(twist), mu * e * grip), twist)
        left = pull if abs(twist) == 0.0 else 0.0
        shown = finger(left, twist, grip)
    assert nudge.friction == pytest.approx((mu,), rel=0.01)
    assert nudge.spin_length == pytest.approx((e,), rel=0.01)
