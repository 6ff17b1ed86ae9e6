"""What every standard topic has in common."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.message_layout import MessageLayout, Messages, Stamps

BASE = "base"
"""Frame in which an arm says where its tip is; the others are `hand`, and `finger_0`, ... for the frame of each
finger's sensor."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Some periods.

    Attributes:
        rows: Shape (n, width), as a `PeriodCodec` has them.
        sequence: Number of each period, shape (n,).
        stamps: Of each period, by which its messages are logged, shape (n,) [ns].
    """

    rows: FloatArray
    sequence: npt.NDArray[np.int64]
    stamps: Stamps

    @classmethod
    def of(cls, heading: Heading, rows: FloatArray, sequence: npt.NDArray[np.int64]) -> "Block":
        """Return periods with their stamps."""
        return cls(rows, sequence, heading.stamps(rows[:, 0]))

    def where(self, chosen: npt.NDArray[np.bool_]) -> "Block":
        """Return some of them."""
        return Block(self.rows[chosen], self.sequence[chosen], self.stamps[chosen])


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


def begin(channel: int, frame: str) -> MessageLayout:
    """Return a message that begins with a std_msgs/Header."""
    layout = MessageLayout(channel)
    layout.stamp()
    layout.text(frame)
    return layout
