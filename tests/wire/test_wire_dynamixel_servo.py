"""The emulated bus against the maker's own library, as it is, over a terminal: every instruction of the table."""

import itertools
import time

import dynamixel_sdk as sdk
import pytest

from palpate.errors import InvalidValueError
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.packets import ALERT, DynamixelRefusal, checksum
from palpate.hw.dynamixel.registers import XL330, XM430, HardwareError, Mode
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.protocol import RequestPacket, replies
from palpate.hw.emulators.dynamixel.servo import START_UP, EmulatedServo
from palpate.hw.emulators.simple_plant import ElasticWall, SimplePlant, SimpleServo
from palpate.spatial import ZERO
from support.emulated_bus import EmulatedBus, still
from support.waiting import until

OK = sdk.COMM_SUCCESS


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """On a loaded machine, 34 ms for a reply are sometimes not enough: 0.6 s."""
    monkeypatch.setattr(sdk.port_handler, "LATENCY_TIMER", 300)


class Client:
    """The library over a terminal."""

    def __init__(self, path, baud=1_000_000):
        self.port, self.packets = sdk.PortHandler(path), sdk.PacketHandler(2.0)
        assert self.port.setBaudRate(baud)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.port.closePort()

    def read(self, servo_id, item):
        data, result, error = self.packets.readTxRx(self.port, servo_id, item.address, item.size)
        return (item.value(bytes(data)) if data else None), result, error

    def write(self, servo_id, item, value):
        return self.packets.writeTxRx(self.port, servo_id, item.address, item.size, list(item.bytes_of(value)))

    def value(self, servo_id, item):
        value, result, error = again_if_late(lambda: self.read(servo_id, item))
        assert (result, error) == (OK, 0)
        return value

    def put(self, servo_id, item, value):
        assert again_if_late(lambda: (None, *self.write(servo_id, item, value))) == (None, OK, 0)


