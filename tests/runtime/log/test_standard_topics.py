"""Topics that other tools read: the numbers of the periods, at the times and in the frames where they belong."""

from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from palpate.errors import InvalidValueError
from palpate.kinematics import Pose
from palpate.runtime.data import ArmSample
from palpate.runtime.log import read_log
from palpate.runtime.log.chunk import PERIOD_CHANNEL
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.mcap_builder import McapBuilder
from palpate.runtime.log.message_layout import PAYLOAD
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.cloud import MOST_POINTS, Cloud
from palpate.runtime.log.standard.topic import Block
from palpate.runtime.log.standard.topics import PLAIN_ROBOT, RobotNotes, StandardTopics
from palpate.runtime.log.told_log import add_topics
from palpate.sensing.contact import ContactStatus
from runtime.log.log_examples import ONE_FINGER, PERIOD, TWO_FINGERS_AND_A_HAND, a_run, bits, write

LATE = 4e-4
"""So long before its period a wrench was sampled [s]."""


class Sliding:
    """A hand whose fingers slide along x by their joints."""

    def sensor_poses(self, joint_position):
        return tuple(Pose((position, 0.0, 0.1 * i)) for i, position in enumerate(joint_position[:2]))


class Broken:
    def sensor_poses(self, joint_position):
        raise ZeroDivisionError("no such hand")


def touching_run(count, layout):
    """Periods that a robot could have: random numbers, proper poses, contacts in every second ten of them."""
    rng, periods = np.random.default_rng(5), []
    for i, (sample, now, *rest) in enumerate(a_run(count, layout)):
        time, rotation = i * PERIOD, Rotation.from_rotvec(rng.normal(size=3)).as_matrix().tolist()
        arm = ArmSample(
            time,
            tuple(rng.normal(size=3)),
            tuple(map(tuple, rotation)),
            (0.0,) * 3,
            tuple(rng.normal(size=layout.joints)),
        )
        arm = replace(arm, tip_force_base=sample.arm.tip_force_base)
        wrenches = tuple(replace(each, time=time - LATE) for each in sample.wrenches)
        fingers = []
        for finger in now.fingers:
            contact = replace(finger.contact, centroid=rng.normal(size=3), status=ContactStatus.OK)
            fingers.append(
                replace(
                    finger,
                    time=time - LATE,
                    wrench=tuple(rng.normal(size=6)),
                    contact=contact,
                    touching=i // 10 % 2 == 1,
                )
            )
        hand = sample.hand and replace(
            sample.hand, time=time, joint_position=tuple(rng.normal(size=layout.hand_joints))
        )
        periods.append(
            (
                replace(sample, time=time, arm=arm, wrenches=wrenches, hand=hand),
                replace(now, fingers=tuple(fingers)),
                *rest,
            )
        )
    return periods


def recorded(path, periods, notes=PLAIN_ROBOT, cloud=None):
    """A log as a run leaves it, and then with topics."""
    assert write(path, periods, {"notes.txt": "as they came"}).problem is None
    add_topics(path, notes, cloud)
    return read_log(path)


def messages(path):
    """By topic, of each message the time at which it was logged and what it tells."""
    found = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def stamp(header):
    return header.stamp.sec * 10**9 + header.stamp.nanosec


def numbers(thing):
    return [number for name in thing.__slots__ for number in flat(getattr(thing, name))]


def flat(value):
    return [value] if isinstance(value, float) else numbers(value)


@pytest.fixture(scope="module", params=[ONE_FINGER, TWO_FINGERS_AND_A_HAND], ids=["one finger", "hand"])
def run(request, tmp_path_factory):
    layout = request.param
    path, periods = tmp_path_factory.mktemp("standard") / "a.mcap", touching_run(430, layout)
    hand = None if layout.hand_joints is None else Sliding()
    return recorded(path, periods, RobotNotes(hand)), periods, messages(path)


