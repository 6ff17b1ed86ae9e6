"""Servos' replies to instructions, packet for packet (ROBOTIS e-manual, Protocol 2.0)."""

from collections.abc import Callable, Iterator, Mapping

from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.packets import (
    BROADCAST_ID,
    HEADER,
    STATUS,
    DynamixelRefusal,
    Instruction,
    checksum,
    packet,
)
from palpate.hw.emulators.dynamixel.receiver import LONGEST, RequestPacket
from palpate.hw.emulators.dynamixel.servo import EmulatedServo

CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"
"""Parameters of a Clear instruction (e-manual)."""

Servos = Mapping[int, EmulatedServo]
"""Those that hear a request, by id, in the order of their ids."""


def replies(request: RequestPacket, servos: Servos, now: float) -> list[bytes]:
    """Carry out a request and return what comes back, in order.

    Args:
        request: With a right checksum.
        servos: Those that hear it.
        now: `time.monotonic` [s].
    """
    for servo in servos.values():
        servo.heard(now)
    try:
        instruction = Instruction(request.instruction)
    except ValueError:
        if request.instruction == STATUS:
            return []  # the reply of another servo
        known = servos.get(request.servo_id)
        return (
            [_status(known, DynamixelRefusal.INSTRUCTION)] if known is not None and known.status_level == 2 else []
        )
    several = _SEVERAL.get(instruction)
    if several is not None:
        return several(request.parameters, servos) if request.servo_id == BROADCAST_ID else []
    if instruction is Instruction.PING:
        return [_ping(servo) for servo in _addressed(request, servos)]
    found = []
    for servo in _addressed(request, servos):
        # as they are before it is carried out: what it changes begins with the next packet
        level, alert = servo.status_level, servo.alert
        if instruction is Instruction.READ:
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


def _reg_write(servo: EmulatedServo, parameters: bytes, now: float) -> DynamixelRefusal:
    return servo.register(_word(parameters, 0), parameters[2:]) if len(parameters) > 2 else DynamixelRefusal.LENGTH


def _action(servo: EmulatedServo, parameters: bytes, now: float) -> DynamixelRefusal:
    return servo.act()


def _reboot(servo: EmulatedServo, parameters: bytes, now: float) -> DynamixelRefusal:
    servo.reboot(now)
    return DynamixelRefusal.NONE


def _factory_reset(servo: EmulatedServo, parameters: bytes, now: float) -> DynamixelRefusal:
    return servo.reset(parameters[0], now) if len(parameters) == 1 else DynamixelRefusal.LENGTH


def _clear(servo: EmulatedServo, parameters: bytes, now: float) -> DynamixelRefusal:
    if parameters != CLEAR_TURNS:
        return DynamixelRefusal.RANGE
    servo.clear_turns()
    return DynamixelRefusal.NONE


_CHANGES: dict[Instruction, Callable[[EmulatedServo, bytes, float], DynamixelRefusal]] = {
    Instruction.WRITE: _write,
    Instruction.REG_WRITE: _reg_write,
    Instruction.ACTION: _action,
    Instruction.REBOOT: _reboot,
    Instruction.FACTORY_RESET: _factory_reset,
    Instruction.CLEAR: _clear,
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
        """Return one packet to which each servo adds its part; it ends before the first who is not there."""
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


_SEVERAL: dict[Instruction, Callable[[bytes, Servos], list[bytes]]] = {
    Instruction.SYNC_READ: _read_several(1),
    Instruction.BULK_READ: _read_several(5),
    Instruction.FAST_SYNC_READ: _read_fast(1),
    Instruction.FAST_BULK_READ: _read_fast(5),
    Instruction.SYNC_WRITE: _sync_write,
    Instruction.BULK_WRITE: _bulk_write,
}


def _word(data: bytes, at: int) -> int:
    return data[at] | data[at + 1] << 8
