"""RTDE, script port and dashboard of the emulated controller, byte by byte, without sockets or clients."""

import random
import struct
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.emulators.ur.arm import ArmMounting
from palpate.hw.emulators.ur.commands import program_of
from palpate.hw.emulators.ur.controller import INPUTS, ControllerVersion, EmulatedController, outputs_of
from palpate.hw.emulators.ur.dashboard import DashboardServer
from palpate.hw.emulators.ur.rtde import (
    ControllerFault,
    FramingError,
    PackageReader,
    PackageType,
    RtdeSession,
    package,
    requested_names,
    text_message,
)
from palpate.hw.emulators.ur.script import ProgramReader, UploadedProgram
from support.served_ur import nearly_right_package

STILL = (0.0, 0.0, 0.0)


def standing() -> tuple[EmulatedController, SimplePlant]:
    """Return a robot that has measured once."""
    robot, plant = EmulatedController(ControllerVersion(), ArmMounting(), 5.0), SimplePlant()
    robot.measure(plant.start())
    return robot, plant


def session(robot: EmulatedController | None = None, owners: dict[str, RtdeSession] | None = None) -> RtdeSession:
    return RtdeSession(robot or standing()[0], {} if owners is None else owners, set())


def inputs(*names: str) -> bytes:
    return package(PackageType.INPUTS, ",".join(names).encode() + b",")


def outputs(frequency: float, *names: str) -> bytes:
    return package(PackageType.OUTPUTS, struct.pack(">d", frequency) + ",".join(names).encode())


def programs(*pieces: bytes) -> list[UploadedProgram]:
    """Return the programs that a script port finds in pieces of text."""
    found: list[UploadedProgram] = []
    reader = ProgramReader(lambda uploaded, _: found.append(uploaded))
    for piece in pieces:
        assert reader.feed(piece, 0.0) == b""
    return found


# -- framing --


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        ("0005 56 0002", "0004 56 01"),
        ("0005 56 0001", "0004 56 00"),
        ("0003 76", "0013 76 00000005 0000000e 00000000 00000001"),
        ("0014 4f 405f400000000000" + b"timestamp".hex(), "000a 4f 01" + b"DOUBLE".hex()),
        ("0003 53", "0004 53 00"),
        ("0003 50", "0004 50 01"),
    ],
)
def test_golden_frames_of_the_makers_guide(request_: str, reply: str) -> None:
    """Size with header, type, payload, big-endian."""
    assert session().feed(bytes.fromhex(request_)) == bytes.fromhex(reply)
    assert package(PackageType.TEXT, text_message("ab", "c", 2)) == bytes.fromhex("0009 4d 02 6162 01 63 02")


@given(
    payloads=st.lists(st.binary(max_size=200), max_size=8),
    cuts=st.lists(st.integers(0, 2000), max_size=20),
)
def test_packages_survive_any_fragmentation(payloads: list[bytes], cuts: list[int]) -> None:
    stream = b"".join(package(PackageType.DATA, payload) for payload in payloads)
    places = sorted({0, len(stream), *(min(cut, len(stream)) for cut in cuts)})
    reader = PackageReader()
    seen = [item for a, b in pairwise(places) for item in reader.feed(stream[a:b])]
    assert seen == [(PackageType.DATA, payload) for payload in payloads]


@pytest.mark.parametrize("size", [0, 2, 4097, 65535])
def test_impossible_sizes_are_refused(size: int) -> None:
    with pytest.raises(FramingError):
        PackageReader().feed(struct.pack(">HB", size, ord("V")))


# -- recipes --


def test_recipe_ids_count_from_one_for_inputs_and_outputs_apart() -> None:
    one = session()
    replies = one.feed(inputs("input_int_register_0") + inputs("input_int_register_0", "input_double_register_3"))
    replies += one.feed(outputs(500.0, "actual_q", "robot_mode") + outputs(500.0, "actual_q"))
    assert PackageReader().feed(replies) == [
        (PackageType.INPUTS, b"\x01INT32"),
        (PackageType.INPUTS, b"\x02INT32,DOUBLE"),
        (PackageType.OUTPUTS, b"\x01VECTOR6D,INT32"),
        (PackageType.OUTPUTS, b"\x02VECTOR6D"),
    ]


def test_unknown_and_taken_variables_are_reported() -> None:
    robot, owners = standing()[0], {}
    first, second = session(robot, owners), session(robot, owners)
    first.feed(inputs("input_int_register_0", "input_int_register_1"))
    taken = second.feed(inputs("input_int_register_1", "input_int_register_2"))
    assert taken == package(PackageType.INPUTS, b"\x00IN_USE,INT32")
    assert second.feed(inputs("no_such")) == package(PackageType.INPUTS, b"\x00NOT_FOUND")
    assert second.feed(outputs(500.0, "actual_q", "no")) == package(PackageType.OUTPUTS, b"\x00VECTOR6D,NOT_FOUND")
    # nothing of a refused recipe was reserved, and the numbering goes on at one
    assert second.feed(inputs("input_int_register_2")) == package(PackageType.INPUTS, b"\x01INT32")
    first.close()
    assert second.feed(inputs("input_int_register_0")) == package(PackageType.INPUTS, b"\x02INT32")


