"""The loop: every way a run can end leaves the robot at rest and the back end closed."""

import gc
import math
import signal
from collections import deque

import numpy as np
import pytest

from palpate.errors import InvalidValueError, LatchedError, OverrunError
from palpate.hw.devices import DeviceError
from palpate.runtime.data import Command, Phase
from palpate.runtime.following import LONGEST_DELAY, MEMORY, SMALLEST, CommandedMotion, FollowingError
from palpate.runtime.loop import run
from palpate.runtime.result import Ending, result_until
from palpate.runtime.supervision import Limits, Supervisor
from runtime.puppets import PERIOD, PUSH, REST, PuppetBackend, PuppetController, sample, touch

NAN, INF = math.nan, math.inf


def go(backend, controller=None, duration=0.05, **more):
    return run(backend, touch(), controller or PuppetController(), duration=duration, **more)


def ended(backend, result):
    """How the run ended; in any case at rest, with the back end closed once, after the last command."""
    assert (result.at_rest, backend.at_rest) == (True, True)
    assert (backend.closed, backend.closed_after) == (1, len(backend.commands))
    return result.ending


def failing_from(step, first):
    """A back end that answers no more."""
    return PuppetBackend({step: first} | {later: OSError("not connected") for later in range(step + 1, 999)})


@pytest.mark.parametrize(
    ("script", "ending", "periods"),
    [
        ({20: Command(REST, Phase.DONE)}, Ending.DONE, 20),
        ({20: Command(REST, Phase.LOST)}, Ending.LOST, 20),
        ({}, Ending.TIME_UP, 50),
    ],
)
def test_the_controller_or_the_time_ends_the_run(script, ending, periods):
    backend = PuppetBackend()
    result = go(backend, PuppetController(script))
    assert (ended(backend, result), result.trip) == (ending, None)
    assert result.duration == pytest.approx(periods * PERIOD)
    assert len(result.timing.compute) == periods + (ending is not Ending.TIME_UP)


BAD_SAMPLES = {
    "force is NaN": ({"wrench": (NAN, *PUSH[1:])}, "wrench"),
    "moment is NaN": ({"wrench": (*PUSH[:5], NAN)}, "wrench"),
    "force is infinite": ({"wrench": (0.0, INF, *PUSH[2:])}, "wrench"),
    "force over the limit": ({"wrench": (0.0, 0.0, 20.1, 0.0, 0.0, 0.0)}, "contact force"),
    "position is NaN": ({"position": (0.0, NAN, 0.0)}, "arm state"),
    "velocity is NaN": ({"velocity": (0.0, 0.0, NAN)}, "arm state"),
    "outside the workspace": ({"position": (0.0, 1.01, 0.0)}, "tip position"),
}


@pytest.mark.parametrize("name", BAD_SAMPLES)
def test_a_sample_out_of_bounds_trips(name):
    bad, measure = BAD_SAMPLES[name]
    backend = PuppetBackend({20: bad})
    result = go(backend)
    assert ended(backend, result) is Ending.TRIPPED
    assert measure in result.trip.measure
    assert result.trip.time == pytest.approx(20 * PERIOD)
    moves = np.array([command.velocity_base_tip for command in backend.commands[20:]])
    assert (moves[:, :2] == 0.0).all()  # stand still, or at most give way to what pushes (along its force)
    assert moves[:, 2].min() >= 0.0
    assert moves[:, 2].max() <= (0.02 if name == "force over the limit" else 0.0)


@pytest.mark.parametrize(
    "velocity", [(NAN, 0.0, 0.0), (0.0, INF, 0.0), (0.0, 0.0, -INF), (0.2, 0.2, 0.0), (1e200, 0.0, 0.0)]
)
def test_a_command_out_of_bounds_never_reaches_the_robot(velocity):
    backend = PuppetBackend()
    result = go(backend, PuppetController({20: Command(velocity, Phase.SCAN)}))
    assert ended(backend, result) is Ending.TRIPPED
    assert result.trip.measure in ("commanded velocity", "commanded speed")
    assert max(math.hypot(*c.velocity_base_tip) for c in backend.commands) <= 0.25


