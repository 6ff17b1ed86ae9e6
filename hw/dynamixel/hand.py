"""A hand of Dynamixel servos: a `HandDevice` over the maker's library.

Every period has one read of all servos, with position, velocity, current, hardware error, torque and watchdog in
one transaction, and one write of goals. An exchange that fails is no fault yet: `read` returns the state before
it, with its time, and raises once several in a row have failed for `HandSettings.silence`.
"""

import math
import time
from collections import Counter
from collections.abc import Iterable, Iterator

from palpate.errors import InvalidValueError
from palpate.hw.condition import DeviceCondition
from palpate.hw.devices import DeviceError, WireError
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.bus import QUIET, Bus, MissedError, RegisterSpan
from palpate.hw.dynamixel.care import ServoCondition, ServoHealth, health, reboot, servo_condition
from palpate.hw.dynamixel.finger_servo import FingerServo, ServoReading
from palpate.hw.dynamixel.port import Port, adapter_latency
from palpate.hw.dynamixel.preparation import hold_still, prepare, presses, shutdown_error, state_span
from palpate.hw.dynamixel.registers import WATCHDOG_EXPIRED, WATCHDOG_UNIT
from palpate.hw.dynamixel.settings import LENGTHS, HandSettings
from palpate.hw.finding import DeviceFinding, DeviceUse, judged
from palpate.kinematics.gear_direction import GearDirection
from palpate.runtime.data import HandSample
from palpate.runtime.watchdog import DeviceWatchdog

HOT, LOW = 10.0, 0.3
"""[degrees C, V] from the limit at which a servo shuts down."""


def hand_condition(name: str, servos: Iterable[ServoCondition]) -> DeviceCondition:
    """Return whether a hand with servos in these conditions is fit to run."""
    servos = tuple(servos)
    failed = [str(servo.servo_id) for servo in servos if servo.error]
    action = f"restart servo {' and '.join(failed)}, which lets go of what it holds" if failed else ""
    return DeviceCondition(name, "; ".join(map(_words, servos)), not failed, action)


def _words(servo: ServoCondition) -> str:
    error = f"shut down by {servo.error.words}" if servo.error else "no hardware error"
    stopped = ", stopped by its bus watchdog" if servo.expired else ""
    return f"servo {servo.servo_id} {error}, torque {'on' if servo.torque_on else 'off'}{stopped}"


def servo_findings(hand: str, servo: ServoHealth, model: str | None) -> Iterator[DeviceFinding]:
    """Yield the findings on a servo; `model` is the required one, None if any will do."""
    name = f"{hand}, servo {servo.servo_id}"
    if model is not None:
        fix = f"write model: {servo.model}, or see which servo has which id"
        yield judged(name, "model", servo.model, "", model, model in servo.model, fix)
    yield DeviceFinding(name, "firmware", float(servo.firmware))
    limit, hottest = servo.temperature_limit, servo.temperature_limit - HOT
    fix = f"let it cool down: at {limit:g} it shuts down, and lets go"
    good = servo.temperature < hottest
    yield judged(name, "temperature", servo.temperature, "deg C", f"below {hottest:g}", good, fix)
    low, high = servo.voltage_range
    fix = "check its supply: outside of its range it shuts down, and lets go"
    good = low + LOW <= servo.voltage <= high - LOW
    yield judged(name, "supply", servo.voltage, "V", f"{low + LOW:.1f} to {high - LOW:.1f}", good, fix)
    words = servo.error.words if servo.error else "none"
    yield judged(name, "hardware error", words, "", "none", not servo.error, "remove the cause, then reboot it")


FEWEST = 3
"""Exchanges in a row that must have failed, besides, before a hand is given up."""


