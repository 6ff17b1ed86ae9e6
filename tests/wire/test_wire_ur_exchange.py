"""Memory shared by the arm and its client process, and checks of states and commands: no process, no socket."""

import math
import mmap
import os
import struct
import subprocess
import sys
import time
from contextlib import closing
from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import support.fake_ur_library as fake
from palpate.errors import InvalidValueError
from palpate.hw.ur import FlangePayload, UrSettings, library
from palpate.hw.ur.exchange import (
    READINGS,
    ClientPhase,
    Exchange,
    Order,
    SharedRow,
    Status,
    UrState,
    new_memory,
    size_of,
)
from palpate.hw.ur.problems import WORDS, Problem, SafetyBit, safety_problem
from palpate.hw.ur.state_receiver import (
    ControllerRestartedError,
    ImpossibleStateError,
    StateReceiver,
    is_possible,
)
from support.waiting import until

SIX = st.tuples(*[st.floats(-1e6, 1e6)] * 6)
ZEROS = (0.0,) * 6
JOINTS = (0.1, -1.57, 1.8, -1.8, -1.57, 0.3)
MOVING = (0.02, -0.01, 0.03, -0.02, 0.01, 0.004)
POSE = (-0.13, 0.49, 0.21, 2.2, -2.2, 0.01)
LOAD = (1.2, -0.4, 5.1, 0.02, 0.3, -0.01)
STATE = UrState(1.0, 1.0, 12.346, JOINTS, MOVING, POSE, MOVING, LOAD, 2, 7, 1, 1.0, 0.8, 0)


@pytest.mark.slow
@given(st.tuples(SIX, SIX, SIX, SIX, SIX), st.integers(0, 2**31), st.integers(0, 10**9))
def test_one_end_reads_what_the_other_writes_bit_for_bit(sixes, bits, lost):
    file = new_memory()
    with closing(Exchange(file)) as here, closing(Exchange(file)) as there:
        assert (here.state(), here.command(), here.status()) == (None, None, None)
        a, b, c, d, e = sixes
        state = UrState(1.5, 1.25, 0.5, a, b, c, d, e, 2, 7, bits, 0.5, 0.25, lost)
        there.write_state(state)
        assert here.state() == state
        for order in (Order(lost + 1, 2.5, True, a), Order(lost + 2, 3.5, False)):
            here.write_command(order)
            assert there.command() == order
        status = Status(1.5, 1.25, ClientPhase.READY, Problem.PROTECTIVE_STOP, lost, 3)
        there.write_status(status)
        assert here.status() == status
    os.close(file)


WRITER = """
import mmap, sys
from palpate.hw.ur.exchange import SharedRow, size_of
width = int(sys.argv[2])
row = SharedRow(mmap.mmap(int(sys.argv[1]), size_of(width)), 0, width)
for number in range(1, 1_000_000):
    row.write([number] * width)
"""


@pytest.mark.slow
def test_rows_are_never_torn_and_never_go_back():
    """Another process writes at full speed: every row that is read is whole, and none is older than the last."""
    width = 400
    file = os.memfd_create("row")
    os.ftruncate(file, size_of(width))
    memory = mmap.mmap(file, size_of(width))
    reader = SharedRow(memory, 0, width)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", WRITER, str(file), str(width)]
    with subprocess.Popen(command, pass_fds=(file,), env=environment) as writer:
        seen, last = 0, 0.0
        while seen < 200:
            assert writer.poll() is None
            row = reader.read()
            if row is not None:
                assert len(set(row)) == 1
                assert row[0] >= last
                seen, last = seen + (row[0] > last), row[0]
        writer.kill()
    reader.close()
    memory.close()
    os.close(file)


@given(st.permutations(range(5)), st.integers(0, 4))
def test_a_row_of_which_only_a_part_is_visible_is_not_read(order, visible):
    """As a processor that reorders its stores may show it: the newest number, words of its row in any order."""
    width = 3
    memory = mmap.mmap(-1, size_of(width))
    row = SharedRow(memory, 0, width)
    for k in range(4):
        row.write([k, k + 0.25, k + 0.5])
    before = memory[:]
    row.write([4.0, 4.25, 4.5])  # over the first
    after = memory[:]
    words = [i for i in range(8, len(after), 8) if after[i : i + 8] != before[i : i + 8]]
    assert len(words) == 5  # number, three values, checksum
    memory[8:] = before[8:]
    for k in order[:visible]:
        memory[words[k] : words[k] + 8] = after[words[k] : words[k] + 8]
    assert row.read() is None
    memory[:] = after
    assert row.read() == (4.0, 4.25, 4.5)
    row.close()
    memory.close()