def test_later_variables_belong_to_later_versions() -> None:
    old, new = outputs_of(ControllerVersion(5, 4, 0, 0)), outputs_of(ControllerVersion(5, 23, 0, 0))
    later = {"payload", "payload_cog", "payload_inertia", "ft_raw_wrench", "actual_current_as_torque"}
    assert set(new) - set(old) == later
    assert set(outputs_of(ControllerVersion(3, 15, 8, 0))) - set(old) == {
        "payload",
        "payload_cog",
        "payload_inertia",
    }
    with pytest.raises(InvalidValueError, match="major must be 3, 5 or 10"):
        EmulatedController(ControllerVersion(4), ArmMounting(), 5.0)


def test_names_of_a_recipe() -> None:
    assert requested_names(b"a,b,") == ("a", "b")
    for wrong in (b"", b"a" * 2049, "ä".encode()):
        with pytest.raises(InvalidValueError):
            requested_names(wrong)


@given(st.sampled_from(sorted(INPUTS)), st.integers(-3, 3))
def test_a_package_of_the_wrong_length_changes_nothing_and_is_counted(name: str, change: int) -> None:
    robot, _ = standing()
    one = session(robot)
    one.feed(inputs(name))
    before = dict(robot.inputs)
    size = struct.calcsize(">" + INPUTS[name].code) + change
    one.feed(package(PackageType.DATA, b"\x01" + b"\x01" * max(0, size)))
    assert robot.dropped == (1 if change else 0)
    assert (robot.inputs == before) == bool(change)


def test_inputs_persist_until_overwritten() -> None:
    robot, _ = standing()
    one = session(robot)
    one.feed(inputs("input_int_register_5", "input_double_register_5"))
    one.feed(inputs("input_int_register_5"))
    one.feed(package(PackageType.DATA, struct.pack(">Bid", 1, 7, 2.5)))
    one.feed(package(PackageType.DATA, struct.pack(">Bi", 2, 8)))
    assert robot.inputs["input_int_register_5"] == (8,)
    assert robot.inputs["input_double_register_5"] == (2.5,)


@given(st.lists(st.tuples(st.integers(0, 255), st.integers(0, 255)), max_size=6))
def test_outputs_that_are_not_masked_stay(writes: list[tuple[int, int]]) -> None:
    robot, plant = standing()
    expected = {"standard": 0, "configurable": 0, "tool": 0}
    for i, (mask, bits) in enumerate(writes):
        kind = tuple(expected)[i % 3]
        robot.write({f"{kind}_digital_output_mask": (mask,), f"{kind}_digital_output": (bits,)})
        expected[kind] = expected[kind] & ~mask | bits & mask
    robot.write(
        {
            "standard_analog_output_mask": (3,),
            "standard_analog_output_type": (1,),
            "standard_analog_output_0": (0.5,),
            "standard_analog_output_1": (0.25,),
        }
    )
    robot.measure(plant.step(STILL, STILL, ()))
    bits = expected["standard"] | expected["configurable"] << 8 | expected["tool"] << 16
    assert robot.outputs["actual_digital_output_bits"] == (bits,)
    # 0 to 10 V, and 4 to 20 mA
    assert [robot.outputs[f"standard_analog_output{i}"] for i in range(2)] == [(5.0,), (8.0,)]


@pytest.mark.parametrize(("asked", "every"), [(500.0, 1), (125.0, 4), (250.0, 2), (1000.0, 1), (1.0, 500)])
def test_a_stream_has_the_requested_rate(asked: float, every: int) -> None:
    one = session()
    one.feed(outputs(asked, "timestamp") + package(PackageType.START, b""))
    sent = [bool(one.stream()) for _ in range(1000)]
    assert sum(sent) == 1000 // every


def test_a_stream_has_the_measurements_until_it_is_paused() -> None:
    robot, plant = standing()
    one = session(robot)
    one.feed(outputs(500.0, "timestamp", "actual_TCP_pose", "runtime_state") + package(PackageType.START, b""))
    robot.measure(plant.step(STILL, STILL, ()))
    ((kind, payload),) = PackageReader().feed(one.stream())
    number, time, x, y, z, *_, state = struct.unpack(">Bd6dI", payload)
    assert (kind, number, time, state) == (PackageType.DATA, 1, 0.002, 1)
    assert (x, y, z) == pytest.approx((-0.1333, 0.4919, 0.4879))
    one.feed(package(PackageType.PAUSE, b""))
    assert one.stream() == b""


