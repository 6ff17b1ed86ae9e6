"""One servo behind the emulated bus: its control table, torque, goals, watchdog, shutdown and reboot.

The e-manual leaves open whether firmware replies with refusal 4 or 6; here a place outside the table is 4, a value
outside its limits 6.
"""

import math

from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.packets import ALERT, LARGEST_ID, DynamixelRefusal
from palpate.hw.dynamixel.registers import (
    BAUD_RATES,
    MIDDLE,
    WATCHDOG_EXPIRED,
    WATCHDOG_UNIT,
    HardwareError,
    Mode,
    Register,
    ServoKind,
)
from palpate.hw.emulators.server import ServoGoal, ServoState
from palpate.kinematics.servo_model import PULSE, PULSES, PWM_UNITS, VELOCITY_UNIT

MODES = frozenset(Mode) - {Mode.PWM}
"""Modes that are emulated: the motor takes goals of position, current and speed, not of voltage."""

START_UP = 0.3
"""Time for which a servo ignores the bus after a reboot [s]; assumed."""

FAR_GOAL = 1e3
"""Goal of a motor that turns without end [rad]."""

GOALS = (reg.GOAL_PWM, reg.GOAL_CURRENT, reg.GOAL_VELOCITY, reg.GOAL_POSITION)
"""Registers that an expired watchdog locks."""


class ControlTable:
    """Memory of one servo. Values are checked against the limits of the e-manual."""

    def __init__(self, kind: ServoKind, servo_id: int, baud: int) -> None:
        """Begin as a new servo of a kind, with an id and a value of Baud Rate(8)."""
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
        identity = {reg.MODEL_NUMBER: kind.number, reg.FIRMWARE: 50, reg.ID: servo_id, reg.BAUD_RATE: baud}
        for item, value in {**kind.initial, **identity}.items():
            self.put(item, value)
        self.power_up()

    def power_up(self) -> None:
        """Set the values that a servo has after power-up: volatile memory begins anew."""
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
        """Set a value, without checks."""
        self._bytes[item.address : item.end] = item.bytes_of(value)

    def read(self, address: int, length: int) -> tuple[DynamixelRefusal, bytes]:
        """Return the result of a read instruction; bytes outside of items are 0."""
        if length == 0:
            return DynamixelRefusal.LENGTH, b""
        if address + length > self.kind.table_end:
            return DynamixelRefusal.RANGE, b""
        places = (self.place(at) for at in range(address, address + length))
        return DynamixelRefusal.NONE, bytes(self._bytes[at] for at in places)

    def check(self, address: int, data: bytes) -> DynamixelRefusal:
        """Return why a write is refused, if it is."""
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
        """Write data that `check` has accepted; return the written items, in order."""
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
        """Return the address, or the one to which an indirect data byte refers."""
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


