"""What the arm and its client process share, and what is checked before it is sent: no process, no socket."""

import math
import mmap
import os
import subprocess
import sys
import time

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import support.fake_ur_library as fake
from palpate.errors import InvalidValueError
from palpate.hw.round_trip_clock import RoundTrip
from palpate.hw.ur import FlangePayload, ForceTask, UrSettings
from palpate.hw.ur.exchange import (
    COMMAND_NUMBERS,
    ClientPhase,
    Exchange,
    MotionCommand,
    Order,
    Status,
    UrState,
    new_memory,
)
from palpate.hw.ur.goals import checked_joints, checked_pose_goal, checked_velocity, six
from palpate.hw.ur.problems import WORDS, Problem, SafetyBit, safety_problem
from palpate.hw.ur.shared_row import SharedRow, size_of
from palpate.hw.ur.state_receiver import ControllerRestartedError, ImpossibleStateError, StateReceiver
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from support.waiting import until

FINITE = st.floats(-1e6, 1e6)
SIX = st.tuples(*[FINITE] * 6)
WRONG = st.lists(FINITE, max_size=12).filter(lambda v: len(v) != 6)
NOT_FINITE = st.sampled_from([math.nan, math.inf, -math.inf])


def state(**changed) -> UrState:
    six_zeros = (0.0,) * 6
    values = {
        "time": 1.0,
        "seen": 1.0,
        "controller_time": 1.0,
        "runtime_state": 2,
        "robot_mode": 7,
        "safety_mode": 1,
        "safety_bits": 1,
        "speed_scaling": 1.0,
        "speed_slider": 1.0,
        "joint_position": six_zeros,
        "joint_velocity": six_zeros,
        "tool_pose": six_zeros,
        "tool_velocity": six_zeros,
        "tool_wrench": six_zeros,
        "raw_wrench": six_zeros,
        "acceleration": (0.0, 0.0, 9.8),
        "lost": 0,
    }
    return UrState(**{**values, **changed})


@pytest.fixture
def ends():
    file = new_memory()
    here, there = Exchange(file), Exchange(file)
    yield here, there
    here.close()
    there.close()
    os.close(file)


@given(SIX, SIX, SIX, SIX, SIX, SIX, st.integers(0, 2**31), st.integers(0, 10**9))
def test_what_one_end_writes_the_other_reads_bit_for_bit(a, b, c, d, e, f, bits, lost):
    file = new_memory()
    here, there = Exchange(file), Exchange(file)
    try:
        sent = state(
            joint_position=a,
            joint_velocity=b,
            tool_pose=c,
            tool_velocity=d,
            tool_wrench=e,
            raw_wrench=f,
            safety_bits=bits,
            lost=lost,
        )
        there.write_state(sent)
        assert here.state() == sent
        order = Order(lost + 1, 2.5, MotionCommand.FORCE, (a + b + c + d)[:COMMAND_NUMBERS])
        here.write_command(order)
        assert there.command() == order
        status = Status(1.5, 1.25, ClientPhase.READY, Problem.PROTECTIVE_STOP, lost, 3)
        there.write_status(status)
        assert here.status() == status
    finally:
        here.close()
        there.close()
        os.close(file)


def test_nothing_is_read_before_anything_was_written(ends):
    here, _ = ends
    assert here.state() is None
    assert here.command() is None
    assert here.status() is None


WRITER = """
import mmap, sys
from palpate.hw.ur.shared_row import SharedRow, size_of
width = int(sys.argv[2])
row = SharedRow(mmap.mmap(int(sys.argv[1]), size_of(width)), 0, width)
for number in range(1, 1_000_000):
    row.write([number] * width)
"""


@pytest.mark.slow
def test_rows_are_never_torn_and_never_go_back():
    """Another process writes at full speed: whoever reads gets all of one row, and none older than the last."""
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
def test_a_row_of_which_only_a_part_is_visible_is_not_believed(order, visible):
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


# -- one cycle's values together --


