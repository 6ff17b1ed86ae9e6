"""A back end around another, to which it delegates all that it does not override."""

from typing import Generic, TypeVar

from palpate.runtime.closing import Closing
from palpate.runtime.data import Command, Sample
from palpate.runtime.pacing import Pacer
from palpate.runtime.protocols import Backend

Inner = TypeVar("Inner", bound=Backend)


class WrappedBackend(Closing, Generic[Inner]):
    """A `Backend` that does as the one in it; a subclass says where it differs.

    Attributes:
        backend: The other one.
    """

    def __init__(self, backend: Inner) -> None:
        """Take the other one."""
        self.backend = backend

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.backend.period

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self.backend.pacer

    def start(self) -> Sample:
        """See `Backend`."""
        return self.backend.start()

    def step(self, command: Command) -> Sample:
        """See `Backend`."""
        return self.backend.step(command)

    def close(self) -> None:
        """See `Backend`."""
        self.backend.close()


def unwrapped(source: object) -> object:
    """Return the innermost back end of one that is wrapped; anything else as it is."""
    while isinstance(source, WrappedBackend):
        source = source.backend
    return source
