"""What goes wrong on a servo bus: what the hand does, how soon it knows, what it says, how it comes back."""

import contextlib
import itertools
import math
import os
import random
import re
import select
import threading
import time

import pytest

import palpate.hw.dynamixel.port
from emulated_bus import PROMPT, EmulatedBus, connected, hosted_servos, read_until, settings, still, time_to
from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.bus import MissedError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.port import Packets, Port
from palpate.hw.dynamixel.registers import XL330, HardwareError
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.plant import ServoState
from palpate.hw.emulators.process import EmulatorProcess
from waiting import soonest

NOTICED = 0.05
"""Within which a fault must be told [s]."""

ATTEMPTS = 8
"""How often a fault is tried until it is told in time: a busy machine alone takes 30 ms away now and then."""


@pytest.fixture
def emulated():
    with EmulatedBus(motors=[still(), still()]) as bus:
        yield bus


@pytest.fixture
def hand(emulated):
    # the watchdog has a test of its own; here it would go off while faults last
    device = connected(emulated, watchdog=0.0)
    device.start()
    yield device
    device.close()


@pytest.fixture
def prompt_hand(emulated):
    device = connected(emulated, watchdog=0.0, **PROMPT)
    device.start()
    yield device
    device.close()


def recovered(hand, longest=3.0):
    """Read until an answer is new: what was under way must first be over."""
    end = time.monotonic() + longest
    while time.monotonic() < end:
        begun = time.monotonic()
        with contextlib.suppress(DeviceError):
            if hand.read().time >= begun:
                return
    pytest.fail("it never came back")


# fault, its value, what switches it off, what the message says
LASTING = [
    ("silent", 2, -1, "servo 2 does not answer .* check its cable and its power"),
    ("mute", 1, 0, "servo 1 does not answer"),
    ("wrong_checksum", 1.0, 0, "servo 1 answers, but damaged .* check the bus"),
    ("lost_bytes", 1.0, 0, "servo 1 (answers, but damaged|does not answer)"),
    ("late", 0.02, 0, "servo 1 (does not answer|answers, but damaged)"),
]


@pytest.mark.parametrize(("fault", "value", "off", "told"), LASTING, ids=[case[0] for case in LASTING])
def test_a_lasting_fault_is_told_in_time_and_passes(emulated, prompt_hand, fault, value, off, told):
    tried = []
    for _ in range(ATTEMPTS):
        recovered(prompt_hand)
        emulated.inject(fault, value)
        within, raised = time_to(DeviceError, prompt_hand.read)
        tried.append((within, str(raised)))
        emulated.inject(fault, off)
        recovered(prompt_hand)
        if within <= NOTICED and raised.device == prompt_hand.name and re.search(told, str(raised)):
            return
    pytest.fail(f"never told in time: {tried}")


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "share"), [("wrong_checksum", 0.1), ("lost_bytes", 0.1), ("noise", 0.3)])
def test_a_share_of_faults_costs_exchanges_not_the_hand(emulated, fault, share):
    hand = connected(emulated, watchdog=0.0, answer_time=0.03, silence=2.0)
    hand.start()
    missed = hand.missed
    emulated.inject(fault, share)
    fresh = sum(hand.read().time >= begun for begun in (time.monotonic() for _ in range(300)))
    assert emulated.bus.harmed > 20
    assert fresh >= (270 if fault == "noise" else 150)
    assert fresh + hand.missed - missed == 300
    emulated.inject(fault, 0.0)
    hand.close()


def test_answers_in_pieces_are_put_together(emulated):
    hand = connected(emulated, watchdog=0.0, answer_time=0.5, silence=2.0)
    hand.start()
    emulated.inject("pieces", 3)
    fresh = sum(hand.read().time >= begun for begun in (time.monotonic() for _ in range(5)))
    assert fresh >= 4
    hand.close()