class DynamixelHand:
    """Fingers on one bus, for one thread. `start` may be called again after any fault: it connects anew."""

    def __init__(self, port: str, settings: HandSettings) -> None:
        """Name what there is; nothing is opened yet.

        Args:
            port: Path of the adapter's terminal.
            settings: Servos, fingers and patience.
        """
        self._port_path, self.settings = port, settings
        self._bus: Bus | None = None
        self._fingers: tuple[FingerServo, ...] = ()
        self._forces: tuple[float, ...] = ()
        self._gears: tuple[GearDirection, ...] = ()
        self._found_pressing = False
        self._readings: tuple[ServoReading, ...] = ()
        self._spans: list[RegisterSpan] = []
        self._failing_since, self._failures = math.inf, Counter[tuple[int, bool]]()
        self._lost: DeviceError | None = None
        self._forget()
        self.closing_note = ""
        self.missed = 0

    @property
    def name(self) -> str:
        """See `Device`."""
        return f"Dynamixel hand at {self._port_path}"

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`: nothing stops servos whose bus watchdog is off."""
        if not self.settings.watchdog:
            return ()
        action = "is stopped by its servos, where it stands, and may let go of what it holds,"
        return (DeviceWatchdog(self.name, action, self.settings.watchdog, "hold what it holds before you go on"),)

    @property
    def holding(self) -> bool:
        """Whether a finger was last commanded to press, by this program or one before it."""
        return self._found_pressing or any(force > 0.0 for force in self._forces)

    def start(self) -> None:
        """See `HandDevice`: connect, check, and switch the torque on where the fingers stand.

        What a hand still holds from before, it goes on holding.

        Raises:
            DeviceError: The port or a servo is not fit; the message names it and the remedy.
        """
        if self._bus is not None:
            self._bus.close()
            self._bus = None
        latency = adapter_latency(self._port_path)
        if latency is not None and 2.0 * latency[0] > self.settings.reply_timeout:
            raise DeviceError(
                self.name,
                f"the adapter keeps bytes back for {1e3 * latency[0]:.0f} ms",
                f"`echo 1 | sudo tee {latency[1]}`, and a udev rule to keep it so",
            )
        bus = self._opened()
        try:
            self._fingers = tuple(prepare(bus, self.name, its, self.settings) for its in self.settings.servos)
            pressing = [presses(bus, finger) for finger in self._fingers]
        except BaseException:
            bus.close()
            raise
        self._bus = bus
        self._forget()
        self._found_pressing = any(pressing)
        try:
            for finger in self._fingers:  # after all of them have turned out fit
                hold_still(bus, finger)
            self._read_first()
        except BaseException:
            self.close()
            raise

    def read(self) -> HandSample:
        """See `HandDevice`.

        Raises:
            DeviceError: A servo is silent or has shut down, or the port is lost. The next call tries again, unless
                as many exchanges have failed as there are lengths of them: then `start` has to.
        """
        sample = self._take()
        self._watch()
        return sample

    def state(self) -> tuple[ServoReading, ...]:
        """Return the servos' states from the last `read` that succeeded."""
        self._connected()
        return self._readings

    def press(self, grip_force: tuple[float, ...]) -> None:
        """See `HandDevice`: more than the servos can do is what they can do.

        To be called every period: levers change as fingers move, and goals are not confirmed by anybody.

        Raises:
            InvalidValueError: Another number of forces than of fingers, or one that is negative or not finite.
            DeviceError: The port is lost.
        """
        if len(grip_force) != len(self.settings.servos):
            raise InvalidValueError(
                f"grip_force = {grip_force}: must have {len(self.settings.servos)} entries, one per finger"
            )
        for force in grip_force:
            if not 0.0 <= force < math.inf:
                raise InvalidValueError(
                    f"grip_force = {grip_force} N: must be finite, 0 or above; 0 opens the hand"
                )
        bus = self._connected()
        self._forces, self._found_pressing = grip_force, False
        currents, motions = {}, {}
        each = zip(self._fingers, grip_force, self._gears, self._sample.joint_position, strict=True)
        for finger, force, gear, q in each:
            gear.command(force)
            goals = finger.goals(force, gear.driving, q)
            currents[finger.servo_id], motions[finger.servo_id] = goals.current, goals.motion
        # two short packets: between them stand Goal Velocity(104) and Profile Acceleration(108), left alone
        bus.write_together(reg.GOAL_CURRENT, currents)
        bus.write_together(reg.PROFILE_VELOCITY, motions)

    def health(self) -> tuple[ServoHealth, ...]:
        """Ask every servo how it is; takes a few milliseconds each, so not in the loop.

        Raises:
            DeviceError: One does not reply.
        """
        bus = self._connected()
        return tuple(health(bus, finger) for finger in self._fingers)

    def examine(self) -> tuple[ServoCondition, ...]:
        """Ask every servo for its fault, torque and watchdog; nothing is written, so nothing is let go.

        Raises:
            DeviceError: The port cannot be opened, or one does not reply.
        """
        bus = self._bus if self._bus is not None else self._opened()
        try:
            return tuple(servo_condition(bus, its.servo_id) for its in self.settings.servos)
        finally:
            if self._bus is None:
                bus.close()

    def findings(self, use: DeviceUse) -> Iterator[DeviceFinding]:
        """See `SelfExamining`."""
        for its, servo in zip(self.settings.servos, self.health(), strict=True):
            yield from servo_findings(self.name, servo, its.model)
        share = 100.0 * self.missed / max(1, use.exchanges)
        cable = "check cables, baud rate and the adapter's latency"
        yield judged(self.name, "exchanges missed", share, "%", "at most 1", share <= 1.0, cable)

    def condition(self) -> DeviceCondition:
        """See `Recoverable`."""
        return hand_condition(self.name, self.examine())

    def recover(self) -> None:
        """Restart the servos that have shut down, which let go of what they hold.

        Raises:
            DeviceError: One does not come back, or its hardware error does.
        """
        for servo in self.examine():
            if servo.error:
                self.reboot(servo.servo_id)

    def reboot(self, servo_id: int) -> None:
        """Restart one servo, which lets go of what it holds; then `start` the hand again.

        Raises:
            DeviceError: It does not come back, or its hardware error does.
            InvalidValueError: No such servo in this hand.
        """
        ids = [its.servo_id for its in self.settings.servos]
        if servo_id not in ids:
            raise InvalidValueError(f"servo_id = {servo_id}: must be one of {ids}")
        bus = self._bus if self._bus is not None else self._opened()
        try:
            reboot(bus, self.name, servo_id)
        finally:
            if self._bus is None:
                bus.close()

    def close(self) -> None:
        """See `Device`: torque off, unless the hand presses; `closing_note` says which.

        A hand that was last commanded to press keeps pressing with that force, its bus watchdog off.
        """
        bus, self._bus = self._bus, None
        if bus is None:
            return
        holding = self.holding
        register = reg.BUS_WATCHDOG if holding else reg.TORQUE_ENABLE
        failed = []
        for finger in self._fingers:
            try:
                bus.write(finger.servo_id, register, 0)
            except DeviceError as error:
                failed.append(error.problem)
        bus.close()
        if not holding:
            note = "commanded to switch its torque off" if failed else "torque off"
        elif self._found_pressing:
            note = "left with its torque on, as it was found"
        else:
            note = f"left with its torque on, pressing with {', '.join(f'{force:g}' for force in self._forces)} N"
        self.closing_note = f"{self.name}: " + ", but ".join([note, *failed[:1]])

    def _opened(self) -> Bus:
        port = Port(self._port_path, self.name, self.settings.baud_rate)
        port.open()
        port.drain(QUIET, 0.05)  # replies to a program before this one
        return Bus(port, self.settings.reply_timeout)

    def _connected(self) -> Bus:
        if self._bus is None:
            raise DeviceError(self.name, "it is not connected", "call start()")
        return self._bus

    def _forget(self) -> None:
        n = len(self.settings.servos)
        self._forces, self._found_pressing = (0.0,) * n, False
        self._gears = tuple(GearDirection(self.settings.direction_span) for _ in range(n))
        self._failing_since, self._failures = math.inf, Counter()
        self._lost = None
        self._sample = HandSample(-math.inf, (0.0,) * n)
        self._readings = ()
        self._ask(0)

    def _ask(self, longer: int) -> None:
        self._longer = longer
        self._spans = [state_span(finger, longer) for finger in self._fingers]

    def _take(self) -> HandSample:
        """Return the state of one exchange, or the last one if it fails."""
        bus = self._connected()
        if self._lost is not None:
            raise self._lost
        sent = time.monotonic()
        try:
            replies = bus.exchange(self._spans)
        except MissedError as missed:
            return self._miss(missed, sent)
        if self._failures:
            self._failing_since, self._failures = math.inf, Counter()
        fingers = self._fingers
        self._readings = readings = tuple(
            finger.reading(data) for finger, data in zip(fingers, replies, strict=True)
        )
        pairs = zip(fingers, readings, strict=True)
        self._sample = HandSample(sent, tuple(finger.joint_position(its.position) for finger, its in pairs))
        self._check()
        return self._sample

    def _read_first(self) -> None:
        while not math.isfinite(self._sample.time):
            self._take()

    def _miss(self, missed: MissedError, sent: float) -> HandSample:
        """Count a failed exchange; ask for another length next time, by which a late reply is recognised."""
        self.missed += 1
        self._ask((self._longer + 1) % LENGTHS)
        self._failing_since = min(self._failing_since, sent)
        failing = time.monotonic() - self._failing_since
        self._failures[missed.servo_id, missed.silent] += 1
        # a failure or two may be this process having slept, however long it took
        if failing < self.settings.silence or self._failures.total() < FEWEST:
            return self._sample
        # the one that failed most, not the last: on a busy computer a reply of a sound servo is late, too
        (servo_id, silent), _ = self._failures.most_common(1)[0]
        worst = MissedError(servo_id, silent)
        remedy = "check its cable and its power" if worst.silent else "check the bus for loose or noisy cables"
        error = WireError(self.name, f"{worst} for {1e3 * failing:.0f} ms", f"{remedy}, then `palpate recover`")
        if self._failures.total() >= LENGTHS:  # a late reply is no longer recognised: nothing proves its age
            self._lost = error
        raise error

    def _check(self) -> None:
        for finger, its in zip(self._fingers, self._readings, strict=True):
            if its.error:
                raise shutdown_error(self.name, finger.servo_id, its.error)
            impossible = finger.impossible(its.position)
            if impossible:
                raise DeviceError(
                    self.name, impossible, "check its encoder, and its zero_rad and direction in the robot file"
                )
            if its.watchdog == WATCHDOG_EXPIRED:
                raise DeviceError(
                    self.name,
                    f"servo {finger.servo_id} has stopped: nobody spoke to it for {self.settings.watchdog:g} s",
                    "repeat the run; if it comes back, find what held the loop up (`palpate doctor`)",
                )
            if not its.torque_on:
                raise DeviceError(
                    self.name,
                    f"the torque of servo {finger.servo_id} is off: it lost its power, or somebody else did it",
                    "check its power, then `palpate recover`",
                )

    def _watch(self) -> None:
        """Set the bus watchdog where it is not: not before the first period, as other devices take time to start.

        Nobody confirms it, so every read looks.
        """
        wanted = math.ceil(self.settings.watchdog / WATCHDOG_UNIT - 1e-9)
        if any(its.watchdog != wanted for its in self._readings):
            one = reg.BUS_WATCHDOG.bytes_of(wanted)
            self._connected().write_together(reg.BUS_WATCHDOG, {its.servo_id: one for its in self._fingers})
