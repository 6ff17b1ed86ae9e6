"""The Net F/T client against the emulated box over real sockets: readings, tare, faults, recovery."""

import os
import socket
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest

from palpate.errors import InvalidValueError
from palpate.hw.devices import DeviceError
from palpate.hw.emulators.netft import BoxSettings, NetFtServer, OnRobotServer, onrobot_box
from palpate.hw.ft_stream import StreamSettings
from palpate.hw.netft import AXIA, BoxCalibration, NetFt, NetFtSettings, Scales, net_ft, onrobot_settings
from palpate.hw.netft.rdt import RECORD, OnRobotCommand
from support.ft_host import ZERO_LOAD, good, served, state
from support.waiting import WITHIN, first_error, until

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
LOAD = (1.5, -2.0, 0.25, 0.01, -0.02, 0.03)


def emulated(**changes: object) -> NetFtServer:
    return NetFtServer(BoxSettings(**{"rdt_port": 0, "calibration_port": 0, **changes}))


PATIENT = StreamSettings(NOISE, silent_after=1.0, start_within=WITHIN)
"""A busy machine stands still for 0.3 s now and then."""


def sensor(box: NetFtServer, **changes: object) -> NetFt:
    ports = {"rdt_port": box.rdt_port, "calibration_port": box.calibration_port or 1}
    return NetFt(box.address, NetFtSettings(**{"stream": PATIENT, "patience": 5.0, **ports, **changes}))


@contextmanager
def started(
    box: NetFtServer, *, load: tuple[float, ...] | None = None, **changes: object
) -> Iterator[tuple[NetFtServer, NetFt]]:
    if load is not None:
        box.take(state(load))
    with served(box):
        ft = sensor(box, **changes)
        try:
            ft.start()
            yield box, ft
        finally:
            ft.close()


@pytest.mark.parametrize("units", [(2, 4), (1, 2)])
def test_readings_are_si_whatever_the_units_of_the_box(units: tuple[int, int]) -> None:
    with started(emulated(calibration=BoxCalibration(*units, 4_000_000, 5_000_000)), load=LOAD) as (_, ft):
        assert ft.read().wrench == pytest.approx(LOAD, abs=1e-3)
        assert ft.read().healthy


def test_raw_counts_pass_for_a_sensor_file_that_calibrates() -> None:
    with started(emulated(), load=LOAD, scales=Scales(1.0, 1.0)) as (_, ft):
        assert ft.read().wrench == pytest.approx([1e6 * v for v in LOAD[:3]] + [1e9 * v for v in LOAD[3:]])


@pytest.mark.slow
def test_an_onrobot_box_is_set_up_and_scaled() -> None:
    box = OnRobotServer(onrobot_box(rdt_port=0))
    box.take(state(LOAD))
    with served(box):
        ft = NetFt(box.address, onrobot_settings(NOISE, period=0.002, cutoff=150.0, rdt_port=box.rdt_port))
        ft.start()
        assert any(line.endswith(f" {OnRobotCommand.PERIOD:#x} 2") for line in box.lines())  # ms
        assert ft.read().wrench == pytest.approx(LOAD, abs=1e-4)
        assert box.ignored == 0
        ft.close()


@pytest.mark.slow
def test_tare_takes_the_load_at_rest_for_zero_and_the_moved_one_not() -> None:
    with started(emulated(), load=LOAD) as (box, ft):
        ft.tare()
        assert ft.read().wrench == pytest.approx(ZERO_LOAD, abs=1e-6)
        moving = threading.Event()

        def swing() -> None:
            k = 0
            while not moving.wait(0.005):
                k += 1
                box.take(state((1.5 + 0.05 * (k % 7), *LOAD[1:])))

        arm = threading.Thread(target=swing)
        arm.start()
        try:
            with pytest.raises(DeviceError, match="Fx"):
                ft.tare()
        finally:
            moving.set()
            arm.join()
        box.take(state(LOAD))
        until(lambda: ft.read().wrench == pytest.approx(ZERO_LOAD, abs=1e-6))  # the first tare still holds


@pytest.mark.slow
def test_no_tare_of_an_unhealthy_or_silent_sensor() -> None:
    with started(emulated(), stream=StreamSettings(NOISE, silent_after=0.5)) as (box, ft):
        box.inject("out_of_range", 1)
        until(lambda: not ft.read().healthy)
        with pytest.raises(DeviceError, match="saturated"):
            ft.tare()
        box.inject("silent", 1)
        with pytest.raises(DeviceError, match="silent"):
            ft.tare()