def test_the_servo_that_failed_most_is_named_not_the_one_that_was_late_last(prompt_hand, monkeypatch):
    missing = iter([2, 2, 2, 1])

    def exchange(spans):
        servo_id = next(missing)
        if servo_id == 1:
            time.sleep(2.0 * prompt_hand.settings.silence)
        raise MissedError(servo_id, silent=True)

    monkeypatch.setattr(prompt_hand._bus, "exchange", exchange)
    with pytest.raises(DeviceError, match="servo 2 does not answer"):
        read_until(prompt_hand, lambda _: False)


def test_a_missed_exchange_gives_the_state_before_it_with_its_time(emulated, hand):
    before = hand.read()
    emulated.inject("mute", 1)
    assert hand.read() == before
    assert hand.missed >= 1
    emulated.inject("mute", 0)


@pytest.mark.slow
@pytest.mark.parametrize("late", [0.008, 0.015, 0.04])
def test_no_late_answer_is_taken_for_a_new_one(emulated, prompt_hand, late):
    """The shaft turns all the time; a sample must never be older than it says."""
    turned = []
    ended = threading.Event()

    def turn():
        for i in itertools.count():
            if ended.is_set():
                return
            position = 1e-3 * (i % 1500)
            with emulated.lock:
                turned.append((time.monotonic(), position))
                for motor in emulated.motors:
                    motor.state = ServoState(position, 0.0, 0.0)
                emulated.bus.take(emulated.plant.start())
            time.sleep(1e-3)

    thread = threading.Thread(target=turn)
    thread.start()
    samples = []
    try:
        for i in range(36):
            emulated.inject("late", late if i % 3 == 0 else 0.0)
            for _ in range(2):
                begun = time.monotonic()
                try:
                    sample = prompt_hand.read()
                except DeviceError:
                    continue
                if sample.time >= begun:
                    samples.append((sample, time.monotonic()))
    finally:
        ended.set()
        thread.join(5.0)
    assert len(samples) >= 10
    for sample, until in samples:
        # where the shafts stood from when the request went out until the answer was there
        ends = [t for t, _ in turned[1:]] + [math.inf]
        during = [q for (t, q), end in zip(turned, ends, strict=True) if end >= sample.time and t <= until]
        for q in sample.joint_position:
            shaft = q / 0.02
            assert min(abs(shaft - position) for position in during) < 2e-3


@pytest.mark.parametrize(
    ("fault", "value", "told"),
    [
        ("overload", 2, r"servo 2 reports overload; .*reboot\(2\)"),
        ("brown_out", 1, r"servo 1 .*(lost its power|does not answer)"),
        ("voltage", 2.0, "servo 1 reports voltage"),
        ("temperature", 95, "servo 1 reports overheating"),
        ("unplugged", 1, r"the port was lost .* plug the adapter in and call start\(\) again"),
    ],
)
def test_what_ends_the_torque_is_told_in_time(fault, value, told):
    tried = []
    for _ in range(ATTEMPTS):
        with EmulatedBus(motors=[still(), still()]) as emulated:
            hand = connected(emulated, watchdog=0.0, **PROMPT)
            hand.start()
            with contextlib.suppress(DeviceError):  # the machine may stand still just now
                hand.read()
            emulated.inject(fault, value)
            within, raised = time_to(DeviceError, hand.read)
            tried.append((within, str(raised)))
            hand.close()
            hand.close()
        if within <= NOTICED and re.search(told, str(raised)):
            return
    pytest.fail(f"never told in time: {tried}")


def test_a_brief_loss_of_power_is_seen_although_the_servo_answers_again(emulated, hand):
    hand.read()
    with emulated.lock:
        emulated.servos[0].reboot(-math.inf)  # back at once
    with pytest.raises(DeviceError, match="torque of servo 1 is off"):
        read_until(hand, lambda _: False)
    hand.start()
    assert all(its.torque_on for its in hand.state())


