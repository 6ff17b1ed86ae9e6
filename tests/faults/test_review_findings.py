"""What reviews of loop and supervisor found: each stays mended."""

import math
import signal
from dataclasses import replace

import numpy as np
import pytest

from palpate.runtime.data import Command, HandSample, Phase
from palpate.runtime.log import MemoryLog, Recorder
from palpate.runtime.loop import run
from palpate.runtime.result import Ending, result_until
from palpate.runtime.supervision import CONTACT_FORCE, AtMost, Guard, Limits, Supervisor
from palpate.sensing.ft.health import HealthCheck, SampleHealth
from palpate.spatial import norm
from runtime.puppets import PERIOD, REST, PuppetBackend, PuppetController, sample, touch

AT = 20
HARD = {"wrench": (0.0, 0.0, 30.0, 0.0, 0.0, 0.0)}
FIRM = {"wrench": (0.0, 0.0, 6.0, 0.0, 0.0, 0.0)}
FOR_EVER = range(AT, 2000)


def go(backend, controller=None, duration=0.1, **more):
    return run(backend, touch(), controller or PuppetController(), duration=duration, **more)


def spoilt(change, **given):
    """Return a puppet whose samples are changed from period `AT` on."""

    class Spoilt(PuppetBackend):
        def _now(self, step):
            now = super()._now(step)
            return change(now) if step >= AT else now

    return Spoilt(**given)


class Handed(PuppetBackend):
    """A puppet with a hand, which is lost in period `gone`."""

    gone = math.inf

    def _now(self, step):
        now = super()._now(step)
        return replace(now, hand=HandSample(now.time, (0.1,)) if step < self.gone else None)


class LosesHand(Handed):
    """Its grip force is no longer guarded, and the log would drop every period from there."""

    gone = AT


def later(now):
    """Return a sample after ten lost seconds: the arm's watchdog has expired long ago."""
    fingers = tuple(replace(one, time=one.time + 10.0) for one in now.wrenches)
    return replace(now, time=now.time + 10.0, arm=replace(now.arm, time=now.arm.time + 10.0), wrenches=fingers)


def loaded(*wrench):
    """Return a puppet with this wrench in period `AT`: 100 N m at no force or no contact, so no spin torque."""
    return PuppetBackend({AT: {"wrench": wrench}})


STOP = Command((0.01, 0.0, 0.0), Phase.STOP)
"""With a phase that only the supervisor may use."""

TRIPS = {
    "hand gone": lambda: (LosesHand(),),
    "hand new": lambda: (spoilt(lambda now: replace(now, hand=HandSample(now.time, (0.1,)))),),
    "joints new": lambda: (spoilt(lambda now: replace(now, arm=replace(now.arm, joint_position=(1.0, 2.0)))),),
    "moment without force": lambda: (loaded(0.0, 0.0, 0.0, 0.0, 0.0, 100.0),),
    "moment without contact": lambda: (loaded(0.0, 0.0, 1.0, 100.0, 0.0, 0.0),),
    "stop by a controller": lambda: (PuppetBackend(), PuppetController({AT: STOP})),
    "time lost": lambda: (spoilt(later),),
}


@pytest.mark.parametrize("given", TRIPS.values(), ids=TRIPS)
def test_a_change_that_makes_the_run_unsafe_is_a_trip(given):
    assert go(*given()).trip is not None


def fastest(backend):
    return max(math.hypot(*command.velocity_base_tip) for command in backend.commands)


def test_a_retraction_keeps_to_the_speed_limit_and_is_not_broken_off_by_it():
    """With a limit below 20 mm/s the reaction breaks the limit itself, and its own guard then ends it."""
    backend = PuppetBackend(dict.fromkeys(FOR_EVER, HARD))
    slow = PuppetController(velocity=(0.004, 0.0, 0.0))
    go(backend, slow, duration=2.0, supervisor=Supervisor(Limits(speed=0.01)))
    assert fastest(backend) <= 0.01 * (1 + 1e-9)
    assert sum(c.velocity_base_tip[2] > 0.0 for c in backend.commands) > 100


def test_a_rotation_that_is_none_does_not_make_the_retraction_fast():
    """Found at 20 m/s: the way out is rotated by whatever the arm says."""
    scaled = tuple(tuple(1e3 * (i == j) for j in range(3)) for i in range(3))
    backend = PuppetBackend(dict.fromkeys(FOR_EVER, HARD | {"rotation": scaled}))
    go(backend)
    assert fastest(backend) <= 0.25