def test_each_wrench_is_there_with_the_time_at_which_it_was_sampled(run):
    log, periods, found = run
    for i, channels in enumerate(log.layout.channels):
        for topic in ("wrench", "wrench_raw")[: 2 if channels == 6 else 1]:
            told = found[f"/finger_{i}/{topic}"]
            assert len(told) == len(periods)
            for (sample, now, *_), (logged, message) in zip(periods, told, strict=True):
                assert message.header.frame_id == f"finger_{i}"
                assert logged == log.heading.stamp(sample.time)
                assert stamp(message.header) == log.heading.stamp(sample.time - LATE)
                wanted = now.fingers[i].wrench if topic == "wrench" else sample.wrenches[i].wrench
                assert np.array_equal(numbers(message.wrench), wanted, equal_nan=True)
    assert ("/finger_1/wrench_raw" in found) == (log.layout.channels[1:] == (6,))  # 16 raw channels are no wrench


def test_joints_are_there_in_every_period(run):
    log, periods, found = run
    for (sample, *_), (_, message) in zip(periods, found["/joint_states"], strict=True):
        assert tuple(message.position) == sample.arm.joint_position
        assert list(message.name) == [f"joint_{i + 1}" for i in range(log.layout.joints)]
        assert stamp(message.header) == log.heading.stamp(sample.arm.time)
    for (sample, *_), (_, message) in zip(periods, found.get("/hand/joint_states", ()), strict=False):
        assert tuple(message.position) == sample.hand.joint_position
    assert ("/hand/joint_states" in found) == (log.layout.hand_joints is not None)


def test_a_hundred_times_a_second_the_frames_are_where_the_samples_say(run):
    _, periods, found = run
    chosen = periods[::10]
    assert len(found["/tf"]) == len(chosen)
    for (sample, *_), (_, message) in zip(chosen, found["/tf"], strict=True):
        first, *fingers = message.transforms
        rotation = Rotation.from_quat(numbers(first.transform.rotation)).as_matrix()
        assert rotation == pytest.approx(np.array(sample.arm.rotation_base_tip), abs=1e-12)
        assert tuple(numbers(first.transform.translation)) == sample.arm.position_base_tip
        carried = "finger_0" if sample.hand is None else "hand"
        assert (first.header.frame_id, first.child_frame_id) == ("base", carried)
        for i, finger in enumerate(fingers):
            assert (finger.header.frame_id, finger.child_frame_id) == ("hand", f"finger_{i}")
            position = sample.hand.joint_position[i]
            assert numbers(finger.transform.translation) == [position, 0.0, 0.1 * i]