def nobody_replies(ask):
    """Whether no reply comes to a question in 34 ms."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sdk.port_handler, "LATENCY_TIMER", 16)
        return ask() == sdk.COMM_RX_TIMEOUT


def again_if_late(ask):
    """Ask up to three times: on a loaded machine an emulator is sometimes not scheduled for long."""
    for _ in range(2):
        reply = ask()
        if reply[1] != sdk.COMM_RX_TIMEOUT:
            return reply
    return ask()


@pytest.fixture
def bus():
    servos = [EmulatedServo(XL330, 1), EmulatedServo(XM430, 2)]
    with EmulatedBus(servos, [still(0.3, -0.5, 0.2), still(-0.1)]) as emulated:
        yield emulated


@pytest.fixture
def client(bus):
    with Client(bus.bus.address) as connected:
        yield connected


def test_a_ping_reports_the_model_and_no_other_servo_replies(client):
    assert client.packets.ping(client.port, 1) == (1200, OK, 0)
    assert client.packets.ping(client.port, 2) == (1030, OK, 0)
    assert nobody_replies(lambda: client.packets.ping(client.port, 3)[1])


@pytest.mark.slow
def test_every_servo_replies_to_a_broadcast_ping(client):
    found, result = client.packets.broadcastPing(client.port)
    assert result == OK
    assert {servo_id: number for servo_id, (number, _) in found.items()} == {1: 1200, 2: 1030}


@pytest.mark.parametrize("kind", [XL330, XM430], ids=lambda kind: kind.servo.name)
def test_a_new_servo_has_its_makers_values(kind):
    with EmulatedBus([EmulatedServo(kind, 1)], [still()]) as emulated, Client(emulated.bus.address) as client:
        assert client.value(1, reg.CURRENT_LIMIT) == round(kind.servo.current_limit / kind.servo.current_unit)
        assert client.value(1, reg.POSITION_P_GAIN) == kind.servo.gain_p
        assert client.value(1, reg.OPERATING_MODE) == Mode.POSITION
        assert client.value(1, reg.RETURN_DELAY) == 250
        assert client.value(1, reg.STATUS_RETURN_LEVEL) == 2
        assert client.value(1, reg.PRESENT_VOLTAGE) == 10 * kind.servo.voltage


def test_what_the_motor_measures_stands_in_the_table(client):
    assert client.value(1, reg.PRESENT_POSITION) == 2048 + round(0.3 * 4096 / 6.283185307)
    assert client.value(1, reg.PRESENT_VELOCITY) == round(-0.5 / 0.229 * 60 / 6.283185307)
    assert client.value(1, reg.PRESENT_CURRENT) == 200
    client.put(1, reg.DRIVE_MODE, 1)
    assert client.value(1, reg.PRESENT_CURRENT) == -200
    assert client.value(1, reg.PRESENT_POSITION) == 2048 - round(0.3 * 4096 / 6.283185307)
    client.put(1, reg.HOMING_OFFSET, 1000)
    assert client.value(1, reg.PRESENT_POSITION) == 3048 - round(0.3 * 4096 / 6.283185307)


@pytest.mark.parametrize(
    ("item", "value", "torque", "refusal"),
    [
        (reg.OPERATING_MODE, 5, 1, DynamixelRefusal.ACCESS),  # locked while the torque is on
        (reg.PRESENT_POSITION, 0, 0, DynamixelRefusal.ACCESS),
        (reg.MODEL_NUMBER, 7, 0, DynamixelRefusal.ACCESS),
        (reg.Register(71, 1), 7, 0, DynamixelRefusal.ACCESS),  # nothing there
        (reg.Register(116, 2), 7, 0, DynamixelRefusal.LENGTH),
        (reg.Register(60_000, 2), 7, 0, DynamixelRefusal.RANGE),
        (reg.GOAL_CURRENT, 1751, 0, DynamixelRefusal.LIMIT),
        (reg.GOAL_CURRENT, -1751, 0, DynamixelRefusal.LIMIT),
        (reg.GOAL_POSITION, 4096, 0, DynamixelRefusal.LIMIT),
        (reg.OPERATING_MODE, 2, 0, DynamixelRefusal.LIMIT),
        (reg.BUS_WATCHDOG, 128, 0, DynamixelRefusal.LIMIT),
        (reg.GOAL_CURRENT, -1750, 0, DynamixelRefusal.NONE),
        (reg.GOAL_POSITION, 4095, 0, DynamixelRefusal.NONE),
        (reg.LED, 1, 1, DynamixelRefusal.NONE),
    ],
)
def test_writes_are_refused_as_the_manual_says_and_then_change_nothing(client, item, value, torque, refusal):
    client.put(1, reg.TORQUE_ENABLE, torque)
    before = client.read(1, item)
    assert client.write(1, item, value) == (OK, refusal)
    after = client.read(1, item)
    assert after == before or refusal is DynamixelRefusal.NONE
    if refusal is DynamixelRefusal.NONE:
        assert after[0] == value


def test_instructions_that_are_not_emulated_are_refused(client):
    assert client.packets.clearMultiTurn(client.port, 1) == (OK, 2)
    assert client.packets.factoryReset(client.port, 1, 0xFF) == (OK, 2)


def test_reads_outside_are_refused(client):
    assert client.packets.readTxRx(client.port, 1, 200, 100)[1:] == (OK, DynamixelRefusal.RANGE)
    assert client.packets.readTxRx(client.port, 1, 132, 0)[1:] == (OK, DynamixelRefusal.LENGTH)


def test_sync_and_bulk_reads_and_writes(client):
    port, packets = client.port, client.packets
    for make in (sdk.GroupSyncWrite, sdk.GroupBulkWrite):
        many = make(port, packets, 116, 4) if make is sdk.GroupSyncWrite else make(port, packets)
        for servo_id in (1, 2):
            data = list(reg.GOAL_POSITION.bytes_of(100 * servo_id + (make is sdk.GroupSyncWrite)))
            assert (
                many.addParam(servo_id, data)
                if make is sdk.GroupSyncWrite
                else many.addParam(servo_id, 116, 4, data)
            )
        assert many.txPacket() == OK
        for read, fast in itertools.product((sdk.GroupSyncRead, sdk.GroupBulkRead), (False, True)):
            group = read(port, packets, 116, 4) if read is sdk.GroupSyncRead else read(port, packets)
            for servo_id in (1, 2):
                assert group.addParam(servo_id) if read is sdk.GroupSyncRead else group.addParam(servo_id, 116, 4)
            if fast:
                result = group.fastSyncRead() if read is sdk.GroupSyncRead else group.fastBulkRead()
            else:
                result = group.txRxPacket()
            assert result == OK, (read, fast)
            for servo_id in (1, 2):
                assert group.getData(servo_id, 116, 4) == 100 * servo_id + (make is sdk.GroupSyncWrite)


def test_a_fast_reply_is_one_packet_whose_parts_have_running_checksums(bus):
    servos = {servo.servo_id: servo for servo in bus.servos}
    (packet,) = replies(RequestPacket(0xFE, 0x8A, bytes((132, 0, 4, 0, 1, 2))), servos, 0.0)
    assert packet[:8] == bytes.fromhex("FFFFFD00 FE") + (1 + 2 * 8).to_bytes(2, "little") + b"\x55"
    for end in (len(packet) - 8, len(packet)):
        assert checksum(packet[: end - 2]) == int.from_bytes(packet[end - 2 : end], "little")


def test_indirect_data_are_what_their_addresses_say(client):
    client.put(1, reg.Register(168, 2), reg.PRESENT_TEMPERATURE.address)
    client.put(1, reg.Register(170, 2), reg.LED.address)
    assert client.value(1, reg.Register(208, 1)) == 30
    client.put(1, reg.Register(209, 1), 1)
    assert client.value(1, reg.LED) == 1
    assert client.write(1, reg.Register(208, 1), 5) == (OK, DynamixelRefusal.ACCESS)


def test_the_status_return_level_sets_which_instructions_get_replies(client):
    client.put(1, reg.STATUS_RETURN_LEVEL, 1)
    assert nobody_replies(lambda: client.write(1, reg.LED, 1)[0])
    assert client.value(1, reg.LED) == 1  # it was heard all the same
    assert nobody_replies(lambda: client.write(1, reg.STATUS_RETURN_LEVEL, 0)[0])
    assert nobody_replies(lambda: client.read(1, reg.LED)[1])
    assert client.packets.ping(client.port, 1)[1] == OK


def test_who_speaks_at_another_rate_is_not_heard(bus, client):
    with Client(bus.bus.address, 57600) as slow:
        assert nobody_replies(lambda: slow.packets.ping(slow.port, 1)[1])
    with Client(bus.bus.address) as quick:
        quick.put(1, reg.BAUD_RATE, 1)
        assert nobody_replies(lambda: quick.packets.ping(quick.port, 1)[1])
        assert quick.packets.ping(quick.port, 2)[1] == OK
    with Client(bus.bus.address, 57600) as slow:
        assert slow.packets.ping(slow.port, 1)[1] == OK


def test_another_mode_takes_the_goal_current_back(client):
    client.put(1, reg.GOAL_CURRENT, 5)
    client.put(1, reg.OPERATING_MODE, Mode.CURRENT_BASED_POSITION)
    assert client.value(1, reg.GOAL_CURRENT) == 1750


def test_torque_comes_on_where_the_shaft_stands(client):
    client.put(1, reg.GOAL_POSITION, 7)
    client.put(1, reg.TORQUE_ENABLE, 1)
    assert client.value(1, reg.GOAL_POSITION) == client.value(1, reg.PRESENT_POSITION)


def test_a_shutdown_takes_the_torque_and_only_a_reboot_gives_it_back(bus, client):
    client.put(1, reg.TORQUE_ENABLE, 1)
    client.put(1, reg.LED, 1)
    bus.inject("overload", 1)
    assert client.read(1, reg.TORQUE_ENABLE) == (0, OK, ALERT)
    assert client.read(1, reg.HARDWARE_ERROR_STATUS)[0] == HardwareError.OVERLOAD
    assert client.read(2, reg.TORQUE_ENABLE)[2] == 0
    assert client.write(1, reg.TORQUE_ENABLE, 1) == (OK, ALERT | DynamixelRefusal.RESULT)
    assert client.packets.reboot(client.port, 1) == (OK, ALERT)
    until(lambda: client.packets.ping(client.port, 1)[1] == OK)  # it starts up
    assert client.value(1, reg.HARDWARE_ERROR_STATUS) == 0
    assert client.value(1, reg.LED) == 0  # what is not kept without power is gone
    client.put(1, reg.TORQUE_ENABLE, 1)


def test_a_hardware_error_that_is_not_in_the_mask_only_alerts(bus, client):
    client.put(1, reg.SHUTDOWN, 0)
    client.put(1, reg.TORQUE_ENABLE, 1)
    bus.inject("temperature", 90)
    until(lambda: client.read(1, reg.TORQUE_ENABLE) == (1, OK, ALERT))
    assert client.read(1, reg.HARDWARE_ERROR_STATUS)[0] == HardwareError.OVERHEATING


def test_a_servo_that_starts_up_is_deaf():
    servo = EmulatedServo(XL330, 1)
    servo.reboot(100.0)
    assert servo.starting(100.0)
    assert servo.starting(99.99 + START_UP)
    assert not servo.starting(100.0 + START_UP)


def test_the_watchdog_stops_a_servo_that_nobody_speaks_to():
    """By a clock of its own."""
    servo, plant = EmulatedServo(XL330, 1), SimplePlant(servos=(SimpleServo(),))
    for item, value in (
        (reg.OPERATING_MODE, Mode.CURRENT_BASED_POSITION),
        (reg.PROFILE_VELOCITY, 5),
        (reg.TORQUE_ENABLE, 1),
        (reg.GOAL_POSITION, 4000),
        (reg.BUS_WATCHDOG, 3),  # 60 ms
    ):
        assert servo.write(item.address, item.bytes_of(value)) is DynamixelRefusal.NONE

    def run(begin, end):
        for i in range(round(1e3 * begin), round(1e3 * end), 2):
            servo.tick(1e-3 * i)
            (motor,) = plant.step(ZERO, ZERO, (servo.goal(),)).servos
            servo.take(motor)
        return motor

    for i in range(6):  # fed, it goes on
        servo.feed_watchdog(0.02 * i)
        assert run(0.02 * i, 0.02 * (i + 1)).velocity > 0.0
        assert servo.table.get(reg.BUS_WATCHDOG) == 3
    run(0.12, 0.16)
    assert servo.table.get(reg.BUS_WATCHDOG) == 3
    stood = run(0.16, 0.26).position
    assert servo.table.get(reg.BUS_WATCHDOG) == 255
    assert run(0.26, 0.31).position == pytest.approx(stood, abs=1e-3)
    assert servo.write(reg.GOAL_POSITION.address, reg.GOAL_POSITION.bytes_of(4000)) is DynamixelRefusal.RANGE
    for item, value in ((reg.BUS_WATCHDOG, 0), (reg.GOAL_POSITION, 4000)):
        assert servo.write(item.address, item.bytes_of(value)) is DynamixelRefusal.NONE


def test_an_expired_watchdog_locks_the_goals_until_it_is_reset(client):
    client.put(1, reg.BUS_WATCHDOG, 3)
    until(lambda: client.write(1, reg.GOAL_POSITION, 4000) == (OK, DynamixelRefusal.RANGE) or time.sleep(0.1))
    assert client.value(1, reg.BUS_WATCHDOG) == 255
    client.put(1, reg.BUS_WATCHDOG, 0)
    client.put(1, reg.GOAL_POSITION, 4000)


def test_a_stalled_motor_draws_its_goal_current():
    motor = SimpleServo(wall=ElasticWall(0.05))
    with EmulatedBus([EmulatedServo(XL330, 1)], [motor]) as emulated, Client(emulated.bus.address) as client:
        client.put(1, reg.OPERATING_MODE, Mode.CURRENT_BASED_POSITION)
        client.put(1, reg.GOAL_CURRENT, 150)
        client.put(1, reg.TORQUE_ENABLE, 1)
        client.put(1, reg.GOAL_POSITION, 4000)
        until(lambda: client.value(1, reg.PRESENT_CURRENT) == 150)


def test_a_terminal_has_its_own_link_and_takes_it_along(tmp_path):
    link = tmp_path / "hand"
    bus = DynamixelBus([EmulatedServo(XL330, 1)], link=link)
    try:
        assert bus.address == str(link)
        assert link.resolve().exists()
        bus.inject("unplugged", 1)
        assert not link.exists()
        bus.inject("unplugged", 0)
        assert link.resolve().exists()
    finally:
        bus.close()
    assert not link.is_symlink()


def test_a_link_that_a_killed_process_left_is_replaced_and_nothing_else_is(tmp_path):
    link, file = tmp_path / "hand", tmp_path / "notes"
    link.symlink_to("/dev/pts/9999")
    DynamixelBus([EmulatedServo(XL330, 1)], link=link).close()
    file.write_text("kept")
    with pytest.raises(InvalidValueError, match="choose another place"):
        DynamixelBus([EmulatedServo(XL330, 1)], link=file)
    assert file.read_text() == "kept"


@pytest.mark.parametrize(
    ("fault", "value", "message"),
    [
        ("sillent", 1, "silent, mute"),
        ("silent", 9, "one of 1, 2"),
        ("noise", 1.5, "0 to 1"),
        ("late", -1, "0 or above"),
    ],
)
def test_faults_that_there_are_not_are_refused(bus, fault, value, message):
    with pytest.raises(InvalidValueError, match=message):
        bus.inject(fault, value)


def test_two_servos_of_one_id_are_refused():
    with pytest.raises(InvalidValueError, match="its own"):
        DynamixelBus([EmulatedServo(XL330, 1), EmulatedServo(XM430, 1)])
