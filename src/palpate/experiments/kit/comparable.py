"""What results of runs may offer besides metrics, so that runs can be overlaid."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.errors import FloatArray
from palpate.mapping import SurfaceMap, SurfaceMesh


@dataclass(frozen=True, slots=True, eq=False)
class ErrorSample:
    """Errors of a run whose spread is worth a figure.

    Attributes:
        title: What they are.
        caption: What one sees and what is good.
        quantity: What the axis tells.
        unit: Of it.
        values: In that unit, any number of them.
    """

    title: str
    caption: str
    quantity: str
    unit: str
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


class FeltMap(Protocol):
    """The map of a surface."""

    @property
    def surface(self) -> SurfaceMap:
        """What can be asked where the surface is."""
        ...

    @property
    def mesh(self) -> SurfaceMesh:
        """What is known of it, as triangles."""
        ...


@runtime_checkable
class WithMap(Protocol):
    """A result that may have a map."""

    @property
    def claimed_map(self) -> FeltMap | None:
        """It, if it claims anything."""
        ...
