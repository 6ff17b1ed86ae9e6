"""Dynamixel Protocol 2.0, letter by letter: the maker's own frames, checksum, stuffing, torn streams."""

import random

import pytest
from dynamixel_sdk import COMM_SUCCESS, Protocol2PacketHandler
from hypothesis import given
from hypothesis import strategies as st

from palpate.hw.dynamixel.bus import Bus
from palpate.hw.dynamixel.packets import FORBIDDEN, STATUS, Instruction, checksum, packet, stuffed, unstuffed
from palpate.hw.dynamixel.port import Packets
from palpate.hw.emulators.dynamixel.protocol import PacketReceiver

# bytes that make and break headers, much more often than chance has them
NASTY = st.lists(st.sampled_from([0xFF, 0xFF, 0xFD, 0x00, 0x55, 0x01]) | st.integers(0, 255), max_size=24).map(
    bytes
)

GOLDEN = [  # ROBOTIS e-manual, Protocol 2.0
    ("FFFFFD00 01 0300 01 194E", 1, bytes([Instruction.PING])),
    ("FFFFFD00 01 0700 55 00 0604 26 655D", 1, bytes.fromhex("55 00 0604 26")),
    ("FFFFFD00 01 0700 02 8400 0400 1D15", 1, bytes.fromhex("02 8400 0400")),
    ("FFFFFD00 01 0800 55 00 A6000000 8CC0", 1, bytes.fromhex("55 00 A6000000")),
    ("FFFFFD00 01 0900 03 7400 00020000 CA89", 1, bytes.fromhex("03 7400 00020000")),
    ("FFFFFD00 FE 0900 82 8400 0400 01 02 CEFA", 0xFE, bytes.fromhex("82 8400 0400 01 02")),
]


@pytest.mark.parametrize(("frame", "servo_id", "content"), GOLDEN)
def test_packets_are_those_of_the_manual(frame, servo_id, content):
    assert packet(servo_id, content) == bytes.fromhex(frame)


@given(NASTY, NASTY)
def test_a_checksum_goes_on_where_another_ended_and_is_the_librarys(a, b):
    assert checksum(b, checksum(a)) == checksum(a + b)
    assert checksum(a) == Protocol2PacketHandler().updateCRC(0, a, len(a))
    assert checksum(a) == Packets().updateCRC(0, list(a), len(a))


@given(NASTY)
def test_what_is_stuffed_holds_no_header_and_comes_back(content):
    wire = stuffed(content)
    assert unstuffed(wire) == content
    at = wire.find(FORBIDDEN)
    while at >= 0:
        assert wire[at + 3] == 0xFD
        at = wire.find(FORBIDDEN, at + 1)


@given(st.lists(st.tuples(st.integers(0, 252), NASTY), min_size=1, max_size=5), st.integers(1, 7), NASTY)
def test_packets_come_whole_out_of_any_stream(packets, pieces, noise):
    """However torn, with noise before, between, and with stuffing in them."""
    # noise that begins a packet swallows the next one, as it must: it cannot be distinguished from a torn packet
    noise = noise.replace(b"\xff", b"\x00")
    stream = b"".join(noise + packet(servo_id, b"\x03" + data) for servo_id, data in packets)
    receiver, found = PacketReceiver(), []
    for i in range(0, len(stream), pieces):
        found += receiver.feed(stream[i : i + pieces], 0.0)
    assert [(r.servo_id, r.instruction, r.parameters) for r in found] == [(i, 3, data) for i, data in packets]


@given(NASTY, st.data())
def test_a_torn_packet_costs_at_most_itself(data, draw):
    whole = packet(1, b"\x03" + data)
    cut = draw.draw(st.integers(0, len(whole) - 1))
    torn = whole[:cut] + whole[cut + 1 :]
    receiver = PacketReceiver()
    found = receiver.feed(torn + packet(2, b"\x01") + packet(3, b"\x01"), 0.0)
    ids = [r.servo_id for r in found]
    assert ids == [2, 3]


def test_a_header_that_nothing_follows_is_given_up():
    receiver = PacketReceiver()
    assert receiver.feed(bytes.fromhex("FFFFFD00 01 FF00 03"), 0.0) == []
    assert [r.servo_id for r in receiver.feed(packet(2, b"\x01"), 1.0)] == [2]


