"""Every fault of the table, on puppets: the defined safe state within two periods, and nothing moves until reset."""

import math
from dataclasses import replace

import pytest

from faults.fault_rig import FaultyBackend, Outcome, Rig, carry_out
from faults.fault_table import ANYWHERE, RETRACT_SPEED, Fault, Reaction
from palpate.errors import LatchedError
from palpate.runtime.data import ArmSample, Sample
from palpate.runtime.loop import run
from palpate.runtime.result import Ending
from palpate.runtime.supervision import Limits
from runtime.puppets import REST, PuppetBackend, PuppetController, touch

AT = 30
"""Index of the first period with the fault."""
MOST_PERIODS = 2
"""From the period that shows the fault to the last one that is not safe."""
JOINTS = (0.0, 0.0)


class Jointed(PuppetBackend):
    """An arm that tells of two joints."""

    def _now(self, step):
        now = super()._now(step)
        return Sample(now.time, replace(now.arm, joint_position=JOINTS), now.wrenches)


def puppet_rig() -> Rig:
    return Rig(FaultyBackend(Jointed()), touch(), PuppetController(), Limits(), duration=0.1)


def is_safe(command, fault: Fault, arm: ArmSample, grip=None) -> bool:
    """Whether the robot may be told this from the trip on (on the puppet: the object is below, -z)."""
    x, y, z = command.velocity_base_tip
    if command.grip_force != grip:
        return False
    stands = (x, y, z) == REST
    if fault.reaction is Reaction.STAND:
        return stands
    return stands or (z > 0.0 and math.hypot(x, y, z) <= RETRACT_SPEED * (1 + 1e-12))


def periods_until_safe(outcome: Outcome, fault: Fault, at: int, safe) -> int:
    """From the period that trips, or at which the signal came, to the first from which on all is safe."""
    first = outcome.tripped_at(at)
    told = outcome.commands
    unsafe = [i for i in range(first, len(told)) if not safe(told[i], fault, outcome.rig.backend.samples[i].arm)]
    return unsafe[-1] + 1 - first if unsafe else 0


def check(outcome: Outcome, fault: Fault, at: int) -> None:
    """All of what a fault must lead to, but for the commands."""
    result, backend = outcome.result, outcome.rig.backend
    assert result.ending is fault.ending
    if fault.measure is None:
        assert result.trip is None
    else:
        assert result.trip.measure.startswith(fault.measure)
        assert fault.value in result.trip.value
        assert result.trip.limit
        assert str(result.trip) in outcome.errors()
        assert outcome.tripped_at(at) - at == fault.delay
    assert outcome.events[-1].text == f"ended: {fault.ending.value}"
    assert backend.closed_after == len(backend.commands)
    assert result.recording.rows_lost == 0 or "wrench" in fault.name


def check_latch(outcome: Outcome, fresh: Rig) -> None:
    """A trip lets nothing move until it is reset."""
    if outcome.result.trip is None:
        return
    with pytest.raises(LatchedError, match="reset"):
        run(fresh.backend, fresh.touch, fresh.controller, outcome.supervisor, duration=0.02)
    assert fresh.backend.commands == []
    outcome.supervisor.reset()
    outcome.supervisor.limits = fresh.limits


@pytest.mark.parametrize("fault", ANYWHERE, ids=str)
def test_a_fault_ends_in_the_safe_state_within_two_periods(fault):
    rig = puppet_rig()
    fault.injection.into(rig, AT)
    outcome = carry_out(rig)
    check(outcome, fault, AT)
    assert {c.velocity_base_tip for c in outcome.commands[:AT]} == {(0.01, 0.0, 0.0)}  # it was in full swing
    assert periods_until_safe(outcome, fault, AT, is_safe) <= MOST_PERIODS
    if fault.name != "a device is lost for good":
        assert rig.backend.sound.at_rest
    check_latch(outcome, puppet_rig())


def test_without_a_fault_there_is_no_trip():
    """The rigs are sound: what trips is the fault."""
    outcome = carry_out(puppet_rig())
    assert outcome.result.ending is Ending.TIME_UP
    assert outcome.result.trip is None
    assert outcome.errors() == []
