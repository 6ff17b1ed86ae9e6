"""Faults on a servo bus: how the hand reacts, when it detects them, what it reports, how it recovers.

How long that takes on a computer, `benchmarks/wire faults` measures.
"""

import contextlib
import itertools
import math
import os
import random
import re
import select
import statistics
import threading
import time
from dataclasses import fields
from types import SimpleNamespace

import pytest

import palpate.hw.dynamixel.port
from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.bus import MissedError
from palpate.hw.dynamixel.hand import FEWEST, DynamixelHand
from palpate.hw.dynamixel.port import LATEST, Packets, Port
from palpate.hw.dynamixel.registers import WATCHDOG_EXPIRED, XL330, HardwareError
from palpate.hw.dynamixel.settings import HandSettings
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.server import ServoState
from support.emulated_bus import (
    EmulatedBus,
    connected,
    hosted_servos,
    new_sample,
    read_until,
    settings,
    started,
    still,
)
from support.waiting import first_error, until

NOTICED = 0.05
"""Within which a fault must be reported with the default settings [s]."""

AT_ONCE = {"watchdog": 0.0, "silence": 1e-3}
"""For a hand that is given up after `FEWEST` exchanges, and counts no time."""


@pytest.fixture
def emulated():
    with EmulatedBus(motors=[still(), still()]) as bus:
        yield bus


@pytest.fixture
def hand(emulated):
    # the watchdog has a test of its own; here it would go off while faults last
    with started(emulated, watchdog=0.0) as device:
        yield device


@pytest.fixture
def prompt_hand(emulated):
    with started(emulated, **AT_ONCE) as device:
        yield device


def recovered(hand):
    """Read until a reply is new: an exchange under way must end first."""

    def new_reply():
        with contextlib.suppress(DeviceError):
            return new_sample(hand)

    until(new_reply)


# fault, its value, what switches it off, what the message says
LASTING = [
    ("silent", 2, -1, "servo 2 does not reply .* check its cable and its power"),
    ("mute", 1, 0, "servo 1 does not reply"),
    ("wrong_checksum", 1.0, 0, "servo 1 sends damaged replies .* check the bus"),
    ("lost_bytes", 1.0, 0, "servo 1 (sends damaged replies|does not reply)"),
    ("late", 0.2, 0, "servo 1 (does not reply|sends damaged replies)"),
]


@pytest.mark.parametrize(("fault", "value", "off", "message"), LASTING, ids=[case[0] for case in LASTING])
def test_a_lasting_fault_is_reported_after_a_few_exchanges_and_passes(
    emulated, prompt_hand, fault, value, off, message
):
    recovered(prompt_hand)
    missed = prompt_hand.missed
    emulated.inject(fault, value)
    error = first_error(prompt_hand.read)
    assert prompt_hand.missed == missed + FEWEST
    assert error.device == prompt_hand.name
    assert re.search(message, str(error))
    emulated.inject(fault, off)
    recovered(prompt_hand)


@pytest.fixture
def clock(monkeypatch):
    """A clock of the hand that only tests move."""
    made_up = SimpleNamespace(now=100.0, monotonic=lambda: made_up.now)
    monkeypatch.setattr("palpate.hw.dynamixel.hand.time", made_up)
    return made_up


def test_silence_is_reported_after_its_time_limit_and_not_before(emulated, clock, monkeypatch):
    defaults = {its.name: its.default for its in fields(HandSettings)}
    with started(emulated, **{name: defaults[name] for name in ("watchdog", "reply_timeout", "silence")}) as hand:
        began = clock.now

        def exchange(spans):
            clock.now += hand.settings.reply_timeout
            raise MissedError(1, silent=True)

        monkeypatch.setattr(hand._bus, "exchange", exchange)
        while clock.now + hand.settings.reply_timeout < began + hand.settings.silence:
            hand.read()
        with pytest.raises(DeviceError, match="servo 1 does not reply"):
            hand.read()
        assert clock.now <= began + NOTICED


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "share"), [("wrong_checksum", 0.1), ("lost_bytes", 0.1), ("noise", 0.3)])
def test_a_share_of_faults_costs_exchanges_not_the_hand(emulated, fault, share):
    with started(emulated, watchdog=0.0, silence=20.0) as hand:
        emulated.inject(fault, share)
        fresh = sum(new_sample(hand) is not None for _ in range(100))
        assert emulated.bus.harmed > 7
        assert fresh >= (90 if fault == "noise" else 50)
        emulated.inject(fault, 0.0)


def test_replies_in_pieces_are_reassembled(emulated):
    with started(emulated, watchdog=0.0, reply_timeout=0.5, silence=2.0) as hand:
        emulated.inject("pieces", 3)
        assert sum(new_sample(hand) is not None for _ in range(5)) >= 4


def test_the_servo_that_failed_most_is_named_not_the_one_that_was_late_last(hand, clock, monkeypatch):
    missing = iter([2, 2, 2, 1])

    def exchange(spans):
        servo_id = next(missing)
        if servo_id == 1:
            clock.now += 2.0 * hand.settings.silence
        raise MissedError(servo_id, silent=True)

    monkeypatch.setattr(hand._bus, "exchange", exchange)
    assert "servo 2 does not reply" in str(first_error(hand.read))


