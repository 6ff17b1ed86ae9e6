"""Real time: deadlines on a grid that never drifts, what is done about missed ones, a thread left as it was."""

import ctypes
import math
import os
import subprocess
import sys
import threading
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import OverrunError
from palpate.runtime import real_time
from palpate.runtime.real_time import MOST_BEHIND, Overrun, RealTime

linux = pytest.mark.skipif(sys.platform != "linux", reason="Linux's scheduler")
PERIOD = 2.0**-10  # whole multiples of it are exact: about 1 kHz


class FakeClock:
    """Time passes by sleeping, by working, and by looking at the clock if `look` [s] is given."""

    def __init__(self, oversleep=0.0, look=0.0):
        self.now, self.oversleep, self.look = 0.0, oversleep, look
        self.wakes, self.looks = [], 0

    def monotonic(self):
        self.now += self.look
        self.looks += 1
        return self.now

    def sleep(self, duration):
        assert duration > 0.0
        self.now += duration + self.oversleep
        self.wakes.append(self.now)


@pytest.fixture
def clock(monkeypatch, request):
    fake = FakeClock(**getattr(request, "param", {}))
    monkeypatch.setattr(real_time, "monotonic", fake.monotonic)
    monkeypatch.setattr(real_time, "sleep", fake.sleep)
    return fake


def test_a_hundred_thousand_periods_do_not_drift(clock):
    """1 ms is no binary fraction: adding it up so often would be off by some 1e-10 s."""
    clock.now, period = 12345.678, 1e-3
    pacer = RealTime(period)
    pacer.start()
    start, off = Fraction(clock.now), []
    for k in range(1, 100_001):
        pacer.wait()
        off.append(abs(clock.now - start - k * Fraction(period)) if k % 997 == 0 else 0)
    assert max(off) <= 2 * math.ulp(clock.now)
    found = pacer.stop()
    assert (len(found.lateness), found.overruns) == (100_000, 0)


work = st.lists(st.integers(0, 24), min_size=1, max_size=60)
"""How long each period's work takes, in eighths of a period: none ends at a deadline but those of whole ones."""


def paced(policy, eighths, oversleep=0.0):
    """Run periods of so much work; return what the pacer says and the number of the deadline after each wait."""
    fake, after = FakeClock(oversleep), []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(real_time, "monotonic", fake.monotonic)
        patch.setattr(real_time, "sleep", fake.sleep)
        pacer = RealTime(PERIOD, policy)
        pacer.start()
        for eighth in eighths:
            fake.now += eighth * PERIOD / 8
            pacer.wait()
            after.append(fake.now / PERIOD)
        return pacer.stop(), after


@pytest.mark.parametrize(
    ("policy", "eighths", "oversleep", "woken", "late", "overruns"),
    [
        (Overrun.SKIP, [0, *[4] * 99], 0.25, [k + 0.25 for k in range(1, 101)], [0.25] * 100, 0),
        (Overrun.CATCH_UP, [44, 0, 0, 0, 0, 0], 0.0, [5.5] * 5 + [6], [4.5, 3.5, 2.5, 1.5, 0.5, 0.0], 5),
        (Overrun.STOP, [8] * 5, 0.0, [1, 2, 3, 4, 5], [0.0] * 5, 0),
    ],
    ids=["late wake-ups do not move the grid", "a short stall is made up for", "work may end with the period"],
)
def test_deadlines_lie_on_the_grid(policy, eighths, oversleep, woken, late, overruns):
    found, after = paced(policy, eighths, oversleep * PERIOD)
    assert (after, found.lateness.values.tolist()) == (woken, [PERIOD * each for each in late])
    assert found.overruns == overruns


@given(work)
def test_skipping_waits_for_the_next_deadline_of_the_grid(eighths):
    found, after = paced(Overrun.SKIP, eighths)
    now, overruns = 0, 0
    for eighth, woken in zip(eighths, after, strict=True):
        done = now + Fraction(eighth, 8)
        following = now + 1
        while following < done:  # work that ends with the period is in time
            following += 1
            overruns += 1
        now = max(following, math.ceil(done))
        assert woken == now
    assert found.overruns == overruns
    np.testing.assert_array_equal(found.lateness.values, 0.0)


