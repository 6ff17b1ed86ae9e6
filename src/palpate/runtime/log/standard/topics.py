"""Which standard topics a run has, and their messages."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from palpate.kinematics.hand import HandKinematics
from palpate.runtime.log.fields import HAND, finger_name
from palpate.runtime.log.layout import Layout
from palpate.runtime.log.message_layout import Messages
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.cloud import CLOUD_CHANNEL
from palpate.runtime.log.standard.contact import ContactMarkerTopic, ContactPointTopic
from palpate.runtime.log.standard.topic import Block, NumbersTopic, Topic, begin
from palpate.runtime.log.standard.transforms import TransformTopic
from palpate.runtime.log.standard.types import JOINT_STATE, WRENCH_STAMPED


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


FIRST_CHANNEL = CLOUD_CHANNEL
"""From here on channels are standard: all that is in them is in the periods, too, or was found after the run."""

INTERVAL = 0.01
"""Between two transforms, and two contacts of a finger [s]: thrice as often as a screen is drawn, and in a log a
tenth of what every period would take at 1 kHz."""

_WRENCH = 6
"""Numbers of one."""


@dataclass(frozen=True, slots=True)
class RobotNotes:
    """What standard topics need to know of a robot besides its samples.

    Attributes:
        hand: Where its fingers are in the hand; None: there is no hand, or nobody knows.
        gives_wrenches: Whether the reading of each finger's device is a wrench, and no raw channels; shorter than
            there are fingers: the others' are.
    """

    hand: HandKinematics | None = None
    gives_wrenches: tuple[bool, ...] = ()


PLAIN_ROBOT = RobotNotes()
"""A fingertip at the end of an arm, whose sensor gives wrenches."""


class StandardTopics:
    """Turns periods into messages that every tool reads, whole blocks at once.

    Attributes:
        every_period: Topics with a message in each period: wrenches and joints.
        seldom: Topics with at most one every `INTERVAL`: transforms, contacts.
    """

    def __init__(self, codec: PeriodCodec, notes: RobotNotes = PLAIN_ROBOT) -> None:
        """Take the rows' codec, and what else is known of the robot."""
        layout = codec.heading.layout
        self._every = max(1, round(INTERVAL / codec.heading.period))
        channel = iter(range(FIRST_CHANNEL + 1, 2**16))
        self.every_period: tuple[NumbersTopic, ...] = tuple(_every_period(codec, notes, layout, channel))
        self.seldom: tuple[Topic, ...] = tuple(_seldom(codec, notes, layout, channel))

    def selected(self, block: Block) -> Block:
        """Return the periods whose transforms and contacts are told."""
        return block.where(block.sequence % self._every == 0)

    def messages(self, block: Block) -> Iterator[tuple[Topic, Messages]]:
        """Yield the messages of some periods, topic after topic."""
        selected = self.selected(block)
        yield from ((topic, topic.messages(block)) for topic in self.every_period)
        yield from ((topic, topic.messages(selected)) for topic in self.seldom)


def _every_period(
    codec: PeriodCodec, notes: RobotNotes, layout: Layout, channel: Iterator[int]
) -> Iterator[NumbersTopic]:
    for i, channels in enumerate(layout.channels):
        name = finger_name(i)
        yield wrench_topic(codec, next(channel), f"/{name}/wrench", i, "wrench")
        if channels == _WRENCH and (i >= len(notes.gives_wrenches) or notes.gives_wrenches[i]):
            yield wrench_topic(codec, next(channel), f"/{name}/wrench_raw", i, "reading")
    if layout.joints:
        joints = tuple(f"joint_{i + 1}" for i in range(layout.joints))
        yield joint_topic(codec, next(channel), "/joint_states", "arm", joints)
    if layout.hand_joints:
        joints = tuple(f"hand_joint_{i + 1}" for i in range(layout.hand_joints))
        yield joint_topic(codec, next(channel), "/hand/joint_states", HAND, joints)


def _seldom(codec: PeriodCodec, notes: RobotNotes, layout: Layout, channel: Iterator[int]) -> Iterator[Topic]:
    hand = notes.hand if layout.hand_joints is not None else None
    yield TransformTopic(codec, next(channel), hand)
    kinds: tuple[Callable[[PeriodCodec, int, int], Topic], ...] = (ContactPointTopic, ContactMarkerTopic)
    for i in range(len(layout.channels)):
        for kind in kinds:
            yield kind(codec, next(channel), i)
