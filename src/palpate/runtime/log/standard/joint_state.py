"""Joint positions as sensor_msgs/JointState."""

from palpate.runtime.log.message_layout import Messages, messages_at, put_stamps
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.topic import Block, begin
from palpate.runtime.log.standard.types import JOINT_STATE


class JointTopic:
    """A `Topic`: positions [rad, or m if a joint slides]; velocities and efforts are empty."""

    kind = JOINT_STATE

    def __init__(self, codec: PeriodCodec, channel: int, name: str, group: str, joints: tuple[str, ...]) -> None:
        """Take whose: "arm" or "hand", and the names of its joints."""
        self.channel, self.name = channel, name
        self._heading = codec.heading
        self._time = codec.columns[f"{group}.time"].start
        self._columns = codec.columns[f"{group}.joint_position"]
        layout = begin(channel, "")
        layout.constant("<u4", len(joints))
        for joint in joints:
            layout.text(joint)
        layout.constant("<u4", len(joints))
        layout.add("position", "<f8", len(joints))
        layout.constant("<u4", 0, 0)
        self._template = layout.template()

    def messages(self, block: Block) -> Messages:
        """See `Topic`."""
        found = messages_at(self._template, block.sequence, block.stamps)
        put_stamps(found, self._heading.stamps(block.rows[:, self._time]))
        found["position"] = block.rows[:, self._columns]
        return found