def test_a_shut_down_servo_is_rebooted_and_used_again(emulated, hand):
    emulated.inject("overload", 2)
    with pytest.raises(DeviceError, match="overload"):
        read_until(hand, lambda _: False)
    with pytest.raises(DeviceError, match="overload"):
        hand.start()
    hand.reboot(2)
    hand.start()
    assert hand.read().time > 0.0
    assert all(its.torque_on and its.error == HardwareError(0) for its in hand.state())


def test_a_reboot_that_does_not_help_says_so(emulated, hand):
    emulated.servos[1].table.put(reg.SHUTDOWN, 0)
    emulated.inject("voltage", 2.0)
    with pytest.raises(DeviceError, match="servo 2 still reports voltage"):
        hand.reboot(2)


def test_an_adapter_that_was_unplugged_is_taken_up_again(tmp_path):
    with EmulatedBus(motors=[still(), still()], link=tmp_path / "hand") as emulated:
        hand = connected(emulated)
        hand.start()
        hand.read()
        emulated.inject("unplugged", 1)
        assert time_to(DeviceError, hand.read)[1] is not None
        for act in (hand.read, lambda: hand.press((1.0, 1.0)), hand.health):
            with pytest.raises(DeviceError):
                act()
        with pytest.raises(DeviceError, match="ls /dev/serial"):
            hand.start()
        emulated.inject("unplugged", 0)
        hand.start()
        assert hand.read().time > 0.0
        hand.close()


def test_pressing_on_a_lost_port_is_told(emulated, hand):
    hand.read()
    emulated.inject("unplugged", 1)
    with pytest.raises(DeviceError, match="port was lost"):
        hand.press((1.0, 1.0))


def test_closing_says_what_could_not_be_done(emulated, hand):
    hand.read()
    emulated.inject("silent", 2)
    hand.close()
    assert "told to switch its torque off, but servo 2 does not answer" in hand.closing_note
    assert not emulated.servos[0].table.get(reg.TORQUE_ENABLE)


def test_an_expired_watchdog_is_told_and_a_new_start_goes_on(emulated):
    hand = connected(emulated, watchdog=0.1, silence=0.09)
    hand.start()

    def fallen_silent():
        hand.read()
        hand.read()
        time.sleep(0.25)
        read_until(hand, lambda _: False)

    with pytest.raises(DeviceError, match=r"servo 1 has stopped: nobody spoke to it for 0\.1 s"):
        fallen_silent()
    hand.start()
    hand.read()
    hand.close()


def test_an_emulator_that_hangs_does_not_hang_the_hand(emulated, prompt_hand):
    with emulated.lock:
        within, raised = time_to(DeviceError, prompt_hand.read)
        assert raised is not None
        assert within < 0.5  # a tenth of it, but for what the machine holds up
        for _ in range(400):  # until the terminal takes no more
            try:
                prompt_hand.press((0.0, 0.0))
            except DeviceError:
                break


@pytest.mark.parametrize("harm", ["wrong_checksum", "lost_bytes"])
def test_setting_up_copes_with_damaged_answers(harm):
    """A write whose answer is damaged may have been done: it is read back, not taken for failed."""
    with EmulatedBus([EmulatedServo(XL330, i) for i in (1, 2)], [still(), still()], seed=3) as emulated:
        emulated.inject(harm, 0.15)
        hand = connected(emulated)
        hand.start()
        assert emulated.bus.harmed > 3
        emulated.inject(harm, 0.0)
        read_until(hand, lambda sample: sample.time > 0.0)
        hand.close()


@pytest.mark.parametrize("rate", [20_000, 2_000_000])
def test_a_bus_that_babbles_does_not_hold_a_period_up(emulated, prompt_hand, rate):
    """Between the noise answers come through, or they do not; a read ends."""
    emulated.inject("babble", rate)
    longest = []
    for _ in range(40):
        begun = time.monotonic()
        with contextlib.suppress(DeviceError):
            prompt_hand.read()
        longest.append(time.monotonic() - begun)
    assert sorted(longest)[30] <= NOTICED  # three in four: the machine itself holds some up
    emulated.inject("babble", 0)


