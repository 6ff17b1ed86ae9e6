"""Bota and Resense sensors: frames byte by byte, then the client on real pseudo-terminals with faulty lines."""

import math
import os
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.hw.devices import DeviceError
from palpate.hw.emulators.serial_ft import BotaServer, ResenseServer, TerminalServer
from palpate.hw.ft_stream import StreamCounts, StreamSettings
from palpate.hw.serial_ft import Bota, Resense, SerialSensor
from palpate.hw.serial_ft.crc import crc16_x25
from palpate.hw.serial_ft.line import Make
from support.ft_host import ZERO_LOAD, good, served, state
from support.waiting import WITHIN, first_error, until

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
LOAD = (1.5, -2.0, 0.25, 0.01, -0.02, 0.03)
RANGES = ((12.0, 12.0, 17.0), (0.12, 0.12, 0.12))


def bota_frame(time_us: int, load: tuple[float, ...] = LOAD, status: int = 0) -> bytes:
    data = struct.pack("<H6fIf", status, *load, time_us, 30.0)
    return b"\xaa" + data + struct.pack("<H", crc16_x25(data))


def resense_frame(load: tuple[float, ...], temperature: float = 27.0) -> bytes:
    return struct.pack("<7f", *load[:3], *(1e3 * v for v in load[3:]), temperature)


class NoLine:
    """A line on which nothing is ever sent: what `Resense.begin` needs of one."""


def fresh_resense() -> tuple[Resense, StreamCounts]:
    make, counts = Resense(*RANGES), StreamCounts()
    make.begin(NoLine(), counts)
    return make, counts


# --- frames ---


def test_crc_check_value_of_the_catalogue() -> None:
    assert crc16_x25(b"123456789") == 0x906E


def test_golden_bota_frame() -> None:
    data = bytes.fromhex("0000 0000803f 000000c0 0000803e 00000000 00000000 00000000 40420f00 0000f041")
    assert bota_frame(1_000_000, (1.0, -2.0, 0.25, 0.0, 0.0, 0.0))[:-2] == b"\xaa" + data
    assert len(bota_frame(0)) == 37


def test_bota_frames_are_found_in_any_pieces_after_anything() -> None:
    frames = b"\xaa\xaa\x00" + b"".join(bota_frame(1000 * k) for k in range(1, 40))
    for size in (1, 3, 36, 37, 38, 1000):
        make, records = Bota(51), []
        for at in range(0, len(frames), size):
            records += make.records(frames[at : at + size], 1.0 + 1e-6 * at)
        assert len(records) == 37
        assert records[-1].wrench == pytest.approx(LOAD)


def test_a_bota_frame_with_any_bit_turned_is_not_believed() -> None:
    whole = bota_frame(5000)
    for bit in range(8 * len(whole)):
        make = Bota(51)
        for k in range(1, 5):
            make.records(bota_frame(1000 * k), 1e-3 * k)
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        assert make.records(bytes(damaged), 5e-3) == []
        assert len(make.records(bota_frame(6000), 6e-3)) == 1


def test_bota_readings_that_are_no_numbers_are_dropped_and_bad_ones_are_reported() -> None:
    make = Bota(51)
    for k in range(1, 5):
        make.records(bota_frame(1000 * k), 1e-3 * k)
    assert make.records(bota_frame(5000, (math.nan, *LOAD[1:])), 5e-3) == []
    assert make.records(bota_frame(6000, (math.inf, *LOAD[1:])), 6e-3) == []
    (record,) = make.records(bota_frame(7000, status=0b10), 7e-3)
    assert "out of range" in make.problem(record.status)
    assert make.problem(0b1) == ""


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.data())
def test_no_shifted_resense_frame_is_ever_believed(seed: int, data: st.DataObject) -> None:
    """Bytes are lost, doubled and put in; what comes out was sent, each reading whole."""
    g = np.random.default_rng(seed)
    temperature = data.draw(st.floats(15.5, 44.5))
    make, _ = fresh_resense()
    sent: dict[tuple[float, ...], tuple[float, ...]] = {}
    believed, now = 0, 10.0
    for k in range(120):
        load = tuple(float(np.float32(v)) for v in g.normal(0.0, 1.0, 6) * (*RANGES[0], *RANGES[1]) * 0.3)
        frame = bytearray(resense_frame(load, temperature))
        sent[load[:3]] = load[3:]
        if k > 5 and g.random() < 0.3:
            at = int(g.integers(0, len(frame)))
            if g.random() < 0.5:
                del frame[at : at + int(g.integers(1, 28))]
            else:
                frame[at:at] = g.bytes(int(g.integers(1, 28)))
        now += 1e-3 * int(g.integers(1, 4))
        cut = int(g.integers(0, len(frame) + 1)) if g.random() < 0.3 else len(frame)
        for piece in (bytes(frame[:cut]), bytes(frame[cut:])):
            now += 1e-5
            for record in make.records(piece, now) if piece else ():
                believed += 1
                moments = sent[record.wrench[:3]]  # fails if there were no such forces
                assert max(abs(a - b) for a, b in zip(moments, record.wrench[3:], strict=True)) < 1e-6
    assert believed > 20


