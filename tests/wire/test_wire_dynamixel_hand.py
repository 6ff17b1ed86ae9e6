"""A hand over the maker's library, on a terminal with emulated servos: states, forces, start and end."""

import math
import struct
from dataclasses import replace

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.hw.devices import DeviceError, HandDevice
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.bus import Bus
from palpate.hw.dynamixel.finger_servo import FingerServo
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.port import Port, adapter_latency
from palpate.hw.dynamixel.registers import MIDDLE, XL330, XM430, HardwareError, Mode
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.server import ServoState
from palpate.hw.emulators.simple_plant import ElasticWall, SimpleServo
from palpate.kinematics.servo_model import OPENING_FORCE, PULSE, VELOCITY_UNIT, XL330_M288
from palpate.robots.dynamixel_hand import DynamixelEntry
from palpate.robots.rig import rig_entry
from palpate.robots.robot import load_robot
from palpate.sim.hand.finger import HingeFinger, SlideFinger
from support.emulated_bus import EmulatedBus, connected, new_sample, read_until, settings, started, still
from support.waiting import until


def walled():
    """Motors of two fingers with an object between them, which stops the shafts after half a radian."""
    return [SimpleServo(wall=ElasticWall(0.5)) for _ in range(2)]


@pytest.fixture
def emulated():
    with EmulatedBus(motors=walled()) as bus:
        yield bus


@pytest.fixture
def hand(emulated):
    with started(emulated) as device:
        yield device


def exchange(hand):
    """Read until a reply has come: what was written before it has been taken then."""
    until(lambda: new_sample(hand))


def goal_current(emulated, i=0):
    return emulated.servos[i].table.get(reg.GOAL_CURRENT) * emulated.servos[i].table.kind.servo.current_unit


def test_it_is_a_hand_device(hand):
    device: HandDevice = hand
    assert device.name.startswith("Dynamixel hand at /dev/")


def test_starting_leaves_the_fingers_where_they_stand():
    motors = [SimpleServo(state=ServoState(position, 0.0, 0.0)) for position in (0.4, -0.2)]
    with (
        EmulatedBus(motors=motors) as emulated,
        started(emulated, servos=(ServoCalibration(1), ServoCalibration(2, zero=-0.7))) as hand,
    ):
        for _ in range(20):
            exchange(hand)
        assert hand.read().joint_position == pytest.approx((0.4 * 0.02, 0.5 * 0.02), abs=2 * PULSE * 0.02)
        assert all(its.torque_on for its in hand.state())


@given(
    st.floats(-math.pi, math.pi),
    st.sampled_from([-1, 1]),
    st.floats(0.0, 0.04),
    st.sampled_from([0.005, 0.02, 0.05]),
)
def test_goals_and_positions_are_each_others_inverse(zero, direction, q, pinion):
    given = HandSettings((ServoCalibration(3, zero, direction),), SlideFinger(pinion=pinion), q + 1e-3, 0.0)
    finger = FingerServo(given.servos[0], given, XL330, 1750)
    _, closed = finger.range
    position = (closed - 2048) * PULSE
    assert finger.joint_position(position) == pytest.approx(q + 1e-3, abs=0.51 * PULSE * pinion)


@given(st.floats(0.1, 5.0), st.floats(0.0, 0.8))
def test_the_current_of_a_force_is_what_friction_and_lever_make_of_it(force, q):
    """What this current drives at most, over the lever, is the force again; when it sinks, what it holds."""
    hinge = HingeFinger(length=0.07)
    given = HandSettings((ServoCalibration(1),), hinge, 0.04, 0.012)
    finger, motor = FingerServo(given.servos[0], given, XM430, 1193), XM430.servo
    step = 0.51 * motor.torque_constant * 2.69e-3 / hinge.lever(q, 0.012)

    def current(rising):
        return int.from_bytes(finger.goals(force, float(rising), q).current, "little") * 2.69e-3

    lever = hinge.lever(q, 0.012)
    assert motor.driving_torque(current(True)) / lever == pytest.approx(force, abs=step * 1.1)
    if motor.yielding_current(force * lever) > 0.0:
        assert motor.holding_torque(current(False)) / lever == pytest.approx(force, abs=step * 1.2)


