"""A run's topics live: other programs get the bytes that the log holds, and none of them can hold up the loop."""

import json
import multiprocessing
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from websockets.sync.client import connect

from palpate import extras
from palpate.commands.view.command import run_view
from palpate.commands.view.config import ViewConfig
from palpate.errors import InvalidValueError
from palpate.extras import MissingLibraryError
from palpate.runtime.log import MemoryLog, Recorder
from palpate.runtime.log.chunk import PERIOD_CHANNEL
from palpate.runtime.log.message_layout import PAYLOAD
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.topic import Block
from palpate.runtime.log.standard.topics import PLAIN_ROBOT, RobotNotes, StandardTopics
from palpate.viewing import LOOPBACK, ViewUnavailableError
from palpate.viewing.live_topics import LiveTopics, _HeadingSink, play_topics
from palpate.viewing.rerun_publisher import RerunPublisher
from palpate.viewing.row_ring import RingReader, RowRing
from palpate.viewing.server import free_port
from palpate.viewing.topic_viewers import FOXGLOVE, RERUN
from runtime.log.log_examples import ONE_FINGER, PERIOD, TWO_FINGERS_AND_A_HAND
from runtime.log.test_standard_topics import Sliding, recorded, touching_run

ANSWER_TIME = 30.0
NEEDED = r'--{0} needs .*pip install "palpate\[{0}\]"'


class Page:
    """What Foxglove does: subscribe to all there is."""

    def __init__(self, url):
        self._socket = connect(url, subprotocols=["foxglove.sdk.v1"], open_timeout=ANSWER_TIME)
        self._topics, self.schemas = {}, {}

    def subscribe(self, count):
        while len(self._topics) < count:
            message = json.loads(self._socket.recv(ANSWER_TIME))
            for channel in message.get("channels", ()):
                self._topics[channel["id"]] = channel["topic"]
                self.schemas[channel["topic"]] = (
                    channel["schemaName"],
                    channel["schemaEncoding"],
                    channel["encoding"],
                )
        wanted = [{"id": number, "channelId": number} for number in self._topics]
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def messages(self, wanted, feed):
        """Until there is one of each topic that was logged then, fed again and again: bytes by topic and time."""
        found = {topic: {} for topic in self._topics.values()}
        while not all(wanted in each for each in found.values()):
            try:
                data = self._socket.recv(0.5)
            except TimeoutError:
                feed()
                continue
            if isinstance(data, bytes) and data[0] == 1:
                number, time = struct.unpack_from("<IQ", data, 1)
                found[self._topics[number]][time] = data[13:]
        return found


@pytest.mark.slow
@pytest.mark.parametrize("layout", [ONE_FINGER, TWO_FINGERS_AND_A_HAND], ids=["one finger", "hand"])
def test_foxglove_gets_what_the_log_holds(layout):
    pytest.importorskip("foxglove", reason="the extra foxglove is not installed")
    periods = touching_run(40, layout)
    notes = RobotNotes(None if layout.hand_joints is None else Sliding())
    with LiveTopics(FOXGLOVE, notes, LOOPBACK, 0) as live:
        live.observe(*periods[0][:3])  # the run has not begun: there is nobody to send it to
        memory = MemoryLog()
        recorder = Recorder(memory, *live.sinks)
        recorder.start(periods[0][0], periods[0][1], PERIOD)
        for period in periods:
            recorder.record(*period)
        assert recorder.close().rows_written == 40
        codec, rows = memory.codec, memory.kept_rows()
        topics, page = StandardTopics(codec, notes), Page(live.url)
        names = [topic.name for topic in (*topics.every_period, *topics.seldom)]
        page.subscribe(len(names))

        def feed():
            for period in periods:
                live.observe(*period[:3])

        found = page.messages(codec.heading.stamp(periods[30][0].time), feed)
        assert live.run_over() == ()
    assert sorted(found) == sorted(names)
    for topic, messages in topics.messages(Block.of(codec, rows, np.arange(40))):
        kept = {int(each["log_time"]): each.tobytes()[PAYLOAD:] for each in messages}
        assert found[topic.name].items() <= kept.items()
        assert page.schemas[topic.name] == (topic.kind.replace("/", "/msg/"), "ros2msg", "cdr")


