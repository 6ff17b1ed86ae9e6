"""Lifting and setting down: failing fingers, a load taken up slowly, a release only on the table."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given, settings
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

ABSENT, FAILED, HEALTHY_FINGER = finger(0.0, 0.0, 0.0, touching=False), finger(0.5, health=BROKEN), finger(0.5)


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
    for force in [1.0] * 100 + [1.0 + 10.0 * ODD_FORCE] * 100:
        ahead.step(ContactLoad(3.0, (force, 0.0, 0.0), 0.0))
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


def lifted(fingers_at):
    """Commands of a lift, up to its end."""
    lift = LiftController(SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD), PERIOD, QUICK)
    lift.start(observed(0.0, *fingers_at(0.0)))
    commands = []
    while len(commands) < 3000 and not (commands and commands[-1].phase.is_final):
        time = len(commands) * PERIOD
        commands.append(lift.step(observed(time, *fingers_at(time))))
    return commands


def test_fingers_that_find_nothing_give_up():
    """A lift and a nudge alike; a lift is done in good health, also after a failure for a moment."""
    assert lifted(lambda t: (HEALTHY_FINGER,) * 2)[-1].phase is Phase.DONE
    moment = lifted(lambda t: (HEALTHY_FINGER, FAILED if 0.4 < t < 0.6 else HEALTHY_FINGER))
    assert moment[-1].phase is Phase.DONE
    commands = lifted(lambda t: (HEALTHY_FINGER, ABSENT))
    assert commands[-1].phase is Phase.LOST
    assert len(commands) * PERIOD == pytest.approx(QUICK.close_time, abs=0.01)
    nudge = NudgeController(2, PERIOD, NudgeParameters(2.0, ZERO, close_time=0.5))
    nudge.start(observed(0.0, HEALTHY_FINGER, ABSENT))
    phases = [nudge.step(observed(k * PERIOD, HEALTHY_FINGER, ABSENT)).phase for k in range(600)]
    assert phases.index(Phase.LOST) * PERIOD == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("failed", "fails"), [(FAILED, 0.08), (FAILED, 0.4), (ABSENT, 0.25), (ABSENT, 0.45)])
def test_a_lift_ends_held_where_a_finger_fails_and_is_never_done_then(fails, failed):
    commands = lifted(lambda t: (HEALTHY_FINGER, HEALTHY_FINGER if t < fails else failed))
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
    draws = iter(noise * np.random.default_rng(2).standard_normal((10000, 2)))

    def respond(command):
        a, b = next(draws)
        return finger(1.0 + a, 2e-3 * (1.0 + b), 2.0)

    nudge = nudged(2, 2.0, finger(0.5), respond)
    assert nudge.friction == nudge.spin_length == (None, None)


def test_friction_is_found_in_a_contact_that_was_loaded_before():
    """A third of mu f_n from closing, 0.4 mm of elastic travel, and a twist that turns back as far as it went."""
    mu, e, grip = 0.6, 0.003, 2.0
    pull, twist = 0.33 * mu * grip, 0.0

    def respond(command):
        nonlocal pull, twist
        pull = min(pull - command.velocity_base_tip[2] * PERIOD * mu * grip / 4e-4, mu * grip)
        twist += command.angular_velocity_base_tip[0] * PERIOD * mu * e * grip / 0.05
        twist = min(max(twist, -mu * e * grip), mu * e * grip)
        return finger(pull if twist == 0.0 else 0.0, twist, grip)

    nudge = nudged(1, grip, finger(pull, 0.0, grip), respond)
    assert nudge.friction == pytest.approx((mu,), rel=0.01)
    assert nudge.spin_length == pytest.approx((e,), rel=0.01)


LAG, FOLLOWS, MU, LARGEST = 10, 15.0, 0.5, 15.5

LIFT = LiftParameters(height=0.02, speed=0.06, acceleration=0.3, settle_time=0.05, hold_time=0.3)


def taken_up(weight, stiffness, follows=FOLLOWS):
    """Lift; return the last phase, how long the lift took, and the largest load over the limit of friction.

    The hand does what is commanded after `LAG` periods, and the grip follows with so many newtons a second.
    """
    grip = SlipSafeGrip(2, KnownSurface(LimitSurface(MU, 0.004)), PERIOD, GripParameters(largest_grip=LARGEST))
    lift = LiftController(grip, PERIOD, LIFT)
    pressed, way, worst, moves, phases = LIFT.first_grip, 0.0, 0.0, [0.0] * LAG, []
    lift.start(observed(0.0, *[finger(0.0, 0.0, pressed)] * 2))
    while len(phases) < 8000 and not (phases and phases[-1].is_final):
        load, time = min(stiffness * way, 0.5 * weight), len(phases) * PERIOD
        worst = max(worst, load / (MU * pressed))
        grip.live.step(time)
        command = lift.step(observed(time, *[finger(load, 0.0, pressed, time=time)] * 2))
        phases.append(command.phase)
        moves.append(command.velocity_base_tip[2])
        way += moves[-1 - LAG] * PERIOD
        pressed += min(max(command.grip_force[0] - pressed, -follows * PERIOD), follows * PERIOD)
    return phases[-1], phases.count(Phase.LIFT) * PERIOD, worst


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.floats(0.5, 13.0), st.floats(3.0, 5.3))
@example(1.0, math.log10(5e4))
def test_no_load_comes_on_faster_than_the_grip_follows(weight, exponent):
    """A light object is lifted as fast as before, but for e-folds to the load: h / v + v / a from rest to rest."""
    phase, took, worst = taken_up(weight, 10.0**exponent)
    assert phase is Phase.DONE
    assert worst < 1.0
    if weight == 1.0:
        straight = LIFT.height / LIFT.speed + LIFT.speed / LIFT.acceleration
        assert took == pytest.approx(straight, abs=0.17)


@pytest.mark.parametrize(("weight", "follows"), [(20.0, FOLLOWS), (10.0, 1e-6)], ids=["too heavy", "stuck grip"])
def test_a_load_that_the_grip_cannot_hold_ends_the_lift_before_it_slips(weight, follows):
    phase, _, worst = taken_up(weight, 5e4, follows=follows)
    assert phase is Phase.LOST
    assert worst < 1.0


WEIGHT, EDGE = 0.5, 0.006
"""Load of a finger [N]: with mu = 0.5 it takes 1 N. Height at which a tilted object meets the table with an edge
[m], above where it stood."""


def lowered(table, first=(WEIGHT, 0.0)):
    """Close, hold, lower; returns the controller, commands of lowering, and ways left [m] when they were given.

    Args:
        table: From the way that is left [m] to the (tangential force, spin torque) of the first finger.
        first: Its load before.
    """
    grip, down = SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD), SetDownParameters(height=0.01, speed=0.02)
    lift = LiftController(grip, PERIOD, LiftParameters(height=0.0, settle_time=0.05, hold_time=0.5))
    controller = GraspController(lift, grip, PERIOD, down)
    controller.start(observed(0.0, finger(*first, 3.0), finger(WEIGHT, 0.0, 3.0)))
    commands, lefts, left = [], [], down.height
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


HEAVY = 2.0 * (GROWN * WEIGHT / SURFACE.friction + GROWN_BY) * SURFACE.friction * SURFACE.spin_length
"""A torque that counts as grown after a light load [N m]."""

EDGES = {
    "harder down": (2.0, 0.0),
    "turned": (0.0, 0.006),
    "lifted off": (-2.0, 0.0),
    "turned, after a light load": (0.7 * WEIGHT, HEAVY),
}


@pytest.mark.parametrize("name", EDGES)
def test_an_edge_that_is_met_while_lowering_ends_it_there_with_the_grip_as_it_is(name):
    controller, commands, lefts = lowered(lambda left: EDGES[name] if left < EDGE else (WEIGHT, 0.0))
    last = commands[-1]
    assert last.phase is Phase.LOST
    assert controller.met_early
    assert last.velocity_base_tip == ZERO
    assert EDGE - 0.02 * 0.1 < lefts[-1] < EDGE  # within 0.1 s: the load's way through the tracker
    assert all(now >= before - 1e-9 for now, before in zip(last.grip_force, commands[0].grip_force, strict=True))


def hardly_grown(share):
    """The load falls or grows up to `GROWN` times; the table then takes it all, and a bit."""
    return lambda left: (WEIGHT * share, 0.0) if left > 0.0 else (-3.0 * WEIGHT, 0.0)


FROM_ABOVE, AT_HEIGHT = (-math.inf, 0.0), (0.0, SLOW)

TABLES = {
    "load gone": (hardly_grown(0.0), (WEIGHT, 0.0), FROM_ABOVE),
    "load halved": (hardly_grown(0.5), (WEIGHT, 0.0), FROM_ABOVE),
    "load grown a little": (hardly_grown(1.4), (WEIGHT, 0.0), FROM_ABOVE),
    "a torque from before": (lambda left: (WEIGHT if left > 0.0 else -3.0, HEAVY), (WEIGHT, HEAVY), FROM_ABOVE),
    "a contact at the height where it stood": (
        lambda left: (-4.0 * WEIGHT, 0.01) if left < 0.9 * SLOW else (WEIGHT, 0.0),
        (WEIGHT, 0.0),
        AT_HEIGHT,
    ),
    "a torque that fingers exert on one another": (
        lambda left: (WEIGHT if left > 0.0 else -3.0 * WEIGHT, 0.006),
        (WEIGHT, 0.0),
        FROM_ABOVE,
    ),
}


@pytest.mark.parametrize("name", TABLES)
def test_the_table_is_known_by_its_height_and_by_the_weight_that_it_takes(name):
    """A contact at the height where the object stood is the table, however the load grows."""
    table, first, (low, high) = TABLES[name]
    controller, _, lefts = lowered(table, first)
    assert controller.stage is GraspStage.LET_GO
    assert not controller.met_early
    assert low < lefts[-1] < high


def test_one_odd_sample_is_neither_edge_nor_table():
    samples = iter([WEIGHT] * 99 + [-50.0] + [WEIGHT] * 5000)
    controller, commands, lefts = lowered(lambda left: (next(samples), 0.0))
    assert controller.stage is GraspStage.LET_GO
    assert lefts[99] > SLOW
    assert max(force for command in commands for force in command.grip_force) < 1.01 * commands[0].grip_force[0]
