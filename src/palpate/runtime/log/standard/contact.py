"""A finger's contact, while there is one: its place as geometry_msgs/PointStamped, its force as an arrow."""

import numpy as np

from palpate.runtime.log.fields import finger_name
from palpate.runtime.log.message_layout import Messages, put_heads, put_stamps
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.topic import Block, begin
from palpate.runtime.log.standard.types import MARKER, POINT_STAMPED
from palpate.runtime.palette import FELT, rgb
from palpate.sensing.contact import ContactStatus

ARROW_LENGTH = 0.015
"""[m/N], as in the view: a force of 2 N is as long as a fingertip is wide."""

SHAFT, HEAD = 0.0015, 0.003
"""Diameters of an arrow [m]."""

LIFETIME = 10**8
"""How long an arrow stays when none follows it [ns]: ten of them are due in that time."""


class _Touches:
    """Which periods have a contact that is known, and where."""

    def __init__(self, codec: PeriodCodec, finger: int) -> None:
        self._name = at = finger_name(finger)
        statuses = codec.heading.codes.statuses
        self._ok = statuses.index(ContactStatus.OK.name) if ContactStatus.OK.name in statuses else -1
        self._touching, self._status = (codec.columns[f"{at}.{name}"].start for name in ("touching", "status"))
        self.centroid = codec.columns[f"{at}.centroid"]
        wrench = codec.columns[f"{at}.wrench"].start
        self.force = slice(wrench, wrench + 3)

    def of(self, block: Block) -> Block:
        rows = block.rows
        known = (rows[:, self._touching] > 0.0) & (rows[:, self._status] == self._ok)
        return block.where(known & np.isfinite(rows[:, self.centroid]).all(axis=1))

    def filled(self, template: Messages, touched: Block) -> Messages:
        found: Messages = np.repeat(template, len(touched.rows))
        put_heads(found, touched.sequence, touched.stamps)
        put_stamps(found, touched.sampled(self._name))
        return found


class ContactPointTopic:
    """A `Topic`: the contact centroid in the frame of the finger's sensor [m]."""

    kind = POINT_STAMPED

    def __init__(self, codec: PeriodCodec, channel: int, finger: int) -> None:
        """Take whose contact."""
        self.channel, self.name = channel, f"/{finger_name(finger)}/contact"
        self._touches = _Touches(codec, finger)
        layout = begin(channel, finger_name(finger))
        layout.add("point", "<f8", 3)
        self._template = layout.template()

    def messages(self, block: Block) -> Messages:
        """See `Topic`."""
        touched = self._touches.of(block)
        found = self._touches.filled(self._template, touched)
        found["point"] = touched.rows[:, self._touches.centroid]
        return found


class ContactMarkerTopic:
    """A `Topic`: the force that the object exerts on the finger, as an arrow from the contact centroid."""

    kind = MARKER

    def __init__(self, codec: PeriodCodec, channel: int, finger: int) -> None:
        """Take whose contact."""
        self.channel, self.name = channel, f"/{finger_name(finger)}/force_arrow"
        self._touches = _Touches(codec, finger)
        layout = begin(channel, finger_name(finger))
        layout.text("force")
        layout.constant("<i4", finger, 0, 0)  # id, ARROW, ADD
        layout.constant("<f8", 0, 0, 0, 0, 0, 0, 1)  # pose: the frame itself
        layout.constant("<f8", SHAFT, HEAD, 0)
        layout.constant("<f4", *(channel / 255.0 for channel in rgb(FELT)), 1)
        layout.constant("<i4", 0)
        layout.constant("<u4", LIFETIME)
        layout.constant("u1", 1)  # it goes with its frame
        layout.constant("<u4", 2)
        layout.add("from", "<f8", 3)
        layout.add("to", "<f8", 3)
        layout.constant("<u4", 0)  # colours
        layout.text("")
        layout.constant("<u4", 0, 0)  # a texture's header
        layout.text("")
        layout.text("")
        layout.constant("<u4", 0, 0)  # its data, coordinates on it
        for _ in ("text", "mesh_resource", "filename"):
            layout.text("")
        layout.constant("<u4", 0)
        layout.constant("u1", 0)
        self._template = layout.template()

    def messages(self, block: Block) -> Messages:
        """See `Topic`."""
        touched = self._touches.of(block)
        found = self._touches.filled(self._template, touched)
        start = touched.rows[:, self._touches.centroid]
        found["from"] = start
        found["to"] = start + ARROW_LENGTH * touched.rows[:, self._touches.force]
        return found