@given(work)
def test_catching_up_leaves_out_no_period_until_it_is_too_far_behind(eighths):
    found, after = paced(Overrun.CATCH_UP, eighths)
    index, now = 0, Fraction(0)
    for eighth, woken, late in zip(eighths, after, found.lateness.values.tolist(), strict=True):
        done = now + Fraction(eighth, 8)
        index += 1
        if done - index > MOST_BEHIND:
            index = math.ceil(done)
        now = max(done, Fraction(index))
        assert (woken, late) == (now, (now - index) * PERIOD)
        assert late <= MOST_BEHIND * PERIOD


def test_stopping_says_by_how_much_once_and_then_keeps_the_pace(clock):
    pacer = RealTime(PERIOD, Overrun.STOP)
    pacer.start()
    pacer.wait()
    clock.now += 3.5 * PERIOD
    with pytest.raises(
        OverrunError, match=r"2\.44 ms after its deadline; the limit is the period of 0\.97(.|\n)*SKIP"
    ) as raised:
        pacer.wait()
    assert isinstance(raised.value, TimeoutError)
    for work_, woken in ((0.25, 5), (1.5, 7)):
        clock.now += work_ * PERIOD
        pacer.wait()
        assert clock.now == woken * PERIOD
    assert pacer.stop().overruns == 4


@pytest.mark.parametrize("clock", [{"look": PERIOD / 1024}], indirect=True)
def test_spinning_sleeps_less_and_watches_the_clock_for_the_rest(clock):
    pacer = RealTime(PERIOD, spin=PERIOD / 4)
    pacer.start()
    start = clock.now
    pacer.wait()
    assert clock.wakes == [start + 0.75 * PERIOD]
    assert 0.0 <= clock.now - start - PERIOD <= PERIOD / 1024
    assert clock.looks > 200


def test_it_starts_again_from_nothing(clock):
    pacer = RealTime(PERIOD, Overrun.STOP)
    for _ in range(2):
        pacer.start()
        assert pacer.lateness == 0.0
        pacer.wait()
        clock.now += 1.5 * PERIOD
        with pytest.raises(OverrunError):
            pacer.wait()
        assert pacer.lateness == 0.5 * PERIOD
        assert [(len(found.lateness), found.overruns) for found in (pacer.stop(), pacer.stop())] == [(2, 1)] * 2


def test_in_real_time_it_never_wakes_early():
    pacer = RealTime(2e-3)
    pacer.start()
    for _ in range(50):
        pacer.wait()
    late = pacer.stop().lateness.values
    assert (len(late), late.min() >= 0.0) == (50, True)


def scheduling():
    """Of the calling thread: policy, priority, nice and timer slack."""
    thread = threading.get_native_id()
    with open(f"/proc/{thread}/timerslack_ns") as file:
        slack = int(file.read())
    policy = os.sched_getscheduler(thread)
    return policy, os.sched_getparam(thread).sched_priority, os.getpriority(os.PRIO_PROCESS, thread), slack


def in_a_thread(work):
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()


@linux
@pytest.mark.parametrize("priority", [None, 1, 50])
@pytest.mark.parametrize("elsewhere", [False, True], ids=["", "stopped by another thread"])
def test_the_thread_is_as_before_whatever_happens(priority, elsewhere):
    ctypes.CDLL(None).prctl(
        29, ctypes.c_ulong(40_000), 0, 0, 0
    )  # timer slack [ns]: neither Linux's 50 us nor ours
    before = scheduling()
    assert before[3] == 40_000
    pacer = RealTime(1e-3, priority=priority)
    for _ in range(2):
        pacer.start()
        assert scheduling()[3] <= 1  # a real-time thread has none
        pacer.start()  # twice, by mistake
        pacer.wait()
        in_a_thread(pacer.stop) if elsewhere else pacer.stop()
        assert scheduling()[:3] == before[:3]
        pacer.stop()
        assert elsewhere or scheduling() == before


@linux
def test_only_the_calling_thread_is_urgent_not_those_that_it_starts():
    seen = []
    pacer = RealTime(1e-3, priority=10)
    pacer.start()
    try:
        mine = scheduling()
        in_a_thread(lambda: seen.append(scheduling()))
    finally:
        message = pacer.stop().note
    assert seen[0][:2] == (os.SCHED_OTHER, 0)
    assert seen[0][2] >= 0
    granted = mine[0] == os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
    assert granted == (message == "real-time priority 10 (SCHED_FIFO)")
    assert granted or "going on" in message


@linux
def test_an_interruption_while_it_becomes_urgent_leaves_nothing_behind(monkeypatch):
    before, given = scheduling(), os.sched_setscheduler
    calls = []

    def interrupted(thread, policy, parameter):
        calls.append(policy)
        given(thread, policy, parameter) if len(calls) > 1 else None
        if len(calls) == 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(os, "sched_setscheduler", interrupted)
    pacer = RealTime(1e-3, priority=10)
    with pytest.raises(KeyboardInterrupt):
        pacer.start()
    assert len(calls) == 2
    assert scheduling() == before


