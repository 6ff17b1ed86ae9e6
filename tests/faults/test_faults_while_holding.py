"""Whatever goes wrong while an object is held, stopping does not drop it."""

import pytest

from faults.fault_checks import MOST_PERIODS, check_ending, periods_until_safe
from faults.fault_rig import Commands, carry_out
from faults.fault_table import ANYWHERE, WITH_A_HAND, Fault
from faults.grip_plant import GRIP, TIP_RADIUS, GripPlant, holding_rig
from palpate.runtime.data import Command, Phase
from palpate.runtime.supervision import Supervisor
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import ZERO
from palpate.surfaces import Sphere

AT = 60
CREEP = 1e-6
"""[m]: friction of Coulomb's kind does not creep."""

CASES = (*ANYWHERE, *WITH_A_HAND)


class LettingGo(Supervisor):
    """What a supervisor must not be: it opens the hand to be on the safe side."""

    def standstill(self):
        return Command(ZERO, Phase.STOP, (0.0, 0.0))


@pytest.mark.parametrize("fault", CASES, ids=str)
def test_what_is_held_stays_held_and_the_arm_stops(fault):
    rig = holding_rig()
    fault.injection.into(rig, AT)
    outcome = carry_out(rig)
    plant = rig.backend.sound
    plant.coast(1.0)
    assert plant.fallen < CREEP
    assert plant.grip > plant.least_grip
    check_ending(outcome, fault, AT)
    until = periods_until_safe(outcome, fault, AT, lambda index: (0.0, 0.0, 0.0), (GRIP, GRIP))
    assert until <= MOST_PERIODS
    assert all(c.velocity_base_tip == ZERO for c in outcome.commands[outcome.tripped_at(AT) + MOST_PERIODS :])


@pytest.mark.parametrize("fault", ANYWHERE, ids=str)
def test_a_supervisor_that_lets_go_would_drop_it(fault):
    """The negative control: the plant is such that letting go is seen."""
    rig = holding_rig()
    fault.injection.into(rig, AT)
    carry_out(rig, LettingGo(rig.limits))
    rig.backend.sound.coast(1.0)
    assert rig.backend.sound.fallen > 0.1


def test_the_plant_drops_what_is_held_too_loosely_and_carries_what_is_not():
    for grip, falls in ((2.3, True), (2.6, False)):
        plant = GripPlant(grip)
        assert (grip < plant.least_grip) is falls
        plant.coast(0.5)
        assert (plant.fallen > 0.01) is falls


def test_the_fingers_carry_the_weight_and_touch_tells_so():
    plant = GripPlant(GRIP)
    now = Touch(*[Finger(Sphere(TIP_RADIUS))] * 2).sense(plant.start())
    for finger, side in zip(now.fingers, (1.0, -1.0), strict=True):
        assert finger.contact.normal_force == pytest.approx(GRIP)
        assert finger.contact.normal == pytest.approx([side, 0.0, 0.0], abs=1e-9)
    weight = sum(finger.wrench[2] for finger in now.fingers)
    assert weight == pytest.approx(-plant.mass * 9.80665)


def test_in_the_retraction_that_a_force_asks_for_a_hand_does_not_take_part():
    """Drawing back the finger that feels too much would drop what it holds."""
    rig = holding_rig()
    fault = Fault("", Commands(lambda c: c), None)
    next(f for f in ANYWHERE if f.name == "force over the limit").injection.into(rig, AT)
    outcome = carry_out(rig)
    assert outcome.result.trip.measure == "contact force"
    assert periods_until_safe(outcome, fault, AT, lambda index: (0.0, 0.0, 0.0), (GRIP, GRIP)) == 0