def test_faults_of_a_session() -> None:
    faults: set[ControllerFault] = set()
    one = RtdeSession(standing()[0], {}, faults)
    one.feed(outputs(500.0, "timestamp") + package(PackageType.START, b""))
    faults.add(ControllerFault.REFUSE_VERSION)
    assert one.feed(bytes.fromhex("0005 56 0002")) == bytes.fromhex("0004 56 00")
    faults.add(ControllerFault.SHORT_DATA)
    assert len(one.stream()) == 3 + 1 + 8 - 1
    faults.add(ControllerFault.STRAY_TEXT)
    kinds = [kind for kind, _ in PackageReader().feed(one.feed(package(PackageType.PAUSE, b"")))]
    assert kinds == [PackageType.TEXT, PackageType.PAUSE]
    one.feed(package(PackageType.START, b""))
    faults.add(ControllerFault.STALL_STREAM)
    assert one.stream() == b""
    faults.add(ControllerFault.REJECT_START)
    assert one.feed(package(PackageType.START, b""))[-1] == 0


# -- fuzz --


LAYOUT = inputs("input_int_register_0", *(f"input_double_register_{i}" for i in range(8))) * 3
CONTROL = b'def rtde_control():\ntextmsg("RTDE Control Script Loaded")\nend\n'


@pytest.mark.slow
@pytest.mark.parametrize(("packages", "seed"), [(6_000, 1), (100_000, 2)])
def test_rubbish_neither_stops_nor_misleads_the_controller(packages: int, seed: int) -> None:
    random_ = random.Random(seed)
    robot, plant = standing()
    owners: dict[str, RtdeSession] = {}
    broken = 0
    one = session(robot, owners)
    one.feed(LAYOUT)
    (uploaded,) = programs(CONTROL)
    for i in range(packages):
        try:
            one.feed(nearly_right_package(random_))
        except FramingError:
            broken += 1
            one.close()
            one = session(robot, owners)
            one.feed(LAYOUT)
        if i % 200 == 0:
            # a slow move would keep all other commands waiting
            robot.end_program("to go on")
        if i % 2 == 0:
            robot.unlock(by_hand=True)
            if robot.runtime.name != "PLAYING":
                robot.start_program(program_of(uploaded, robot), "control")
            robot.cycle()
            velocity, turning = robot.arm.tip_velocity(robot.twist)
            state = plant.step(velocity, turning, ())
            # only numbers, and no speed beyond the limit of the safety system, reach the plant
            assert all(abs(x) < 100.0 for x in (*state.arm.position_base_tip, *state.arm.velocity_base_tip))
            robot.measure(state)
            one.stream()
    assert robot.dropped > packages // 6
    assert broken > packages // 1200


@pytest.mark.slow
@given(st.lists(st.binary(max_size=400), max_size=20))
def test_the_script_port_accepts_anything(pieces: list[bytes]) -> None:
    programs(*pieces)


STANDING = standing()[0]


@given(st.text(max_size=60))
def test_the_dashboard_replies_to_any_line_with_one_line(line: str) -> None:
    reply = DashboardServer(STANDING).reply(line)
    assert reply
    assert "\n" not in reply.replace(line, "")


# -- script --

_PATH = """def rtde_control():
# HEADER_BEGIN
    global reg_offset_float = # float register offset
24    global reg_offset_int = # int register offset
23    global stop_type = 0
    def exec_move_path():
        # inject move path
\tsignal_async_progress(0)
\tmovel(p[-0.1033,0.4919,0.4379,2.2214,-2.2214,0],a=1.2,v=0.25,r=0)
\tsignal_async_progress(1)
\tmovej([-1.5,-1.5e0,1.5,-1.5,-1.5,.0],a=1.4,v=1.05,r=0.02)
    end
        textmsg("RTDE Control Script Loaded (14.02.2024-12:23)")
end
"""


@given(st.lists(st.integers(0, len(_PATH)), max_size=10))
def test_a_control_script_is_recognised_in_any_pieces(cuts: list[int]) -> None:
    places = sorted({0, len(_PATH), *cuts})
    (program,) = programs(*(_PATH[a:b].encode() for a, b in pairwise(places)))
    assert program.is_control
    assert (program.name, program.int_offset, program.double_offset) == ("rtde_control", 23, 24)
    line, joints = program.path()
    assert (line.joint_space, line.is_pose, line.speed, line.acceleration) == (False, True, 0.25, 1.2)
    assert line.target == (-0.1033, 0.4919, 0.4379, 2.2214, -2.2214, 0.0)
    assert (joints.joint_space, joints.is_pose) == (True, False)
    assert (line.progress, joints.progress) == (0, 1)
    assert joints.target == (-1.5, -1.5, 1.5, -1.5, -1.5, 0.0)


def test_another_script_writes_its_registers() -> None:
    text = b"def hello():\n\twrite_output_integer_register(0 + 2, 5)\n\tsleep(0.01)\n"
    text += b"\twrite_output_float_register(3, 2.5)\n\tmovej(x)\nend\n"
    (program,) = programs(text)
    robot, plant = standing()
    robot.start_program(program_of(program, robot), program.name)
    cycles = 0
    while robot.runtime.name == "PLAYING":
        robot.cycle()
        robot.measure(plant.step(STILL, STILL, ()))
        cycles += 1
        assert cycles < 20
    assert robot.outputs["output_int_register_2"] == (5,)
    assert robot.outputs["output_double_register_3"] == (2.5,)
    assert cycles >= 5