def test_pressing_raises_the_current_sinking_yields_and_nothing_opens(emulated, hand):
    hand.read()
    hand.press((4.0, 4.0))
    read_until(hand, lambda _: hand.state()[0].current > 0.0 and goal_current(emulated) > 0.0)
    assert goal_current(emulated) == pytest.approx(XL330_M288.driving_current(4.0 * 0.02), abs=5.1e-4)
    hand.press((2.0, 4.0))
    exchange(hand)
    assert goal_current(emulated) == pytest.approx(XL330_M288.yielding_current(2.0 * 0.02), abs=5.1e-4)
    assert goal_current(emulated, 1) == pytest.approx(XL330_M288.driving_current(4.0 * 0.02), abs=5.1e-4)
    hand.press((2.0, 4.0))  # as before: the way it was going stays the way
    exchange(hand)
    assert goal_current(emulated) == pytest.approx(XL330_M288.yielding_current(2.0 * 0.02), abs=5.1e-4)
    hand.press((0.0, 0.0))
    exchange(hand)
    assert goal_current(emulated) == pytest.approx(XL330_M288.driving_current(OPENING_FORCE * 0.02), abs=5.1e-4)
    assert emulated.servos[0].table.get(reg.GOAL_POSITION) == 2048


def test_fingers_close_with_their_speed_stop_at_the_object_and_press_what_was_asked(emulated):
    with started(emulated, closing_speed=0.05) as hand:
        wanted = XL330_M288.driving_current(3.0 * 0.02)

        def pressing(sample):
            hand.press((3.0, 3.0))
            return sample.joint_position[0] > 0.01 and all(
                its.current == pytest.approx(wanted, abs=6e-4) for its in hand.state()
            )

        read_until(hand, pressing)
        assert emulated.servos[0].goal().speed == pytest.approx(0.05 / 0.02, abs=0.5 * VELOCITY_UNIT)
        sample = hand.read()
        torque = emulated.motors[0].motor.torque_constant * hand.state()[0].current
        assert sample.joint_position[0] == pytest.approx(0.02 * (0.5 + torque / 20.0), abs=2e-4)


def test_more_than_a_servo_can_do_is_what_it_can_do(emulated, hand):
    hand.read()
    hand.press((1e6, 1e300))
    exchange(hand)
    assert (
        goal_current(emulated) == goal_current(emulated, 1) == pytest.approx(XL330_M288.largest_current, abs=1e-3)
    )


def test_friction_that_was_measured_is_taken_for_the_makers():
    rough = replace(XL330_M288, coulomb=0.03)
    given = settings(servos=(ServoCalibration(1), ServoCalibration(2, motor=rough)))
    makers, measured = (FingerServo(its, given, XL330, 1750) for its in given.servos)
    more = [int.from_bytes(its.goals(2.0, True, 0.0).current, "little") * 1e-3 for its in (makers, measured)]
    assert more == pytest.approx([XL330_M288.driving_current(0.04), rough.driving_current(0.04)], abs=5.1e-4)


@pytest.mark.parametrize("level", [0, 1])
def test_servos_are_set_to_reply_to_every_instruction(emulated, level):
    emulated.servos[1].table.put(reg.STATUS_RETURN_LEVEL, level)
    with started(emulated):
        assert emulated.servos[1].status_level == 2


def test_every_hardware_error_has_words():
    for bits in range(1, 256):
        assert HardwareError(bits).words
    assert HardwareError(0x24).words == "overheating and overload"
    assert HardwareError(0x40).words == "hardware error 0x40"


