"""What every streaming sensor does, on a link and a clock that are made up."""

import math
import threading
import time
from collections.abc import Iterator, Sequence
from itertools import pairwise

import pytest

from palpate.hw.devices import DeviceError
from palpate.hw.ft_stream import StreamCounts, StreamedSensor, StreamReading, StreamSettings, streamed_sensor
from support.waiting import until

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
SETTINGS = StreamSettings(NOISE, silent_after=0.5, start_within=30.0)


class Clock:
    """Stands still until somebody moves it [s]."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made_up = Clock()
    monkeypatch.setattr(streamed_sensor, "monotonic", made_up)
    return made_up


def refused(ft: StreamedSensor) -> str:
    """What a reading is refused for; empty if it is not."""
    try:
        ft.read()
    except DeviceError as error:
        return str(error)
    return ""


class MadeUpLink:
    """Gives a set reading every 2 ms of its clock, which is no faster than the real one."""

    name = "made-up sensor"

    def __init__(self, clock: Clock) -> None:
        self.clock, self.asked = clock, list[float]()
        self.counts = StreamCounts()
        self.failure: Exception | None = None
        self.silent = False
        self.closed = 0

    def open(self) -> None:
        self.failure = None

    def request(self) -> None:
        self.asked.append(self.clock.now)

    def receive(self) -> Sequence[StreamReading]:
        time.sleep(0.002)
        self.clock.now += 0.002
        if self.failure:
            self.clock.now += 0.01
            raise self.failure
        if self.silent:
            return ()
        self.counts.records += 1
        return (StreamReading(self.clock.now, self.clock.now, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), 0),)

    def problem(self, status: int) -> str:
        return ""

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def link(clock: Clock) -> MadeUpLink:
    return MadeUpLink(clock)


@pytest.fixture
def ft(link: MadeUpLink) -> Iterator[StreamedSensor]:
    sensor = StreamedSensor(link, SETTINGS)
    sensor.start()
    yield sensor
    sensor.close()


def test_a_bug_in_the_reading_thread_is_reported_and_a_new_start_helps(
    clock: Clock, link: MadeUpLink, ft: StreamedSensor
) -> None:
    link.failure = ZeroDivisionError("a bug")
    until(lambda: ft._died)
    clock.now += 2.0 * SETTINGS.silent_after
    assert "thread has ended: ZeroDivisionError: a bug" in refused(ft)
    ft.start()
    assert ft.read().wrench[:3] == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(("undated", "words"), [(0, "silent for 41 ms"), (1, "nothing proves yet how old")])
def test_silence_is_reported_after_its_time_limit_and_not_before(clock: Clock, undated: int, words: str) -> None:
    """Records that nothing dates are no better than none."""

    class Stopped(MadeUpLink):
        def receive(self) -> Sequence[StreamReading]:
            if self.counts.records:
                time.sleep(0.002)
                return (StreamReading(self.clock.now, -math.inf, (9.0,) * 6, 0),) * undated
            return super().receive()

    ft = StreamedSensor(Stopped(clock), StreamSettings(NOISE))
    ft.start()
    clock.now += 0.0399
    assert ft.read().wrench == (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)
    clock.now += 0.001
    assert words in refused(ft)
    ft.close()


def test_a_new_start_forgets_the_tare(ft: StreamedSensor) -> None:
    ft.tare()
    assert ft.read().wrench[:3] == (0.0, 0.0, 0.0)
    ft.start()
    assert ft.read().wrench[:3] == (1.0, 2.0, 3.0)


def test_a_tare_that_goes_silent_keeps_the_old_zero(link: MadeUpLink, ft: StreamedSensor) -> None:
    link.silent = True
    with pytest.raises(DeviceError, match="silent"):
        ft.tare()
    link.silent = False
    until(lambda: not refused(ft))
    assert ft.read().wrench[:3] == (1.0, 2.0, 3.0)


def test_a_broken_wire_is_retried_and_reported_meanwhile(link: MadeUpLink, ft: StreamedSensor) -> None:
    link.failure = OSError("no route")
    until(lambda: "no route" in refused(ft) and len(link.asked) >= 4)
    _, *again = link.asked
    assert all(0.1 < b - a < 0.125 for a, b in pairwise(again))  # every tenth of a second
    link.failure = None
    until(lambda: not refused(ft))
    assert ft.read().healthy


def test_foreign_records_are_distinguished_from_silence(link: MadeUpLink) -> None:
    link.silent = True
    link.counts.refused = 7
    with pytest.raises(DeviceError, match="7 pieces of what arrived"):
        StreamedSensor(link, StreamSettings(NOISE, start_within=0.3)).start()
    assert link.closed >= 1


@pytest.mark.slow
def test_a_device_is_not_asked_to_begin_anew_because_this_computer_slept(clock: Clock) -> None:
    """What has come meanwhile lies there: it is read before the device is taken for silent."""

    class Asleep(tuple[StreamReading, ...]):
        """Records after which the reading thread is not run for a while."""

        def __getitem__(self, i):
            clock.now += 0.2
            return super().__getitem__(i)

    class Held(MadeUpLink):
        sleeps = 0

        def receive(self) -> Sequence[StreamReading]:
            records = super().receive()
            self.sleeps += 1
            return Asleep(records) if self.sleeps % 5 == 0 else records

    link = Held(clock)
    ft = StreamedSensor(link, SETTINGS)
    ft.start()
    until(lambda: link.sleeps > 20)
    ft.close()
    assert len(link.asked) == 1


@pytest.mark.slow
def test_a_sensor_is_not_called_silent_because_this_computer_slept(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The loop may run first afterwards: it looks again before it believes that nothing came."""

    class Gated(MadeUpLink):
        open_gate = threading.Event()

        def receive(self) -> Sequence[StreamReading]:
            self.open_gate.wait()
            return super().receive()

    monkeypatch.setattr(
        streamed_sensor, "_STALE_RETRIES", 5000
    )  # seconds, in which any machine runs the other thread
    link = Gated(clock)
    link.open_gate.set()
    ft = StreamedSensor(link, SETTINGS)
    ft.start()
    link.open_gate.clear()
    clock.now += 1.5 * SETTINGS.silent_after
    link.open_gate.set()
    assert ft.read().healthy
    ft.close()
