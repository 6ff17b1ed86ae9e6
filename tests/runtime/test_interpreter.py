"""The interpreter does nothing long of its own accord, forgets no garbage, and is afterwards as it was."""

import contextlib
import gc
import sys
import threading
import time
import weakref

import pytest

from palpate.runtime.interpreter import IMMORTAL, SWITCH_INTERVAL, undisturbed


class Loop:
    """Cyclic garbage as soon as nobody holds it."""

    def __init__(self):
        self.me = self


@pytest.fixture
def collections():
    """The generation of every collection so far; whatever the test does to the collector is undone."""
    seen = []

    def note(stage, facts):
        if stage == "start":
            seen.append(facts["generation"])

    enabled, thresholds, interval = gc.isenabled(), gc.get_threshold(), sys.getswitchinterval()
    gc.callbacks.append(note)
    yield seen
    gc.callbacks.remove(note)
    gc.unfreeze()
    gc.set_threshold(*thresholds)
    (gc.enable if enabled else gc.disable)()
    sys.setswitchinterval(interval)


def state():
    frozen = max(gc.get_freeze_count() - IMMORTAL, 0)
    return gc.isenabled(), gc.get_threshold(), frozen, sys.getswitchinterval()


def hoard(count):
    """Objects that live on: enough of them make Python look at all there is."""
    return [{"a": [Loop()]} for _ in range(count)]


def test_no_full_collection_however_much_is_kept(collections):
    # many enough that Python would: a quarter of what there was at the last one, which is little now
    gc.freeze()
    gc.collect()
    count = 100_000
    with undisturbed():
        collections.clear()
        kept = hoard(count)
        assert max(collections) == 1
    collections.clear()
    kept = [kept, hoard(count)]
    assert 2 in collections  # the fixture can tell


def test_garbage_does_not_pile_up(collections):
    """What an hour of a controller's cycles would take must not depend on the hour."""
    gone = []
    with undisturbed():
        for _ in range(20_000):
            weakref.finalize(Loop(), gone.append, 1).atexit = False
    assert len(gone) > 19_000


@pytest.mark.slow
def test_a_collection_that_somebody_asks_for_has_nothing_to_look_at(collections):
    gc.collect()
    everything = len(gc.get_objects())  # that it looks at: none of what is frozen
    with undisturbed():
        assert gc.get_freeze_count() > 10_000
        gc.collect()
        assert len(gc.get_objects()) < everything / 10
    assert len(gc.get_objects()) == pytest.approx(everything, rel=0.01)


@pytest.mark.parametrize(
    ("enabled", "thresholds", "interval", "error"),
    [
        (True, (700, 10, 10), 5e-3, None),
        (True, (0, 10, 10), 1e-5, RuntimeError),
        (True, (50, 2, 3), 5.7e-5, KeyboardInterrupt),
        (False, (700, 10, 10), 1e-5, KeyboardInterrupt),
        (False, (0, 10, 10), 5.7e-5, None),
        (False, (50, 2, 3), 5e-3, RuntimeError),
        (True, (50, 2, 3), 1e-5, None),
        (False, (700, 10, 10), 5.7e-5, RuntimeError),
    ],
)
def test_everything_is_as_before(collections, enabled, thresholds, interval, error):
    (gc.enable if enabled else gc.disable)()
    gc.set_threshold(*thresholds)
    sys.setswitchinterval(interval)
    before = state()
    with contextlib.suppress(RuntimeError, KeyboardInterrupt), undisturbed():
        assert (gc.isenabled(), gc.get_threshold()[0] == 0) == (enabled, thresholds[0] == 0)
        assert sys.getswitchinterval() == pytest.approx(min(interval, SWITCH_INTERVAL))
        if error:
            raise error
    assert state() == before


def test_what_was_frozen_before_stays_frozen(collections):
    gc.freeze()
    count = gc.get_freeze_count()
    with undisturbed():
        pass
    assert gc.get_freeze_count() == pytest.approx(count, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    "order", ["ABba", "ABab", "ABxa"], ids=["nested", "overlapping", "the inner one ends with an error"]
)
def test_only_the_last_of_several_runs_restores_the_interpreter(collections, order):
    """Capitals begin a run, other letters end it; robots of several environments overlap."""
    before, runs, seen = state(), {"A": undisturbed(), "B": undisturbed(), "X": None}, []
    runs["X"] = runs["B"]
    for each in order:
        run, error = runs[each.upper()], RuntimeError if each == "x" else None
        run.__enter__() if each.isupper() else run.__exit__(error, error and error(), None)
        seen.append((state()[1], state()[3], gc.get_freeze_count() > 10_000))
    assert seen[:3] == [seen[0]] * 3
    assert seen[0][2]
    assert state() == before


def test_a_busy_thread_gives_way(collections):
    """A thread that computes without a break has Python as long as Python lets it: here to its end, but for us."""
    stop, ended = threading.Event(), []

    def compute():
        for _ in range(20_000_000):  # half a minute
            if stop.is_set():
                return
            sum(range(100))
        ended.append("of its own accord")

    thread = threading.Thread(target=compute)
    sys.setswitchinterval(3600.0)
    with undisturbed():
        thread.start()  # waits for the thread, which gives nothing back
        time.sleep(1e-4)
        stop.set()
    thread.join()
    assert not ended
