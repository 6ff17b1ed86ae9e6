"""Periods as rows of float64 and as messages of a log, a block at a time, by numpy alone.

The writer's thread must not hold the interpreter for long: a loop that wakes up meanwhile has to wait for it. A
block of 200 periods costs about a dozen calls.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.runtime.log.fields import LogField, path_of, period_groups, walk
from palpate.runtime.log.heading import Heading

MESSAGE = 5
"""Opcode of an MCAP message record."""

CDR_LITTLE_ENDIAN = bytes((0, 1, 0, 0))
"""Encapsulation header: plain CDR, little endian (DDS-XTypes 1.2, section 7.6.3.1.2)."""

MESSAGE_HEADER = (
    ("opcode", "u1"),
    ("length", "<u8"),
    ("channel", "<u2"),
    ("sequence", "<u4"),
    ("log_time", "<u8"),
    ("publish_time", "<u8"),
    ("encapsulation", "u1", (4,)),
    ("sec", "<i4"),
    ("nanosec", "<u4"),
)
"""An MCAP message record up to the first quantity; every message of a log begins with its stamp."""

Messages = npt.NDArray[np.void]
SEQUENCES = 2**32
"""Sequence numbers are counted modulo this: 32 bits last for 49 days at 1 kHz."""


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
        self._runs, self.dtype = self._wire_format()
        template: Messages = np.zeros(1, self.dtype)
        template["opcode"] = MESSAGE
        template["length"] = self.dtype.itemsize - 9  # without opcode and length
        template["channel"] = channel
        template["encapsulation"] = tuple(CDR_LITTLE_ENDIAN)
        self._template = template

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
        messages: Messages = np.repeat(self._template, len(rows))
        stamp = self.heading.stamps(rows[:, 0])
        messages["sequence"] = sequence % SEQUENCES
        messages["log_time"] = messages["publish_time"] = stamp
        messages["sec"], messages["nanosec"] = np.divmod(stamp, 10**9)
        for run in self._runs:
            messages[run.name] = rows[:, run.column : run.column + run.count]
        return messages

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

    def _wire_format(self) -> tuple[tuple[_Run, ...], np.dtype[np.void]]:
        """Lay the message out as CDR: each number at a multiple of its size, counted from the stamp."""
        header = np.dtype(list(MESSAGE_HEADER))
        origin = header.itemsize - 8
        fields = dict(header.fields or {})
        names: list[str] = list(fields)
        formats, offsets = [x[0] for x in fields.values()], [x[1] for x in fields.values()]
        runs: list[_Run] = []
        place, column, last = header.itemsize, 0, ""
        for _, quantity in walk(self.groups):
            size = np.dtype(quantity.dtype).itemsize
            start = place + -(place - origin) % size
            if start == place and quantity.dtype == last:
                runs[-1] = _Run(runs[-1].name, runs[-1].column, runs[-1].count + quantity.count)
                formats[-1] = np.dtype((last, (runs[-1].count,)))
            else:
                runs.append(_Run(f"run_{len(runs)}", column, quantity.count))
                names.append(runs[-1].name)
                formats.append(np.dtype((quantity.dtype, (quantity.count,))))
                offsets.append(start)
            place, column, last = start + size * quantity.count, column + quantity.count, quantity.dtype
        return tuple(runs), np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": place})


def _column_type(quantity: LogField) -> tuple[Any, ...]:
    dtype = "?" if quantity.ros_type == "bool" else quantity.dtype
    return (quantity.name, dtype, (quantity.count,)) if quantity.is_vector else (quantity.name, dtype)
