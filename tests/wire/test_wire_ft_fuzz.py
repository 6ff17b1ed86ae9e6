"""Rubbish of every kind to force/torque clients and emulators: none of it is believed, nothing hangs."""

import socket
import struct
from collections.abc import Callable

import numpy as np
import pytest

from palpate.hw.emulators.netft import BoxSettings, NetFtServer, OnRobotServer, onrobot_box
from palpate.hw.emulators.serial_ft import BotaServer, ResenseServer
from palpate.hw.ft_stream import StreamReading, StreamSettings
from palpate.hw.netft import NetFtSettings, Scales
from palpate.hw.netft.net_ft import MOST_AT_ONCE, RdtLink
from palpate.hw.netft.rdt import CALIBRATION_REQUEST, RECORD, REQUEST
from palpate.hw.serial_ft import Bota, Resense
from palpate.hw.serial_ft.bota import DATA
from palpate.hw.serial_ft.crc import crc16_x25
from support.ft_host import served, state

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
LOAD = (1.5, -2.0, 0.25, 0.01, -0.02, 0.03)
BURST = 50
"""Datagrams at a time: fewer than a socket's buffer holds."""

packets = pytest.mark.parametrize("count", [4_000, pytest.param(100_000, marks=pytest.mark.slow)])


def any_datagram(g: np.random.Generator, sequence: int, sample: int) -> bytes:
    """Return anything but a record that follows: random, cut, longer, with one of the counters that fits."""
    random = int(g.integers(0, 2**32))
    body = g.bytes(28)
    match int(g.integers(0, 6)):
        case 0:
            return g.bytes(int(g.integers(0, 100)))
        case 1:
            return g.bytes(RECORD.size)
        case 2:
            whole = struct.pack(">II", sequence % 2**32, sample % 2**32) + body
            return whole[: int(g.integers(0, RECORD.size))]
        case 3:
            return struct.pack(">II", sequence % 2**32, sample % 2**32) + body + g.bytes(int(g.integers(1, 40)))
        case 4:
            return struct.pack(">II", sequence % 2**32, random) + body
        case _:
            return struct.pack(">II", random, sample % 2**32) + body


