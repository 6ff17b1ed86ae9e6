"""Where the frames are, as tf2_msgs/TFMessage: the tip or the hand in the base frame, fingers in the hand."""

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray
from palpate.kinematics.hand import HandKinematics
from palpate.runtime.log.fields import HAND, finger_name
from palpate.runtime.log.message_layout import MessageLayout, Messages, messages_at, put_stamps
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.poses import proper_rotations
from palpate.runtime.log.standard.topic import BASE, Block
from palpate.runtime.log.standard.types import TRANSFORMS


class TransformTopic:
    """A `Topic`. Periods in which a pose cannot be are left out: readers refuse them."""

    kind, name = TRANSFORMS, "/tf"

    def __init__(self, codec: PeriodCodec, channel: int, hand: HandKinematics | None) -> None:
        """Take the geometry of the hand; None if there is none, or if it is not known."""
        self.channel = channel
        self._heading, self._columns, self._hand = codec.heading, codec.columns, hand
        fingers = len(codec.heading.layout.channels)
        carried = finger_name(0) if hand is None and fingers == 1 else HAND
        self._children = (carried, *((finger_name(i) for i in range(fingers)) if hand is not None else ()))
        layout = MessageLayout(channel)
        layout.constant("<u4", len(self._children))
        for child in self._children:
            layout.stamp(child)
            layout.text(BASE if child == carried else HAND)
            layout.text(child)
            layout.add(child, "<f8", 7)
        self._template = layout.template()

    def messages(self, block: Block) -> Messages:
        """See `Topic`."""
        names = ("arm.position", "arm.rotation", *(("hand.joint_position",) if self._hand is not None else ()))
        usable = np.isfinite(np.hstack([block.rows[:, self._columns[name]] for name in names])).all(axis=1)
        usable[usable] = proper_rotations(
            block.rows[usable][:, self._columns["arm.rotation"]].reshape(-1, 3, 3)
        )
        block = block.where(usable)
        found, rows = messages_at(self._template, block.sequence, block.stamps), block.rows
        position, rotation = rows[:, self._columns["arm.position"]], rows[:, self._columns["arm.rotation"]]
        carried, *fingers = self._children
        put_stamps(found, self._stamps(rows, "arm"), carried)
        found[carried] = _transforms(position, rotation)
        if self._hand is not None and len(rows):
            joints = rows[:, self._columns["hand.joint_position"]].tolist()
            poses = [self._hand.sensor_poses(tuple(angles)) for angles in joints]
            for i, finger in enumerate(fingers):
                put_stamps(found, self._stamps(rows, HAND), finger)
                found[finger] = _transforms(
                    np.array([each[i].position for each in poses]),
                    np.array([each[i].rotation for each in poses]).reshape(-1, 9),
                )
        return found

    def _stamps(self, rows: FloatArray, group: str) -> np.ndarray[tuple[int], np.dtype[np.uint64]]:
        return self._heading.stamps(rows[:, self._columns[f"{group}.time"].start])


def _transforms(position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Translations (n, 3) and rotations (n, 9) as the numbers of a geometry_msgs/Transform, shape (n, 7)."""
    if not len(position):
        return np.empty((0, 7))
    return np.hstack([position, Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_quat()])  # w last, as ROS