def test_a_missed_exchange_gives_the_state_before_it_with_its_time(emulated, hand):
    before = hand.read()
    emulated.inject("mute", 1)
    assert hand.read() == before
    assert hand.missed >= 1
    emulated.inject("mute", 0)


@pytest.mark.slow
@pytest.mark.parametrize("late", [0.13, 0.27, 0.67])
def test_a_late_reply_is_not_taken_for_a_new_one_and_the_hand_recovers_after_the_last(emulated, late):
    """The shaft turns all the time: a sample is never older than its request.

    The line keeps replies in order: those to later requests queue behind a late one, and the hand misses as many
    exchanges as fit into the delay, and one more.
    """
    hand = connected(emulated, watchdog=0.0, reply_timeout=0.1, silence=20.0)
    hand.start()
    positions = [0.0]
    ended = threading.Event()

    def turn():
        for i in itertools.count(1):
            if ended.wait(1e-3):
                return
            with emulated.lock:
                positions.append(1e-3 * (i % 1500))
                for motor in emulated.motors:
                    motor.state = ServoState(positions[-1], 0.0, 0.0)
                emulated.bus.take(emulated.plant.start())

    def fresh():
        before = len(positions)
        if sample := new_sample(hand):
            passed = positions[before - 1 :]  # from when the request went out until the reply was there
            for q in sample.joint_position:
                assert min(abs(q / 0.02 - position) for position in passed) < 2e-3
        return sample

    thread = threading.Thread(target=turn)
    thread.start()
    missed = []
    try:
        for _ in range(5):
            emulated.inject("late", late)
            fresh()
            fresh()
            emulated.inject("late", 0.0)
            before = hand.missed
            until(fresh)
            missed.append(hand.missed - before)
    finally:
        ended.set()
        thread.join()
        hand.close()
    # the median: a machine that stands still makes some replies later than they were meant to be
    assert statistics.median(missed) <= math.ceil(late / hand.settings.reply_timeout) + 1


@pytest.mark.parametrize(
    ("fault", "value", "message"),
    [
        ("overload", 2, r"servo 2 reports overload; .*`palpate recover`"),
        ("brown_out", 1, r"servo 1 .*(lost its power|does not reply)"),
        ("voltage", 2.0, "servo 1 reports voltage"),
        ("temperature", 95, "servo 1 reports overheating"),
        ("unplugged", 1, r"the port was lost .* plug the adapter in, then `palpate recover`"),
    ],
)
def test_a_loss_of_torque_is_reported_within_a_few_exchanges(emulated, prompt_hand, fault, value, message):
    recovered(prompt_hand)
    replies = []
    emulated.inject(fault, value)
    assert re.search(message, str(first_error(lambda: replies.append(new_sample(prompt_hand)))))
    assert len(replies) < FEWEST
    assert not any(replies)
    prompt_hand.close()
    prompt_hand.close()


def test_a_brief_loss_of_power_is_detected_although_the_servo_replies_again(emulated, hand):
    hand.read()
    with emulated.lock:
        emulated.servos[0].reboot(-math.inf)  # back at once
    assert "torque of servo 1 is off" in str(first_error(hand.read))
    hand.start()
    assert all(its.torque_on for its in hand.state())


def test_a_shut_down_servo_is_rebooted_and_used_again(emulated, hand):
    emulated.inject("overload", 2)
    assert "overload" in str(first_error(hand.read))
    with pytest.raises(DeviceError, match="overload"):
        hand.start()
    hand.reboot(2)
    hand.start()
    assert hand.read().time > 0.0
    assert all(its.torque_on and its.error == HardwareError(0) for its in hand.state())


def test_a_reboot_without_effect_is_reported(emulated, hand):
    emulated.servos[1].table.put(reg.SHUTDOWN, 0)
    emulated.inject("voltage", 2.0)
    with pytest.raises(DeviceError, match="servo 2 still reports voltage"):
        hand.reboot(2)


def test_an_adapter_plugged_in_again_is_used_again(tmp_path):
    with EmulatedBus(motors=[still(), still()], link=tmp_path / "hand") as emulated, started(emulated) as hand:
        hand.read()
        emulated.inject("unplugged", 1)
        first_error(hand.read)
        for act in (hand.read, lambda: hand.press((1.0, 1.0)), hand.health):
            with pytest.raises(DeviceError):
                act()
        with pytest.raises(DeviceError, match="ls /dev/serial"):
            hand.start()
        emulated.inject("unplugged", 0)
        hand.start()
        assert hand.read().time > 0.0


def test_pressing_on_a_lost_port_is_reported(emulated, hand):
    hand.read()
    emulated.inject("unplugged", 1)
    with pytest.raises(DeviceError, match="port was lost"):
        hand.press((1.0, 1.0))


