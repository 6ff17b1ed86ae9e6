"""What results of runs may offer besides figures, so that runs can be overlaid."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.errors import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ErrorSample:
    """Errors of a run whose spread is worth a picture.

    Attributes:
        title: What they are.
        caption: What one sees and what is good.
        axis: Label of the axis, with unit.
        values: In that unit, any number of them.
    """

    title: str
    caption: str
    axis: str
    values: FloatArray


@runtime_checkable
class WithSetForce(Protocol):
    """A result that knows which normal force was asked for."""

    @property
    def set_force(self) -> FloatArray:
        """In every period, shape (n,) [N]; NaN where none was."""
        ...


@runtime_checkable
class WithErrors(Protocol):
    """A result that knows its errors."""

    def error_samples(self) -> tuple[ErrorSample, ...]:
        """Return them; none where the truth is not known."""
        ...
