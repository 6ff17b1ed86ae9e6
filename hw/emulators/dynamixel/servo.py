"""One servo behind the emulated bus: torque, goals, watchdog, shutdown and reboot, on top of its control table."""

import math

from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.packets import ALERT, DynamixelRefusal
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
from palpate.hw.emulators.dynamixel.control_table import ControlTable
from palpate.hw.emulators.server import ServoGoal, ServoState
from palpate.kinematics.servo_model import PULSE, PULSES, VELOCITY_UNIT

START_UP = 0.3
"""How long a servo is deaf after a reboot [s]; assumed."""

FAR = 1e3
"""Goal of a motor that shall turn on without end [rad]."""

GOALS = (reg.GOAL_PWM, reg.GOAL_CURRENT, reg.GOAL_VELOCITY, reg.GOAL_POSITION)
"""What an expired watchdog locks."""


class EmulatedServo:
    """What the bus talks to, and the plant's motor listens to. Times are of `time.monotonic` [s]."""

    def __init__(self, kind: ServoKind, servo_id: int, baud_rate: int = 1_000_000) -> None:
        """Take a servo of a kind.

        Args:
            kind: Its model.
            servo_id: 0 to 252.
            baud_rate: At which it hears and speaks [1/s], one of `BAUD_RATES`.
        """
        self.table = ControlTable(kind, servo_id, BAUD_RATES.index(baud_rate))
        self._turns = 0  # subtracted from what the plant says, so that after a reboot the position is in one turn
        self._registered: tuple[int, bytes] | None = None
        self._deaf_until = -math.inf
        self._heard = -math.inf
        self._state = ServoState(0.0, 0.0, 0.0)
        table = self.table
        table.put(reg.PRESENT_TEMPERATURE, 30)
        table.put(reg.PRESENT_VOLTAGE, round(10.0 * kind.servo.voltage))
        self.take(self._state)

    @property
    def servo_id(self) -> int:
        """Its id on the bus."""
        return self.table.get(reg.ID)

    @property
    def baud_rate(self) -> int:
        """At which it hears and speaks [1/s]."""
        return BAUD_RATES[self.table.get(reg.BAUD_RATE)]

    @property
    def status_level(self) -> int:
        """0: it replies to pings only, 1: to reads, too, 2: to everything."""
        return self.table.get(reg.STATUS_RETURN_LEVEL)

    @property
    def alert(self) -> int:
        """The bit that its replies carry while a hardware error is set."""
        return ALERT if self.table.get(reg.HARDWARE_ERROR_STATUS) else 0

    def deaf(self, now: float) -> bool:
        """Return whether it is starting up."""
        return now < self._deaf_until

    def heard(self, now: float) -> None:
        """Take note that a packet came along the bus: that is what the watchdog waits for."""
        self._heard = now
        # milliseconds of its own clock, however fast the plant runs
        self.table.put(reg.REALTIME_TICK, int(1000.0 * now) % 32768)

    def write(self, address: int, data: bytes) -> DynamixelRefusal:
        """Do what a write instruction asks, all of it or nothing."""
        refusal = self._refusal(address, data)
        if refusal is DynamixelRefusal.NONE:
            for item, value in self.table.write(address, data):
                self._written(item, value)
        return refusal

    def register(self, address: int, data: bytes) -> DynamixelRefusal:
        """Keep a write for later."""
        refusal = self._refusal(address, data)
        if refusal is DynamixelRefusal.NONE:
            self._registered = (address, data)
            self.table.put(reg.REGISTERED_INSTRUCTION, 1)
        return refusal

    def act(self) -> DynamixelRefusal:
        """Do what was kept."""
        if self._registered is None:
            return DynamixelRefusal.INSTRUCTION
        kept, self._registered = self._registered, None
        self.table.put(reg.REGISTERED_INSTRUCTION, 0)
        return self.write(*kept)

    def reboot(self, now: float) -> None:
        """Start anew; it hears nothing for a while. Where the shaft stands, it stands."""
        self.table.power_up()
        self._registered = None
        self._deaf_until = now + START_UP
        self.clear_turns()

    def reset(self, option: int, now: float) -> DynamixelRefusal:
        """Become as new: all (0xFF), all but the id (1), all but id and baud rate (2)."""
        if option not in (0xFF, 1, 2):
            return DynamixelRefusal.RANGE
        table = self.table
        if table.get(reg.TORQUE_ENABLE):
            return DynamixelRefusal.RESULT
        servo_id, baud = table.get(reg.ID), table.get(reg.BAUD_RATE)
        table.factory_reset()
        if option != 0xFF:
            table.put(reg.ID, servo_id)
        if option == 2:
            table.put(reg.BAUD_RATE, baud)
        self.reboot(now)
        return DynamixelRefusal.NONE

    def clear_turns(self) -> None:
        """Count turns from here: the position is within one again."""
        self._turns += (self._raw() - self._turns * PULSES) // PULSES
        self._show()

    def fail(self, error: HardwareError) -> None:
        """Let a hardware error happen; the torque goes off if Shutdown(63) says so."""
        table = self.table
        table.put(reg.HARDWARE_ERROR_STATUS, table.get(reg.HARDWARE_ERROR_STATUS) | error)
        if error & table.get(reg.SHUTDOWN):
            table.put(reg.TORQUE_ENABLE, 0)

    def take(self, state: ServoState) -> None:
        """Take what the plant's motor measures."""
        self._state = state
        self._show()
        self._guard_supply()

    def watchdog_due(self) -> float:
        """Return when the watchdog expires [s]; infinity if it is not set."""
        value = self.table.get(reg.BUS_WATCHDOG)
        return self._heard + WATCHDOG_UNIT * value if 0 < value < WATCHDOG_EXPIRED else math.inf

    def tick(self, now: float) -> None:
        """Stop if nobody has spoken on the bus for too long."""
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
                return ServoGoal(on, math.copysign(FAR, goal), current, 0.0)
            case Mode.VELOCITY if table.get(reg.GOAL_VELOCITY):
                goal = table.get(reg.GOAL_VELOCITY) * self._direction
                return ServoGoal(on, math.copysign(FAR, goal), largest, abs(goal) * VELOCITY_UNIT)
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