def test_a_reaction_of_ones_own_is_held_to_the_limits_too():
    class Wild:
        def step(self, now, since, grip):
            return Command((math.nan, 9.0, 0.0), Phase.HOLD, grip) if now.time < since.time + 0.01 else None

    guard = Guard(AtMost(CONTACT_FORCE, 5.0), reaction=(Wild(),))
    backend = PuppetBackend(dict.fromkeys(FOR_EVER, FIRM))
    go(backend, supervisor=Supervisor(guards=(guard,)))
    assert backend.moved_by_finite_commands


@pytest.mark.parametrize("container", [list, np.array])
def test_a_controller_that_fills_the_same_array_every_time_does_not_escape_the_acceleration_limit(container):
    """The supervisor keeps the array, and compares it with itself."""

    class Refilling(PuppetController):
        velocity = container([0.0, 0.0, 0.0])

        def __init__(self):
            super().__init__(velocity=self.velocity)

        def step(self, now):
            self.velocity[0] = 0.0 if now.time < 0.01 else 0.24
            return Command(self.velocity, Phase.SCAN)

    backend = PuppetBackend()
    result = go(backend, Refilling())
    assert result.trip is not None
    assert result.trip.measure.startswith("commanded")
    assert max(norm(tuple(command.velocity_base_tip)) for command in backend.commands) <= 25.0 * PERIOD


def test_a_finger_forgotten_after_a_command_without_grip_is_noticed():
    hold, silent, one = (Command(REST, Phase.HOLD, grip) for grip in ((3.0, 3.0), None, (3.0,)))
    backend = PuppetBackend()
    result = go(backend, PuppetController({5: hold, 6: silent, 7: one}))
    assert result.trip is not None
    assert (3.0,) not in {command.grip_force for command in backend.commands}


def test_a_trip_whose_reaction_outlasts_the_time_is_a_trip_and_the_reaction_is_finished():
    """Found: ending TIME_UP, exit code of success, and 20 um of 5 mm of the way out."""
    backend = PuppetBackend(dict.fromkeys(range(49, 2000), HARD))
    result = go(backend, duration=0.05)
    assert result.trip is not None
    assert result.ending is Ending.TRIPPED
    assert backend.commands[60].velocity_base_tip[2] > 0.0


@pytest.mark.parametrize("at", [AT + 10, 110], ids=["while it retracts", "while it comes to rest"])
def test_a_signal_is_not_swallowed_because_the_run_ends_for_another_reason(at):
    """Found: a process asked to end, by Ctrl-C or by the system going down, goes on with the next run."""
    seen = []

    def watch(*_):
        seen.append(None)
        if len(seen) == at:
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt) as raised:
        go(PuppetBackend(dict.fromkeys(FOR_EVER, HARD) if at < 100 else {}), observers=(watch,))
    assert result_until(raised.value).ending is (Ending.TRIPPED if at < 100 else Ending.TIME_UP)


class Unclosable(PuppetBackend):
    def close(self):
        super().close()
        raise OSError("no reply to the last stop")


def test_a_back_end_that_cannot_be_closed_does_not_cost_the_result():
    """A lost device: the very case in which the trip must be reported."""
    cable = OSError("the cable is out")
    result = go(Unclosable({AT: cable}))
    assert result.error is cable
    assert not result.at_rest
    assert go(Unclosable()).ending is Ending.TRIPPED  # it may move still, and somebody must look


def test_the_robot_is_closed_before_the_log_which_may_take_long():
    order = []

    class Noting(PuppetBackend):
        def close(self):
            order.append("robot")
            super().close()

    class NotingLog(MemoryLog):
        def close(self):
            order.append("log")
            return super().close()

    go(Noting(), recorder=Recorder(NotingLog()))
    assert order == ["robot", "log"]


@pytest.mark.parametrize(
    "nonsense", [None, "sample", replace(sample(), time=None)], ids=["None", "str", "no time"]
)
def test_a_back_end_that_gives_no_sample_is_a_trip_and_the_robot_is_stopped(nonsense):
    """Found: AttributeError out of run(), and no stop command."""
    backend = spoilt(lambda _: nonsense)
    result = go(backend)
    assert result.ending is Ending.TRIPPED
    assert backend.commands[-1].velocity_base_tip == REST


def test_an_exception_that_cannot_be_shown_is_a_trip_like_others():
    class MuteError(Exception):
        def __str__(self):
            raise RuntimeError("no words")

    result = go(PuppetBackend(), PuppetController({10: MuteError()}))
    assert result.trip.measure == "controller"
    assert "MuteError" in result.trip.value


