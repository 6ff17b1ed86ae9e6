"""Raw data transfer byte by byte: golden frames, units, status words, and the emulated box on a bare socket."""

import contextlib
import itertools
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.hw.emulators.netft import BoxSettings, NetFtServer, OnRobotServer, onrobot_box
from palpate.hw.netft.calibration import FORCE_UNITS, TORQUE_UNITS, BoxCalibration, parse_calibration
from palpate.hw.netft.rdt import RECORD, REQUEST
from palpate.hw.netft.status import AXIA, NET_BOX
from support.ft_host import ZERO_LOAD, serve_once, served, state
from support.waiting import until

STREAM = bytes.fromhex("1234 0002 00000000")
STOP = bytes.fromhex("1234 0000 00000000")
BIAS = bytes.fromhex("1234 0042 00000000")


def box(**changes: object) -> NetFtServer:
    return NetFtServer(BoxSettings(**{"rdt_port": 0, "calibration_port": 0, **changes}))


@contextmanager
def client(server: NetFtServer) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.settimeout(30.0)
        wire.connect((server.address, server.rdt_port))
        yield wire


@contextmanager
def talk(server: NetFtServer) -> Iterator[tuple[NetFtServer, socket.socket]]:
    """Connect a client to a box, which is closed at the end."""
    with contextlib.closing(server), client(server) as wire:
        yield server, wire


def ask(server: NetFtServer, wire: socket.socket, request: bytes) -> None:
    wire.send(request)
    serve_once((server,), 0.5)


def records_of(server: NetFtServer, wire: socket.socket, count: int) -> list[tuple[int, ...]]:
    found: list[tuple[int, ...]] = []
    wire.setblocking(False)

    def came() -> bool:
        serve_once((server,), 0.1)
        with contextlib.suppress(BlockingIOError):
            while True:
                found.extend(RECORD.iter_unpack(wire.recv(4096)))
        return len(found) >= count

    until(came)
    return found


def test_golden_request_and_record() -> None:
    assert REQUEST.pack(0x1234, 2, 0) == STREAM
    frame = bytes.fromhex("00000001 00001b58 00000000 000f4240 fff0bdc0 00000000 000003e8 00000000 ffffffff")
    assert len(frame) == 36
    assert RECORD.unpack(frame) == (1, 7000, 0, 1_000_000, -1_000_000, 0, 1000, 0, -1)


def test_golden_calibration_of_a_nano17() -> None:
    reply = bytes.fromhex("1234 02 04 000f4240 000f4240") + bytes(12)
    scales = parse_calibration(reply).scales
    assert (scales.force, scales.moment) == (pytest.approx(1e-6), pytest.approx(1e-9))


def test_every_unit_of_the_table() -> None:
    # NIST SP 811: what one of each is in SI
    assert [FORCE_UNITS[k] for k in range(1, 7)] == pytest.approx(
        [4.448222, 1.0, 4448.222, 1000.0, 9.80665, 0.00980665], rel=1e-6
    )
    assert [TORQUE_UNITS[k] for k in range(1, 7)] == pytest.approx(
        [0.1129848, 1.355818, 1.0, 1e-3, 0.0980665, 1000.0], rel=1e-6
    )


