"""Slips as they were heard."""

from dataclasses import dataclass
from enum import Enum

from palpate.friction.slip.kinds import SlipKind


class Signal(Enum):
    """By what a slip is heard."""

    FALL = "what hangs fell"
    SHARE = "the load went over to the other finger"
    SQUEEZE = "what hangs rose with the grip"
    RIPPLE = "the load followed the ripple of the grip"


@dataclass(frozen=True, slots=True)
class SlipAlarm:
    """A slip that was heard.

    Attributes:
        time: When [s].
        finger: Where.
        kind: Whether it slides or spins.
        signal: By what.
    """

    time: float
    finger: int
    kind: SlipKind
    signal: Signal
