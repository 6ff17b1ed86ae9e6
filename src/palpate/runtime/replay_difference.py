"""Where a replay differs from what was recorded, bit for bit."""

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.log import Log
from palpate.runtime.log.fields import LogField, LogGroup, path_of, walk
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.replay import Replay

_NOT_SENSED = ("time", "reading", "acceleration")
"""What a finger's row says that comes from the device."""


@dataclass(frozen=True, slots=True)
class FirstDifference:
    """Where two runs part.

    Attributes:
        row: Number of the period.
        time: Of the recorded sample [s].
        name: Of the quantity ("command.velocity.x"); empty if the replay had ended.
        recorded: Its value with unit, every digit of it.
        replayed: Likewise.
    """

    row: int
    time: float
    name: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        """One line for a person."""
        where = f"t = {self.time:.3f} s (period {self.row})"
        if not self.name:
            return f"{where}: the replay had ended"
        return f"{where}: {self.name} was {self.recorded}, replayed {self.replayed}"


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """How two runs differ.

    Attributes:
        same: Whether all 64 bits of every number of a recorded period came out again, shape (n,); false where the
            replay had ended.
        first: Where they part; None if they do not.
    """

    same: npt.NDArray[np.bool_]
    first: FirstDifference | None

    @property
    def count(self) -> int:
        """Recorded periods."""
        return len(self.same)

    @property
    def identical(self) -> int:
        """How many of them came out the same."""
        return int(np.count_nonzero(self.same))


def difference_of_commands(log: Log, count: int, replay: Replay, replayed: int) -> Difference:
    """Return how the commands of the first `count` rows of a log differ from the first `replayed` of a replay.

    Raises:
        InvalidValueError: They are of different robots.
    """
    return _difference(log, count, replay, replayed, lambda group, quantity: group.name == "command")


def difference_of_sensing(log: Log, count: int, replay: Replay, replayed: int) -> Difference:
    """Return likewise how what was sensed differs: wrenches, contacts, touches, health."""

    def is_sensed(group: LogGroup, quantity: LogField) -> bool:
        return group.name.startswith("finger_") and quantity.name not in _NOT_SENSED

    return _difference(log, count, replay, replayed, is_sensed)


def rows_as_numbered_by(codec: PeriodCodec, log: Log) -> FloatArray:
    """Return the rows of a log with phases, statuses and measures numbered as a codec does, shape (n, width).

    Raises:
        InvalidValueError: The codec is for another layout.
    """
    if log.layout != codec.heading.layout:
        raise InvalidValueError(f"the log's rows have {log.layout}, the replay's {codec.heading.layout}")
    if log.heading.codes == codec.heading.codes:
        return log.rows
    rows = log.rows.copy()
    for (group, old), (_, new) in zip(walk(log.codec.groups), walk(codec.groups), strict=True):
        if old.codes:
            column = codec.columns[path_of(group, new)].start
            numbers = np.array([new.codes.index(name) for name in old.codes], dtype=np.float64)
            rows[:, column] = numbers[rows[:, column].astype(np.intp)]
    return rows


def _difference(
    log: Log, count: int, replay: Replay, replayed: int, chosen: Callable[[LogGroup, LogField], bool]
) -> Difference:
    codec, common = replay.codec, min(count, replayed)
    before, after = rows_as_numbered_by(codec, log)[:common], replay.rows[:common]
    quantities = [(path_of(group, one), one) for group, one in walk(codec.groups) if chosen(group, one)]
    same = np.zeros(count, dtype=np.bool_)
    same[:common] = True
    for path, _ in quantities:
        at = codec.columns[path]
        same[:common] &= (_bits(before[:, at]) == _bits(after[:, at])).all(axis=1)
    if same.all():
        return Difference(same, None)
    row = int(same.argmin())
    time = float(log.rows[row, 0])
    if row >= common:
        return Difference(same, FirstDifference(row, time, "", "", ""))
    for path, quantity in quantities:
        at = codec.columns[path]
        for i, (old, new) in enumerate(zip(before[row, at].tolist(), after[row, at].tolist(), strict=True)):
            if struct.pack("<d", old) != struct.pack("<d", new):
                name = ".".join(part for part in (path, quantity.components[i]) if part)
                shown = (_shown(value, quantity, quantity.units[i]) for value in (old, new))
                return Difference(same, FirstDifference(row, time, name, *shown))
    raise AssertionError(f"row {row} differs and does not")


def _bits(values: FloatArray) -> npt.NDArray[np.uint64]:
    return np.ascontiguousarray(values).view(np.uint64)


def _shown(value: float, quantity: LogField, unit: str) -> str:
    if quantity.codes:
        return quantity.codes[int(value)].lower().replace("_", " ")
    if quantity.ros_type in ("bool", "int8"):
        return str(int(value))
    number = f"NaN ({struct.pack('>d', value).hex()})" if math.isnan(value) else repr(value)
    return f"{number} {unit}".rstrip()
