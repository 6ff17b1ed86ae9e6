"""Every fault of the table, on puppets: the safe state within two periods, and nothing moves until reset."""

from dataclasses import replace

import pytest

from faults.fault_checks import MOST_PERIODS, check_ending, check_latch, periods_until_safe
from faults.fault_rig import FaultyBackend, Rig, carry_out
from faults.fault_table import ANYWHERE
from palpate.runtime.log import LogWriter, read_log
from palpate.runtime.result import Ending
from palpate.runtime.supervision import Limits
from runtime.puppets import PuppetBackend, PuppetController, touch

AT = 30
"""Index of the first period with the fault."""
JOINTS = (0.0, 0.0)
UP = (0.0, 0.0, 1.0)
"""Out of the object: the puppet presses down with z, but a little friction along x."""


class Jointed(PuppetBackend):
    """An arm that tells of two joints."""

    def _now(self, step):
        now = super()._now(step)
        return replace(now, arm=replace(now.arm, joint_position=JOINTS))


def puppet_rig() -> Rig:
    return Rig(FaultyBackend(Jointed()), touch(), PuppetController(), Limits(), duration=0.4)


@pytest.mark.parametrize("fault", ANYWHERE, ids=str)
def test_a_fault_ends_in_the_safe_state_within_two_periods(fault, tmp_path):
    rig = puppet_rig()
    fault.injection.into(rig, AT)
    outcome = carry_out(rig, file=LogWriter(tmp_path / "run.mcap"))
    check_ending(outcome, fault, AT)
    assert {c.velocity_base_tip for c in outcome.commands[:AT]} == {(0.01, 0.0, 0.0)}  # it was in full swing
    assert periods_until_safe(outcome, fault, AT, lambda index: UP) <= MOST_PERIODS
    if fault.name != "a device is lost for good":
        assert rig.backend.sound.at_rest
    check_latch(outcome, puppet_rig())
    log = read_log(tmp_path / "run.mcap")
    assert log.complete
    assert log.damage is None
    assert len(log) == len(outcome.log.record())
    assert [str(event.text) for event in log.events] == [event.text for event in outcome.events]


def test_without_a_fault_there_is_no_trip():
    """The rig is sound: what trips is the fault."""
    outcome = carry_out(puppet_rig())
    assert outcome.result.ending is Ending.TIME_UP
    assert outcome.result.trip is None
    assert outcome.errors() == []
