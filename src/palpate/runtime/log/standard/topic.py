"""What every standard topic has in common."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.runtime.log.message_layout import MessageLayout, Messages, Stamps, put_heads, put_stamps
from palpate.runtime.log.period_codec import PeriodCodec

BASE = "base"
"""Frame in which an arm says where its tip is; the others are `hand`, and `finger_0`, ... for the frame of each
finger's sensor."""

_PERIOD = "time"
"""Column of a period's own time; those of devices are called "arm.time", and so on."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Some periods.

    Attributes:
        rows: Shape (n, width), as a `PeriodCodec` has them.
        sequence: Number of each period, shape (n,).
        times: Stamps of each period and of what was sampled in it, shape (n, k) [ns].
        columns: Which of these is the period's ("time"), the arm's ("arm.time"), ...
    """

    rows: FloatArray
    sequence: npt.NDArray[np.int64]
    times: Stamps
    columns: Mapping[str, int]

    @classmethod
    def of(cls, codec: PeriodCodec, rows: FloatArray, sequence: npt.NDArray[np.int64]) -> "Block":
        """Return periods with their stamps."""
        names = [name for name in codec.columns if name.rpartition(".")[2] == _PERIOD]
        times = codec.heading.stamps(rows[:, [codec.columns[name].start for name in names]])
        return cls(rows, sequence, times, {name: i for i, name in enumerate(names)})

    @property
    def stamps(self) -> Stamps:
        """Of each period, by which its messages are logged, shape (n,) [ns]."""
        return self.times[:, self.columns[_PERIOD]]

    def sampled(self, group: str) -> Stamps:
        """Return when "arm", "hand" or "finger_0" was sampled, shape (n,) [ns]."""
        return self.times[:, self.columns[f"{group}.{_PERIOD}"]]

    def where(self, chosen: npt.NDArray[np.bool_]) -> "Block":
        """Return some of them."""
        return Block(self.rows[chosen], self.sequence[chosen], self.times[chosen], self.columns)


class Topic(Protocol):
    """A topic of a type that other programs know.

    A message is stamped with the time at which what it tells was sampled, and logged at its period's.
    """

    @property
    def channel(self) -> int:
        """Of the MCAP file."""
        ...

    @property
    def name(self) -> str:
        """As /finger_0/wrench."""
        ...

    @property
    def kind(self) -> str:
        """Its ROS type, as geometry_msgs/WrenchStamped."""
        ...

    def messages(self, block: Block) -> Messages:
        """Return whole message records, all of one size."""
        ...


class NumbersTopic:
    """A `Topic` with a message in every period: a header, and numbers that stand in a row as they are sent."""

    def __init__(
        self,
        codec: PeriodCodec,
        layout: MessageLayout,
        kind: str,
        channel: int,
        name: str,
        group: str,
        quantity: str,
    ) -> None:
        """Take which numbers of which group.

        Args:
            codec: Of the rows.
            layout: Of the message, with the numbers as its field "numbers".
            kind: See `Topic`.
            channel: See `Topic`.
            name: See `Topic`.
            group: That has the quantity: "arm", "hand", "finger_0", ...
            quantity: As "wrench".
        """
        self.kind, self.channel, self.name, self._group = kind, channel, name, group
        self._columns = codec.columns[f"{group}.{quantity}"]
        self.template = layout.template()

    def messages(self, block: Block) -> Messages:
        """See `Topic`."""
        found: Messages = np.repeat(self.template, len(block.rows))
        self.fill(found, block)
        return found

    def fill(self, messages: Messages, block: Block) -> None:
        """Fill in messages made from `template`, one per period."""
        put_heads(messages, block.sequence, block.stamps)
        put_stamps(messages, block.sampled(self._group))
        messages["numbers"] = block.rows[:, self._columns]


def begin(channel: int, frame: str) -> MessageLayout:
    """Return a message that begins with a std_msgs/Header."""
    layout = MessageLayout(channel)
    layout.stamp()
    layout.text(frame)
    return layout
