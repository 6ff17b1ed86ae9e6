"""Rubbish on the bus, for emulator and client: no crash, no hang, nothing accepted that nobody sent."""

import contextlib
import os

import dynamixel_sdk as sdk
import numpy as np
import pytest

from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel.bus import Bus, MissedError, RegisterSpan
from palpate.hw.dynamixel.packets import STATUS, Instruction, packet, stuffed
from palpate.hw.dynamixel.port import Packets
from palpate.hw.dynamixel.registers import BAUD_RATE, ID, OPERATING_MODE, STATUS_RETURN_LEVEL, XL330, XM430, Mode
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.protocol import PacketReceiver
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from support.emulated_bus import EmulatedBus, new_sample, started, still
from support.waiting import until

QUICK, ALL = 2500, 100_000
COUNT = pytest.mark.parametrize("count", [QUICK, pytest.param(ALL, marks=pytest.mark.slow)])

BYTES = np.array([0xFF, 0xFF, 0xFF, 0xFD, 0xFD, 0x00, 0x55, 0x01, 0x02])
"""Which fuzzing takes half of the time: the letters of headers."""


def random_bytes(draw, most):
    n = int(draw.integers(0, most + 1))
    nasty = draw.random(n) < 0.5
    return (
        np.where(nasty, BYTES[draw.integers(0, len(BYTES), n)], draw.integers(0, 256, n))
        .astype(np.uint8)
        .tobytes()
    )


def harmed(draw, whole):
    """A packet after something has happened to it; sometimes nothing has."""
    data = bytearray(whole)
    for _ in range(int(draw.integers(0, 3))):
        at = int(draw.integers(0, len(data))) if data else 0
        match int(draw.integers(0, 5)):
            case 0:
                data[at : at + 1] = bytes([data[at] ^ (1 << int(draw.integers(0, 8)))]) if data else b""
            case 1:
                del data[at : at + int(draw.integers(1, 4))]
            case 2:
                data[at:at] = random_bytes(draw, 6)
            case 3:
                del data[at:]
            case _:
                data += data[at:]
    return bytes(data)


def request(draw):
    """A request that is right by its letters, and may mean anything."""
    code = int(draw.choice(list(Instruction))) if draw.random() < 0.9 else int(draw.integers(0, 256))
    parameters = random_bytes(draw, 20)
    if draw.random() < 0.6:  # an address that there is
        address = int(draw.integers(0, 260))
        parameters = bytes((address & 0xFF, address >> 8)) + parameters
    return packet(int(draw.choice([1, 2, 3, 0xFE])), bytes([code]) + parameters)


class Written(DynamixelBus):
    """A bus whose replies are kept."""

    def _out(self, data):
        self.replies = [*getattr(self, "replies", []), data]


@COUNT
def test_an_emulator_takes_any_bytes(count):
    draw = np.random.default_rng(7)
    servos = [EmulatedServo(XL330, 1), EmulatedServo(XM430, 2)]
    bus = Written(servos)
    port = sdk.PortHandler(bus.address)
    assert port.setBaudRate(1_000_000)
    try:
        (master,) = bus.files()
        now = 0.0
        for i in range(count):
            now += float(draw.choice([0.0, 1e-3, 0.3]))
            whole = harmed(draw, request(draw))
            if whole:
                os.write(port.ser.fd, whole)
                bus.receive(master, now)
            if now >= bus.due():
                bus.tick(now)
            if i % 50 == 0:
                for servo, kind in zip(servos, (XL330, XM430), strict=True):
                    goal = servo.goal()
                    assert abs(goal.position) < 1e4
                    assert 0.0 <= goal.current <= kind.servo.current_limit * 1.001
                    assert goal.speed >= 0.0
                    assert servo.table.get(OPERATING_MODE) in set(Mode)
                    # some have been set to another id or rate
                    servo.table.put(ID, 1 + servos.index(servo))
                    servo.table.put(BAUD_RATE, 3)
                    servo.table.put(STATUS_RETURN_LEVEL, 2)
        assert len(bus.replies) > count // 20
        for reply in bus.replies:
            if reply[4] != 0xFE:  # a fast reply is not stuffed
                (found,) = PacketReceiver().feed(reply, 0.0)
                assert found.instruction == STATUS
    finally:
        port.closePort()
        bus.close()


