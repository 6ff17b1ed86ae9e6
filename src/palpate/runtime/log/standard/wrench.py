"""A finger's wrench as geometry_msgs/WrenchStamped."""

from palpate.runtime.log.fields import finger_name
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.topic import NumbersTopic, begin
from palpate.runtime.log.standard.types import WRENCH_STAMPED


def wrench_topic(codec: PeriodCodec, channel: int, name: str, finger: int, quantity: str) -> NumbersTopic:
    """Return the topic of a finger's wrench, in the frame of its sensor.

    Args:
        codec: Of the rows.
        channel: Of the MCAP file.
        name: Of the topic.
        finger: Which.
        quantity: "wrench", or "reading" if that has six numbers.
    """
    layout = begin(channel, finger_name(finger))
    layout.add("numbers", "<f8", 6)
    return NumbersTopic(codec, layout, WRENCH_STAMPED, channel, name, finger_name(finger), quantity)