class EmulatedServo:
    """Servo between the bus and the plant's motor. Times are of `time.monotonic` [s]."""

    def __init__(self, kind: ServoKind, servo_id: int, baud_rate: int = 1_000_000) -> None:
        """Begin as a new servo.

        Args:
            kind: Model of the servo.
            servo_id: Id, 0 to 252.
            baud_rate: Rate of the bus [1/s], one of `BAUD_RATES`.
        """
        self.table = ControlTable(kind, servo_id, BAUD_RATES.index(baud_rate))
        self._turns = 0  # subtracted from the plant's, so that after a reboot the position is within one turn
        self._up_at = -math.inf
        self._fed = -math.inf
        self._state = ServoState(0.0, 0.0, 0.0)
        table = self.table
        table.put(reg.PRESENT_TEMPERATURE, 30)
        table.put(reg.PRESENT_VOLTAGE, round(10.0 * kind.servo.voltage))
        self.take(self._state)

    @property
    def servo_id(self) -> int:
        """Id on the bus."""
        return self.table.get(reg.ID)

    @property
    def baud_rate(self) -> int:
        """Rate of the bus to which it is set [1/s]."""
        return BAUD_RATES[self.table.get(reg.BAUD_RATE)]

    @property
    def status_level(self) -> int:
        """0: it replies to pings only, 1: to reads, too, 2: to everything."""
        return self.table.get(reg.STATUS_RETURN_LEVEL)

    @property
    def alert(self) -> int:
        """The bit that its replies carry while a hardware error is set."""
        return ALERT if self.table.get(reg.HARDWARE_ERROR_STATUS) else 0

    def starting(self, now: float) -> bool:
        """Return whether it starts up, and ignores the bus."""
        return now < self._up_at

    def feed_watchdog(self, now: float) -> None:
        """Note a packet on the bus: that feeds the watchdog."""
        self._fed = now
        # milliseconds of its own clock, at any speed of the plant
        self.table.put(reg.REALTIME_TICK, int(1000.0 * now) % 32768)

    def write(self, address: int, data: bytes) -> DynamixelRefusal:
        """Carry out a write instruction, all of it or nothing."""
        refusal = self._refusal(address, data)
        if refusal is DynamixelRefusal.NONE:
            for item, value in self.table.write(address, data):
                self._written(item, value)
        return refusal

    def reboot(self, now: float) -> None:
        """Restart: it ignores the bus for a while, and its position is within one turn again. The shaft stays."""
        self.table.power_up()
        self._up_at = now + START_UP
        self._turns += (self._raw() - self._turns * PULSES) // PULSES
        self._show()

    def fail(self, error: HardwareError) -> None:
        """Set a hardware error; the torque goes off if Shutdown(63) has its bit."""
        table = self.table
        table.put(reg.HARDWARE_ERROR_STATUS, table.get(reg.HARDWARE_ERROR_STATUS) | error)
        if error & table.get(reg.SHUTDOWN):
            table.put(reg.TORQUE_ENABLE, 0)

    def take(self, state: ServoState) -> None:
        """Take the measurements of the plant's motor."""
        self._state = state
        self._show()
        self._guard_supply()

    def watchdog_due(self) -> float:
        """Return when the watchdog expires [s]; infinity if it is not set."""
        value = self.table.get(reg.BUS_WATCHDOG)
        return self._fed + WATCHDOG_UNIT * value if 0 < value < WATCHDOG_EXPIRED else math.inf

    def tick(self, now: float) -> None:
        """Stop if the watchdog has expired."""
        if now >= self.watchdog_due():
            self.table.put(reg.BUS_WATCHDOG, WATCHDOG_EXPIRED)
            self.table.put(reg.GOAL_POSITION, self.table.get(reg.PRESENT_POSITION))
            self.table.put(reg.GOAL_VELOCITY, 0)

    def goal(self) -> ServoGoal:
        """Return the motor's goal."""
        table, kind = self.table, self.table.kind
        on = bool(table.get(reg.TORQUE_ENABLE))
        unit = kind.servo.current_unit
        largest = table.get(reg.CURRENT_LIMIT) * unit
        speed = min(table.get(reg.PROFILE_VELOCITY), table.get(reg.VELOCITY_LIMIT)) * VELOCITY_UNIT
        current = abs(table.get(reg.GOAL_CURRENT)) * unit
        match table.get(reg.OPERATING_MODE):
            case Mode.CURRENT:
                goal = table.get(reg.GOAL_CURRENT) * self._direction
                return ServoGoal(on, math.copysign(FAR_GOAL, goal), current, 0.0)
            case Mode.VELOCITY if table.get(reg.GOAL_VELOCITY):
                goal = table.get(reg.GOAL_VELOCITY) * self._direction
                return ServoGoal(on, math.copysign(FAR_GOAL, goal), largest, abs(goal) * VELOCITY_UNIT)
            case Mode.VELOCITY:
                return ServoGoal(on, self._state.position, largest, 0.0)
            case Mode.CURRENT_BASED_POSITION:
                return ServoGoal(on, self._shaft(table.get(reg.GOAL_POSITION)), min(current, largest), speed)
            case _:
                return ServoGoal(on, self._shaft(table.get(reg.GOAL_POSITION)), largest, speed)

    @property
    def _direction(self) -> int:
        return -1 if self.table.get(reg.DRIVE_MODE) & 1 else 1

    def _raw(self) -> int:
        return MIDDLE + self._direction * round(self._state.position / PULSE)

    def _shaft(self, position: int) -> float:
        """Return the shaft's angle [rad] of a position as the registers have it."""
        raw = position - self.table.get(reg.HOMING_OFFSET) + self._turns * PULSES
        return self._direction * (raw - MIDDLE) * PULSE

    def _show(self) -> None:
        table, state, direction = self.table, self._state, self._direction
        velocity = direction * round(state.velocity / VELOCITY_UNIT)
        table.put(reg.PRESENT_POSITION, self._raw() - self._turns * PULSES + table.get(reg.HOMING_OFFSET))
        table.put(reg.PRESENT_VELOCITY, velocity)
        table.put(reg.PRESENT_CURRENT, direction * round(state.current / table.kind.servo.current_unit))
        table.put(reg.MOVING, int(abs(velocity) > table.get(reg.MOVING_THRESHOLD)))

    def _guard_supply(self) -> None:
        table = self.table
        voltage = table.get(reg.PRESENT_VOLTAGE)
        if not table.get(reg.MIN_VOLTAGE_LIMIT) <= voltage <= table.get(reg.MAX_VOLTAGE_LIMIT):
            self.fail(HardwareError.VOLTAGE)
        if table.get(reg.PRESENT_TEMPERATURE) > table.get(reg.TEMPERATURE_LIMIT):
            self.fail(HardwareError.OVERHEATING)

    def _refusal(self, address: int, data: bytes) -> DynamixelRefusal:
        table = self.table
        refusal = table.check(address, data)
        if refusal is not DynamixelRefusal.NONE:
            return refusal
        written = {table.place(address + i): byte for i, byte in enumerate(data)}
        if table.get(reg.BUS_WATCHDOG) == WATCHDOG_EXPIRED and (
            any(item.address in written for item in GOALS) or written.get(reg.BUS_WATCHDOG.address)
        ):
            return DynamixelRefusal.RANGE
        failed = HardwareError(table.get(reg.HARDWARE_ERROR_STATUS))
        if written.get(reg.TORQUE_ENABLE.address) and failed & table.get(reg.SHUTDOWN):
            return DynamixelRefusal.RESULT
        return DynamixelRefusal.NONE

    def _written(self, item: Register, value: int) -> None:
        table = self.table
        if item is reg.TORQUE_ENABLE and value:
            table.put(reg.GOAL_POSITION, table.get(reg.PRESENT_POSITION))
        elif item is reg.OPERATING_MODE:
            table.put(reg.GOAL_CURRENT, table.get(reg.CURRENT_LIMIT))
            table.put(reg.GOAL_POSITION, table.get(reg.PRESENT_POSITION))
        elif item in (reg.DRIVE_MODE, reg.HOMING_OFFSET):
            self._show()