@pytest.mark.parametrize("where", ["controller", "observer"])
def test_an_exception_is_a_trip_and_comes_with_the_result(where):
    error, backend, count = RuntimeError("no idea"), PuppetBackend(), []

    def observer(sample, now, command):
        count.append(now.time)
        if where == "observer" and len(count) == 11:
            raise error

    result = go(backend, PuppetController({10: error} if where == "controller" else {}), observers=(observer,))
    assert (ended(backend, result), result.error, result.trip.measure) == (Ending.TRIPPED, error, where)
    assert result.why == f"{where} was RuntimeError: no idea at t = {result.trip.time:.3f} s"
    assert {c.velocity_base_tip for c in backend.commands[10:]} == {REST}


@pytest.mark.parametrize("error", [KeyboardInterrupt(), SystemExit(3)])
@pytest.mark.parametrize("broken", [False, True], ids=["", "back end fails"])
def test_requests_to_end_the_process_propagate_once_the_robot_rests(error, broken):
    backend = failing_from(11, OSError("not connected")) if broken else PuppetBackend()
    with pytest.raises(type(error)) as raised:
        go(backend, PuppetController({10: error}))
    assert raised.value is error
    assert (backend.closed, broken or backend.at_rest) == (1, True)


def test_an_exception_with_a_user_message_is_reported_by_that_alone():
    """And the log keeps what raised it: the extent of a replay is read from there."""
    lost = DeviceError(
        "UR arm at 127.0.0.2", "its newest sample is 104 ms old, the limit is 100 ms", "close programs"
    )
    for error in (lost, OverrunError("a period took 9 ms: close programs")):
        result = go(PuppetBackend({10: error}))
        assert result.why == f"at t = {result.trip.time:.3f} s, {error}"
        assert str(result.trip).startswith(f"back end was {type(error).__name__}: {error}")
        assert "the limit is no exception" not in str(result.trip)
    numbered = go(PuppetBackend({10: ConnectionRefusedError(111, "Connection refused")}))
    assert numbered.why.startswith("back end was ConnectionRefusedError: ")


def test_a_back_end_that_fails_is_closed_and_brought_to_rest_if_it_fails_only_once():
    """The first failure is the one reported."""
    first = OSError("the cable is out")
    once, for_good = PuppetBackend({10: first}), failing_from(10, first)
    result, stuck = go(once), go(for_good)
    assert (ended(once, result), result.error, result.trip.measure) == (Ending.TRIPPED, first, "back end")
    assert (stuck.error, stuck.at_rest, for_good.closed) == (first, False, 1)
    assert "the cable is out" in str(stuck.trip)


@pytest.mark.parametrize(
    ("script", "error", "message"),
    [
        ({0: ConnectionError("no robot")}, ConnectionError, "no robot"),
        ({0: {"wrenches": (PUSH, PUSH)}}, InvalidValueError, "2 wrenches: there are 1 fingers"),
    ],
)
def test_a_failure_at_start_closes_the_back_end_too(script, error, message):
    backend = PuppetBackend(script)
    with pytest.raises(error, match=message):
        go(backend)
    assert (backend.closed, backend.commands) == (1, [])


SWING = {n: {"velocity": (0.05 * math.cos(0.02 * math.pi * (n - 50)), 0.0, 0.0)} for n in range(51, 900)}
CREEP = {k: {"position": (4e-3 * k * PERIOD, 0.0, 0.0), "velocity": REST} for k in range(5000)}


@pytest.mark.parametrize(
    "backend",
    [PuppetBackend(slow_down=10**6), PuppetBackend(SWING), PuppetBackend(CREEP)],
    ids=["goes on", "swings: a turning point is not rest", "creeps at 4 mm/s and reports rest"],
)
def test_a_robot_that_does_not_come_to_rest_is_reported(backend):
    result = go(backend, PuppetController(velocity=REST if backend.script is CREEP else (0.01, 0.0, 0.0)))
    assert (result.at_rest, backend.closed) == (False, 1)
    assert len(backend.commands) <= 50 + 500