def test_silence_is_noticed_and_passes_when_it_streams_again() -> None:
    with started(emulated(), stream=StreamSettings(NOISE)) as (box, ft):
        for fault in ("silent", "rebooted"):
            box.inject(fault, 1)
            error = first_error(ft.read)
            assert "F/T sensor at 127.0.0.1: silent for" in str(error)
            assert "cable" in error.remedy
            box.inject("silent", 0)
            good(ft)
        until(lambda: ft.counts.requests >= 2)  # one that has rebooted streams again when it is asked
        good(ft)


def test_no_reading_with_an_overload_is_healthy_and_it_says_what_to_do() -> None:
    with started(emulated(status_words=AXIA), status_words=AXIA) as (box, ft):
        box.take(state((0.0, 0.0, -40.0, 0.0, 0.0, 0.0)))

        def overloaded() -> bool:
            reading = ft.read()
            assert reading.healthy == (reading.wrench == pytest.approx(ZERO_LOAD))
            return not reading.healthy

        until(overloaded)
        assert "take the load off" in ft.problem
        assert ft.read().wrench[2] == pytest.approx(-17.0)
        box.take(state(ZERO_LOAD))
        good(ft)
        assert ft.problem == ""


def test_gaps_are_counted_and_nothing_else_happens() -> None:
    with started(emulated()) as (box, ft):
        lost = 0
        for gap in (1, 7, 100):
            box.inject("gap", gap)
            lost += gap
            until(lambda lost=lost: ft.read().lost >= lost)
        assert ft.read().lost == 108
        assert (ft.counts.restarts, ft.counts.refused, ft.counts.older) == (0, 0, 0)


@pytest.mark.slow
def test_a_bad_network_costs_what_it_takes_and_no_more() -> None:
    with started(emulated(rate=2000.0)) as (box, ft):

        def spoil(fault: str, k: int, counted: str) -> None:
            records, sent, before = ft.counts.records, box.sent, getattr(ft.counts, counted)
            box.inject(fault, k)
            until(lambda: ft.read() and box.sent > sent + 400)
            box.inject(fault, 0)
            spoilt = box.sent - sent
            until(lambda: ft.counts.records > records + spoilt)  # it has seen all of them
            cost = getattr(ft.counts, counted) - before
            assert cost == pytest.approx(spoilt / k, rel=0.5, abs=3), fault
            # of both there are more all the time; what is under way is read sooner or later, what is lost is not
            until(lambda: (box.sent - sent) - (ft.counts.records - records) <= cost + 3)

        spoil("dropped", 10, "lost")
        spoil("reordered", 5, "older")
        spoil("repeated", 4, "older")
        spoil("wrong_length", 5, "refused")
        assert ft.counts.restarts == 0


def test_counters_that_begin_anew_are_followed_without_a_restart_of_the_client() -> None:
    with started(emulated()) as (box, ft):
        until(lambda: ft.counts.records > 100)  # to begin anew after a few would be no change
        box.inject("restarted", 1)
        until(lambda: ft.counts.restarts)
        times: list[float] = []
        until(lambda: times.append(good(ft).time) or len(set(times)) > 50)
        assert times == sorted(times)
        assert ft.counts.requests == 1


def test_a_stream_taken_by_another_client_is_noticed_and_taken_back() -> None:
    with (
        started(emulated(), stream=StreamSettings(NOISE)) as (box, ft),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thief,
    ):
        thief.sendto(bytes.fromhex("1234000200000000"), (box.address, box.rdt_port))
        assert "no other program" in first_error(ft.read).remedy
        until(lambda: ft.counts.requests >= 2)
        good(ft)


@pytest.mark.slow
def test_nobody_listens() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    stream = StreamSettings(NOISE, start_within=1.0)
    with pytest.raises(DeviceError, match="nobody listens on TCP port 1;"):
        NetFt("127.0.0.1", NetFtSettings(stream, rdt_port=port, calibration_port=1)).start()
    with pytest.raises(DeviceError, match=f"nobody listens on UDP port {port}"):
        NetFt("127.0.0.1", NetFtSettings(stream, Scales(1e-6, 1e-6), rdt_port=port)).start()


@pytest.mark.slow
def test_a_box_that_is_switched_off_is_noticed_and_back_when_it_is_on_again() -> None:
    box = emulated()
    ports = {"rdt_port": box.rdt_port, "calibration_port": box.calibration_port}
    ft = sensor(box, stream=StreamSettings(NOISE, silent_after=0.5))
    try:
        with served(box):
            ft.start()
        until(lambda: "nobody listens" in str(first_error(ft.read)))  # when it has asked again
        with served(emulated(**ports)):
            good(ft)
    finally:
        ft.close()


