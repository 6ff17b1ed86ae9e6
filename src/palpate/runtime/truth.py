"""What really happens, as a simulation knows it and no sensor does: rows of numbers that a log keeps beside a run.

Controllers never see it. A back end that knows it is a `TruthSource`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.protocols import Backend
from palpate.runtime.wrapped_backend import unwrapped


@runtime_checkable
class TruthSource(Protocol):
    """Knows what really happened at the last sample."""

    @property
    def truth_columns(self) -> tuple[str, ...]:
        """Names of the numbers of a row, each with its unit at its end; the same in the whole run."""
        ...

    def truth_row(self) -> Sequence[float]:
        """Return the row that belongs to the last sample."""
        ...


def truth_source(backend: Backend) -> TruthSource | None:
    """Return what tells the truth of a back end; None on a robot, where nobody knows it."""
    inner = unwrapped(backend)
    return inner if isinstance(inner, TruthSource) else None


@dataclass(frozen=True, slots=True, eq=False)
class TruthTable:
    """The truth of a run, one row per period.

    Attributes:
        columns: Names of the numbers; none on a robot.
        rows: Shape (n, len(columns)).
    """

    columns: tuple[str, ...]
    rows: FloatArray

    @property
    def known(self) -> bool:
        """Whether there is any."""
        return bool(self.columns)

    def column(self, *names: str) -> FloatArray:
        """Return columns side by side, shape (n, len(names)).

        Raises:
            InvalidValueError: There is no such column.
        """
        for name in names:
            if name not in self.columns:
                raise InvalidValueError(f"truth: there is no column {name}; there are {', '.join(self.columns)}")
        return self.rows[:, [self.columns.index(name) for name in names]]