def test_closing_reports_what_failed(emulated, hand):
    hand.read()
    emulated.inject("silent", 2)
    hand.close()
    assert "commanded to switch its torque off, but servo 2 does not reply" in hand.closing_note
    assert not emulated.servos[0].table.get(reg.TORQUE_ENABLE)


def test_an_expired_watchdog_is_reported_and_a_new_start_goes_on(emulated):
    with started(emulated, watchdog=0.4, silence=0.3) as hand:
        with contextlib.suppress(DeviceError):  # a busy machine alone may be silent for so long
            read_until(hand, lambda _: hand.state()[0].watchdog == 20)
        until(lambda: emulated.servos[0].table.get(reg.BUS_WATCHDOG) == WATCHDOG_EXPIRED)
        assert "servo 1 has stopped: nobody spoke to it for 0.4 s" in str(first_error(hand.read))
        hand.start()
        hand.read()


def test_an_emulator_that_hangs_does_not_hang_the_hand(emulated, prompt_hand):
    recovered(prompt_hand)
    missed = prompt_hand.missed
    with emulated.lock:
        first_error(prompt_hand.read)
        assert prompt_hand.missed == missed + FEWEST
        for _ in range(400):  # until the terminal takes no more
            try:
                prompt_hand.press((0.0, 0.0))
            except DeviceError:
                break


@pytest.mark.slow
@pytest.mark.parametrize("harm", ["wrong_checksum", "lost_bytes"])
def test_setting_up_copes_with_damaged_replies(harm):
    """A write whose reply is damaged may have been done: it is read back, not taken for failed."""
    with EmulatedBus([EmulatedServo(XL330, i) for i in (1, 2)], [still(), still()], seed=3) as emulated:
        emulated.inject(harm, 0.15)
        with started(emulated) as hand:
            assert emulated.bus.harmed > 3
            emulated.inject(harm, 0.0)
            read_until(hand, lambda sample: sample.time > 0.0)


@pytest.mark.parametrize("rate", [20_000, 2_000_000])
def test_a_babbling_bus_does_not_delay_a_period(emulated, prompt_hand, rate, monkeypatch):
    """Replies may get through the noise or not; once the time is over, little more is read."""
    emulated.inject("babble", rate)
    late = []
    read = Port._read

    def counted(port, length, wait):
        found = read(port, length, wait)
        late[-1] += len(found) * (wait == 0.0)
        return found

    monkeypatch.setattr(Port, "_read", counted)
    for _ in range(40):
        late.append(0)
        with contextlib.suppress(DeviceError):
            prompt_hand.read()
    assert max(late) < 2 * LATEST
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
        fresh += new_sample(hand) is not None
    assert fresh >= 7


@pytest.mark.slow
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


def test_waiting_on_a_bus_that_never_goes_silent_ends_in_time(monkeypatch):
    port, draw, now = Port("/dev/null", "bus", 1_000_000), random.Random(0), itertools.count(0.0, 0.1)
    monkeypatch.setattr(port, "getCurrentTime", lambda: next(now))  # [ms]
    monkeypatch.setattr(port, "_read", lambda length, wait: draw.randbytes(length))
    port.reply_timeout = 2e-3
    port.setPacketTimeout(24)
    assert Packets().readRx(port, 1, 13)[1] != 0
    assert next(now) < 1e3 * NOTICED


def test_the_time_of_day_may_be_set(hand, monkeypatch):
    jumps = itertools.cycle([0.0, 1e6, -1e6])
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() + next(jumps))
    stamps = [sample.time for _ in range(50) if (sample := new_sample(hand))]
    assert len(stamps) >= 40
    assert stamps == sorted(stamps)


@pytest.mark.slow
def test_an_emulator_of_its_own_process_serves_takes_faults_and_may_be_killed():
    with EmulatorProcess(hosted_servos) as process:
        hand = DynamixelHand(process.addresses["dynamixel"], settings(4, **AT_ONCE))
        hand.start()
        recovered(hand)
        process.control.fault("dynamixel", "silent", 3)
        assert "servo 3 does not reply" in str(first_error(hand.read))
        process.control.fault("dynamixel", "silent", -1)
        assert process.control.log("dynamixel") == ["dynamixel: silent = 3", "dynamixel: silent = -1"]
        assert "'torque': 1" in str(process.control.state()["devices"])
        recovered(hand)
        process.kill()
        assert "the port was lost" in str(first_error(hand.read))
        hand.close()
        assert "but the port was lost" in hand.closing_note


def test_nothing_stays_open(tmp_path):
    def files():
        return len(os.listdir("/proc/self/fd"))

    before = files()
    for i in range(3):
        with EmulatedBus(motors=[still(), still()], link=tmp_path / "hand") as emulated, started(emulated) as hand:
            if i == 1:
                emulated.inject("unplugged", 1)
                first_error(hand.read)
            if i == 2:
                emulated.inject("silent", 1)
                with pytest.raises(DeviceError):
                    hand.start()
    assert files() == before
    assert not any("_run" in thread.name for thread in threading.enumerate())