@pytest.mark.slow
def test_a_silent_box_fails_to_start_in_time_and_in_words() -> None:
    box = emulated()
    box.inject("silent", 1)
    with served(box):
        with pytest.raises(DeviceError, match=r"no reply on TCP port \d+ within 0.3 s"):
            sensor(box, patience=0.3).start()
        with pytest.raises(DeviceError, match=r"no steady stream within 0.3 s"):
            sensor(box, stream=StreamSettings(NOISE, start_within=0.3), scales=Scales(1e-6, 1e-9)).start()


def test_a_box_without_calibration_is_refused() -> None:
    with (
        served(emulated(calibration=BoxCalibration(2, 4, 1, 1))),
        socket.create_server(("127.0.0.1", 0)) as liar,
    ):
        port = liar.getsockname()[1]

        def reply() -> None:
            wire, _ = liar.accept()
            with wire:
                wire.recv(20)
                wire.sendall(bytes(24))

        thread = threading.Thread(target=reply)
        thread.start()
        with pytest.raises(DeviceError, match="useless: it begins with 0x0000"):
            NetFt("127.0.0.1", NetFtSettings(StreamSettings(NOISE), calibration_port=port)).start()
        thread.join()


def test_it_leaves_nothing_behind_and_can_start_again() -> None:
    box = emulated()
    with served(box):
        files, threads = len(os.listdir("/proc/self/fd")), threading.active_count()
        ft = sensor(box)
        with pytest.raises(DeviceError, match="not started"):
            ft.read()
        for _ in range(2):
            ft.start()
            ft.read()
            ft.close()
            ft.close()
            with pytest.raises(DeviceError, match="not started"):
                ft.read()
        until(lambda: box.due() == float("inf"))  # asked to stop
        assert threading.active_count() == threads
        assert len(os.listdir("/proc/self/fd")) <= files + 1  # the box may still hold the last one who asked it


REFUSED = [
    (StreamSettings, {"silent_after": 0.0}),
    (StreamSettings, {"ask_again_after": -1.0}),
    (StreamSettings, {"noise": (0.0,) * 6}),
    (onrobot_settings, {"period": 0.0}),
    (onrobot_settings, {"period": 0.3}),
    (onrobot_settings, {"period": 0.002, "cutoff": 100.0}),
    (onrobot_settings, {"period": float("nan")}),
]


@pytest.mark.parametrize(("make", "changes"), REFUSED)
def test_settings_that_cannot_be_are_refused(make: Callable[..., object], changes: dict[str, object]) -> None:
    with pytest.raises(InvalidValueError):
        make(**{"noise": NOISE, **changes})


@pytest.mark.parametrize("rate", [0.0, 0.005, 0.08, 0.5])
def test_records_are_dated_by_echoes_however_the_delay_creeps(
    monkeypatch: pytest.MonkeyPatch, rate: float
) -> None:
    """On a clock that is handed in: 500 records a second of a box that counts anew with every request."""
    now, under_way = 100.0, deque[tuple[float, float, bytes]]()
    monkeypatch.setattr(net_ft, "monotonic", lambda: now)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as box:
        box.bind(("127.0.0.1", 0))
        box.setblocking(False)
        port = box.getsockname()[1]
        link = net_ft.RdtLink(
            "127.0.0.1", NetFtSettings(StreamSettings((1.0,) * 6), Scales(1.0, 1.0), rdt_port=port)
        )
        link.open()
        link.request()
        sequence, ages = 0, []
        for k in range(3000):
            now += 0.002
            if k in (1000, 1001, 1003):  # asked again before it has replied, as after a stall of this computer
                link.request()
            with suppress(BlockingIOError):
                _, client = box.recvfrom(100)
                sequence = 0
            sequence += 1
            record = RECORD.pack(sequence, 7_000_000 + 14 * k, 0, 1, 2, 3, 4, 5, 6)
            under_way.append((now, now + 5e-4 + rate * max(0.0, now - 102.0), record))
            while under_way and under_way[0][1] <= now + 1e-3:
                sampled, _, datagram = under_way.popleft()
                box.sendto(datagram, client)
                (reading,) = link.receive() or (None,)
                if now > 101.0:
                    assert reading is not None
                    assert reading.time <= sampled
                    if now - sampled < 0.3:
                        ages.append(sampled - reading.time)
        assert max(ages) < 0.004
        assert link.counts.restarts == 0
        link.close()
