"""The loop: every way a run can end leaves the robot at rest and the back end closed."""

import gc
import math

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.runtime.data import Command, Phase
from palpate.runtime.loop import Ending, run
from palpate.runtime.supervisor import Limits, Supervisor
from runtime.puppets import PERIOD, PUSH, REST, PuppetBackend, PuppetController, touch

NAN, INF = math.nan, math.inf


def go(backend, controller=None, duration=0.05, **more):
    return run(backend, touch(), controller or PuppetController(), duration=duration, **more)


@pytest.mark.parametrize(("phase", "ending"), [(Phase.DONE, Ending.DONE), (Phase.LOST, Ending.LOST)])
def test_the_controller_ends_the_run(phase, ending):
    backend = PuppetBackend()
    result = go(backend, PuppetController({20: Command(REST, phase)}))
    assert result.ending is ending
    assert result.trip is None
    assert result.duration == pytest.approx(20 * PERIOD)
    assert len(result.compute_time) == 21
    assert result.stopped
    assert backend.at_rest
    assert backend.closed == 1


def test_time_ends_the_run():
    backend = PuppetBackend()
    result = go(backend)
    assert result.ending is Ending.TIME_UP
    assert result.duration == pytest.approx(0.05)
    assert len(result.compute_time) == 50
    assert result.stopped
    assert backend.at_rest
    assert backend.closed == 1


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
    told, measure = BAD_SAMPLES[name]
    backend = PuppetBackend({20: told})
    result = go(backend)
    assert result.ending is Ending.TRIPPED
    assert measure in result.trip.measure
    assert result.trip.time == pytest.approx(20 * PERIOD)
    for command in backend.commands[20:]:  # stand still, or at most give way to what pushes (along its force)
        x, y, z = command.velocity_base_tip
        assert (x, y) == (0.0, 0.0)
        assert 0.0 <= z <= (0.02 if name == "force over the limit" else 0.0)
    assert result.stopped
    assert backend.at_rest
    assert backend.closed == 1


@pytest.mark.parametrize(
    "velocity", [(NAN, 0.0, 0.0), (0.0, INF, 0.0), (0.0, 0.0, -INF), (0.2, 0.2, 0.0), (1e200, 0.0, 0.0)]
)
def test_a_command_out_of_bounds_never_reaches_the_robot(velocity):
    backend = PuppetBackend()
    result = go(backend, PuppetController({20: Command(velocity, Phase.SCAN)}))
    assert result.ending is Ending.TRIPPED
    assert result.trip.measure == "commanded speed"
    assert backend.moved_as_told_finitely
    assert max(math.hypot(*c.velocity_base_tip) for c in backend.commands) <= 0.25
    assert backend.at_rest
    assert backend.closed == 1


@pytest.mark.parametrize("error", [RuntimeError("no idea"), KeyboardInterrupt(), SystemExit(3)])
@pytest.mark.parametrize("where", ["controller", "observer"])
def test_an_exception_propagates_once_the_robot_rests(error, where):
    backend, count = PuppetBackend(), []

    def observer(sample, now, command):
        count.append(now.time)
        if where == "observer" and len(count) == 11:
            raise error

    script = {10: error} if where == "controller" else {}
    with pytest.raises(type(error)) as raised:
        go(backend, PuppetController(script), observers=(observer,))
    assert raised.value is error
    assert backend.at_rest
    assert backend.closed == 1
    assert backend.closed_after == len(backend.commands)


def test_a_back_end_that_fails_once_is_still_brought_to_rest():
    backend = PuppetBackend({10: OSError("a packet was lost")})
    with pytest.raises(OSError, match="packet") as raised:
        go(backend)
    assert raised.value is backend.script[10]
    assert backend.at_rest
    assert backend.closed == 1


def test_a_back_end_that_fails_for_good_is_closed_and_the_first_failure_is_the_one_reported():
    first = OSError("the cable is out")
    backend = PuppetBackend({10: first} | {step: OSError("not connected") for step in range(11, 999)})
    with pytest.raises(OSError, match="the cable is out") as raised:
        go(backend)
    assert raised.value is first
    assert backend.closed == 1


def test_an_interruption_is_not_hidden_by_a_back_end_that_cannot_be_brought_to_rest():
    backend = PuppetBackend({step: OSError("not connected") for step in range(11, 999)})
    with pytest.raises(KeyboardInterrupt):
        go(backend, PuppetController({10: KeyboardInterrupt()}))
    assert backend.closed == 1