@packets
def test_a_netft_client_believes_only_the_records_of_its_stream(count: int) -> None:
    g = np.random.default_rng(9)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as box:
        box.bind(("127.0.0.1", 0))
        box.settimeout(30.0)
        port = box.getsockname()[1]
        link = RdtLink("127.0.0.1", NetFtSettings(StreamSettings(NOISE), Scales(1.0, 1.0), rdt_port=port))
        link.open()
        link.request()
        _, client = box.recvfrom(100)

        def rubbish_and(k: int) -> list[StreamReading]:
            for _ in range(BURST):
                box.sendto(any_datagram(g, k, 7 * k), client)
            box.sendto(RECORD.pack(k, 7 * k, 0, 1, 2, 3, 4, 5, 6), client)
            return [record for _ in range(-(-(BURST + 1) // MOST_AT_ONCE)) for record in link.receive()]

        for k in range(1, 21):
            assert rubbish_and(k) == []  # nothing follows anything
        for k in range(21, 24):
            box.sendto(RECORD.pack(k, 7 * k, 0, 1, 2, 3, 4, 5, 6), client)
            records = link.receive()
        assert len(records) == 1
        for k in range(24, 24 + count // BURST):
            (record,) = rubbish_and(k)
            assert record.wrench == (1, 2, 3, 4, 5, 6)
        assert link.counts.lost == 0
        link.close()


def a_box() -> NetFtServer:
    return NetFtServer(BoxSettings(rdt_port=0, calibration_port=0))


def an_onrobot_box() -> NetFtServer:
    return OnRobotServer(onrobot_box(rdt_port=0))


@packets
@pytest.mark.parametrize("make", [a_box, an_onrobot_box])
def test_an_emulated_box_ignores_what_is_no_request(make: Callable[[], NetFtServer], count: int) -> None:
    g = np.random.default_rng(10)
    server = make()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.settimeout(30.0)
        wire.connect((server.address, server.rdt_port))
        sent = 0
        for _ in range(count // BURST):
            for _ in range(BURST):
                size = int(g.integers(0, 60))
                datagram = g.bytes(size) if g.random() < 0.5 else b"\x12\x34" + g.bytes(6)
                if datagram[:2] == b"\x12\x34" and len(datagram) == 8:
                    datagram = datagram[:2] + b"\x99" + datagram[3:]  # no command begins with this
                wire.send(datagram)
                sent += 1
            for _ in range(2):
                server.receive(server.files()[0], 0.0)
        assert server.ignored == sent
        assert server.due() == float("inf")
        wire.send(REQUEST.pack(0x1234, 2, 1))
        server.receive(server.files()[0], 0.0)
        server.tick(server.due())
        assert len(wire.recv(100)) == RECORD.size
    server.close()


def test_an_emulated_box_replies_on_tcp_after_any_rubbish() -> None:
    g = np.random.default_rng(11)
    server = a_box()
    with served(server):
        where = (server.address, server.calibration_port)
        for _ in range(100):
            with socket.create_connection(where, 30.0) as wire:
                wire.sendall(g.bytes(int(g.integers(1, 2000))))
        idle = [socket.create_connection(where, 30.0) for _ in range(20)]  # more than it keeps
        with socket.create_connection(where, 30.0) as wire:
            wire.settimeout(30.0)
            for _ in range(3):
                wire.sendall(CALIBRATION_REQUEST)
                assert wire.recv(100)[:2] == b"\x12\x34"
        for one in idle:
            one.close()


@packets
def test_bota_frames_among_rubbish_are_the_only_ones_believed(count: int) -> None:
    g = np.random.default_rng(12)
    make = Bota(51)
    k, believed = 0, 0
    for _ in range(count // BURST):
        for _ in range(4):
            k += 1
            data = DATA.pack(0, *LOAD, 1000 * k, 30.0)
            for record in make.records(b"\xaa" + data + struct.pack("<H", crc16_x25(data)), 1e-3 * k):
                believed += 1
                assert record.wrench == pytest.approx(LOAD)
        for _ in range(BURST):
            rubbish = b"\xaa" + g.bytes(int(g.integers(0, 60)))
            if g.random() < 0.2:  # with the right checksum, but random loads and time
                data = g.bytes(DATA.size)
                rubbish = b"\xaa" + data + struct.pack("<H", crc16_x25(data))
            assert not any(
                record.wrench != pytest.approx(LOAD) for record in make.records(rubbish, 1e-3 * k + 5e-4)
            )
    assert believed > 2 * (count // BURST)


@packets
def test_resense_believes_no_rubbish(count: int) -> None:
    g = np.random.default_rng(13)
    make = Resense((12.0, 12.0, 17.0), (0.12, 0.12, 0.12))
    frame = struct.pack("<7f", *LOAD[:3], *(1e3 * v for v in LOAD[3:]), 27.0)
    now, believed = 1.0, 0
    for _ in range(count // BURST):
        for burst in (
            *[frame] * 4,
            *(g.bytes(28 if g.random() < 0.5 else int(g.integers(1, 90))) for _ in range(BURST)),
        ):
            now += 1e-3
            for record in make.records(burst, now):
                believed += 1
                assert record.wrench == pytest.approx(LOAD)
    assert believed > 2 * (count // BURST)


@packets
def test_emulated_serial_sensors_hear_anything_and_go_on(count: int) -> None:
    g = np.random.default_rng(14)
    bota, resense = BotaServer(), ResenseServer()
    for server in (bota, resense):
        server.take(state(LOAD))
        alphabet = b"CRcf,0123456789r \x00\xff\xaa"
        for _ in range(count):
            if g.random() < 0.5:
                message = g.bytes(int(g.integers(0, 30)))
            else:
                message = bytes(alphabet[i] for i in g.integers(0, len(alphabet), int(g.integers(0, 30))))
            server._obey(message, 1.0)
    assert len(bota._received) <= 64
    bota._obey(b",,,Cc,0,1,0,4f,51,0,0,0R", 2.0)
    assert bota.due() == pytest.approx(2.0 + 51 * 19.53125e-6)
    bota.close()
    resense.close()