WITHOUT_RIGHTS = """
import os, resource, threading
from palpate.runtime.real_time import RealTime
if os.getuid() == 0:
    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    resource.setrlimit(resource.RLIMIT_NICE, (0, 0))
    os.setuid(65534)  # nobody
thread = threading.get_native_id()
before = os.sched_getscheduler(thread), os.getpriority(os.PRIO_PROCESS, thread)
pacer = RealTime(1e-3, priority=50)
pacer.start()
pacer.wait()
print(os.sched_getscheduler(thread) & ~os.SCHED_RESET_ON_FORK, pacer.stop().note)
# the flag that keeps other threads ordinary can stay; the priority may not
assert (os.sched_getscheduler(thread) & ~os.SCHED_RESET_ON_FORK, os.getpriority(os.PRIO_PROCESS, thread)) == before
"""


@pytest.mark.slow
@linux
@pytest.mark.skipif(sys.platform == "win32" or os.getuid() != 0, reason="needs rights to give away")
def test_without_rights_it_says_what_is_missing_and_goes_on():
    done = subprocess.run([sys.executable, "-c", WITHOUT_RIGHTS], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert done.stdout == (
        f"{os.SCHED_OTHER} no permission for real-time priority 50 (RLIMIT_RTPRIO 0): add `@realtime - rtprio 90` "
        "to /etc/security/limits.d/realtime.conf and join that group, or run with CAP_SYS_NICE; going on without\n"
    )


@linux
@pytest.mark.parametrize("allowed", [0, 7])
@pytest.mark.parametrize("nice_is_granted", [False, True])
def test_it_takes_what_the_system_grants(monkeypatch, allowed, nice_is_granted):
    import resource

    before, schedule, nice, policies = scheduling(), os.sched_setscheduler, [], []

    def refuse_real_time(thread, policy, parameter):
        if policy & os.SCHED_FIFO:
            raise PermissionError(1, "Operation not permitted")
        policies.append(policy)
        schedule(thread, policy, parameter)

    def set_nice(which, thread, value):
        nice.append(value)
        if value < before[2] and not nice_is_granted:
            raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse_real_time)
    monkeypatch.setattr(os, "setpriority", set_nice)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (allowed, allowed))
    pacer = RealTime(1e-3, priority=8)
    pacer.start()
    note = pacer.stop().note
    assert f"real-time priority 8 (RLIMIT_RTPRIO {allowed})" in note
    assert ("or ask for at most 7" in note) == (allowed == 7)
    assert note.endswith("going on with nice -20 instead" if nice_is_granted else "going on without")
    assert nice == [-20, before[2]]
    # threads that are started meanwhile are ordinary
    assert policies == [before[0] | os.SCHED_RESET_ON_FORK] * nice_is_granted + [before[0]]
    assert scheduling()[1:] == before[1:]


@pytest.mark.parametrize("platform", ["darwin", "win32"])
@pytest.mark.parametrize(
    ("priority", "note"), [(50, "real-time priority is not supported on {}: going on without"), (None, "")]
)
def test_elsewhere_it_goes_on_without(monkeypatch, platform, priority, note):
    monkeypatch.setattr(sys, "platform", platform)
    pacer = RealTime(1e-3, priority=priority)
    pacer.start()
    pacer.wait()
    assert pacer.stop().note == note.format(platform)


@linux
def test_a_user_who_may_not_take_the_flag_off_still_gets_the_old_policy_back(monkeypatch):
    """The kernel lets a user with RLIMIT_RTPRIO set SCHED_RESET_ON_FORK, but not clear it (sched(7))."""
    asked = []

    def schedule(thread, policy, parameter):
        asked.append((policy, parameter.sched_priority))
        if not policy & os.SCHED_RESET_ON_FORK:
            raise PermissionError(1, "Operation not permitted")

    policy = os.sched_getscheduler(0)
    monkeypatch.setattr(os, "sched_setscheduler", schedule)
    pacer = RealTime(1e-3, priority=8)
    pacer.start()
    assert pacer.stop().note == "real-time priority 8 (SCHED_FIFO)"
    assert asked[0] == (os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, 8)
    assert asked[-1] == (policy | os.SCHED_RESET_ON_FORK, 0)
