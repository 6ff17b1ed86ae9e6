"""Standard topics to Foxglove, by the server of its SDK: the bytes that a log would hold, with their schemas."""

from importlib import import_module
from typing import Any

from palpate.runtime.log.message_layout import PAYLOAD
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.schema import full_name, schema
from palpate.runtime.log.standard.topic import Block, Topic
from palpate.runtime.log.standard.topics import StandardTopics
from palpate.runtime.log.standard.types import STANDARD_TYPES
from palpate.viewing.guard import EVERYWHERE
from palpate.viewing.server import ViewUnavailableError, free_port

BACKLOG = 8192
"""Messages that wait for one slow page, three seconds of a run with one finger; then the oldest are dropped."""


class FoxglovePublisher:
    """A `Publisher`: serves whoever connects, and takes nothing from them."""

    def __init__(self, host: str, port: int) -> None:
        """Start serving.

        Raises:
            InvalidValueError: There is no such port.
            ViewUnavailableError: It is taken.
        """
        self._sdk: Any = import_module("foxglove")  # which not everybody has
        port = free_port(host, port)
        try:
            self._server: Any = self._sdk.start_server(
                name="palpate", host=host, port=port, message_backlog_size=BACKLOG
            )
        except Exception as error:  # the SDK has no kind of its own for it
            raise ViewUnavailableError(f"host = {host!r}, port = {port}: {error}") from None
        self.url = f"ws://{'localhost' if host in EVERYWHERE else host}:{port}"
        self._channels: dict[int, Any] = {}

    def start(self, codec: PeriodCodec, topics: StandardTopics) -> None:
        """See `Publisher`."""
        self._topics = topics
        for topic in (*topics.every_period, *topics.seldom):
            self._channels[topic.channel] = self._channel(topic.name, topic.kind)

    def periods(self, block: Block) -> None:
        """See `Publisher`."""
        for topic, messages in self._topics.messages(block):
            self._send(topic, messages.tobytes(), messages.itemsize, messages["log_time"].tolist())

    def close(self) -> None:
        """See `Publisher`."""
        self._server.stop()

    def _channel(self, name: str, kind: str) -> Any:
        text = schema(kind, STANDARD_TYPES)
        given = self._sdk.Schema(name=full_name(kind), encoding="ros2msg", data=text.encode())
        return self._sdk.Channel(name, schema=given, message_encoding="cdr")

    def _send(self, topic: Topic, records: bytes, size: int, times: list[int]) -> None:
        log = self._channels[topic.channel].log
        for i, time in enumerate(times):
            log(records[i * size + PAYLOAD : (i + 1) * size], log_time=time)