def test_contacts_are_there_while_there_is_one(run):
    log, periods, found = run
    chosen = [(sample, now) for sample, now, *_ in periods[::10] if now.fingers[0].touching]
    assert 0 < len(chosen) < len(periods[::10])
    for i in range(len(log.layout.channels)):
        points, arrows = found[f"/finger_{i}/contact"], found[f"/finger_{i}/force_arrow"]
        for (sample, now), (_, point), (_, arrow) in zip(chosen, points, arrows, strict=True):
            finger = now.fingers[i]
            assert (point.header.frame_id, arrow.header.frame_id) == (f"finger_{i}",) * 2
            assert stamp(point.header) == stamp(arrow.header) == log.heading.stamp(sample.time - LATE)
            assert numbers(point.point) == finger.contact.centroid.tolist()
            start, end = (np.array(numbers(each)) for each in arrow.points)
            assert start.tolist() == finger.contact.centroid.tolist()
            assert (end - start) / 0.015 == pytest.approx(np.array(finger.force), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("layout", [ONE_FINGER, TWO_FINGERS_AND_A_HAND])
def test_of_random_numbers_a_log_grows_by_at_most_40_per_cent(layout, tmp_path):
    write(tmp_path / "a.mcap", touching_run(430, layout))
    before = (tmp_path / "a.mcap").stat().st_size
    add_topics(tmp_path / "a.mcap", RobotNotes(Sliding()))
    assert before < (tmp_path / "a.mcap").stat().st_size <= 1.4 * before


def test_nothing_of_the_log_itself_is_changed(tmp_path):
    write(tmp_path / "a.mcap", touching_run(430, ONE_FINGER), {"notes.txt": "as they came"})
    before, after = read_log(tmp_path / "a.mcap"), recorded(tmp_path / "b.mcap", touching_run(430, ONE_FINGER))
    for log in (before, after):
        assert (log.complete, log.attachments) == (True, {"notes.txt": "as they came"})
    assert (after.rows.tobytes(), after.sequence.tolist()) == (before.rows.tobytes(), before.sequence.tolist())
    assert bits((after.events, after.changes)) == bits((before.events, before.changes))
    add_topics(tmp_path / "b.mcap", PLAIN_ROBOT)  # a second time
    assert read_log(tmp_path / "b.mcap").rows.tobytes() == before.rows.tobytes()


def test_readings_of_a_sensor_that_is_calibrated_here_are_no_wrenches(tmp_path):
    recorded(tmp_path / "a.mcap", touching_run(20, ONE_FINGER), RobotNotes(gives_wrenches=(False,)))
    assert {"/finger_0/wrench", "/tf"} <= set(messages(tmp_path / "a.mcap"))
    assert "/finger_0/wrench_raw" not in messages(tmp_path / "a.mcap")


def test_a_hand_that_cannot_tell_where_its_fingers_are_does_not_end_the_log(tmp_path):
    log = recorded(tmp_path / "a.mcap", touching_run(20, TWO_FINGERS_AND_A_HAND), RobotNotes(Broken()))
    assert (len(log), log.complete) == (20, True)
    assert "/tf" not in messages(tmp_path / "a.mcap")


def test_a_slow_robot_tells_all_in_every_period():
    codec = PeriodCodec(Heading(ONE_FINGER, 0.05, 0.0, 0, "test"), PERIOD_CHANNEL)
    rows = np.zeros((7, codec.width))
    rows[:, codec.columns["arm.rotation"]] = np.eye(3).ravel()
    told = {
        topic.name: each for topic, each in StandardTopics(codec).messages(Block.of(codec, rows, np.arange(7)))
    }
    assert len(told["/tf"]) == len(told["/finger_0/wrench"]) == 7
    assert told["/tf"][0].tobytes()[PAYLOAD : PAYLOAD + 4] == bytes((0, 1, 0, 0))


CLOUD = Cloud(np.arange(12.0).reshape(4, 3), {"band": np.array([1e-3, 2e-3, np.nan, 4e-3])})


def test_a_map_is_stamped_with_the_end_of_the_run(tmp_path):
    log = recorded(tmp_path / "a.mcap", touching_run(430, ONE_FINGER), cloud=CLOUD)
    assert (log.complete, len(log)) == (True, 430)
    ((logged, cloud),) = messages(tmp_path / "a.mcap")["/map"]
    assert logged == stamp(cloud.header) == log.heading.stamps(log.rows[:, 0]).max()
    assert (cloud.header.frame_id, cloud.width, cloud.is_dense) == ("base", 4, False)
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "band"]
    told = np.frombuffer(bytes(cloud.data), "<f4").reshape(4, 4)
    wanted = np.column_stack([CLOUD.position, CLOUD.quantities["band"]]).astype("<f4")
    assert told.tobytes() == wanted.tobytes()


def test_a_log_that_cannot_be_written_anew_stays(tmp_path, monkeypatch):
    path = tmp_path / "a.mcap"
    write(path, touching_run(100, ONE_FINGER))
    kept = path.read_bytes()

    def full(self):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(McapBuilder, "closing", full)
        with pytest.raises(OSError, match="No space left"):
            add_topics(path, PLAIN_ROBOT)
    assert path.read_bytes() == kept
    path.write_bytes(kept[:-20])
    with pytest.raises(InvalidValueError, match="is not whole: the summary is cut off"):
        add_topics(path, PLAIN_ROBOT)
    assert path.read_bytes() == kept[:-20]
    assert [each.name for each in tmp_path.iterdir() if not each.is_symlink()] == ["a.mcap"]


def test_a_cloud_is_thinned_to_what_a_viewer_draws():
    many = Cloud(np.zeros((3 * MOST_POINTS, 3)), {"band": np.arange(3.0 * MOST_POINTS)})
    assert many.thinned.quantities["band"][:3].tolist() == [0.0, 3.0, 6.0]
    assert len(many.thinned.position) == MOST_POINTS
