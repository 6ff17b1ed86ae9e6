"""How the plan gets from the loop to the view's process: bytes in shared memory, the newest alone.

The loop writes when the plan changes, between legs, and never waits. Number of the writing and checksum stand
before the bytes: a reader that comes while they are written sees that they do not fit, and comes again.
"""

import pickle
import struct
import zlib
from multiprocessing.context import BaseContext
from typing import Any

from palpate.runtime.shown_plan import ShownPlan

CAPACITY = 1 << 17
"""Bytes: twice what the longest plan takes that `ShownPlan.bounded` lets through."""

_HEAD = struct.Struct("<QQL")
"""Number of the writing, bytes, checksum."""


class PlanBoard:
    """Shared memory for one plan; it can be handed to a process that is being started."""

    def __init__(self, context: BaseContext) -> None:
        """Take the memory."""
        # without a lock: nobody waits
        self._memory: Any = context.RawArray("B", CAPACITY)


class PlanWriter:
    """The loop's end; there may be one."""

    def __init__(self, board: PlanBoard) -> None:
        """Take the memory."""
        self._memory, self._view, self._count = board, memoryview(board._memory).cast("B"), 0

    def write(self, plan: ShownPlan) -> None:
        """Put up a plan in the place of the last one; one that does not fit is shown without its path."""
        data = pickle.dumps(plan.bounded())
        if _HEAD.size + len(data) > CAPACITY:
            data = pickle.dumps(ShownPlan(plan.leg, (), plan.axis))
        self._count += 1
        end = _HEAD.size + len(data)
        _HEAD.pack_into(self._view, 0, self._count, len(data), zlib.crc32(data))
        self._view[_HEAD.size : end] = data


class PlanReader:
    """The view's end."""

    def __init__(self, board: PlanBoard) -> None:
        """Take the memory."""
        self._memory, self._view, self._seen = board, memoryview(board._memory).cast("B"), 0

    def news(self) -> ShownPlan | None:
        """Return the plan if it is one that was not seen yet, and whole."""
        count, size, checksum = _HEAD.unpack_from(self._view)
        if count == self._seen or not 0 < size <= CAPACITY - _HEAD.size:
            return None
        data = bytes(self._view[_HEAD.size : _HEAD.size + size])
        if zlib.crc32(data) != checksum:
            return None  # it is just being written
        self._seen = count
        plan: ShownPlan = pickle.loads(data)  # from our own process
        return plan