def test_observers_are_called_once_per_period_with_what_was_commanded():
    backend, calls, controller = PuppetBackend(), [], PuppetController()
    go(backend, controller, observers=(lambda *seen: calls.append(seen),) * 2)
    seen = calls[0::2]
    assert seen == calls[1::2]
    assert [c for _, _, c in seen[:50]] == backend.commands[:50]
    assert {c for _, _, c in seen[50:]} == {Command(phase=Phase.STOP)}  # coming to rest is seen too
    assert [s.time for s, _, _ in seen] == pytest.approx(np.arange(len(seen)) * PERIOD)
    assert all(s.time == o.time for s, o, _ in calls)
    # the controller is started once, with the first observation
    assert [now.time for now in controller.started] == [controller.seen[0].time] == [0.0]


@pytest.mark.parametrize("error", [None, RuntimeError("no idea")])
def test_full_garbage_collections_wait_until_the_run_is_over(error):
    """They take 100 ms: `palpate.runtime.interpreter`."""
    inside, before = [], gc.get_threshold()
    script = {10: error} if error else {}
    go(PuppetBackend(), PuppetController(script), observers=(lambda *_: inside.append(gc.get_threshold()),))
    assert gc.get_threshold() == before
    assert {full for _, _, full in inside} == {2**31 - 1}


def test_observers_see_the_stop_not_the_command_of_the_controller():
    calls = []
    hard = PuppetBackend({20: {"wrench": (0.0, 0.0, 99.0, 0.0, 0.0, 0.0)}})
    go(hard, observers=(lambda *seen: calls.append(seen[2]),))
    assert [c.velocity_base_tip for c in calls[19:21]] == [(0.01, 0.0, 0.0), pytest.approx((0.0, 0.0, 0.02))]
    assert calls[-1] == Command(REST, Phase.STOP)


def test_wrenches_that_change_in_number_stop_the_robot():
    backend = PuppetBackend({20: {"wrenches": ()}})
    result = go(backend)
    assert (ended(backend, result), result.trip.measure) == (Ending.TRIPPED, "touch")
    assert "0 wrenches" in result.trip.value
    assert {c.velocity_base_tip for c in backend.commands[20:]} == {REST}


def test_every_period_is_timed():
    result = go(PuppetBackend())
    assert len(result.timing.compute) == 50
    assert np.all(result.timing.compute.values > 0.0)
    assert len(result.timing.period_time) == 49
    assert np.all(result.timing.period_time.values >= result.timing.compute.values[:-1])
    assert result.timing.overruns == 0  # simulated time cannot be late
    assert result.real_time_factor == pytest.approx(result.duration / result.wall_time)


def test_a_tripped_supervisor_lets_nothing_move_until_it_is_reset():
    supervisor = Supervisor(Limits(speed=0.005))
    assert go(PuppetBackend(), supervisor=supervisor).ending is Ending.TRIPPED
    backend = PuppetBackend()
    with pytest.raises(LatchedError, match=r"commanded speed was .* call its reset"):
        go(backend, supervisor=supervisor)
    assert backend.commands == []
    supervisor.reset()
    assert go(PuppetBackend(), PuppetController(velocity=(0.004, 0.0, 0.0)), supervisor=supervisor).trip is None


class AskingController(PuppetController):
    """Sends its own process a signal at a period."""

    def __init__(self, number, period):
        super().__init__()
        self._number, self._period = number, period

    def step(self, now):
        if len(self.seen) == self._period:
            signal.raise_signal(self._number)
        return super().step(now)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_the_run_between_periods_with_all_that_is_known(name):
    number = getattr(signal, name)
    before, backend = signal.getsignal(number), PuppetBackend()
    with pytest.raises(KeyboardInterrupt) as raised:
        go(backend, AskingController(number, 20))
    result = result_until(raised.value)
    assert (ended(backend, result), result.trip) == (Ending.INTERRUPTED, None)
    assert len(result.timing.compute) == 21
    assert {c.velocity_base_tip for c in backend.commands[20:]} == {REST}
    assert signal.getsignal(number) is before