def test_a_state_is_of_one_cycle_though_the_getters_are_not(tmp_path):
    """It goes on while it is read, and each getter replies for the present cycle: no state may be mixed."""
    fake.forget()
    receiver = fake.receiver(str(tmp_path), 500.0, (5, 14, 0, 0))
    state_receiver = StateReceiver(receiver, fake.echo(str(tmp_path), 500.0), 500.0, raw_wrench=True)
    taken = [until(lambda: state_receiver.take(time.monotonic())) for _ in range(200)]
    fake.forget()
    for s in taken:
        assert (
            s.joint_position[0] == s.joint_velocity[0] == s.tool_wrench[0] == s.raw_wrench[0] == s.controller_time
        )
    stamps = [s.controller_time for s in taken]
    assert stamps == sorted(set(stamps))
    assert taken[-1].lost == round((stamps[-1] - stamps[0]) / 0.002) + 1 - len(stamps)


class Stamps:
    """A receiver whose time stamps are given."""

    def __init__(self, *stamps: float) -> None:
        self.stamps = [s for s in stamps for _ in range(2)]

    def getTimestamp(self) -> float:
        return self.stamps.pop(0) if len(self.stamps) > 1 else self.stamps[0]

    def getActualToolAccelerometer(self) -> list[float]:
        return [0.0, 0.0, 9.8]

    def __getattr__(self, name: str):
        scalar = name in ("getSpeedScaling", "getTargetSpeedFraction") or name.endswith(("State", "Mode", "Bits"))
        return lambda: 1 if scalar else [0.0] * 6


class Proven:
    """An echo for every look."""

    connected = True

    def exchange(self, now: float) -> list[RoundTrip]:
        return [RoundTrip(now, now, now)]


def test_a_clock_that_goes_back_is_a_restarted_controller():
    state_receiver = StateReceiver(Stamps(5.0, 5.002, 0.5), Proven(), 500.0, raw_wrench=True)
    assert state_receiver.take(1.0) is not None
    assert state_receiver.take(1.002) is not None
    with pytest.raises(ControllerRestartedError):
        state_receiver.take(1.004)


class Rubbish(Stamps):
    """The same, and one getter replies with something else."""

    def __init__(self, name: str, reply: object) -> None:
        super().__init__(5.0)
        setattr(self, name, lambda: reply)


@pytest.mark.parametrize(
    ("name", "reply"),
    [
        ("getActualQ", [0.0] * 5 + [math.nan]),
        ("getActualTCPPose", [math.inf] + [0.0] * 5),
        ("getActualTCPForce", [0.0, -math.inf, 0.0, 0.0, 0.0, 0.0]),
        ("getRobotMode", 77),
        ("getRuntimeState", -1),
    ],
)
def test_rubbish_is_not_taken_for_a_state(name, reply):
    state_receiver = StateReceiver(Rubbish(name, reply), Proven(), 500.0, raw_wrench=True)
    with pytest.raises(ImpossibleStateError):
        state_receiver.take(1.0)


def test_a_controller_without_raw_wrench_is_not_asked_for_it():
    state_receiver = StateReceiver(Stamps(5.0), Proven(), 125.0, raw_wrench=False)
    found = state_receiver.take(1.0)
    assert found is not None
    assert all(map(math.isnan, found.raw_wrench))


# -- what may be asked for --


@given(WRONG)
def test_wrong_lengths_are_refused_before_anything_is_sent(values):
    settings = UrSettings()
    for check in (
        lambda: six("goal", values, "rad"),
        lambda: checked_joints(settings, values, state()),
        lambda: ForceTask((False,) * 6, tuple(values)).checked(settings),
    ):
        with pytest.raises(InvalidValueError, match="must be"):
            check()
    if len(values) != 3:
        with pytest.raises(InvalidValueError, match="three numbers"):
            checked_velocity(settings, tuple(values), (0.0, 0.0, 0.0))


@given(NOT_FINITE, st.integers(0, 5))
def test_what_is_not_finite_is_refused(value, place):
    settings = UrSettings()
    numbers = [0.0] * 6
    numbers[place] = value
    with pytest.raises(InvalidValueError):
        checked_velocity(settings, tuple(numbers[:3]), tuple(numbers[3:]))
    with pytest.raises(InvalidValueError):
        checked_joints(settings, numbers, state())
    with pytest.raises(InvalidValueError):
        ForceTask((True,) * 6, tuple(numbers)).checked(settings)
    with pytest.raises(InvalidValueError):
        checked_pose_goal(settings, Pose(tuple(numbers[:3]) if place < 3 else (value, 0.0, 0.0)), state())