# current -1 and velocity -3 stand side by side as FF FF FD FF FF FF: what must be stuffed
SIGNED = [(-1, -3, 2048), (-1, -771, 0), (-1, 0, 4095), (-1000, 3, 1), (1, -1, 2047), (-3, -3, 253)]


@pytest.mark.parametrize(("current", "velocity", "position"), SIGNED)
def test_signs_and_stuffed_bytes_are_read_as_they_are(current, velocity, position):
    motors = [still((position - 2048) * PULSE, velocity * VELOCITY_UNIT, current * 1e-3) for _ in range(3)]
    with (
        EmulatedBus([EmulatedServo(XL330, i) for i in (1, 7, 9)], motors) as emulated,
        started(emulated, servos=tuple(ServoCalibration(i) for i in (1, 7, 9)), watchdog=0.0) as hand,
    ):
        sample = hand.read()
        for its, q in zip(hand.state(), sample.joint_position, strict=True):
            assert its.current == pytest.approx(current * 1e-3)
            assert its.velocity == pytest.approx(velocity * VELOCITY_UNIT)
            assert its.position == pytest.approx((position - 2048) * PULSE)
            assert q == pytest.approx(0.02 * (position - 2048) * PULSE)


def test_goals_with_a_header_in_them_arrive(emulated):
    """Position -131073 is FF FF FD FF, which the library alone sends unstuffed."""
    port = Port(emulated.bus.address, "bus", 1_000_000)
    port.open()
    bus = Bus(port, 0.03)
    bus.write(1, reg.OPERATING_MODE, Mode.CURRENT_BASED_POSITION)
    bus.write_together(reg.GOAL_POSITION, {1: reg.GOAL_POSITION.bytes_of(-131073)})
    assert bus.read(1, reg.GOAL_POSITION) == -131073
    bus.write(1, reg.GOAL_POSITION, -131073)
    assert emulated.bus.rejected == 0
    bus.close()


def test_two_models_on_one_bus_are_read_in_one_transaction():
    with (
        EmulatedBus([EmulatedServo(XL330, 1), EmulatedServo(XM430, 2)], [still(0.3), still(-0.3)]) as emulated,
        started(emulated) as hand,
    ):
        assert hand.read().joint_position == pytest.approx((0.006, -0.006), abs=0.02 * PULSE)
        assert [its.model for its in hand.health()] == ["XL330-M288", "XM430-W210"]


def test_health_is_what_the_servos_measure(emulated, hand):
    emulated.inject("voltage", 4.6)
    emulated.inject("temperature", 55)
    first, _ = hand.health()
    assert first.voltage == pytest.approx(4.6)
    assert first.voltage_range == pytest.approx((3.5, 7.0))
    assert (first.temperature, first.temperature_limit) == (55.0, 70.0)
    assert first.error == HardwareError(0)


def test_closing_an_open_hand_takes_the_torque_off(emulated, hand):
    hand.read()
    hand.press((3.0, 3.0))
    exchange(hand)
    hand.press((0.0, 0.0))
    hand.close()
    hand.close()
    assert not any(servo.table.get(reg.TORQUE_ENABLE) for servo in emulated.servos)
    assert hand.closing_note.endswith("torque off")


def test_a_hand_that_holds_goes_on_holding_and_may_be_taken_over(emulated, hand):
    hand.read()
    hand.press((3.0, 3.0))
    exchange(hand)
    hand.close()
    assert "pressing with 3, 3 N" in hand.closing_note
    assert not any(servo.table.get(reg.BUS_WATCHDOG) for servo in emulated.servos)
    held = goal_current(emulated)
    assert held == pytest.approx(XL330_M288.driving_current(0.06), abs=5.1e-4)
    assert all(servo.table.get(reg.TORQUE_ENABLE) for servo in emulated.servos)
    again = connected(emulated)
    again.start()
    exchange(again)
    assert goal_current(emulated) == held
    assert emulated.servos[0].table.get(reg.GOAL_POSITION) > 2048
    assert all(servo.table.get(reg.TORQUE_ENABLE) for servo in emulated.servos)
    again.close()  # as somebody who only looked
    assert "as it was found" in again.closing_note
    assert all(servo.table.get(reg.TORQUE_ENABLE) for servo in emulated.servos)
    again.start()
    again.press((0.0, 0.0))
    again.close()
    assert not any(servo.table.get(reg.TORQUE_ENABLE) for servo in emulated.servos)


