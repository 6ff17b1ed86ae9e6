"""Where the frames are, as tf2_msgs/TFMessage: the tip or the hand in the base frame, fingers in the hand."""

import numpy as np

from palpate.errors import FloatArray
from palpate.kinematics.hand import HandKinematics
from palpate.runtime.log.fields import HAND, finger_name
from palpate.runtime.log.message_layout import MessageLayout, Messages, put_heads, put_stamps
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.poses import proper_rotations, quaternions_xyzw
from palpate.runtime.log.standard.topic import BASE, Block
from palpate.runtime.log.standard.types import TRANSFORMS


class TransformTopic:
    """A `Topic`. Periods in which a pose cannot be are left out: readers refuse them.

    Attributes:
        frames: Each frame with that in which it is told, in the order of a message.
    """

    kind, name = TRANSFORMS, "/tf"

    def __init__(self, codec: PeriodCodec, channel: int, hand: HandKinematics | None) -> None:
        """Take the geometry of the hand; None if there is none, or if it is not known."""
        self.channel = channel
        self._columns, self._hand = codec.columns, hand
        fingers = len(codec.heading.layout.channels)
        carried = finger_name(0) if hand is None and fingers == 1 else HAND
        held = range(fingers) if hand is not None else ()
        self.frames = ((carried, BASE), *((finger_name(i), HAND) for i in held))
        layout = MessageLayout(channel)
        layout.constant("<u4", len(self.frames))
        for child, parent in self.frames:
            layout.stamp(child)
            layout.text(parent)
            layout.text(child)
            layout.add(child, "<f8", 7)
        self._template = layout.template()

    def messages(self, block: Block) -> Messages:
        """See `Topic`."""
        names = ("arm.position", "arm.rotation", *(("hand.joint_position",) if self._hand is not None else ()))
        numbers = np.hstack([block.rows[:, self._columns[name]] for name in names])
        usable = np.asarray(np.isfinite(numbers).all(axis=1))
        usable[usable] = proper_rotations(block.rows[usable][:, self._columns["arm.rotation"]].reshape(-1, 3, 3))
        block = block.where(usable)
        rows = block.rows
        position, rotation = rows[:, self._columns["arm.position"]], rows[:, self._columns["arm.rotation"]]
        (carried, _), *fingers = self.frames
        try:
            in_hand = self._in_hand(rows)
        except Exception:  # whatever a geometry of others raises: the log must not end for it
            return np.repeat(self._template, 0)
        found: Messages = np.repeat(self._template, len(rows))
        put_heads(found, block.sequence, block.stamps)
        put_stamps(found, block.sampled("arm"), carried)
        found[carried] = _transforms(position, rotation)
        for (finger, _), pose in zip(fingers, in_hand, strict=True):
            put_stamps(found, block.sampled(HAND), finger)
            found[finger] = pose
        return found

    def _in_hand(self, rows: FloatArray) -> list[FloatArray]:
        """Return where each finger is in the hand, numbers of transforms, shape (n, 7) each."""
        if self._hand is None:
            return []
        joints = rows[:, self._columns["hand.joint_position"]].tolist()
        poses = [self._hand.sensor_poses(tuple(angles)) for angles in joints]
        return [
            _transforms(
                np.array([each[i].position for each in poses]).reshape(-1, 3),
                np.array([each[i].rotation for each in poses]),
            )
            for i in range(len(self.frames) - 1)
        ]


def _transforms(position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Translations (n, 3) and rotations (n, 9) as the numbers of a geometry_msgs/Transform, shape (n, 7)."""
    return np.hstack([position, quaternions_xyzw(rotation)])
