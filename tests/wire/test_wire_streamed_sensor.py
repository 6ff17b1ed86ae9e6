"""What every streaming sensor does, on a link that is made up."""

import threading
import time
from collections.abc import Sequence

import pytest

from ft_host import state
from palpate.hw.devices import DeviceError, SensorDevice
from palpate.hw.emulators.netft import BoxSettings, NetFtServer, OnRobotServer, onrobot_box
from palpate.hw.emulators.serial_ft import BotaServer, ResenseServer
from palpate.hw.emulators.server import Server
from palpate.hw.ft_stream import Record, StreamCounts, StreamedSensor, StreamSettings, streamed_sensor
from palpate.hw.netft import NetFt, NetFtSettings, Scales
from palpate.hw.serial_ft import Bota, Resense, SerialSensor
from waiting import until

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
SETTINGS = StreamSettings(NOISE, silent_after=0.5, start_within=3.0)
"""A busy machine stands still for tens of milliseconds."""


def refused(ft: StreamedSensor) -> str:
    """What a reading is refused for; empty if it is not."""
    try:
        ft.read()
    except DeviceError as error:
        return str(error)
    return ""


class MadeUpLink:
    """Gives what it is told to, every 2 ms."""

    name = "made-up sensor"

    def __init__(self) -> None:
        self.counts = StreamCounts()
        self.failure: Exception | None = None
        self.silent = False
        self.closed = 0

    def open(self) -> None:
        self.failure = None

    def request(self) -> None:
        self.counts.requests += 1

    def receive(self) -> Sequence[Record]:
        time.sleep(0.002)
        if self.failure:
            raise self.failure
        if self.silent:
            return ()
        self.counts.records += 1
        return (Record(time.monotonic(), None, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), 0, anew=False),)

    def problem(self, status: int) -> str:
        return ""

    def close(self) -> None:
        self.closed += 1


def test_sensors_and_emulators_are_what_a_rig_and_a_host_take() -> None:
    stream = StreamSettings(NOISE)
    devices: list[SensorDevice] = [
        NetFt("127.0.0.1", NetFtSettings(stream, Scales(1.0, 1.0))),
        SerialSensor("/dev/null", Bota(51), stream),
        SerialSensor("/dev/null", Resense((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)), stream),
    ]
    servers: list[Server] = [
        NetFtServer(BoxSettings(rdt_port=0, calibration_port=0)),
        OnRobotServer(onrobot_box(rdt_port=0)),
        BotaServer(sensor=1),
        ResenseServer(sensor=1),
    ]
    for device in devices:
        device.close()
    for server in servers:
        server.take(state((0.0,) * 6, (1.0,) * 6))
        server.close()
        assert server.name
        assert server.address


def test_a_bug_in_the_reading_thread_is_told_and_a_new_start_helps() -> None:
    link = MadeUpLink()
    ft = StreamedSensor(link, SETTINGS)
    ft.start()
    link.failure = ZeroDivisionError("a bug")
    until(lambda: "thread has ended: ZeroDivisionError: a bug" in refused(ft))
    ft.start()
    assert ft.read().wrench[:3] == (1.0, 2.0, 3.0)
    ft.close()


@pytest.mark.slow
def test_a_device_that_begins_anew_is_stamped_by_its_new_count() -> None:
    class Counting(MadeUpLink):
        sampled, first, anew = 0.0, 0.0, False

        def receive(self) -> Sequence[Record]:
            time.sleep(0.002)
            now = time.monotonic()
            anew, self.anew = self.anew, False
            self.first = now if anew else self.first or now
            count = int(1e6 * (now - self.first)) + (0 if self.restarted else 5_000_000)
            return (Record(now, count, (0.0,) * 6, 0, anew),)

        restarted = False

    link = Counting()
    ft = StreamedSensor(link, SETTINGS)
    ft.start()
    for _ in range(2):
        ages = []
        for _ in range(250):
            time.sleep(0.002)
            ages.append(time.monotonic() - ft.read().time)
        assert min(ages) > -1e-6
        assert sorted(ages)[25] < 0.004  # the youngest tenth: a busy machine makes the others older
        assert ft.counter_rate == pytest.approx(1e6, rel=2e-3)
        link.restarted = link.anew = True
    ft.close()


def test_a_new_start_forgets_the_tare() -> None:
    ft = StreamedSensor(MadeUpLink(), SETTINGS)
    ft.start()
    ft.tare()
    assert ft.read().wrench[:3] == (0.0, 0.0, 0.0)
    ft.start()
    assert ft.read().wrench[:3] == (1.0, 2.0, 3.0)
    ft.close()


def test_a_tare_that_goes_silent_keeps_the_old_zero() -> None:
    link = MadeUpLink()
    ft = StreamedSensor(link, SETTINGS)
    ft.start()
    link.silent = True
    with pytest.raises(DeviceError, match="silent"):
        ft.tare()
    link.silent = False
    until(lambda: not refused(ft))
    assert ft.read().wrench[:3] == (1.0, 2.0, 3.0)
    ft.close()


def test_a_broken_wire_is_tried_again_and_said_meanwhile() -> None:
    link = MadeUpLink()
    ft = StreamedSensor(link, SETTINGS)
    ft.start()
    begun = time.monotonic()
    link.failure = OSError("no route")
    until(lambda: "no route" in refused(ft) and link.counts.requests >= 3)
    assert link.counts.requests <= 2 + (time.monotonic() - begun) / 0.1  # every tenth of a second
    link.failure = None
    until(lambda: not refused(ft))
    assert ft.read().healthy
    ft.close()


def test_what_is_none_of_its_records_is_told_from_silence() -> None:
    link = MadeUpLink()
    link.silent = True
    link.counts.refused = 7
    with pytest.raises(DeviceError, match="7 pieces of what arrived"):
        StreamedSensor(link, StreamSettings(NOISE, start_within=0.3)).start()
    assert link.closed >= 1


def test_a_device_is_not_asked_to_begin_anew_because_this_computer_slept() -> None:
    """What has come meanwhile lies there: it is read before the device is taken for silent."""

    class Asleep(tuple[Record, ...]):
        """Records after which the reading thread is not run for a while."""

        def __getitem__(self, i):
            time.sleep(0.2)
            return super().__getitem__(i)

    class Held(MadeUpLink):
        sleeps = 0

        def receive(self) -> Sequence[Record]:
            records = super().receive()
            self.sleeps += 1
            return Asleep(records) if self.sleeps % 5 == 0 else records

    link = Held()
    ft = StreamedSensor(link, SETTINGS)
    ft.start()
    until(lambda: link.sleeps > 20)
    ft.close()
    assert link.counts.requests == 1


def test_a_sensor_is_not_called_silent_because_this_computer_slept(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop may run first afterwards: it looks again before it believes that nothing came."""

    class Gated(MadeUpLink):
        open_gate = threading.Event()

        def receive(self) -> Sequence[Record]:
            self.open_gate.wait()
            return super().receive()

    monkeypatch.setattr(streamed_sensor, "_GLANCES", 5000)  # seconds, in which any machine runs the other thread
    link = Gated()
    link.open_gate.set()
    ft = StreamedSensor(link, SETTINGS)
    ft.start()
    link.open_gate.clear()
    time.sleep(1.5 * SETTINGS.silent_after)
    link.open_gate.set()
    assert ft.read().healthy
    ft.close()