def test_no_temperature_shifted_by_a_byte_is_another_temperature() -> None:
    upper = np.arange(2**16)  # the upper two bytes decide
    with np.errstate(invalid="ignore"):
        value = (upper.astype(np.uint32) << np.uint32(16)).view(np.float32)
    possible = (value >= 14.9) & (value <= 45.1)
    for first, second in ((b >> 8, b & 0xFF) for b in upper[possible].tolist()):
        for other in range(256):
            assert not possible[other << 8 | first]  # a byte lost: the first of the next frame follows
            assert not possible[second << 8 | other]  # a byte put in


def test_resense_frames_are_believed_after_three_alike_from_the_middle_of_one() -> None:
    make, counts = fresh_resense()
    frame, now = resense_frame(LOAD), 1.0
    assert make.records(frame[11:], now) == ()
    for k in range(1, 3):
        assert not make.records(frame, now + 1e-3 * k)
    (record,) = make.records(frame, now + 3e-3)
    assert record.wrench == pytest.approx(LOAD)
    assert (counts.refused, counts.lost, counts.records) == (1, 0, 1)


def test_resense_a_stall_of_this_computer_loses_nothing() -> None:
    make, counts = fresh_resense()
    frame = resense_frame(LOAD)
    for k in range(5):
        make.records(frame, 1.0 + 1e-3 * k)
    assert len(make.records(40 * frame, 1.045)) == 40
    assert counts.lost == 0


@pytest.mark.parametrize("temperature", [0.0, 14.9, 45.1, math.nan, math.inf, -30.0])
def test_resense_frames_without_a_temperature_are_none(temperature: float) -> None:
    make, _ = fresh_resense()
    assert not any(make.records(resense_frame(LOAD, temperature), 1.0 + 1e-3 * k) for k in range(10))


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e-30, 1e3])
def test_impossible_resense_loads_are_dropped_and_overloads_are_reported(value: float) -> None:
    make, _ = fresh_resense()
    for k in range(5):
        make.records(resense_frame(LOAD), 1.0 + 1e-3 * k)
    assert not make.records(resense_frame((value, *LOAD[1:])), 1.006)
    (record,) = make.records(resense_frame((20.0, *LOAD[1:])), 1.007)
    assert "out of range" in make.problem(record.status)


@pytest.mark.parametrize("length", [50, 513, 0])
def test_a_sinc_length_that_a_bota_does_not_have_is_refused(length: int) -> None:
    with pytest.raises(InvalidValueError, match="51 to 512"):
        Bota(length)


# --- on the wire ---


def emulated(kind: str, link: Path) -> tuple[TerminalServer, Make]:
    if kind == "bota":
        return BotaServer(link=link), Bota(51)
    return ResenseServer(link=link), Resense(*RANGES)


@contextmanager
def started(kind: str, folder: Path, silent_after: float = 1.0) -> Iterator[tuple[TerminalServer, SerialSensor]]:
    server, make = emulated(kind, folder / "sensor")
    server.take(state(LOAD))
    with served(server):
        ft = SerialSensor(server.address, make, StreamSettings(NOISE, silent_after, start_within=WITHIN))
        try:
            ft.start()
            yield server, ft
        finally:
            ft.close()