def test_a_guard_of_ones_own_that_raises_is_not_blamed_on_touch_and_its_period_is_recorded():
    class Faulty:
        def broken(self, now, before):
            if now.time > AT * PERIOD:
                raise ZeroDivisionError
            return

    log = MemoryLog()
    supervisor = Supervisor(guards=(Guard(Faulty()),))
    backend = PuppetBackend()
    result = go(backend, supervisor=supervisor, recorder=Recorder(log))
    assert result.trip.measure == "supervisor"
    assert len(log.record()) == len(backend.commands) + 1


def test_a_broken_observer_does_not_cost_the_record_of_coming_to_rest():
    calls, log, backend = [], MemoryLog(), PuppetBackend()

    def broken(*_):
        calls.append(None)
        if len(calls) > AT:
            raise KeyError

    go(backend, observers=(broken,), recorder=Recorder(log))
    assert len(log.record()) == len(backend.commands) + 1


def test_an_overloaded_sensor_is_drawn_out_of_it_whatever_it_shows():
    """A saturated sensor shows less than there is, and behind a filter shows it late: relief at half of the
    supervisor's force limit is then there from the start, and the finger stays pressed."""
    supervisor = Supervisor()
    supervisor.start(PERIOD)
    now = touch().sense(sample(wrench=(0.0, 0.0, 5.0, 0.0, 0.0, 0.0)))
    now = replace(
        now, fingers=(replace(now.fingers[0], health=SampleHealth(HealthCheck.SATURATED, "Mx", 0.2, 0.12)),)
    )
    assert not supervisor.admits(now)
    assert norm(supervisor.react(now).velocity_base_tip) > 0.0


def test_an_arm_that_says_nothing_new_is_not_taken_to_rest():
    """Its last state is that it stands still; it has moved on since."""
    still = {"time": 0.019, "velocity_base_tip": REST}
    stale = spoilt(lambda now: replace(now, arm=replace(now.arm, **still)), slow_down=10**9)
    assert not go(stale).at_rest


def test_two_packets_lost_in_a_row_do_not_end_the_braking():
    backend = PuppetBackend({AT: OSError("lost"), AT + 1: OSError("lost")})
    result = go(backend)
    assert result.at_rest
    assert backend.at_rest


@pytest.mark.parametrize(
    "changes",
    [{"velocity_base_tip": (0.0, 0.0)}, {"velocity_base_tip": None}, {"time": None}],
    ids=["two numbers", "none", "no time"],
)
def test_an_arm_that_makes_no_sense_while_it_is_brought_to_rest_is_no_exception_out_of_the_run(changes):
    """Found: an IndexError or TypeError instead of the result, after one stop command."""
    backend = spoilt(lambda now: replace(now, arm=replace(now.arm, **changes)))
    result = go(backend)
    assert result.ending is Ending.TRIPPED
    assert not result.at_rest  # nobody knows
    assert {command.velocity_base_tip for command in backend.commands[AT:]} == {REST}


def test_a_hand_without_a_grip_command_does_not_retract_either():
    """It may hold something from before, with "as before" for a grip."""
    backend = Handed(dict.fromkeys(FOR_EVER, HARD))
    go(backend)
    assert {command.velocity_base_tip for command in backend.commands[AT:]} == {REST}


def test_the_default_limits_let_a_hand_grip_as_hard_as_the_grip_limit_says():
    """Found: 40 N of grip are allowed, but a contact force of 20 N of the same finger trips."""
    force = 0.9 * Limits().grip_force
    grip = Command(REST, Phase.HOLD, (force,))
    backend = Handed(dict.fromkeys(range(2000), {"wrench": (0.0, 0.0, force, 0.0, 0.0, 0.0)}))  # noqa: RUF024
    assert go(backend, PuppetController(dict.fromkeys(range(100), grip))).trip is None


def test_two_signals_at_once_are_one_request():
    """The kernel and the shell both send SIGHUP when a terminal is closed."""

    class Closed(PuppetController):
        def step(self, now):
            if len(self.seen) == AT:
                signal.raise_signal(signal.SIGHUP)
                signal.raise_signal(signal.SIGHUP)
            return super().step(now)

    with pytest.raises(KeyboardInterrupt) as raised:
        go(PuppetBackend(), Closed())
    assert result_until(raised.value) is not None