def test_the_second_ctrl_c_ends_a_loop_that_hangs():
    class Hanging(PuppetBackend):
        def step(self, command):
            if len(self.commands) == 10:
                self.commands.append(command)
                signal.raise_signal(signal.SIGINT)
                signal.raise_signal(signal.SIGINT)  # nothing happened, so once more
                raise AssertionError("went on")
            return super().step(command)

    backend = Hanging()
    with pytest.raises(KeyboardInterrupt):
        go(backend)
    assert backend.closed == 1
    assert backend.at_rest


HOLD = (3.0, 3.0)
ENDINGS_WITH_A_LOAD = {
    "done": {20: Command(REST, Phase.DONE)},
    "exception": {20: RuntimeError("no idea")},
    "too fast": {20: Command((9.0, 0.0, 0.0), Phase.HOLD, (0.0, 0.0))},
    "lets go by mistake": {20: Command((0.01, 0.0, 0.0), Phase.HOLD, (NAN, 3.0))},
    "forgets a finger": {20: Command((0.01, 0.0, 0.0), Phase.HOLD, (3.0,))},
    "time is up": {},
    "wrench is NaN": {},
}


@pytest.mark.parametrize("name", ENDINGS_WITH_A_LOAD)
def test_a_held_object_is_not_dropped_however_the_run_ends(name):
    """The puppet lets go unless every command keeps the grip: zero newtons, or none where some were."""
    squeeze = dict.fromkeys(range(50), Command((0.01, 0.0, 0.0), Phase.HOLD, HOLD))
    backend = PuppetBackend({20: {"wrench": (NAN,) * 6}} if name == "wrench is NaN" else {})
    go(backend, PuppetController(squeeze | ENDINGS_WITH_A_LOAD[name]))
    assert {c.grip_force for c in backend.commands} == {HOLD}


@pytest.mark.parametrize("velocity", [0.005, 0.02, 0.2])
def test_an_arm_that_follows_no_command_is_stopped_by_name_within_the_stated_time(velocity):
    """Its stamps go on and it reports rest; before, it was commanded for as long as the controller liked."""
    backend = PuppetBackend({k: {"position": REST, "velocity": REST} for k in range(20000)})
    supervisor = Supervisor(Limits(contact_speed=0.2, acceleration=1000.0))
    result = go(backend, PuppetController(velocity=(velocity, 0.0, 0.0)), supervisor=supervisor, duration=10.0)
    assert "the tip went 0 mm where" in result.why
    stated = LONGEST_DELAY + SMALLEST / velocity
    forgotten = -MEMORY * math.log(1.0 - stated / MEMORY)  # commands of long ago count less
    assert stated <= result.trip.time <= forgotten + 2 * PERIOD


NOW = touch().sense(sample())


@pytest.mark.parametrize(("delay", "share"), [(0.0, 0.2), (0.1, 0.2), (0.02, 1.0), (0.0, 1.5), (0.1, 1.5)])
def test_an_arm_that_follows_late_or_slowed_down_goes_on(delay, share):
    arm, late = CommandedMotion(PERIOD, sample().arm), deque([0.0] * round(delay / PERIOD))
    position = 0.0
    for k in range(8000):
        velocity = 0.1 * math.sin(2.0 * PERIOD * k)
        late.append(velocity)
        position += share * PERIOD * late.popleft()
        arm.take(Command((velocity, 0.0, 0.0)), NOW, sample(position=(position, 0.0, 0.0)))


@pytest.mark.parametrize("turned", [(0.0, 1.0), (-1.0, 0.0)])
def test_an_arm_that_goes_elsewhere_than_commanded_is_found(turned):
    arm = CommandedMotion(PERIOD, sample().arm)
    states = [sample(position=(2e-5 * k * turned[0], 2e-5 * k * turned[1], 0.0)) for k in range(1, 1000)]
    with pytest.raises(FollowingError, match="another frame"):
        all(arm.take(Command((0.02, 0.0, 0.0)), NOW, state) is None for state in states)