# -- states --


def test_a_state_is_of_one_cycle_although_the_getters_are_not(tmp_path):
    """Cycles pass while a state is read, and each getter replies for the present one: no state may be mixed."""
    fake.forget()
    receiver = fake.receiver(str(tmp_path), 500.0)
    state_receiver = StateReceiver(receiver, fake.echo(str(tmp_path), 500.0), 500.0)
    taken = [until(lambda: state_receiver.take(time.monotonic())) for _ in range(200)]
    fake.forget()
    assert all(s.joint_position[0] == s.joint_velocity[0] == s.tool_wrench[0] == s.controller_time for s in taken)
    stamps = [s.controller_time for s in taken]
    assert stamps == sorted(set(stamps))
    assert taken[-1].lost == round((stamps[-1] - stamps[0]) / 0.002) + 1 - len(stamps)


class Stamps:
    """A receiver whose time stamps are given, and the values of a state; one getter may reply with another."""

    def __init__(self, *stamps: float, name: str = "", reply: object = None) -> None:
        self.stamps = [s for s in stamps for _ in range(2)]
        for field, (_, getter) in READINGS.items():
            value = getattr(STATE, field)
            found = reply if getter == name else list(value) if isinstance(value, tuple) else value
            setattr(self, getter, lambda found=found: found)

    def getTimestamp(self) -> float:
        return self.stamps.pop(0) if len(self.stamps) > 1 else self.stamps[0]


def receiver(stamps: Stamps) -> StateReceiver:
    return StateReceiver(stamps, fake.FakeEcho(lambda: time.monotonic()), 500.0)


def test_a_clock_that_goes_back_is_a_restarted_controller():
    states = receiver(Stamps(5.0, 5.002, 0.5))
    taken = states.take(1.0)
    assert replace(taken, time=1.0, seen=1.0, controller_time=12.346) == STATE
    assert states.take(1.002) is not None
    with pytest.raises(ControllerRestartedError):
        states.take(1.004)


VECTORS = ("joint_position", "joint_velocity", "tool_pose", "tool_velocity", "tool_wrench")


@pytest.mark.parametrize(
    ("getter", "reply"),
    [
        *((READINGS[name][1], [0.0, value, 0.0, 0.0, 0.0, 0.0])
          for name in VECTORS for value in (math.nan, math.inf, -math.inf, 1e9, -1e9)),
        ("getRobotMode", 77),
        ("getRuntimeState", -1),
        (READINGS["speed_scaling"][1], math.nan),
        (READINGS["speed_scaling"][1], 3.0),
        (READINGS["speed_slider"][1], -0.5),
    ],
)  # fmt: skip
def test_values_that_no_controller_sends_are_not_taken_for_a_state(getter, reply):
    with pytest.raises(ImpossibleStateError):
        receiver(Stamps(5.0, name=getter, reply=reply)).take(1.0)


LAYOUT = struct.Struct(">d" + "6d" * 5 + "IiI" + "dd" + "d")
"""As `library.RECEIVED` orders them, with the unused value at the end."""


def package(state: UrState) -> bytes:
    values = [value for name in READINGS for value in _row(getattr(state, name))]
    return LAYOUT.pack(state.controller_time, *values, 0.0005)


def _row(value) -> tuple:
    return value if isinstance(value, tuple) else (value,)


def read(payload: bytes, before: bytes) -> UrState:
    """Return the state that the library makes of a package: it takes missing bytes from the package before."""
    values = LAYOUT.unpack(payload + before[len(payload) :])
    sixes = [tuple(values[1 + 6 * i : 7 + 6 * i]) for i in range(5)]
    return UrState(1.0, 1.0, values[0], *sixes, *values[31:36], 0)


