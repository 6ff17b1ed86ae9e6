"""A weight that nobody told is taken up so slowly that servos that are slow keep up, whatever the stiffness."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import ArmSample, Observation, Phase
from palpate.spatial import IDENTITY, ZERO
from support.felt_finger import finger

PERIOD, LAG, FOLLOWS, MU, LARGEST = 1e-3, 10, 15.0, 0.5, 15.5
ARM = ArmSample(0.0, ZERO, IDENTITY, ZERO)
LIFT = LiftParameters(height=0.02, speed=0.06, acceleration=0.3, settle_time=0.05, hold_time=0.3)


def lifted(weight, stiffness, follows=FOLLOWS):
    """Lift; return the last phase, how long the lift took, and the largest load over what contacts bear.

    The hand does what is commanded after `LAG` periods, and the grip follows with so many newtons a second.
    """
    grip = SlipSafeGrip(2, KnownSurface(LimitSurface(MU, 0.004)), PERIOD, GripParameters(largest_grip=LARGEST))
    lift = LiftController(grip, PERIOD, LIFT)
    pressed, way, worst, took, moves = LIFT.first_grip, 0.0, 0.0, 0, [0.0] * LAG
    for i in range(8000):
        load = min(stiffness * way, 0.5 * weight)
        worst = max(worst, load / (MU * pressed))
        its = finger(load, 0.0, pressed, time=i * PERIOD)
        now = Observation(i * PERIOD, ARM, (its, its))
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
    phase, _, worst = lifted(weight, 10.0**exponent)
    assert phase is Phase.DONE
    assert worst < 1.0


def test_a_light_object_is_lifted_as_fast_as_before_but_for_the_taking_up():
    """From rest to rest with one acceleration takes h / v + v / a; e-folds to it are all that is added."""
    _, took, _ = lifted(1.0, 5e4)
    straight = LIFT.height / LIFT.speed + LIFT.speed / LIFT.acceleration
    assert took == pytest.approx(straight, abs=0.17)


def test_what_takes_more_grip_than_may_be_is_not_lifted_and_not_let_go():
    phase, _, worst = lifted(20.0, 5e4)
    assert phase is Phase.LOST
    assert worst < 1.0


def test_a_grip_that_does_not_follow_at_all_ends_the_lift_before_it_slips():
    phase, _, worst = lifted(10.0, 5e4, follows=1e-6)
    assert phase is Phase.LOST
    assert worst < 1.0