class Loop:
    """A port whose reader hears what its writer says."""

    def __init__(self, reply=b""):
        self.is_using, self.sent, self.reply = False, b"", reply

    def clearPort(self):
        pass

    def writePort(self, data):
        self.sent += bytes(data)
        return len(data)

    def readPort(self, length):
        found, self.reply = self.reply[: max(0, length)], self.reply[max(0, length) :]
        return found

    def setPacketTimeout(self, length):
        pass

    def isPacketTimeout(self):
        return True


NO_1 = bytes.fromhex("FF FF FD FF")  # goal current -1, or position -131073


def test_the_library_alone_forgets_to_stuff_and_ours_does_not():
    theirs, ours = Loop(), Loop()
    Protocol2PacketHandler().writeTxOnly(theirs, 1, 116, 4, list(NO_1))
    Packets().writeTxOnly(ours, 1, 116, 4, list(NO_1))
    wanted = packet(1, b"\x03\x74\x00" + NO_1)
    assert ours.sent == wanted
    assert theirs.sent != wanted
    assert PacketReceiver().feed(ours.sent, 0.0)[0].parameters == b"\x74\x00" + NO_1
    assert PacketReceiver().feed(theirs.sent, 0.0) == []


@given(NASTY.filter(lambda data: len(data) > 0))
def test_requests_arrive_and_replies_are_read(data):
    port, packets = Loop(packet(7, bytes((STATUS, 0)) + data)), Packets()
    assert packets.readRx(port, 7, len(data)) == (list(data), COMM_SUCCESS, 0)
    packets.syncWriteTxOnly(port, 100, len(data), [1, *data], 1 + len(data))
    got = PacketReceiver().feed(port.sent, 0.0)
    assert [(r.instruction, r.parameters) for r in got] == [
        (Instruction.SYNC_WRITE, bytes((100, 0, len(data), 0, 1)) + data)
    ]


def test_the_library_alone_takes_out_too_much_of_what_it_receives():
    data = bytes.fromhex("FF FF FD FF FD FD")
    reply = packet(7, bytes((STATUS, 0)) + data)
    assert Protocol2PacketHandler().readRx(Loop(reply), 7, 6)[0] != list(data)
    assert Packets().readRx(Loop(reply), 7, 6)[0] == list(data)


def test_a_reply_of_another_length_is_ignored():
    late, wanted = packet(7, bytes((STATUS, 0)) + bytes(5)), packet(7, bytes((STATUS, 0)) + b"\x02" * 6)
    assert Packets().readRx(Loop(late + wanted), 7, 6)[0] == [2] * 6
    data, result, _ = Packets().readRx(Loop(late), 7, 6)
    assert data == []
    assert result != COMM_SUCCESS


class Drained(Loop):
    """The same for a bus, which sets and drains it."""

    device, reply_timeout = "bus", 0.0

    def drain(self, quiet, longest):
        pass


def test_a_late_reply_to_another_request_is_not_one_to_a_ping():
    """The library alone takes bytes of it for the servo's model."""
    late, wanted = packet(1, bytes((STATUS, 0)) + bytes(13)), packet(1, bytes.fromhex("55 00 B004 26"))
    assert Protocol2PacketHandler().ping(Loop(late + wanted), 1)[0] == 0
    assert Bus(Drained(late + wanted), 0.0).ping(1) == 1200
    assert Bus(Drained(late), 0.0).ping(1) is None


def test_no_reply_is_shorter_than_the_shortest_packet():
    """A length below 4 leaves no room for an error byte: nothing may be read of it, whatever its checksum."""
    for servo_id in range(253):
        for length in range(4):
            head = bytes.fromhex("FFFFFD00") + bytes((servo_id, length, 0, STATUS, 0, 0, 0))
            assert Packets().readRx(Loop(head), servo_id, 1)[0] == []


def test_random_bytes_are_no_packet():
    rubbish = random.Random(0).randbytes(200_000)
    assert PacketReceiver().feed(rubbish, 0.0) == []