def test_the_layout_of_these_tests_is_the_requested_one():
    assert library.RECEIVED[0] == "timestamp"
    assert library.RECEIVED[1:-1] == tuple(variable for variable, _ in READINGS.values())
    assert library.LAST not in library.RECEIVED[:-1]
    assert read(package(STATE), package(STATE)) == STATE


@given(st.integers(1, 8))
def test_bytes_that_are_missing_at_the_end_change_no_value(missing):
    now, before = package(STATE), package(replace(STATE, joint_velocity=ZEROS))
    assert read(now[:-missing], before) == read(now, before)


@given(st.lists(st.floats(0.05, 3.0) | st.floats(-3.0, -0.05), min_size=6, max_size=6), st.integers(8, 55))
def test_a_byte_that_is_missing_among_the_joints_is_noticed(joints, lost):
    """The rest is read a byte off, in which exponents are digits and modes others."""
    whole = package(replace(STATE, joint_position=tuple(joints)))
    assert is_possible(read(whole, whole))
    assert not is_possible(read(whole[:lost] + whole[lost + 1 :], whole))


# -- commands and settings --


@given(st.floats(0.0, 10.0), st.floats(0.0, 2.0 * math.pi), st.floats(0.0, 10.0))
def test_speeds_pass_up_to_the_limit_in_any_direction(speed, angle, turning):
    settings = UrSettings()
    v = (speed * math.cos(angle), speed * math.sin(angle), 0.0)
    w = (0.0, turning * math.cos(angle), turning * math.sin(angle))
    rounding = 1.0 + 1e-9
    if math.hypot(*v) <= settings.speed * rounding and math.hypot(*w) <= settings.angular_speed * rounding:
        assert settings.checked_twist(v, w) == v + w
    else:
        with pytest.raises(InvalidValueError, match="limit"):
            settings.checked_twist(v, w)


def twist(velocity, turning=(0.0, 0.0, 0.0)):
    return lambda: UrSettings().checked_twist(velocity, turning)


def setting(**wrong):
    return lambda: UrSettings(**wrong)


@pytest.mark.parametrize(
    ("message", "make"),
    [
        (r"velocity_base_tip = \(0.0, 0.0\): must be three numbers", twist((0.0, 0.0))),
        ("angular_velocity_base_tip.*three numbers", twist((0.0, 0.0, 0.0), (0.0,) * 4)),
        ("velocity_base_tip = nan m/s", twist((math.nan, 0.0, 0.0))),
        (r"inf rad/s.*UrSettings\.angular_speed", twist((0.0, 0.0, 0.0), (0.0, -math.inf, 0.0))),
        ("speed", setting(speed=0.0)),
        ("speed", setting(speed=5.0)),
        ("angular_speed", setting(angular_speed=math.nan)),
        ("acceleration", setting(acceleration=151.0)),
        ("deceleration", setting(deceleration=151.0)),
        ("watchdog", setting(watchdog=5.0)),
        ("watchdog", setting(watchdog=1e-3)),
        ("speed_slider", setting(speed_slider=0.0)),
        ("speed_slider", setting(speed_slider=1.1)),
        ("stale_after", setting(stale_after=-1.0)),
        ("mass", lambda: FlangePayload(-0.1)),
        ("center", lambda: FlangePayload(0.1, (0.0, math.nan, 0.0))),
    ],
)
def test_impossible_velocities_and_settings_are_refused_by_name(message, make):
    with pytest.raises(InvalidValueError, match=message):
        make()


# -- safety --


@given(st.integers(0, 2**11 - 1), st.integers(-1, 8))
@example(0, 7)
def test_only_a_powered_and_unstopped_arm_has_no_problem(bits, mode):
    found = safety_problem(mode, bits)
    stopped = bits & ~(SafetyBit.NORMAL | SafetyBit.REDUCED | SafetyBit.RECOVERY)
    assert (found is Problem.NONE) == (mode == 7 and bits != 0 and not stopped)


def test_every_problem_has_a_message_that_names_a_remedy():
    assert set(WORDS) == set(Problem) - {Problem.NONE}
    assert all("`palpate recover`" in remedy for _, remedy in WORDS.values())