def test_a_period_that_does_not_fit_is_left_out_and_the_run_goes_on():
    live = object.__new__(LiveTopics)
    ring = RowRing(multiprocessing.get_context("spawn"), 1, 10_000)
    ours, theirs = multiprocessing.Pipe()
    live._sink = _HeadingSink(ring, ours)
    periods = touching_run(3, ONE_FINGER)
    recorder = Recorder(*live.sinks)
    recorder.start(periods[0][0], periods[0][1], PERIOD)
    codec = PeriodCodec(theirs.recv(), PERIOD_CHANNEL)
    reader = RingReader(ring.divided(codec.width + 2))
    live.observe(*periods[0][:3])
    live.observe(replace(periods[1][0], wrenches=()), *periods[1][1:3])
    live.observe(*periods[2][:3])
    rows = reader.read()
    assert rows[:, 0].tolist() == [0.0, 1.0]
    assert rows[:, 1].tolist() == [periods[0][0].time, periods[2][0].time]
    theirs.close()
    ours.close()
    assert recorder.close().problem is None


def test_a_missing_extra_is_named_and_two_programs_at_once_and_pictures_are_refused(monkeypatch):
    monkeypatch.setattr(extras, "find_spec", lambda library: None)
    for run, options, kind, message in (
        (
            "explore",
            {"foxglove": True},
            MissingLibraryError,
            NEEDED.format("foxglove"),
        ),
        ("explore", {"rerun": True}, MissingLibraryError, NEEDED.format("rerun")),
        ("explore", {"foxglove": True, "rerun": True}, InvalidValueError, "by one of them"),
        ("runs/first", {"foxglove": True, "picture": Path("a.png")}, InvalidValueError, "drawn by the simulator"),
    ):
        with pytest.raises(kind, match=message):
            run_view(ViewConfig(run, **options))


class Kept:
    """A `Publisher` that keeps what it is given."""

    def __init__(self):
        self.numbers = []

    def start(self, codec, topics):
        self.topics = topics

    def periods(self, block):
        self.numbers += block.sequence.tolist()


@pytest.mark.parametrize("speed", [float("inf"), 1.0])
def test_a_recorded_run_is_sent_whole_and_in_order(speed, tmp_path):
    kept = Kept()
    play_topics(kept, recorded(tmp_path / "a.mcap", touching_run(40, ONE_FINGER)), PLAIN_ROBOT, speed)
    assert kept.numbers == list(range(40))


def test_without_a_viewer_of_rerun_it_says_how_to_start_one():
    pytest.importorskip("rerun", reason="the extra rerun, half a gigabyte, is not installed")
    with pytest.raises(ViewUnavailableError, match=r"no rerun viewer at .*start one with `rerun"):
        RERUN.publisher(LOOPBACK, free_port(LOOPBACK, 0))


def test_rerun_gets_each_topic_in_its_frame(tmp_path):
    rerun = pytest.importorskip("rerun", reason="the extra rerun, half a gigabyte, is not installed")
    log = recorded(tmp_path / "a.mcap", touching_run(40, TWO_FINGERS_AND_A_HAND))
    stream = rerun.RecordingStream("palpate")
    stream.save(tmp_path / "a.rrd")
    publisher = RerunPublisher.into(stream)
    play_topics(publisher, log, RobotNotes(Sliding()), speed=float("inf"))
    publisher.close()
    printed = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "print", "-v", str(tmp_path / "a.rrd")],
        capture_output=True,
        text=True,
    ).stdout
    for name in (
        "/finger_0/wrench",
        "/joint_states",
        "/tf/hand",
        "/tf/finger_1",
        "/finger_1/contact",
        "/finger_0/force_arrow",
    ):
        assert name in printed