@given(st.floats(0.0, 10.0), st.floats(0.0, 2.0 * math.pi), st.floats(0.0, 10.0))
def test_speeds_pass_up_to_the_limit_in_any_direction(speed, angle, turning):
    settings = UrSettings()
    v = (speed * math.cos(angle), speed * math.sin(angle), 0.0)
    w = (0.0, turning * math.cos(angle), turning * math.sin(angle))
    within = math.hypot(*v) <= settings.speed * (1 + 1e-9) and math.hypot(*w) <= settings.angular_speed * (
        1 + 1e-9
    )
    if within:
        assert checked_velocity(settings, v, w) == v + w
    else:
        with pytest.raises(InvalidValueError, match="limit"):
            checked_velocity(settings, v, w)


def test_goals_of_a_servo_must_be_within_reach():
    settings = UrSettings()
    reach = settings.joint_speed * (settings.lookahead + settings.watchdog)
    assert checked_joints(settings, [0.99 * reach] * 6, state())
    with pytest.raises(InvalidValueError, match="joint 4"):
        checked_joints(settings, [0.0, 0.0, 0.0, 1.01 * reach, 0.0, 0.0], state())
    way = settings.speed * (settings.lookahead + settings.watchdog)
    assert checked_pose_goal(settings, Pose((0.0, 0.99 * way, 0.0)), state())
    with pytest.raises(InvalidValueError, match="mm"):
        checked_pose_goal(settings, Pose((0.0, 1.01 * way, 0.0)), state())
    with pytest.raises(InvalidValueError, match="rad"):
        checked_pose_goal(settings, Pose(rotation=rotation_from_rotvec((0.3, 0.0, 0.0))), state())


def test_only_compliant_axes_count_in_a_force_task():
    settings = UrSettings()
    z_only = (False, False, True, False, False, False)
    values = ForceTask(z_only, (100.0, 0.0, -10.0, 0.0, 0.0, 0.0)).checked(settings)
    assert len(values) == COMMAND_NUMBERS
    assert values[6:12] == (0, 0, 1, 0, 0, 0)
    assert values[12:18] == (0.0, 0.0, -10.0, 0.0, 0.0, 0.0)
    assert values[18:24] == (0.01, 0.01, 0.05, 0.1, 0.1, 0.1)
    with pytest.raises(InvalidValueError, match="force"):
        ForceTask(z_only, (0.0, 0.0, -30.0, 0.0, 0.0, 0.0)).checked(settings)


@pytest.mark.parametrize(
    "wrong",
    [
        {"speed": 0.0},
        {"speed": 5.0},
        {"angular_speed": math.nan},
        {"watchdog": 5.0},
        {"watchdog": 1e-3},
        {"lookahead": 0.5},
        {"gain": 50.0},
        {"speed_slider": 0.0},
        {"speed_slider": 1.1},
        {"stale_after": -1.0},
        {"force": math.inf},
    ],
)
def test_settings_that_cannot_be_are_refused_by_name(wrong):
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        UrSettings(**wrong)


def test_a_payload_must_be_one():
    with pytest.raises(InvalidValueError):
        FlangePayload(-0.1)
    with pytest.raises(InvalidValueError):
        FlangePayload(0.1, (0.0, math.nan, 0.0))


# -- what the controller's safety says --


@given(st.integers(0, 2**11 - 1), st.integers(-1, 8))
@example(0, 7)
def test_whatever_safety_says_only_a_powered_and_unstopped_arm_has_no_problem(bits, mode):
    found = safety_problem(mode, bits)
    stopped = bits & ~(SafetyBit.NORMAL | SafetyBit.REDUCED | SafetyBit.RECOVERY)
    assert (found is Problem.NONE) == (mode == 7 and bits != 0 and not stopped)


def test_every_problem_has_words_that_name_a_remedy():
    assert set(WORDS) == set(Problem) - {Problem.NONE}
    assert all("`palpate recover`" in remedy for _, remedy in WORDS.values())
