"""Loads that somebody announces while a grip goes on."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from palpate.controllers.grip.expected_load import ExpectedLoad


class Announcer(Protocol):
    """Who knows of loads before they act."""

    def announced(self, time: float) -> Sequence[ExpectedLoad]:
        """Return what is known at a time [s] of loads to come."""
        ...


class NothingAnnounced:
    """Knows of nothing. An `Announcer`."""

    def announced(self, time: float) -> Sequence[ExpectedLoad]:
        """See `Announcer`."""
        return ()


@dataclass(frozen=True, slots=True)
class LoadAnnouncedBefore:
    """A load that is told of so long before it acts. An `Announcer`.

    Attributes:
        load: It.
        before: Its beginning [s].
    """

    load: ExpectedLoad
    before: float

    def announced(self, time: float) -> Sequence[ExpectedLoad]:
        """See `Announcer`."""
        return (self.load,) if time >= self.load.begin - self.before else ()
