"""A grip that knows what comes is there before it; one that does not pays a price that was told."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.announced_loads import LoadAnnouncedBefore
from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.expected_load import ExpectedLoad
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.preload import Preload
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.errors import InvalidValueError
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import ArmSample, Observation
from palpate.sensing.ft.poses import STANDARD_GRAVITY
from palpate.spatial import IDENTITY, ZERO
from support.felt_finger import finger

PERIOD = 1e-3
SURFACE = LimitSurface(0.5, 0.004)
PLAIN = GripParameters(margin=0.1, reserve=0.05)
HANGS, SPINS = 0.5, 1e-3


def grip_of(**more):
    return SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD, PLAIN, **more)


def targets(grip, seconds, tangential=HANGS, torque=SPINS, first=0.0):
    """What is wanted in each period, while each finger bears so much and feels what is wanted."""
    wanted = []
    for i in range(round(seconds / PERIOD)):
        t, felt = first + i * PERIOD, finger(tangential, torque, grip.target)
        grip.step(Observation(t, ArmSample(t, ZERO, IDENTITY, ZERO), (felt, felt)))
        wanted.append(grip.target)
    return wanted


@given(st.floats(0.1, 8.0), st.floats(0.0, 0.02), st.floats(0.0, 0.5))
@settings(max_examples=8, deadline=None)
def test_what_is_expected_is_held_when_it_begins_and_no_longer_when_it_is_over(force, moment, earlier):
    grip = grip_of()
    grip.expect(ExpectedLoad(1.0, 1.2, force, moment))
    wanted = targets(grip, 1.0 - PLAIN.lead + 2.0 * PERIOD)
    both = SURFACE.least_normal_force(HANGS + 0.5 * force, SPINS + 0.5 * moment)
    assert wanted[-1] >= min((1.0 + PLAIN.margin) * both, PLAIN.largest_grip) * (1.0 - 1e-6)
    quiet = targets(grip_of(), 0.5)[-1]
    way = (wanted[-1] - quiet) / PLAIN.grip_rate + PLAIN.lead
    before = round((1.0 - way) / PERIOD) - 3 - round(0.1 * earlier / PERIOD)
    assert wanted[before] <= quiet * 1.001
    assert targets(grip, 4.0, first=1.0 - PLAIN.lead + 2.0 * PERIOD)[-1] == pytest.approx(quiet, rel=1e-3)


def test_a_hand_that_accelerates_is_held_for_what_then_pulls():
    grip = grip_of()
    grip.expect(ExpectedLoad(0.5, 1.0, acceleration=0.5 * STANDARD_GRAVITY))
    need = SURFACE.least_normal_force(HANGS, SPINS)
    assert targets(grip, 0.5)[-1] >= 1.1 * 1.5 * need


def test_an_announcement_counts_once_and_from_when_it_is_made():
    load = ExpectedLoad(1.0, 1.2, 2.0)
    told, known = grip_of(announcer=LoadAnnouncedBefore(load, 0.015)), grip_of()
    known.expect(load)
    late, early = targets(told, 1.2), targets(known, 1.2)
    assert max(late) == pytest.approx(max(early), rel=1e-9)
    assert late[980] < early[990]
    assert late[980] == pytest.approx(targets(grip_of(), 1.0)[980])


@given(st.floats(0.0, 5.0), st.floats(0.0, 0.02))
@settings(max_examples=8, deadline=None)
def test_a_preload_bears_its_step_and_costs_what_is_told(force, moment):
    preload, quiet = Preload(force, moment), targets(grip_of(), 0.5)[-1]
    with_it = targets(grip_of(preload=preload), 0.5)[-1]
    price = preload.grip(SURFACE, 2, PLAIN.margin, PLAIN.lead, PLAIN.grip_rate)
    both = SURFACE.least_normal_force(HANGS + 0.5 * force, SPINS + 0.5 * moment)
    assert with_it == pytest.approx(quiet + price, rel=1e-3)
    assert with_it >= both
    quicker = preload.grip(SURFACE, 2, PLAIN.margin, 0.0, PLAIN.grip_rate)
    assert quicker <= price


@pytest.mark.parametrize("wrong", [{"end": 0.5}, {"force": -1.0}, {"begin": float("nan")}, {"end": float("inf")}])
def test_what_cannot_be_expected_is_refused(wrong):
    with pytest.raises(InvalidValueError):
        ExpectedLoad(**({"begin": 1.0, "end": 2.0} | wrong))
