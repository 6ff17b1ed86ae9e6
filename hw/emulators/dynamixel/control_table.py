"""Memory of an emulated servo: what may be written where, and with which error the rest is refused.

Whether real firmware replies with 4 or 6 is not known; here a place outside the table is 4, a value outside its
limits 6.
"""

from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.packets import LARGEST_ID, DynamixelRefusal
from palpate.hw.dynamixel.registers import Mode, Register, ServoKind
from palpate.kinematics.servo_model import PWM_UNITS

MODES = frozenset(Mode) - {Mode.PWM}
"""The modes that are emulated: the motor behind takes goals of position, current and speed, not of voltage."""


class ControlTable:
    """Bytes of one servo. Values are checked as the e-manual has their limits."""

    def __init__(self, kind: ServoKind, servo_id: int, baud: int) -> None:
        """Take a new servo of a kind, with its id and its value of Baud Rate(8)."""
        self.kind = kind
        self._bytes = bytearray(kind.table_end)
        self._writable = bytearray(kind.table_end)
        self._item_at: dict[int, Register] = {}
        self._items: list[Register] = list(reg.REGISTERS)
        for i in range(kind.indirect):
            self._items.append(Register(reg.INDIRECT_ADDRESSES + 2 * i, 2))
            self._items.append(Register(kind.indirect_data + i, 1))
        for item in self._items:
            self._item_at[item.address] = item
            if item.writable:
                self._writable[item.address : item.end] = bytes([1]) * item.size
        self.factory_reset()
        self.put(reg.ID, servo_id)
        self.put(reg.BAUD_RATE, baud)

    def factory_reset(self) -> None:
        """Take every value that a new servo has."""
        self._bytes[: reg.EEPROM_END] = bytes(reg.EEPROM_END)
        for item, value in self.kind.initial.items():
            self.put(item, value)
        self.put(reg.MODEL_NUMBER, self.kind.number)
        self.put(reg.FIRMWARE, 50)
        self.power_up()

    def power_up(self) -> None:
        """Take every value that a servo has after its power came on: what is not kept without it begins anew."""
        measured = [(item, self.get(item)) for item in (reg.PRESENT_VOLTAGE, reg.PRESENT_TEMPERATURE)]
        self._bytes[reg.EEPROM_END :] = bytes(len(self._bytes) - reg.EEPROM_END)
        for item, value in measured:
            self.put(item, value)
        for item, value in self.kind.initial.items():
            if item.address >= reg.EEPROM_END:
                self.put(item, value)
        for i in range(self.kind.indirect):
            self.put(self._item_at[reg.INDIRECT_ADDRESSES + 2 * i], self.kind.indirect_data + i)
        self.put(reg.GOAL_PWM, self.get(reg.PWM_LIMIT))
        self.put(reg.GOAL_CURRENT, self.get(reg.CURRENT_LIMIT))

    def get(self, item: Register) -> int:
        """Return a value."""
        return item.value(self._bytes[item.address : item.end])

    def put(self, item: Register, value: int) -> None:
        """Set a value from inside, whatever anybody may write."""
        self._bytes[item.address : item.end] = item.bytes_of(value)

    def read(self, address: int, length: int) -> tuple[DynamixelRefusal, bytes]:
        """Return what a read instruction gets; bytes that nothing is at are 0."""
        if length == 0:
            return DynamixelRefusal.LENGTH, b""
        if address + length > self.kind.table_end:
            return DynamixelRefusal.RANGE, b""
        places = (self.place(at) for at in range(address, address + length))
        return DynamixelRefusal.NONE, bytes(self._bytes[at] for at in places)

    def check(self, address: int, data: bytes) -> DynamixelRefusal:
        """Return why a write must be refused, if it must."""
        if not data:
            return DynamixelRefusal.LENGTH
        if address + len(data) > self.kind.table_end:
            return DynamixelRefusal.RANGE
        at, rest = address, data
        while rest:
            place = self.place(at)
            item = self._item_at.get(place)
            if item is None or not self._writable[place]:
                return DynamixelRefusal.ACCESS
            if item.address < reg.EEPROM_END and self.get(reg.TORQUE_ENABLE):
                return DynamixelRefusal.ACCESS
            if len(rest) < item.size:
                return DynamixelRefusal.LENGTH
            if not self._within(item, item.value(rest[: item.size])):
                return DynamixelRefusal.LIMIT
            at, rest = at + item.size, rest[item.size :]
        return DynamixelRefusal.NONE

    def write(self, address: int, data: bytes) -> list[tuple[Register, int]]:
        """Write what `check` has admitted; returns what was written, in order."""
        written = []
        at, rest = address, data
        while rest:
            item = self._item_at[self.place(at)]
            value = item.value(rest[: item.size])
            self.put(item, value)
            written.append((item, value))
            at, rest = at + item.size, rest[item.size :]
        return written

    def place(self, address: int) -> int:
        """Return the address itself, or the one that an indirect data byte stands for."""
        first, kind = self.kind.indirect_data, self.kind
        if not first <= address < first + kind.indirect:
            return address
        slot = reg.INDIRECT_ADDRESSES + 2 * (address - first)
        return int.from_bytes(self._bytes[slot : slot + 2], "little")

    def _within(self, item: Register, value: int) -> bool:
        if item is reg.OPERATING_MODE:
            return value in MODES
        largest = self._largest(item)
        if largest is not None:
            return -largest <= value <= largest if item.signed else 0 <= value <= largest
        if item is reg.GOAL_POSITION:
            return self._reachable(value)
        if reg.INDIRECT_ADDRESSES <= item.address < reg.INDIRECT_ADDRESSES + 2 * self.kind.indirect:
            return value < self.kind.table_end
        return True

    def _largest(self, item: Register) -> int | None:
        match item:
            case reg.GOAL_PWM:
                return self.get(reg.PWM_LIMIT)
            case reg.GOAL_CURRENT:
                return self.get(reg.CURRENT_LIMIT)
            case reg.GOAL_VELOCITY:
                return self.get(reg.VELOCITY_LIMIT)
            case reg.PROFILE_VELOCITY | reg.PROFILE_ACCELERATION:
                return 32767
            case reg.CURRENT_LIMIT:
                return self.kind.initial[item]
            case reg.PWM_LIMIT:
                return PWM_UNITS
            case reg.VELOCITY_LIMIT:
                return 2047
            case reg.HOMING_OFFSET:
                return 1_044_479
            case reg.ID:
                return LARGEST_ID
            case reg.BAUD_RATE:
                return self.kind.fastest_baud
            case reg.RETURN_DELAY:
                return 254
            case reg.TORQUE_ENABLE | reg.LED:
                return 1
            case reg.STATUS_RETURN_LEVEL:
                return 2
            case reg.BUS_WATCHDOG:
                return 127
            case reg.MAX_POSITION_LIMIT | reg.MIN_POSITION_LIMIT:
                return 4095
            case _:
                return None

    def _reachable(self, position: int) -> bool:
        if self.get(reg.OPERATING_MODE) == Mode.POSITION:
            return self.get(reg.MIN_POSITION_LIMIT) <= position <= self.get(reg.MAX_POSITION_LIMIT)
        return abs(position) <= 256 * 4096
