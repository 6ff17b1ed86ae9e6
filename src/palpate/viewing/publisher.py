"""What shows standard topics: a program of others, to which they are sent."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from palpate.extras import require
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.topic import Block
from palpate.runtime.log.standard.topics import StandardTopics


class Publisher(Protocol):
    """Sends the topics of a run to whoever watches, from the process that it is in."""

    @property
    def url(self) -> str:
        """What to open."""
        ...

    def start(self, codec: PeriodCodec, topics: StandardTopics) -> None:
        """Take what a run is of; before its first period."""
        ...

    def periods(self, block: Block) -> None:
        """Send what some periods tell."""
        ...

    def close(self) -> None:
        """End it; may be called more than once."""
        ...


@dataclass(frozen=True, slots=True)
class TopicViewer:
    """A program that shows topics.

    Attributes:
        name: For people.
        library: That reaches it, as imported.
        extra: Of palpate, that brings the library.
        port: Its usual one.
        hint: What to do with the address, for people.
        publisher: From host and port to what sends to it; it imports the library.
    """

    name: str
    library: str
    extra: str
    port: int
    hint: str
    publisher: Callable[[str, int], Publisher]

    def check(self, what: str) -> None:
        """Make sure that its library is installed.

        Args:
            what: What needs it, for the message.

        Raises:
            MissingLibraryError: It is not.
        """
        require(self.library, self.extra, what)