def test_a_failure_at_start_closes_the_back_end_too():
    backend = PuppetBackend({0: ConnectionError("no robot")})
    with pytest.raises(ConnectionError):
        go(backend)
    assert backend.closed == 1
    assert backend.commands == []


def test_a_robot_that_does_not_come_to_rest_is_reported():
    backend = PuppetBackend(slow_down=10**6)
    result = go(backend)
    assert not result.stopped
    assert len(backend.commands) <= 50 + 500
    assert backend.closed == 1


def test_a_turning_point_of_an_oscillation_is_not_rest():
    """The tip swings after the stop: one slow sample between fast ones does not count as stopped."""
    swing = {n: {"velocity": (0.05 * math.cos(0.02 * math.pi * (n - 50)), 0.0, 0.0)} for n in range(51, 900)}
    assert not go(PuppetBackend(swing)).stopped


def test_observers_are_called_once_per_period_with_what_was_commanded():
    backend, calls = PuppetBackend(), []
    go(backend, observers=(lambda *seen: calls.append(seen),) * 2)
    assert len(calls) == 2 * 50
    assert calls[0::2] == calls[1::2]
    assert [c for _, _, c in calls[0::2]] == backend.commands[:50]
    assert [s.time for s, _, _ in calls[0::2]] == pytest.approx(np.arange(50) * PERIOD)
    assert all(s.time == o.time for s, o, _ in calls)


def test_observers_see_the_stop_not_what_the_controller_wanted():
    calls = []
    backend = PuppetBackend({20: {"wrench": (0.0, 0.0, 99.0, 0.0, 0.0, 0.0)}})
    go(backend, observers=(lambda *seen: calls.append(seen),))
    assert calls[-1][2] == Command(REST, Phase.HOLD)
    assert calls[-2][2].velocity_base_tip != REST


def test_the_controller_is_started_once_with_the_first_observation():
    controller = PuppetController()
    go(PuppetBackend(), controller)
    assert len(controller.started) == 1
    assert controller.started[0].time == controller.seen[0].time == 0.0


@pytest.mark.parametrize("enabled", [True, False])
@pytest.mark.parametrize("error", [None, RuntimeError("no idea")])
def test_garbage_collection_is_off_in_the_loop_and_afterwards_as_before(enabled, error):
    inside, before = [], gc.isenabled()
    script = {10: error} if error else {}
    try:
        (gc.enable if enabled else gc.disable)()
        try:
            go(
                PuppetBackend(),
                PuppetController(script),
                observers=(lambda *_: inside.append(gc.isenabled()),),
            )
        except RuntimeError:
            assert error
        assert gc.isenabled() == enabled
    finally:
        (gc.enable if before else gc.disable)()
    assert not any(inside)


@pytest.mark.parametrize("duration", [0.0, -1.0, NAN, INF])
def test_a_duration_that_cannot_be_is_refused_before_anything_starts(duration):
    backend = PuppetBackend()
    with pytest.raises(InvalidValueError, match="duration"):
        go(backend, duration=duration)
    assert backend.commands == []


def test_a_wrong_number_of_wrenches_is_refused():
    backend = PuppetBackend({0: {"wrenches": (PUSH, PUSH)}})
    with pytest.raises(InvalidValueError, match="2 wrenches: there are 1 fingers"):
        go(backend)
    assert backend.closed == 1


def test_wrenches_that_change_in_number_stop_the_robot():
    backend = PuppetBackend({20: {"wrenches": ()}})
    with pytest.raises(InvalidValueError, match="0 wrenches"):
        go(backend)
    assert backend.at_rest
    assert backend.closed == 1


def test_compute_time_counts_overruns():
    result = go(PuppetBackend())
    assert result.compute_time.shape == (50,)
    assert np.all(result.compute_time > 0.0)
    assert result.overruns == np.sum(result.compute_time > PERIOD)
    assert result.real_time_factor == pytest.approx(result.duration / result.wall_time)


def test_a_tripped_supervisor_stays_tripped_in_the_next_run():
    supervisor = Supervisor(Limits(speed=0.005))
    assert go(PuppetBackend(), supervisor=supervisor).ending is Ending.TRIPPED
    backend = PuppetBackend()
    assert go(backend, supervisor=supervisor).ending is Ending.TRIPPED
    assert {c.velocity_base_tip for c in backend.commands} == {REST}
