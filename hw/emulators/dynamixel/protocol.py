"""Protocol 2.0 of the emulated servos: packets out of a stream of bytes, and replies to instructions.

Emulated are ping, reads and writes of one or several servos, and reboot; other instructions are refused. Source:
ROBOTIS e-manual, Protocol 2.0.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.packets import (
    BROADCAST_ID,
    FORBIDDEN,
    HEADER,
    OVERHEAD,
    STATUS,
    DynamixelRefusal,
    Instruction,
    checksum,
    packet,
    unstuffed,
)
from palpate.hw.emulators.dynamixel.servo import EmulatedServo

LONGEST = 1024
"""Largest length field that is accepted; the client library sends no longer packets (RXPACKET_MAX_LEN)."""

FRAME_TIMEOUT = 0.1
"""Longest pause within a packet [s]; assumed. A bus at 9600 baud needs it."""


@dataclass(frozen=True, slots=True)
class RequestPacket:
    """Packet with a right checksum.

    Attributes:
        servo_id: Id of the addressed servo.
        instruction: Code, which may be unknown.
        parameters: Parameters without stuffing.
    """

    servo_id: int
    instruction: int
    parameters: bytes


class PacketReceiver:
    """Collects bytes and returns whole packets; `rejected` counts those whose checksum was wrong."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._bytes = bytearray()
        self._last = 0.0
        self.rejected = 0

    def feed(self, data: bytes, now: float) -> list[RequestPacket]:
        """Take the bytes that have arrived and return the packets that are complete.

        Args:
            data: Bytes.
            now: Time [s]; an incomplete packet is given up after a pause.
        """
        held = self._bytes
        if now - self._last > FRAME_TIMEOUT:
            held.clear()
        self._last = now
        held += data
        found: list[RequestPacket] = []
        while True:
            start = held.find(HEADER[:3])
            if start < 0:
                del held[:-2]
                return found
            del held[:start]
            if len(held) < OVERHEAD:
                return found
            length = int.from_bytes(held[5:7], "little")
            if held[3] != 0 or not 3 <= length <= LONGEST:
                del held[:3]
                continue
            whole = OVERHEAD + length
            # where another header begins, this packet was torn: its own content has none
            torn = held.find(FORBIDDEN, OVERHEAD, whole - 2)
            while torn >= 0 and held[torn + 3 : torn + 4] == b"\xfd":
                torn = held.find(FORBIDDEN, torn + 4, whole - 2)
            if 0 <= torn < len(held) - 3:
                del held[:torn]
                self.rejected += 1
                continue
            if len(held) < whole:
                return found
            if checksum(held[: whole - 2]) != int.from_bytes(held[whole - 2 : whole], "little"):
                self.rejected += 1
                del held[:3]
                continue
            content = unstuffed(bytes(held[OVERHEAD : whole - 2]))
            found.append(RequestPacket(held[4], content[0], content[1:]))
            del held[:whole]


Servos = Mapping[int, EmulatedServo]
"""Servos that receive a request, by id, in the order of their ids."""


def replies(request: RequestPacket, servos: Servos, now: float) -> list[bytes]:
    """Carry out a request and return the replies, in order.

    Args:
        request: Packet with a right checksum.
        servos: Servos that receive it.
        now: `time.monotonic` [s].
    """
    for servo in servos.values():
        servo.feed_watchdog(now)
    instruction = request.instruction
    if instruction in _SEVERAL:
        return _SEVERAL[instruction](request.parameters, servos) if request.servo_id == BROADCAST_ID else []
    if instruction == Instruction.PING:
        return [_ping(servo) for servo in _addressed(request, servos)]
    if instruction == STATUS:
        return []  # the reply of another servo
    if instruction != Instruction.READ and instruction not in _CHANGES:
        known = servos.get(request.servo_id)
        return [] if known is None or known.status_level < 2 else [_status(known, DynamixelRefusal.INSTRUCTION)]
    found = []
    for servo in _addressed(request, servos):
        # as before the request: a change begins with the next packet
        level, alert = servo.status_level, servo.alert
        if instruction == Instruction.READ:
            refusal, data = _read(servo, request.parameters)
            replies_due = level >= 1
        else:
            refusal, data = _CHANGES[instruction](servo, request.parameters, now), b""
            replies_due = level >= 2
        if replies_due and request.servo_id != BROADCAST_ID:
            found.append(packet(request.servo_id, bytes((STATUS, refusal | alert)) + data))
    return found


def _addressed(request: RequestPacket, servos: Servos) -> Iterator[EmulatedServo]:
    if request.servo_id == BROADCAST_ID:
        yield from servos.values()
    elif request.servo_id in servos:
        yield servos[request.servo_id]


