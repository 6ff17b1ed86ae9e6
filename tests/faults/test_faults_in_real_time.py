"""Some faults against the clock: periods that last what they should, signals that come from outside, overruns."""

import os
import signal
import time

import pytest

from faults.fault_checks import MOST_PERIODS, check_ending, periods_until_safe
from faults.fault_rig import Commands, FaultyBackend, Rig, carry_out
from faults.fault_table import ANYWHERE, Fault, Reaction
from faults.stage_rig import PERIOD, away, plain_finger, stage_rig
from palpate.runtime.data import Command, Phase
from palpate.runtime.real_time import Overrun, RealTime
from palpate.runtime.result import Ending
from palpate.runtime.supervision import Limits
from palpate.spatial import ZERO, norm
from runtime.puppets import PuppetBackend, PuppetController, touch

AT = 60
"""Index of the first period with the fault; on the stage it is still landing then."""
UP = (0.0, 0.0, 1.0)


class PacedPuppet(PuppetBackend):
    """A puppet that takes its time."""

    def __init__(self, pacer: RealTime) -> None:
        super().__init__()
        self.pacer = pacer

    def step(self, command):
        now = super().step(command)
        self.pacer.wait()
        return now


def paced_rig(overrun: Overrun = Overrun.SKIP) -> Rig:
    backend = FaultyBackend(PacedPuppet(RealTime(PERIOD, overrun)))
    return Rig(backend, touch(), PuppetController(), Limits(), duration=0.5)


IN_REAL_TIME = [
    fault
    for fault in ANYWHERE
    if fault.name
    in (
        "a force is NaN",
        "time goes backwards",
        "the sensor repeats its last sample",
        "a device is lost for one period",
        "the controller raises",
        "Ctrl-C",
    )
]


@pytest.mark.slow
@pytest.mark.parametrize("fault", IN_REAL_TIME, ids=str)
def test_a_fault_ends_in_the_safe_state_in_real_time_too(fault):
    rig = stage_rig(plain_finger(), RealTime(PERIOD), duration=0.5)
    fault.injection.into(rig, AT)
    outcome = carry_out(rig)
    check_ending(outcome, fault, AT)
    assert periods_until_safe(outcome, fault, AT, lambda index: away(rig, index)) <= MOST_PERIODS
    assert norm(rig.backend.truly[-1].arm.velocity_base_tip) < 1e-3
    periods = len(outcome.commands)
    assert outcome.result.timing.lateness.size + outcome.result.timing.overruns >= periods
    assert outcome.result.wall_time >= (periods - 2) * PERIOD


def _late(command: Command) -> Command:
    time.sleep(0.005)
    return command


def test_a_real_overrun_that_is_not_tolerated_stops_the_robot():
    """The controller takes 5 ms of a period of 1 ms."""
    fault = Fault("late", Commands(_late), "back end", "OverrunError", Reaction.STAND)
    rig = paced_rig(Overrun.STOP)
    fault.injection.into(rig, AT)
    outcome = carry_out(rig)
    assert outcome.result.ending is Ending.TRIPPED
    assert outcome.result.trip.measure == "back end"
    assert "OverrunError" in outcome.result.trip.value
    assert outcome.result.stopped
    assert outcome.result.timing.overruns >= 1
    # on a loaded machine it may be late, and stop, before
    stops = [i for i, command in enumerate(outcome.commands) if command.phase is Phase.STOP]
    assert stops[0] <= AT + MOST_PERIODS
    assert all(command.velocity_base_tip == ZERO for command in outcome.commands[stops[0] :])


def test_overruns_that_are_tolerated_are_counted_and_do_not_stop_it():
    rig = paced_rig()
    Commands(_late).into(rig, 490)
    outcome = carry_out(rig)
    assert outcome.result.ending is Ending.TIME_UP
    assert outcome.result.timing.overruns >= 10


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_from_outside_stops_it_within_two_periods(number):
    """While the loop sleeps, most likely."""
    rig = paced_rig()
    sent = []

    def send(*_):
        sent.append(len(rig.backend.commands))
        os.kill(os.getpid(), number)

    def soon(command):
        if not sent:
            signal.setitimer(signal.ITIMER_REAL, 0.3 * PERIOD)
        return command

    Commands(soon).into(rig, AT)
    before = signal.signal(signal.SIGALRM, send)
    try:
        outcome = carry_out(rig)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert outcome.result.ending is Ending.INTERRUPTED
    assert outcome.result.stopped
    assert all(command.velocity_base_tip == ZERO for command in outcome.commands[sent[0] + MOST_PERIODS :])
    assert rig.backend.closed_after == len(outcome.commands)


class Impatient(PuppetBackend):
    """It hangs at a period, and somebody presses Ctrl-C twice."""

    def step(self, command):
        if len(self.commands) == AT:
            self.commands.append(command)
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            raise AssertionError("went on")
        return super().step(command)


def test_a_second_ctrl_c_ends_a_loop_that_hangs_with_the_robot_at_rest_and_the_log_closed():
    from palpate.runtime.log import MemoryLog, Recorder
    from palpate.runtime.loop import run

    backend, log = Impatient(), MemoryLog()
    with pytest.raises(KeyboardInterrupt):
        run(backend, touch(), PuppetController(), duration=0.5, recorder=Recorder(log))
    assert backend.at_rest
    assert backend.closed == 1
    assert log.events[-1].text == "ended by KeyboardInterrupt"
    assert len(log.record()) >= AT