@COUNT
def test_a_receiver_accepts_only_what_somebody_sent(count):
    draw = np.random.default_rng(8)
    receiver, tail, accepted = PacketReceiver(), b"", 0
    for _ in range(count):
        chunk = harmed(draw, request(draw))
        tail = (tail + chunk)[-4096:]
        for found in receiver.feed(chunk, 0.0):
            accepted += 1
            content = bytes([found.instruction]) + found.parameters
            # an FD behind an FF FF FD goes, stuffed or not: a checksum is right only if it was there
            assert packet(found.servo_id, content) in tail or len(stuffed(content)) > len(content)
    assert accepted > count // 5


class Deaf:
    """A port from which only what is given comes back, and for which the time is always over."""

    device, reply_timeout = "bus", 0.0

    def __init__(self, reply):
        self.is_using, self.reply = False, reply

    def clearPort(self):
        pass

    def writePort(self, data):
        return len(data)

    def readPort(self, length):
        found, self.reply = self.reply[: max(0, length)], self.reply[max(0, length) :]
        return found

    def setPacketTimeout(self, length):
        pass

    def isPacketTimeout(self):
        return True

    def drain(self, quiet, longest):
        pass


@COUNT
def test_a_client_accepts_only_genuine_replies(count):
    draw = np.random.default_rng(9)
    spans, accepted = [RegisterSpan(1, 208, 13), RegisterSpan(2, 224, 13)], 0
    for _ in range(count // 2):
        data = [random_bytes(draw, 5).ljust(13, b"\xff")[: int(draw.choice([13, 13, 13, 12]))] for _ in spans]
        replies = [
            packet(span.servo_id, bytes((STATUS, int(draw.choice([0, 0, 128, 4])))) + its)
            for span, its in zip(spans, data, strict=True)
        ]
        stream = b"".join(harmed(draw, reply) if draw.random() < 0.4 else reply for reply in replies)
        try:
            found = Bus(Deaf(stream), 0.0).exchange(spans)
        except MissedError:
            continue
        accepted += 1
        for span, its in zip(spans, found, strict=True):
            assert len(its) == 13
            assert any(packet(span.servo_id, bytes((STATUS, error)) + its) in stream for error in (0, 128))
    assert accepted > count // 20


@COUNT
def test_the_librarys_requests_survive_any_reply(count):
    draw = np.random.default_rng(10)
    packets = Packets()
    for _ in range(count):
        stream = harmed(draw, packet(1, bytes((STATUS, 0)) + random_bytes(draw, 8))) + random_bytes(draw, 12)
        for ask in (
            lambda port: Bus(port, 0.0).ping(1),
            lambda port: packets.ping(port, 1),
            lambda port: packets.writeTxRx(port, 1, 64, 1, [1]),
        ):
            ask(Deaf(stream))


@pytest.mark.slow
def test_a_hand_never_says_what_the_servos_are_not():
    """All faults of the line at once, on a real terminal."""
    motors = [still(0.5, 0.0, -1e-3), still(-0.25, 0.0, -1e-3)]
    with EmulatedBus(motors=motors, seed=5) as emulated, started(emulated, watchdog=0.0) as hand:
        true = hand.read().joint_position
        for fault in ("wrong_checksum", "lost_bytes", "noise"):
            emulated.inject(fault, 0.15)

        def believed():
            with contextlib.suppress(DeviceError):
                return new_sample(hand)

        for _ in range(50):
            assert until(believed).joint_position == true
        for fault in ("wrong_checksum", "lost_bytes", "noise"):
            emulated.inject(fault, 0.0)
