"""A finger's wrench as geometry_msgs/WrenchStamped."""

from palpate.runtime.log.fields import finger_name
from palpate.runtime.log.message_layout import Messages, messages_at, put_stamps
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.topic import Block, begin
from palpate.runtime.log.standard.types import WRENCH_STAMPED


class WrenchTopic:
    """A `Topic`: one message per period, in the frame of the finger's sensor."""

    kind = WRENCH_STAMPED

    def __init__(self, codec: PeriodCodec, channel: int, name: str, finger: int, quantity: str) -> None:
        """Take which of a finger's quantities: "wrench", or "reading" if that has six numbers."""
        self.channel, self.name = channel, name
        self._heading, frame = codec.heading, finger_name(finger)
        self._time = codec.columns[f"{frame}.time"].start
        self._columns = codec.columns[f"{frame}.{quantity}"]
        layout = begin(channel, frame)
        layout.add("wrench", "<f8", 6)
        self._template = layout.template()

    def messages(self, block: Block) -> Messages:
        """See `Topic`."""
        found = messages_at(self._template, block.sequence, block.stamps)
        put_stamps(found, self._heading.stamps(block.rows[:, self._time]))
        found["wrench"] = block.rows[:, self._columns]
        return found
