"""Live parameters: always in bounds, never faster than their rate, the same again from a log, from any thread."""

import math
import sys
import threading
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.runtime.live import (
    LONGEST_ELAPSED,
    Change,
    LiveParameter,
    LiveParameters,
    ScheduledChanges,
    Tunable,
    live_parameters_of,
)
from palpate.runtime.replay import RecordedChanges

PERIOD = 1e-3
FORCE = LiveParameter("force", 2.0, 0.3, 15.0, 5.0, "N", "normal force to hold")
SPEED = LiveParameter("speed", 0.02, 0.001, 0.1, 0.5, "m/s", "speed along the surface")
BOTH = {"force": FORCE, "speed": SPEED}

any_float = st.floats(allow_nan=True, allow_infinity=True)
requests = st.one_of(
    st.tuples(st.just("force"), st.one_of(any_float, st.floats(0.3, 15.0))),
    st.tuples(st.just("speed"), st.one_of(any_float, st.floats(0.001, 0.1))),
)
gaps = st.one_of(st.just(PERIOD), st.floats(0.0, 0.02), st.floats(-1.0, 10.0), st.just(math.nan))
"""From period to period [s]: steady, uneven, backwards, for ever."""
histories = st.lists(st.tuples(gaps, st.lists(requests, max_size=3)), max_size=60)


def live():
    return LiveParameters(FORCE, SPEED)


def ask(parameters, name, value):
    """Request it; whether it was accepted."""
    try:
        parameters.request(name, value)
    except InvalidValueError:
        return False
    return True


def ramp(parameters, seconds, start=0.0):
    """Values of the force over some seconds of periods."""
    forces = []
    for i in range(round(seconds / PERIOD)):
        parameters.step(start + i * PERIOD)
        forces.append(parameters.value("force"))
    return forces


@settings(max_examples=300, deadline=None, derandomize=True)
@given(histories)
def test_whatever_is_requested_whenever_values_stay_in_bounds_and_within_their_rate(history):
    parameters, time = live(), 0.0
    before = parameters.values
    for gap, asked in history:
        last, time = time, gap if math.isnan(time) else time + gap
        for name, value in asked:
            assert ask(parameters, name, value) == (BOTH[name].lower <= value <= BOTH[name].upper)
        parameters.step(time)
        elapsed = min(max(time - last, 0.0), LONGEST_ELAPSED) if math.isfinite(time - last) else 0.0
        for name, now in parameters.values.items():
            assert BOTH[name].lower <= now <= BOTH[name].upper
            assert abs(now - before[name]) <= BOTH[name].rate * elapsed * (1 + 1e-9) + 1e-15
            # never past its target, never away from it
            assert sorted((before[name], now, parameters.targets[name]))[1] == now
        before = parameters.values


@settings(max_examples=100, deadline=None, derandomize=True)
@given(histories)
def test_the_recorded_changes_give_the_same_values_again_bit_for_bit(history):
    original, log, periods, time = live(), [], [], 0.0
    for gap, asked in history:
        time += abs(gap) + 1e-9 if math.isfinite(gap) else PERIOD  # times of samples advance
        for name, value in asked:
            ask(original, name, value)
        log += original.step(time)
        periods.append((time, original.values))
    again = live()
    recorded = RecordedChanges(again, list(log))
    for time, values in periods:
        assert (recorded.step(time), again.values) == (tuple(x for x in log if x.time == time), values)


def test_a_request_is_reached_at_its_rate_and_held_also_after_a_gap():
    parameters = live()
    parameters.step(0.0)
    parameters.request("force", 3.0)
    forces = ramp(parameters, 0.3, start=PERIOD)
    assert (forces[99], forces[200:]) == (pytest.approx(2.5), [3.0] * 100)
    assert parameters.value("speed") == SPEED.value
    parameters.request("force", 15.0)
    parameters.step(100.0)
    assert parameters.value("force") == pytest.approx(3.0 + 5.0 * LONGEST_ELAPSED)


