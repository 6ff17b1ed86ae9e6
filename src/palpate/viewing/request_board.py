"""How requests get from the view's process to the loop: numbers in shared memory, looked at once per period.

There is one place per live parameter, and a count of all requests. The view writes a request, then the count; the
loop looks at the count alone, which takes a tenth of a microsecond, until it has changed. A newer request replaces
one that the loop has not seen yet, as in `palpate.runtime.live`.
"""

from collections.abc import Sequence
from multiprocessing.context import BaseContext
from typing import Any


class RequestBoard:
    """Shared memory for requests; it can be handed to a process that is being started.

    Attributes:
        names: Of the live parameters, in order.
    """

    def __init__(self, context: BaseContext, names: Sequence[str]) -> None:
        """Take the memory.

        Args:
            context: Of `multiprocessing`, with which the other process will be started.
            names: Of the live parameters.
        """
        self.names = tuple(names)
        # first the count of all requests; then, of each parameter, their count and the newest value: who reads in
        # this order and finds a new count gets its value, or a newer one. Without a lock: nobody waits
        self._memory: Any = context.RawArray("d", 1 + 2 * len(self.names))


class BoardWriter:
    """The view's end; there may be one."""

    def __init__(self, board: RequestBoard) -> None:
        """Take the memory."""
        self._memory, self._names = board._memory, board.names

    def request(self, name: str, value: float) -> None:
        """Ask for a change.

        Raises:
            ValueError: There is no such parameter.
        """
        at, memory = 1 + 2 * self._names.index(name), self._memory
        memory[at + 1] = value
        memory[at] += 1.0
        memory[0] += 1.0  # last: by now the request stands there


class BoardReader:
    """The loop's end."""

    def __init__(self, board: RequestBoard) -> None:
        """Take the memory; begins with what is asked from now on."""
        self._memory, self._names = board._memory, board.names
        self._seen = [float(number) for number in self._memory]

    @property
    def is_new(self) -> bool:
        """Whether anything was asked since `take`."""
        return bool(self._memory[0] != self._seen[0])

    def take(self) -> list[tuple[str, float]]:
        """Return the newest request for each parameter that there is one for."""
        memory, before = list(self._memory), self._seen
        self._seen = memory
        places = range(1, len(memory), 2)
        return [
            (name, memory[at + 1])
            for name, at in zip(self._names, places, strict=True)
            if memory[at] != before[at]
        ]