@pytest.mark.parametrize("held", [False, True])
def test_a_start_that_fails_with_the_torque_on_leaves_it_as_closing_does(emulated, hand, monkeypatch, held):
    """Off, but for what the hand holds."""
    hand.press((3.0, 3.0) if held else (0.0, 0.0))
    hand.close()

    def fail():
        assert all(servo.table.get(reg.TORQUE_ENABLE) for servo in emulated.servos)
        raise DeviceError("the bus", "it breaks just now", "try again")

    monkeypatch.setattr(hand, "_read_first", fail)
    with pytest.raises(DeviceError, match="just now"):
        hand.start()
    assert {bool(servo.table.get(reg.TORQUE_ENABLE)) for servo in emulated.servos} == {held}
    with pytest.raises(DeviceError, match="not connected"):
        hand.read()


def test_nothing_is_written_to_lasting_memory_that_stands_there_already(emulated, hand):
    hand.close()
    writes = []
    table = emulated.servos[0].table
    real = table.write
    table.write = lambda address, data: writes.append(address) or real(address, data)
    hand.start()
    assert writes
    assert not [address for address in writes if address < reg.EEPROM_END]


def test_the_watchdog_is_set_with_the_first_read_and_not_before(emulated, hand):
    assert emulated.servos[0].table.get(reg.BUS_WATCHDOG) == 0  # other devices of a rig may take long to start
    read_until(hand, lambda _: emulated.servos[0].table.get(reg.BUS_WATCHDOG) == 100)


def test_only_one_program_has_the_bus(emulated, hand):
    with pytest.raises(DeviceError, match="end the other program"):
        connected(emulated).start()
    hand.read()


def put(register, value):
    return lambda servo: servo.table.put(register, value)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (put(reg.MODEL_NUMBER, 999), "unknown model 999; use one of XL330"),
        (put(reg.DRIVE_MODE, 1), r"drive mode 1.*Drive Mode\(10\) to 0"),
        (put(reg.HOMING_OFFSET, 5000), "outside of the turn"),
        (
            lambda servo: servo.fail(HardwareError.OVERLOAD),
            r"reports overload; .*then `palpate recover` restarts it",
        ),
    ],
)
def test_a_servo_that_is_not_fit_is_named_with_the_remedy(emulated, spoil, message):
    spoil(emulated.servos[1])
    with pytest.raises(DeviceError, match=message) as raised:
        connected(emulated).start()
    assert "servo 2" in str(raised.value)
    assert raised.value.device.startswith("Dynamixel hand at")


def test_an_adapter_that_keeps_bytes_back_is_reported(tmp_path, monkeypatch):
    (tmp_path / "ttyUSB0").mkdir()
    file = tmp_path / "ttyUSB0" / "latency_timer"
    file.write_text("16\n")
    assert adapter_latency("/dev/ttyUSB0", tmp_path) == (pytest.approx(0.016), file)
    assert adapter_latency("/dev/ttyACM0", tmp_path) is None
    monkeypatch.setattr("palpate.hw.dynamixel.hand.adapter_latency", lambda _: (0.016, file))
    with pytest.raises(DeviceError, match=r"16 ms; `echo 1 \| sudo tee"):
        DynamixelHand("/dev/ttyUSB0", settings(reply_timeout=0.006)).start()


NOT_CONNECTED = r"call start\(\)"

