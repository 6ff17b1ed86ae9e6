"""Standard topics to a rerun viewer: wrenches and joints as curves, transforms, contacts as arrows."""

import socket
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from palpate.runtime.log.fields import finger_name
from palpate.runtime.log.message_layout import Messages, Stamps
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.topic import Block, Topic
from palpate.runtime.log.standard.topics import StandardTopics
from palpate.runtime.log.standard.transforms import TransformTopic
from palpate.runtime.log.standard.types import JOINT_STATE, MARKER, POINT_STAMPED, TRANSFORMS, WRENCH_STAMPED
from palpate.runtime.palette import FELT, rgb
from palpate.viewing.server import ViewUnavailableError

TIMELINE = "time"
ANSWER_TIME = 2.0
"""How long a viewer may take to answer [s]."""


class RerunPublisher:
    """A `Publisher`: sends to a viewer that is open."""

    def __init__(self, host: str, port: int) -> None:
        """Connect.

        Raises:
            ViewUnavailableError: There is no viewer.
        """
        try:
            socket.create_connection((host, port), ANSWER_TIME).close()
        except OSError as error:
            raise ViewUnavailableError(
                f"there is no rerun viewer at {host}:{port} ({error.strerror or error}): start one with "
                f"`rerun --bind 127.0.0.1 --port {port}`, or name another with --host and --port"
            ) from None
        self.url = f"rerun+http://{host}:{port}/proxy"
        stream = import_module("rerun").RecordingStream("palpate")
        stream.connect_grpc(self.url)
        self._take(stream)

    @classmethod
    def into(cls, stream: Any) -> "RerunPublisher":
        """Return one that sends to a recording stream of rerun's: a file, memory."""
        self = object.__new__(cls)
        self.url = ""
        self._take(stream)
        return self

    def start(self, codec: PeriodCodec, topics: StandardTopics) -> None:
        """See `Publisher`."""
        self._topics = topics
        for i in range(len(codec.heading.layout.channels)):
            for kind in ("contact", "force_arrow"):
                frame = self._sdk.CoordinateFrame(finger_name(i))
                self._log(f"/{finger_name(i)}/{kind}", frame, static=True)

    def periods(self, block: Block) -> None:
        """See `Publisher`."""
        for topic, messages in self._topics.messages(block):
            if len(messages):
                self._senders[topic.kind](topic, messages)

    def close(self) -> None:
        """See `Publisher`."""
        self._stream.flush()
        self._stream.disconnect()

    def _take(self, stream: Any) -> None:
        self._sdk: Any = import_module("rerun")  # which not everybody has
        self._stream, self._log = stream, stream.log
        self._senders: Mapping[str, Callable[[Any, Messages], None]] = {
            WRENCH_STAMPED: self._curves,
            JOINT_STATE: self._curves,
            TRANSFORMS: self._transforms,
            POINT_STAMPED: self._points,
            MARKER: self._arrows,
        }

    def _curves(self, topic: Topic, messages: Messages) -> None:
        values = messages["numbers"]
        columns = self._sdk.Scalars.columns(scalars=values.ravel())
        lengths = [values.shape[1]] * len(values)
        self._send(topic.name, messages["log_time"], columns.partition(lengths))

    def _transforms(self, topic: TransformTopic, messages: Messages) -> None:
        for child, parent in topic.frames:
            pose = messages[child]
            columns = self._sdk.Transform3D.columns(
                translation=pose[:, :3],
                quaternion=pose[:, 3:],
                child_frame=[child] * len(pose),
                parent_frame=[parent] * len(pose),
            )
            self._send(f"{topic.name}/{child}", messages["log_time"], columns)

    def _points(self, topic: Topic, messages: Messages) -> None:
        columns = self._sdk.Points3D.columns(positions=messages["point"])
        self._send(topic.name, messages["log_time"], columns)

    def _arrows(self, topic: Topic, messages: Messages) -> None:
        start, count = messages["from"], len(messages)
        columns = self._sdk.Arrows3D.columns(
            origins=start, vectors=messages["to"] - start, colors=[rgb(FELT)] * count
        )
        self._send(topic.name, messages["log_time"], columns)

    def _send(self, entity: str, stamps: Stamps, columns: Any) -> None:
        time = self._sdk.TimeColumn(TIMELINE, timestamp=stamps.astype("datetime64[ns]"))
        self._stream.send_columns(entity, [time], columns)
