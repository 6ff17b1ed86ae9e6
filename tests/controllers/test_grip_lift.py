"""Lifting and setting down: failing fingers, a load taken up slowly, a release only on the table."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.grasp import GROWN, GROWN_BY, SLOW, GraspController, GraspStage, SetDownParameters
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.load_ahead import ODD_FORCE, LoadAhead
from palpate.controllers.grip.nudge import NudgeController, NudgeParameters
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.belief import FrictionBelief
from palpate.friction.slip.fingers import LearntSurface
from palpate.runtime.data import Phase
from palpate.spatial import ZERO
from support.felt_finger import BROKEN, finger, grip_load, observed

PERIOD = 1e-3

SURFACE = LimitSurface(0.5, 0.004)

ABSENT = finger(0.0, 0.0, 0.0, touching=False)


@pytest.mark.parametrize(("force", "torque"), [(2.0, 0.0), (20.0, 0.0), (-1e3, 0.0), (1.0, 0.1)])
def test_one_odd_sample_neither_raises_the_grip_nor_passes_for_slip(force, torque):
    grip = SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD)
    grip.start(3.0)
    _, targets = grip_load(grip, lambda t: (1.0, 0.0), 1500)
    grip.step(observed(1.5, finger(force, torque, grip.target), finger(1.0, 0.0, grip.target)))
    _, after = grip_load(grip, lambda t: (1.0, 0.0), 499, 1501)
    assert after.max() <= targets[-1] * 1.001
    assert grip.regrips == 0


def test_a_load_that_jumps_and_stays_is_followed_one_sample_later():
    ahead, forces = LoadAhead(0.004, PERIOD), []
    for k in range(200):
        ahead.step(ContactLoad(3.0, (1.0 if k < 100 else 1.0 + 10.0 * ODD_FORCE, 0.0, 0.0), 0.0))
        forces.append(ahead.ahead(0.0)[0])
    assert (forces[100], forces[-1]) == pytest.approx((1.0, 1.0 + 10.0 * ODD_FORCE))
    assert forces[101] > 1.0 + 3.0 * ODD_FORCE


# --- slips that go on


def test_a_load_under_which_it_goes_on_slipping_is_not_taken_for_held():
    """Heavier by half than the load that began to slip, for long enough for many blocks."""
    learnt = LearntSurface(lambda: FrictionBelief(0.6, 0.004, friction_deviation=0.3, spin_length_deviation=0.4))
    watch = SimpleNamespace(start=lambda: None, slipping=False)
    watch.step = lambda time, loads: (watch.slipping and round(time / PERIOD) == 100, False)
    grip, found = SlipSafeGrip(2, learnt, PERIOD, watch=watch), []
    grip.start(3.0)
    for k in range(600):
        watch.slipping, force = k >= 100, 0.5 if k < 100 else 1.5 if k == 100 else 2.2
        grip.step(observed(k * PERIOD, finger(force), finger(force)))
        found.append(learnt.surface(0).friction)
    assert found[-1] == found[101] < 0.5


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


def test_fingers_that_find_nothing_give_up():
    """A lift and a nudge alike; a healthy lift is done, also after a failure for a moment."""
    assert lifted(lambda t: (finger(0.5), finger(0.5)), 3.0)[-1].phase is Phase.DONE
    moment = lifted(lambda t: (finger(0.5), BROKEN_FINGER if 0.4 < t < 0.6 else finger(0.5)), 3.0)
    assert moment[-1].phase is Phase.DONE
    commands = lifted(lambda t: (finger(0.5), ABSENT), 3.0)
    assert commands[-1].phase is Phase.LOST
    assert len(commands) * PERIOD == pytest.approx(QUICK.close_time, abs=0.01)
    nudge = NudgeController(2, PERIOD, NudgeParameters(2.0, ZERO, close_time=0.5))
    nudge.start(observed(0.0, finger(0.5), ABSENT))
    phases = [nudge.step(observed(k * PERIOD, finger(0.5), ABSENT)).phase for k in range(600)]
    assert phases.index(Phase.LOST) * PERIOD == pytest.approx(0.5, abs=0.01)


BROKEN_FINGER = finger(0.5, health=BROKEN)


@pytest.mark.parametrize(
    ("failed", "fails"), [(BROKEN_FINGER, 0.08), (BROKEN_FINGER, 0.4), (ABSENT, 0.25), (ABSENT, 0.45)]
)
def test_a_lift_ends_held_where_a_finger_fails_and_is_never_done_then(fails, failed):
    commands = lifted(lambda t: (finger(0.5), finger(0.5) if t < fails else failed), 3.0)
    last = commands[-1]
    assert last.phase is Phase.LOST
    assert last.velocity_base_tip == ZERO
    assert min(last.grip_force) >= min(commands[round(fails / PERIOD) - 1].grip_force)


def nudged(fingers, grip, shown, respond):
    """Step a nudge until it is done; `respond` gives the next observation of a finger for a command."""
    nudge = NudgeController(fingers, PERIOD, NudgeParameters(grip, ZERO))
    nudge.start(observed(0.0, *[shown] * fingers))
    for k in range(10000):
        command = nudge.step(observed(k * PERIOD, *[shown] * fingers))
        if nudge.done:
            return nudge
        shown = respond(command)
    raise AssertionError("not done")


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_sensor_that_stands_still_is_no_plateau(noise):
    """Its reading counts as a load like any other."""
    rng = np.random.default_rng(2)

    def respond(command):
        a, b = noise * rng.standard_normal(2)
        return finger(1.0 + a, 2e-3 * (1.0 + b), 2.0)

    nudge = nudged(2, 2.0, finger(0.5), respond)
    assert nudge.friction == nudge.spin_length == (None, None)


def test_what_was_loaded_a_little_before_is_found_all_the_same():
    """A third of mu f_n from closing, 0.4 mm of elastic travel, and a twist that turns back as far as it went."""
    mu, e, grip = 0.6, 0.003, 2.0
    state = SimpleNamespace(pull=0.33 * mu * grip, twist=0.0)

    def respond(command):
        state.pull = min(state.pull - command.velocity_base_tip[2] * PERIOD * mu * grip / 4e-4, mu * grip)
        twist = state.twist + command.angular_velocity_base_tip[0] * PERIOD * mu * e * grip / 0.05
        state.twist = min(max(twist, -mu * e * grip), mu * e * grip)
        return finger(state.pull if state.twist == 0.0 else 0.0, state.twist, grip)

    nudge = nudged(1, grip, finger(state.pull, 0.0, grip), respond)
    assert nudge.friction == pytest.approx((mu,), rel=0.01)
    assert nudge.spin_length == pytest.approx((e,), rel=0.01)


LAG, FOLLOWS, MU, LARGEST = 10, 15.0, 0.5, 15.5

LIFT = LiftParameters(height=0.02, speed=0.06, acceleration=0.3, settle_time=0.05, hold_time=0.3)


def taken_up(weight, stiffness, follows=FOLLOWS):
    """Lift; return the last phase, how long the lift took, and the largest load over what contacts bear.

    The hand does what is commanded after `LAG` periods, and the grip follows with so many newtons a second.
    """
    grip = SlipSafeGrip(2, KnownSurface(LimitSurface(MU, 0.004)), PERIOD, GripParameters(largest_grip=LARGEST))
    lift = LiftController(grip, PERIOD, LIFT)
    pressed, way, worst, took, moves = LIFT.first_grip, 0.0, 0.0, 0, [0.0] * LAG
    for i in range(8000):
        load = min(stiffness * way, 0.5 * weight)
        worst = max(worst, load / (MU * pressed))
        now = observed(i * PERIOD, *[finger(load, 0.0, pressed, time=i * PERIOD)] * 2)
        if i == 0:
            lift.start(now)
        grip.live.step(now.time)
        command = lift.step(now)
        if command.phase.is_final:
            break
        moves.append(command.velocity_base_tip[2])
        way += moves[-1 - LAG] * PERIOD
        step = follows * PERIOD
        pressed += min(max(command.grip_force[0] - pressed, -step), step)
        took += command.phase is Phase.LIFT
    return command.phase, took * PERIOD, worst


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.floats(0.5, 13.0), st.floats(3.0, 5.3))
def test_no_load_comes_on_faster_than_the_grip_follows(weight, exponent):
    phase, _, worst = taken_up(weight, 10.0**exponent)
    assert phase is Phase.DONE
    assert worst < 1.0


def test_a_light_object_is_lifted_as_fast_as_before_but_for_the_taking_up():
    """From rest to rest with one acceleration takes h / v + v / a; e-folds to it are all that is added."""
    _, took, _ = taken_up(1.0, 5e4)
    straight = LIFT.height / LIFT.speed + LIFT.speed / LIFT.acceleration
    assert took == pytest.approx(straight, abs=0.17)


DOWN = SetDownParameters(height=0.01, speed=0.02)

WEIGHT = 0.5
"""[N] That a finger bears: with mu = 0.5 it takes 1 N."""


@pytest.mark.parametrize(("weight", "follows"), [(20.0, FOLLOWS), (10.0, 1e-6)], ids=["too heavy", "stuck grip"])
def test_a_load_that_the_grip_cannot_hold_ends_the_lift_before_it_slips(weight, follows):
    phase, _, worst = taken_up(weight, 5e4, follows=follows)
    assert phase is Phase.LOST
    assert worst < 1.0


def lowered(table, first=(WEIGHT, 0.0)):
    """Close, hold, lower; returns the controller, commands of lowering, and ways left [m] when they were given.

    Args:
        table: From the way that is left [m] to the (tangential force, spin torque) of the first finger.
        first: Its load before.
    """
    grip = SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD)
    lift = LiftController(grip, PERIOD, LiftParameters(height=0.0, settle_time=0.05, hold_time=0.5))
    controller = GraspController(lift, grip, PERIOD, DOWN)
    controller.start(observed(0.0, finger(*first, 3.0), finger(WEIGHT, 0.0, 3.0)))
    commands, left, lefts = [], DOWN.height, []
    for i in range(5000):
        lowering = controller.stage is GraspStage.SET_DOWN
        one = finger(*(table(left) if lowering else first), grip.target)
        command = controller.step(observed(i * PERIOD, one, finger(WEIGHT, 0.0, grip.target)))
        if lowering:
            commands.append(command)
            lefts.append(left)
            left += command.velocity_base_tip[2] * PERIOD
        if command.phase.is_final or controller.stage is GraspStage.LET_GO:
            break
    return controller, commands, lefts


EDGE = 0.006
"""[m] Above where it stood: where a tilted object meets the table with an edge."""


@pytest.mark.parametrize(
    "pushed", [(2.0, 0.0), (0.0, 0.006), (-2.0, 0.0)], ids=["harder down", "turned", "lifted off"]
)
def test_an_edge_that_is_met_while_lowering_ends_it_there_with_the_grip_as_it_is(pushed):
    controller, commands, lefts = lowered(lambda left: pushed if left < EDGE else (WEIGHT, 0.0))
    last = commands[-1]
    assert last.phase is Phase.LOST
    assert controller.met_early
    assert last.velocity_base_tip == ZERO
    assert EDGE - 0.02 * 0.1 < lefts[-1] < EDGE  # within 0.1 s: the load's way through the tracker
    assert all(now >= before - 1e-9 for now, before in zip(last.grip_force, commands[0].grip_force, strict=True))


@pytest.mark.parametrize("share", [0.0, 0.5, 1.4])
def test_a_load_that_goes_away_or_hardly_grows_is_no_edge(share):
    """Up to `GROWN` times the load before; the table then takes it all, and a bit."""
    check_table(lambda left: (WEIGHT * share, 0.0) if left > 0.0 else (-3.0 * WEIGHT, 0.0))


def test_what_counts_as_grown_goes_with_what_was_borne_before():
    """A heavy torque before lowering is no edge, and the same torque after a light load is."""
    torque = 2.0 * (GROWN * WEIGHT / SURFACE.friction + GROWN_BY) * SURFACE.friction * SURFACE.spin_length
    steady, _, _ = lowered(lambda left: (WEIGHT if left > 0.0 else -3.0, torque), (WEIGHT, torque))
    assert not steady.met_early
    grown, _, _ = lowered(lambda left: (0.7 * WEIGHT, torque) if left < EDGE else (WEIGHT, 0.0))
    assert grown.met_early


def check_table(table, low=-math.inf, high=0.0):
    controller, commands, lefts = lowered(table)
    assert controller.stage is GraspStage.LET_GO
    assert not controller.met_early
    assert low < lefts[-1] < high
    return commands, lefts


def test_the_table_is_known_by_its_height_and_by_the_weight_that_it_takes():
    """A contact at the height where the object stood is the table, however the load grows; torques that fingers
    turn against one another come from no table; one odd sample is neither edge nor table."""
    check_table(lambda left: (-4.0 * WEIGHT, 0.01) if left < 0.9 * SLOW else (WEIGHT, 0.0), 0.0, SLOW)
    check_table(lambda left: (WEIGHT if left > 0.0 else -3.0 * WEIGHT, 0.006))
    counted = []
    commands, lefts = check_table(
        lambda left: (counted.append(left) or (-50.0 if len(counted) == 100 else WEIGHT), 0.0)
    )
    assert lefts[99] > SLOW
    assert max(force for command in commands for force in command.grip_force) < 1.01 * commands[0].grip_force[0]