both = pytest.mark.parametrize("kind", ["bota", "resense"])


@pytest.mark.slow
@both
def test_it_streams_tares_and_says_an_overload(kind: str, tmp_path: Path) -> None:
    with started(kind, tmp_path) as (server, ft):
        assert ft.read().wrench == pytest.approx(LOAD)
        assert server._rate == pytest.approx(1000.0, rel=0.01)  # a Bota that was not set up has 100
        ft.tare()
        assert ft.read().wrench == pytest.approx(ZERO_LOAD, abs=1e-6)
        assert ft.read().lost <= server.left_out
        server.inject("out_of_range", 1)
        until(lambda: not ft.read().healthy)
        assert "take it off" in ft.problem


@pytest.mark.slow
@both
def test_a_bad_line_costs_what_it_takes_and_shows_nothing_wrong(kind: str, tmp_path: Path) -> None:
    with started(kind, tmp_path) as (server, ft):
        for fault in ("lost_byte", "noise", "dropped"):
            records, lost, refused = ft.counts.records, ft.counts.lost, ft.counts.refused
            server.inject(fault, 10)

            def believed(records: int = records) -> bool:
                assert ft.read().wrench == pytest.approx(LOAD)
                return ft.counts.records > records + 100

            until(believed)
            if fault == "noise" and kind == "bota":
                until(lambda refused=refused: ft.counts.refused > refused + 12)
            elif fault == "lost_byte" or kind == "bota":
                until(lambda lost=lost: ft.counts.lost > lost + 10)
            # no count of its own: a Resense frame that never came is not missed
            assert ft.read().wrench == pytest.approx(LOAD)
            server.inject(fault, 0)
        server.inject("pieces", 3)
        before, sent = ft.counts.records, server.sent
        until(lambda: server.sent > sent + 300)
        # here the emulator is a thread that waits for its turn between pieces: for Resense that is a silence
        share = 0.8 if kind == "bota" else 0.05
        until(lambda: ft.counts.records - before > share * (server.sent - sent), what="frames put together")
        assert ft.read().wrench == pytest.approx(LOAD)


@pytest.mark.slow
@both
def test_silence_and_an_unplugged_line_are_noticed_and_pass(kind: str, tmp_path: Path) -> None:
    with started(kind, tmp_path, silent_after=0.04) as (server, ft):
        for fault, message in (("silent", "silent for"), ("unplugged", str(tmp_path / "sensor"))):
            server.inject(fault, 1)
            until(lambda message=message: message in str(first_error(ft.read)))
            server.inject(fault, 0)
            assert good(ft).wrench == pytest.approx(LOAD)
        if kind == "bota":  # it must be set up again before it streams
            asked = ft.counts.requests
            server.inject("rebooted", 1)
            first_error(ft.read)
            until(lambda: ft.counts.requests > asked)
            good(ft)


@pytest.mark.slow
def test_a_bota_that_does_not_reply_fails_to_start_with_an_explanation(tmp_path: Path) -> None:
    server = BotaServer(link=tmp_path / "sensor")
    server.inject("deaf", 1)
    with served(server):
        ft = SerialSensor(server.address, Bota(51), StreamSettings(NOISE, start_within=1.5))
        with pytest.raises(DeviceError, match="no reply 'r,0,C,0' to 'C'"):
            ft.start()


@pytest.mark.slow
def test_a_line_that_is_not_there_or_in_use_fails_to_start(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="check the cable"):
        SerialSensor(str(tmp_path / "none"), Bota(51), StreamSettings(NOISE)).start()
    with started("resense", tmp_path) as (server, _):
        second = SerialSensor(server.address, Resense(*RANGES), StreamSettings(NOISE))
        with pytest.raises(DeviceError, match="nobody else uses it"):
            second.start()


@pytest.mark.slow
def test_it_leaves_nothing_behind(tmp_path: Path) -> None:
    files, threads = len(os.listdir("/proc/self/fd")), threading.active_count()
    for kind in ("bota", "resense"):
        with started(kind, tmp_path) as (_, ft):
            ft.close()
            ft.start()
    assert threading.active_count() == threads
    assert len(os.listdir("/proc/self/fd")) == files
    assert list(tmp_path.iterdir()) == []
