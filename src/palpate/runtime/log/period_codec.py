"""Periods as rows of float64 and as messages of a log, a block at a time, by numpy alone.

The writer's thread must not hold the interpreter for long: a loop that wakes up meanwhile has to wait for it. A
block of 200 periods costs about a dozen calls.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.runtime.log.fields import Constant, LogField, path_of, period_groups, walk, wire
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.message_layout import MessageLayout, Messages, Stamps, put_heads, put_stamps


@dataclass(frozen=True, slots=True)
class _Run:
    """Neighbours of one type, in rows and messages alike: copied at once."""

    name: str
    column: int
    count: int


class PeriodCodec:
    """Turns rows into messages and back, for one layout.

    Attributes:
        heading: Of the run.
        groups: All quantities, in order.
        columns: Where each quantity ("arm.position") stands in a row.
        width: Columns of a row.
        dtype: Of one whole message record.
        template: One with all that is the same in every one, shape (1,).
    """

    def __init__(self, heading: Heading, channel: int) -> None:
        """Prepare for the messages of one MCAP channel."""
        self.heading = heading
        self.groups = period_groups(heading.layout, heading.codes)
        self.columns: dict[str, slice] = {}
        self.width = 0
        for group, quantity in walk(self.groups):
            self.columns[path_of(group, quantity)] = slice(self.width, self.width + quantity.count)
            self.width += quantity.count
        self._runs, self.template = self._wire_format(channel)
        self.dtype = self.template.dtype

    @property
    def row_bytes(self) -> int:
        """Size of a row."""
        return 8 * self.width

    def rows(self, data: bytes | memoryview) -> FloatArray:
        """Return packed rows as an array, shape (n, width), without a copy."""
        return np.frombuffer(data, np.float64).reshape(-1, self.width)

    def encode(self, rows: FloatArray, sequence: npt.NDArray[np.int64]) -> Messages:
        """Return the messages of rows, shape (n,).

        Args:
            rows: Shape (n, width).
            sequence: Number of each period, shape (n,).
        """
        messages: Messages = np.repeat(self.template, len(rows))
        self.fill(messages, rows, sequence, self.heading.stamps(rows[:, 0]))
        return messages

    def fill(self, messages: Messages, rows: FloatArray, sequence: npt.NDArray[np.int64], stamps: Stamps) -> None:
        """Fill in messages made from `template`.

        Args:
            messages: Shape (n,).
            rows: Shape (n, width).
            sequence: Number of each period, shape (n,).
            stamps: Of each period, shape (n,) [ns].
        """
        put_heads(messages, sequence, stamps)
        put_stamps(messages, stamps)
        for run in self._runs:
            messages[run.name] = rows[:, run.column : run.column + run.count]

    def decode(self, messages: Messages) -> FloatArray:
        """Return the rows of messages, shape (n, width)."""
        rows = np.empty((len(messages), self.width))
        for run in self._runs:
            rows[:, run.column : run.column + run.count] = messages[run.name]
        return rows

    def is_plausible(self, rows: FloatArray) -> bool:
        """Whether every code in the rows has a name, and every count of forces and velocities has its room."""
        layout = self.heading.layout
        rooms = (
            ("command.grip_count", layout.grips),
            ("command.finger_velocity_count", 3 * layout.finger_velocities),
        )
        for name, room in rooms:
            count = rows[:, self.columns[name]] if name in self.columns else rows[:, :0]
            if not ((count >= -1) & (count <= room)).all():
                return False
        return all(
            (rows[:, self.columns[path_of(group, quantity)]] < len(quantity.codes)).all()
            for group, quantity in walk(self.groups)
            if quantity.codes
        )

    def table(self, rows: FloatArray, sequence: npt.NDArray[np.int64]) -> Messages:
        """Return rows as a structured array with one nested field per group, as the schema has it."""
        dtype: list[Any] = [("sequence", "<i8")]
        for group in self.groups:
            fields = [_column_type(quantity) for quantity in group.fields]
            dtype += [(group.name, fields)] if group.name else fields
        table: Messages = np.empty(len(rows), dtype)
        table["sequence"] = sequence
        for group, quantity in walk(self.groups):
            place = table[group.name] if group.name else table
            values = rows[:, self.columns[path_of(group, quantity)]]
            place[quantity.name] = values if place[quantity.name].ndim > 1 else values[:, 0]
        return table

    def _wire_format(self, channel: int) -> tuple[tuple[_Run, ...], Messages]:
        """Lay the message out."""
        layout = MessageLayout(channel)
        layout.stamp()
        runs: list[_Run] = []
        column, last = 0, ""

        def close() -> None:
            if last:
                layout.add(runs[-1].name, last, runs[-1].count)

        for part in wire(self.groups):
            if isinstance(part, Constant):
                close()
                layout.constant(part.dtype, part.value)
                last = ""
                continue
            if part.dtype == last:
                runs[-1] = replace(runs[-1], count=runs[-1].count + part.count)
            else:
                close()
                runs.append(_Run(f"run_{len(runs)}", column, part.count))
            column, last = column + part.count, part.dtype
        close()
        return tuple(runs), layout.template()


def _column_type(quantity: LogField) -> tuple[Any, ...]:
    dtype = "?" if quantity.ros_type == "bool" else quantity.dtype
    return (quantity.name, dtype, (quantity.count,)) if quantity.is_vector else (quantity.name, dtype)