def test_an_exception_in_the_library_does_not_leave_the_port_in_use(hand, monkeypatch):
    hand.read()
    packets = hand._bus._packets
    fresh = 0
    for _ in range(10):
        with monkeypatch.context() as patch:
            patch.setattr(packets, "rxPacket", lambda *_: [][0])
            with pytest.raises(IndexError):
                hand.read()
        begun = time.monotonic()
        fresh += hand.read().time >= begun
    assert fresh >= 7


def test_waiting_for_a_silent_servo_does_not_spin(emulated, hand, monkeypatch):
    emulated.inject("mute", 1)
    port, waits, looks = hand._bus._port, [], []
    real_wait, real_look = select.select, port.isPacketTimeout
    monkeypatch.setattr(palpate.hw.dynamixel.port, "select", Counted(real_wait, waits))
    monkeypatch.setattr(port, "isPacketTimeout", lambda: looks.append(1) or real_look())
    hand.read()
    assert 1 <= len(waits) <= 4
    assert len(looks) <= 4


class Counted:
    """The module `select`, its calls counted."""

    def __init__(self, real, calls):
        self._real, self._calls = real, calls

    def select(self, *given):
        self._calls.append(given)
        return self._real(*given)


def test_a_bus_that_never_stops_speaking_is_left_when_the_time_is_over(monkeypatch):
    port, draw, calls = Port("/dev/null", "bus", 1_000_000), random.Random(0), []

    def babble(length, wait):
        calls.append(length)
        assert len(calls) < 200_000, "it listens for ever"
        return draw.randbytes(length)

    monkeypatch.setattr(port, "_read", babble)
    port.answer_time = 2e-3

    def listened():
        calls.clear()
        port.setPacketTimeout(24)
        begun = time.monotonic()
        assert Packets().readRx(port, 1, 13)[1] != 0
        return time.monotonic() - begun

    assert soonest(listened, NOTICED) < NOTICED


def test_the_time_of_day_may_be_set(hand, monkeypatch):
    jumps = itertools.cycle([0.0, 1e6, -1e6])
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() + next(jumps))
    begun = time.monotonic()
    assert sum(hand.read().time > begun for _ in range(50)) >= 40


def test_an_emulator_of_its_own_process_serves_takes_faults_and_may_be_killed():
    noticed = []
    with EmulatorProcess(hosted_servos) as process:
        hand = DynamixelHand(process.addresses["dynamixel"], settings(4, watchdog=0.0, **PROMPT))
        hand.start()
        recovered(hand)
        process.control.fault("dynamixel", "silent", 3)
        noticed.append(time_to(DeviceError, hand.read))
        process.control.fault("dynamixel", "silent", -1)
        assert process.control.log("dynamixel") == ["dynamixel: silent = 3", "dynamixel: silent = -1"]
        assert "'torque': 1" in str(process.control.state()["devices"])
        recovered(hand)
        process.kill()
        noticed.append(time_to(DeviceError, hand.read))
        hand.close()
        assert "but the port was lost" in hand.closing_note
    for within, raised in noticed:
        assert raised is not None
        assert within < 1.0  # one try each: what is asked is in the tests above


def test_nothing_stays_open(tmp_path):
    def files():
        return len(os.listdir("/proc/self/fd"))

    before = files()
    for i in range(3):
        with EmulatedBus(motors=[still(), still()], link=tmp_path / "hand") as emulated:
            hand = connected(emulated)
            hand.start()
            if i == 1:
                emulated.inject("unplugged", 1)
                assert time_to(DeviceError, hand.read)[1] is not None
            if i == 2:
                emulated.inject("silent", 1)
                with pytest.raises(DeviceError):
                    hand.start()
            hand.close()
    assert files() == before
    assert not any("_run" in thread.name for thread in threading.enumerate())