@pytest.mark.parametrize(
    ("reply", "message"),
    [
        (b"", "0 bytes"),
        (bytes.fromhex("1235 02 04 000f4240 000f4240") + bytes(12), "0x1235"),
        (bytes.fromhex("1234 07 04 000f4240 000f4240") + bytes(12), "units 7"),
        (bytes.fromhex("1234 02 00 000f4240 000f4240") + bytes(12), "units 2 and 0"),
        (bytes.fromhex("1234 02 04 00000000 000f4240") + bytes(12), "0 counts"),
    ],
)
def test_a_useless_calibration_says_why(reply: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_calibration(reply)


@given(st.integers(0, 2**31 - 1))
def test_a_status_without_bit_31_is_no_problem_and_with_it_always_is(status: int) -> None:
    for words in (AXIA, NET_BOX):
        assert words.problem(status) == ""
        assert words.problem(status | 1 << 31).startswith("status 0x")


def test_an_overload_is_named_for_both_makes() -> None:
    for words in (AXIA, NET_BOX):
        assert "take the load off" in words.problem(words.out_of_range)


@pytest.mark.parametrize("units", [(2, 4), (1, 1), (5, 5), (6, 6), (3, 2), (4, 3)])
def test_the_box_shows_the_plants_wrench_in_its_own_units(units: tuple[int, int]) -> None:
    calibration = BoxCalibration(*units, 1_000_000, 2_000_000)
    with talk(box(calibration=calibration, rate=7000.0, ranges=(1e9,) * 6)) as (server, wire):
        server.take(state((1.5, -2.0, 0.25, 0.01, -0.02, 0.03)))
        ask(server, wire, STREAM)
        _, _, status, *counts = records_of(server, wire, 1)[0]
        scales = calibration.scales
        shown = [scales.force * c for c in counts[:3]] + [scales.moment * c for c in counts[3:]]
        within = max(scales.force, scales.moment)
        assert shown == pytest.approx([1.5, -2.0, 0.25, 0.01, -0.02, 0.03], abs=within)
        assert status == 0


def test_the_stream_counts_from_one_and_samples_seven_times_a_millisecond() -> None:
    with talk(box(rate=1000.0)) as (server, wire):
        ask(server, wire, STREAM)
        first = records_of(server, wire, 20)
        assert [r[0] for r in first] == list(range(1, len(first) + 1))
        assert {b[1] - a[1] for a, b in itertools.pairwise(first)} == {7}
        ask(server, wire, STREAM)
        again = records_of(server, wire, 1 + 20)
        assert 1 in [r[0] for r in again]
        assert min(b[1] - a[1] for a, b in itertools.pairwise(again)) > 0


def test_it_stops_when_asked_and_after_the_wanted_number() -> None:
    with talk(box(rate=5000.0)) as (server, wire):
        ask(server, wire, STREAM[:4] + struct.pack(">I", 7))
        assert len(records_of(server, wire, 7)) == 7
        assert server.due() == float("inf")
        ask(server, wire, STREAM)
        assert server.due() < float("inf")
        ask(server, wire, STOP)
        assert server.due() == float("inf")


def test_buffered_records_come_forty_in_a_datagram_and_the_rest_at_the_end() -> None:
    server = box(rate=7000.0)
    with client(server) as wire, served(server):
        wire.send(bytes.fromhex("1234 0003") + struct.pack(">I", 50))
        assert [len(wire.recv(4096)) // 36 for _ in range(2)] == [40, 10]


def test_the_last_that_asks_gets_the_stream() -> None:
    server = box()
    with client(server) as one, client(server) as other:
        ask(server, one, STREAM)
        records_of(server, one, 3)
        ask(server, other, STREAM)
        assert records_of(server, other, 3)[0][0] == 1
        with pytest.raises(BlockingIOError):
            [one.recv(100) for _ in range(100)]
    server.close()


def test_bias_subtracts_the_load_of_its_moment() -> None:
    with talk(box(rate=7000.0)) as (server, wire):
        server.take(state((1.0, 2.0, 3.0, 0.0, 0.0, 0.01)))
        ask(server, wire, BIAS)
        ask(server, wire, STREAM)
        assert records_of(server, wire, 1)[-1][3:] == (0,) * 6
        server.take(state(ZERO_LOAD))
        assert records_of(server, wire, 5)[-1][3:6] == (-1_000_000, -2_000_000, -3_000_000)


def test_a_load_beyond_the_range_is_clipped_and_reported() -> None:
    with talk(box(rate=7000.0, status_words=AXIA)) as (server, wire):
        server.take(state((0.0, 0.0, -40.0, 0.0, 0.0, 0.0)))
        ask(server, wire, STREAM)
        _, _, status, *counts = records_of(server, wire, 1)[0]
        assert status == 0xC0000000
        assert counts[2] == -17_000_000


def test_an_onrobot_box_has_other_scales_and_commands() -> None:
    with talk(OnRobotServer(onrobot_box(rdt_port=0))) as (server, wire):
        server.take(state((1.0, 0.0, 0.0, 0.0, 0.0, 0.5)))
        for command, value in ((0x82, 2), (0x81, 4), (0x42, 255), (0x02, 0)):
            ask(server, wire, struct.pack(">HHI", 0x1234, command, value))
        biased = records_of(server, wire, 5)
        assert biased[-1][3:] == (0,) * 6
        assert {b[1] - a[1] for a, b in itertools.pairwise(biased)} == {14}  # 2 ms
        ask(server, wire, struct.pack(">HHI", 0x1234, 0x42, 0))
        shown = records_of(server, wire, 60)[-1][3:]
        assert (shown[0], shown[5]) == (10_000, 50_000)
        for command, value in ((0x82, 0), (0x82, 255), (0x81, 9), (0x42, 3)):
            ask(server, wire, struct.pack(">HHI", 0x1234, command, value))
        assert server.ignored == 4
        assert server.calibration_port == 0


def test_it_listens_on_loopback_only() -> None:
    assert BoxSettings().address == "127.0.0.1"
    server = box()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as anywhere:
        anywhere.bind(("127.0.0.2", server.rdt_port))  # only possible if the emulator did not bind every address
        socket.create_server(("127.0.0.2", server.calibration_port)).close()
    server.close()


@pytest.mark.parametrize(
    ("fault", "value"), [("nonsense", 1.0), ("dropped", -1.0), ("dropped", 0.5), ("reordered", 1.0), ("gap", 1e12)]
)
def test_a_fault_that_is_none_is_refused(fault: str, value: float) -> None:
    server = box()
    with pytest.raises(InvalidValueError, match="fault"):
        server.inject(fault, value)
    server.close()


def test_a_rate_above_its_sampling_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="7000"):
        BoxSettings(rate=8000.0)