def _status(servo: EmulatedServo, refusal: DynamixelRefusal, data: bytes = b"") -> bytes:
    return packet(servo.servo_id, bytes((STATUS, refusal | servo.alert)) + data)


def _ping(servo: EmulatedServo) -> bytes:
    table = servo.table
    number = reg.MODEL_NUMBER.bytes_of(table.get(reg.MODEL_NUMBER))
    return _status(servo, DynamixelRefusal.NONE, number + bytes((table.get(reg.FIRMWARE),)))


def _read(servo: EmulatedServo, parameters: bytes) -> tuple[DynamixelRefusal, bytes]:
    if len(parameters) != 4:
        return DynamixelRefusal.LENGTH, b""
    return servo.table.read(_word(parameters, 0), _word(parameters, 2))


def _write(servo: EmulatedServo, parameters: bytes, now: float) -> DynamixelRefusal:
    return servo.write(_word(parameters, 0), parameters[2:]) if len(parameters) > 2 else DynamixelRefusal.LENGTH


def _reboot(servo: EmulatedServo, parameters: bytes, now: float) -> DynamixelRefusal:
    servo.reboot(now)
    return DynamixelRefusal.NONE


_CHANGES: dict[int, Callable[[EmulatedServo, bytes, float], DynamixelRefusal]] = {
    Instruction.WRITE: _write,
    Instruction.REBOOT: _reboot,
}


def _reads(parameters: bytes, each: int) -> Iterator[tuple[int, bytes]]:
    """Yield id and parameters of each servo's own read: of a bulk read (each 5), or a sync read (each 1)."""
    if each == 5:
        for i in range(0, len(parameters) - 4, 5):
            yield parameters[i], parameters[i + 1 : i + 5]
    elif len(parameters) >= 4:
        for servo_id in parameters[4:]:
            yield servo_id, parameters[:4]


def _read_several(each: int) -> Callable[[bytes, Servos], list[bytes]]:
    def several(parameters: bytes, servos: Servos) -> list[bytes]:
        found = []
        for servo_id, wanted in _reads(parameters, each):
            servo = servos.get(servo_id)
            if servo is not None and servo.status_level >= 1:
                found.append(_status(servo, *_read(servo, wanted)))
        return found

    return several


def _read_fast(each: int) -> Callable[[bytes, Servos], list[bytes]]:
    def several(parameters: bytes, servos: Servos) -> list[bytes]:
        """Return one packet to which each servo adds its part; it ends before the first absent one."""
        wanted = list(_reads(parameters, each))
        length = 1 + sum(4 + _word(what, 2) for _, what in wanted)
        if length > LONGEST:
            return []
        found = HEADER + bytes((BROADCAST_ID,)) + length.to_bytes(2, "little") + bytes((STATUS,))
        begun = False
        for servo_id, what in wanted:
            servo = servos.get(servo_id)
            if servo is None or servo.status_level < 1:
                break
            refusal, data = _read(servo, what)
            found += bytes((refusal | servo.alert, servo_id)) + data.ljust(_word(what, 2), b"\0")
            found += checksum(found).to_bytes(2, "little")
            begun = True
        return [found] if begun else []

    return several


def _sync_write(parameters: bytes, servos: Servos) -> list[bytes]:
    if len(parameters) < 4:
        return []
    address, length = _word(parameters, 0), _word(parameters, 2)
    each = parameters[4:]
    if len(each) % (1 + length):
        return []
    for i in range(0, len(each), 1 + length):
        servo = servos.get(each[i])
        if servo is not None:
            servo.write(address, each[i + 1 : i + 1 + length])
    return []


def _bulk_write(parameters: bytes, servos: Servos) -> list[bytes]:
    writes = []
    rest = parameters
    while rest:
        length = _word(rest, 3) if len(rest) >= 5 else 0
        if length == 0 or len(rest) < 5 + length:
            return []
        writes.append((rest[0], _word(rest, 1), rest[5 : 5 + length]))
        rest = rest[5 + length :]
    for servo_id, address, data in writes:
        servo = servos.get(servo_id)
        if servo is not None:
            servo.write(address, data)
    return []


_SEVERAL: dict[int, Callable[[bytes, Servos], list[bytes]]] = {
    Instruction.SYNC_READ: _read_several(1),
    Instruction.BULK_READ: _read_several(5),
    Instruction.FAST_SYNC_READ: _read_fast(1),
    Instruction.FAST_BULK_READ: _read_fast(5),
    Instruction.SYNC_WRITE: _sync_write,
    Instruction.BULK_WRITE: _bulk_write,
}


def _word(data: bytes, at: int) -> int:
    return data[at] | data[at + 1] << 8