def test_of_requests_in_one_period_the_newest_counts_for_each_parameter():
    parameters = live()
    for name, value in (("force", 9.0), ("speed", 0.05), ("force", 1.0)):
        parameters.request(name, value)
    assert set(parameters.step(0.5)) == {Change(0.5, "speed", 0.05), Change(0.5, "force", 1.0)}
    assert parameters.step(0.5 + PERIOD) == ()
    assert parameters.targets == {"force": 1.0, "speed": 0.05}


def test_a_change_of_mind_turns_round_without_a_jump():
    parameters, forces = live(), []
    for target, seconds in ((15.0, 0.1), (0.3, 0.5)):
        parameters.request("force", target)
        forces += ramp(parameters, seconds, start=len(forces) * PERIOD)
    assert (max(forces), forces[-1]) == (pytest.approx(2.5, abs=0.01), 0.3)
    assert max(abs(b - a) for a, b in pairwise(forces)) <= 5.0 * PERIOD * (1 + 1e-9)


def test_restarted_all_is_as_at_first_and_requests_are_forgotten():
    parameters, runs = live(), []
    for _ in range(2):
        parameters.request("speed", 0.1)
        parameters.restart()
        assert parameters.values == parameters.targets == {"force": 2.0, "speed": 0.02}
        assert parameters.step(7.0) == ()
        parameters.restart()
        parameters.request("force", 5.0)
        runs.append(ramp(parameters, 0.2))
        assert parameters.targets == {"force": 5.0, "speed": 0.02}
    assert runs[0] == runs[1]


@pytest.mark.parametrize("bad", [0.2, 15.1, -1.0, math.nan, math.inf, -math.inf, "much", None])
def test_a_refused_request_changes_nothing(bad):
    parameters = live()
    with pytest.raises(InvalidValueError, match=r"force = .* N: must lie between 0\.3 and 15 N"):
        parameters.request("force", bad)
    assert parameters.step(0.0) == ()


def test_the_loop_finds_the_live_parameters_of_controllers_that_have_some():
    tuned, nothing = SimpleNamespace(live=live()), live_parameters_of(object())
    assert isinstance(tuned, Tunable)
    assert live_parameters_of(tuned) is tuned.live
    assert (nothing.step(0.0), dict(nothing.parameters)) == ((), {})


def test_a_thread_that_hammers_neither_breaks_nor_delays_nor_floods_the_loop():
    parameters, values, changes, done = live(), [], [], threading.Event()
    ends = [(name, end) for name, each in BOTH.items() for end in (each.lower, each.upper)]

    def hammer():
        for i in range(100_000):
            parameters.request(*ends[i % 4])
        parameters.request("force", 7.0)
        done.set()

    thread, switching, time = threading.Thread(target=hammer, daemon=True), sys.getswitchinterval(), 0.0
    sys.setswitchinterval(1e-5)  # as many races as can be had
    try:
        thread.start()
        while thread.is_alive():
            time += PERIOD
            changes.append(parameters.step(time))
            values.append(parameters.values)
    finally:
        sys.setswitchinterval(switching)
    changes.append(parameters.step(time + PERIOD))
    assert done.is_set()  # no request failed
    assert max(map(len, changes)) <= 2  # bounded work: one per parameter and period
    assert sum(map(len, changes)) > 2
    for name, given_ in BOTH.items():
        series = np.array([each[name] for each in values])
        assert given_.lower <= series.min()
        assert series.max() <= given_.upper
        assert np.abs(np.diff(series)).max() <= given_.rate * PERIOD * (1 + 1e-6)
    assert parameters.targets["force"] == 7.0  # the last request is not lost


def test_scheduled_changes_are_requested_when_due_counted_from_the_first_period():
    parameters = live()
    scheduled = ScheduledChanges(parameters, [Change(0.2, "force", 3.0), Change(0.1, "speed", 0.05)])
    taken = []
    for i in range(300):
        taken += scheduled.step(50.0 + i * PERIOD)
    assert [(change.name, change.value) for change in taken] == [("speed", 0.05), ("force", 3.0)]
    assert [change.time for change in taken] == pytest.approx([50.1, 50.2], abs=1.01 * PERIOD)