REFUSED = [
    (lambda _: settings(servos=()), "one or more"),
    (lambda _: settings(servos=(ServoCalibration(1), ServoCalibration(1))), "its own"),
    (lambda _: settings(watchdog=0.01), "above silence"),
    (lambda _: settings(watchdog=3.0), "at most 2.54"),
    (lambda _: settings(opening=-1.0), "opening"),
    (lambda _: ServoCalibration(253), "252"),
    (lambda _: ServoCalibration(1, math.nan), "finite"),
    (lambda _: ServoCalibration(1, 0.0, 0), "1 or -1"),
    (lambda bus: connected(bus).press((1.0,)), "grip_force"),
    (lambda bus: connected(bus).press((1.0, -1.0)), "grip_force"),
    (lambda bus: connected(bus).press((math.nan, 1.0)), "grip_force"),
    (lambda bus: connected(bus).press((math.inf, 1.0)), "grip_force"),
    (lambda bus: connected(bus).read(), NOT_CONNECTED),
    (lambda bus: connected(bus).state(), NOT_CONNECTED),
    (lambda bus: connected(bus).health(), NOT_CONNECTED),
    (lambda bus: connected(bus, baud_rate=4_500_000).start(), "no baud rate of 4500000"),
    (lambda bus: connected(bus, baud_rate=57600).start(), "servo 1 does not reply at 57600 baud"),
    (lambda _: DynamixelHand("/dev/ttyNone0", settings()).start(), "ls /dev/serial/by-id"),
]


@pytest.mark.parametrize(("call", "message"), REFUSED)
def test_a_call_that_cannot_be_carried_out_is_refused_in_words(emulated, call, message):
    with pytest.raises((InvalidValueError, DeviceError), match=message):
        call(emulated)


def test_four_servos_can_be_read_and_written_more_than_300_times_a_second(monkeypatch):
    """By what a full cycle puts on the wire, at 1 Mbit/s and ten bits a byte; `benchmarks/wire` measures it."""
    sent, heard = [], []
    write, read = Port.writePort, Port._read
    monkeypatch.setattr(Port, "writePort", lambda port, packet: sent.append(len(packet)) or write(port, packet))
    monkeypatch.setattr(Port, "_read", lambda *given: heard.append(read(*given)) or heard[-1])
    with (
        EmulatedBus([EmulatedServo(XL330, i + 1) for i in range(4)]) as emulated,
        started(emulated, watchdog=0.0, reply_timeout=2.0, silence=5.0) as hand,
    ):
        sent.clear()
        heard.clear()
        assert new_sample(hand)
        hand.press((1.0,) * 4)
        assert len(sent) == 3  # a question to all, and two packets of goals
        assert (sum(sent) + sum(map(len, heard))) * 10 / 1e6 < 1.0 / 300.0
        hand.press((0.0,) * 4)


@pytest.mark.parametrize("position", [-0x75000000, 1 << 20, -5000])
def test_a_position_that_no_finger_has_is_refused_by_name(emulated, hand, monkeypatch, position):
    """With the checksum in order: an encoder or a memory is broken."""
    state = struct.pack("<BBBhii", 1, 0, 5, 0, 0, position)
    monkeypatch.setattr(hand._bus, "exchange", lambda spans: [state] * len(spans))
    with pytest.raises(DeviceError, match=r"servo 1 reports its shaft at .* rad, its finger at") as found:
        hand.read()
    assert f"{(position - MIDDLE) * PULSE:.4g} rad" in str(found.value)
    assert "it can be from" in str(found.value)


def test_a_robot_file_must_not_wait_longer_than_late_replies_are_recognised():
    entry = rig_entry(load_robot("ur5e-hand")).hand
    assert isinstance(entry, DynamixelEntry)
    for silent, accepted in ((0.048, True), (0.049, False)):
        changed = msgspec.structs.replace(entry, silent_after=silent)
        if accepted:
            assert changed.device(load_robot("ur5e-hand")).settings.silence == silent
        else:
            with pytest.raises(InvalidValueError, match=r"silent_after_s = 0\.049: must be at most 0\.048"):
                changed.device(load_robot("ur5e-hand"))
