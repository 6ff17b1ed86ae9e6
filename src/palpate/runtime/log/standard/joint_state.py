"""Joint positions as sensor_msgs/JointState."""

from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.topic import NumbersTopic, begin
from palpate.runtime.log.standard.types import JOINT_STATE


def joint_topic(codec: PeriodCodec, channel: int, name: str, group: str, joints: tuple[str, ...]) -> NumbersTopic:
    """Return the topic of positions [rad, or m if a joint slides]; velocities and efforts are empty.

    Args:
        codec: Of the rows.
        channel: Of the MCAP file.
        name: Of the topic.
        group: Whose: "arm" or "hand".
        joints: Their names.
    """
    layout = begin(channel, "")
    layout.constant("<u4", len(joints))
    for joint in joints:
        layout.text(joint)
    layout.constant("<u4", len(joints))
    layout.add("numbers", "<f8", len(joints))
    layout.constant("<u4", 0, 0)
    return NumbersTopic(codec, layout, JOINT_STATE, channel, name, group, "joint_position")
