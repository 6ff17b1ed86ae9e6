"""Bags of ROS 2: read by rosbags, which needs no ROS, and from a log that was cut off as well."""

import importlib.util
import sys
from pathlib import Path

import pytest

from palpate.commands.log.config import LogRos2Config
from palpate.commands.log.export import run_log_ros2
from palpate.errors import InvalidValueError
from palpate.runtime.log import log_writer
from palpate.runtime.log.standard.topics import RobotNotes
from runtime.log.log_examples import ONE_FINGER, TWO_FINGERS_AND_A_HAND, write
from runtime.log.test_standard_topics import LATE, Sliding, recorded, stamp, touching_run

highlevel = pytest.importorskip("rosbags.highlevel", reason="rosbags reads bags without ROS")
rosbags = pytest.importorskip("rosbags.typesys")
ROS2 = Path(__file__).parents[3] / "examples" / "ros2"


def told(folder):
    """By topic, of each message the time at which it was logged and what it tells; and its type."""
    found, kinds = {}, {}
    with highlevel.AnyReader([folder]) as reader:
        for connection, logged, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((logged, message))
            kinds[connection.topic] = connection.msgtype
    return found, kinds


def test_wrench_joints_transforms_and_contacts_arrive_with_stamps_and_frames(tmp_path):
    periods = touching_run(430, TWO_FINGERS_AND_A_HAND)
    heading = recorded(tmp_path / "a.mcap", periods, RobotNotes(Sliding())).heading
    result = run_log_ros2(LogRos2Config(tmp_path, tmp_path / "bag"))
    assert [path.name for path in result.files] == ["a.mcap", "metadata.yaml"]
    found, kinds = told(tmp_path / "bag")
    assert kinds["/period"] == "palpate_msgs/msg/Period"
    assert result.facts["topics"] == {topic: len(messages) for topic, messages in found.items()}
    for (sample, now, *_), (logged, wrench), (_, joints), (_, period) in zip(
        periods, found["/finger_0/wrench"], found["/joint_states"], found["/period"], strict=True
    ):
        assert logged == heading.stamp(sample.time)
        assert (wrench.header.frame_id, stamp(wrench.header)) == ("finger_0", heading.stamp(sample.time - LATE))
        assert wrench.wrench.force.x == now.fingers[0].wrench[0]
        assert tuple(joints.position) == sample.arm.joint_position
        assert period.fingers[1].wrench.torque.z == now.fingers[1].wrench[5]
        assert tuple(period.hand[0].joint_position) == sample.hand.joint_position
    frames = [(each.header.frame_id, each.child_frame_id) for each in found["/tf"][0][1].transforms]
    assert frames == [("base", "hand"), ("hand", "finger_0"), ("hand", "finger_1")]
    assert {message.header.frame_id for _, message in found["/finger_1/contact"]} == {"finger_1"}


@pytest.mark.parametrize(
    ("written", "damage", "warning"),
    [
        (write, lambda data: data[: int(0.8 * len(data))], "cut off"),
        (
            recorded,
            lambda data: data[: (m := len(data) // 2)] + bytes([data[m] ^ 1]) + data[m + 1 :],
            "is damaged",
        ),
    ],
)
def test_the_whole_chunks_of_a_torn_or_damaged_log_are_in_the_bag(written, damage, warning, tmp_path, monkeypatch):
    monkeypatch.setattr(log_writer, "LARGEST_CHUNK", 1)  # many chunks in a small file
    periods, path = touching_run(430, ONE_FINGER), tmp_path / "a.mcap"
    written(path, periods)
    path.write_bytes(damage(path.read_bytes()))
    result = run_log_ros2(LogRos2Config(path))
    found, _ = told(tmp_path / "a_bag")
    assert 100 < len(found["/period"]) == len(found["/finger_0/wrench"]) < 430
    assert warning in result.warnings[0]
    if warning == "cut off":
        assert found["/period"][-1][1].time == periods[len(found["/period"]) - 1][0].time


def test_a_folder_that_is_there_is_left_alone(tmp_path):
    recorded(tmp_path / "a.mcap", touching_run(2, ONE_FINGER))
    with pytest.raises(InvalidValueError, match="is there already; a bag is a new folder"):
        run_log_ros2(LogRos2Config(tmp_path / "a.mcap", tmp_path))


def test_the_package_for_colcon_has_the_types_of_our_logs():
    """`python examples/ros2/make_messages.py` writes them anew."""
    spec = importlib.util.spec_from_file_location("make_messages", ROS2 / "make_messages.py")
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made
    spec.loader.exec_module(made)
    messages = made.messages()
    assert {path.name: path.read_text(encoding="utf-8") for path in made.FOLDER.iterdir()} == messages
    for name, text in messages.items():  # ROS 2 itself would take them
        assert rosbags.get_types_from_msg(text, f"palpate_msgs/msg/{name.removesuffix('.msg')}")
