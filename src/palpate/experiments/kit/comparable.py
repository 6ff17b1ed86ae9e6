"""Optional data of results besides metrics, for figures of several runs."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.errors import FloatArray
from palpate.mapping import SurfaceMap, SurfaceMesh


@dataclass(frozen=True, slots=True, eq=False)
class ErrorSample:
    """Errors of a run whose spread is worth a figure.

    Attributes:
        title: Title of the figure.
        caption: Caption: what the figure shows, and what is good.
        quantity: Name of the axis.
        unit: Unit of the axis.
        values: Errors in that unit, shape (n,).
    """

    title: str
    caption: str
    quantity: str
    unit: str
    values: FloatArray


@runtime_checkable
class WithSetForce(Protocol):
    """A result with the set normal force."""

    @property
    def set_force(self) -> FloatArray:
        """Set normal force in every period, shape (n,) [N]; NaN where there is none."""
        ...


@runtime_checkable
class WithErrors(Protocol):
    """A result with errors."""

    def error_samples(self) -> tuple[ErrorSample, ...]:
        """Return the errors; none where the truth is unknown."""
        ...


class FeltMap(Protocol):
    """The map of a surface."""

    @property
    def surface(self) -> SurfaceMap:
        """Estimated surface, to be queried at any point."""
        ...

    @property
    def mesh(self) -> SurfaceMesh:
        """Estimated surface as triangles."""
        ...


@runtime_checkable
class WithMap(Protocol):
    """A result that may have a map."""

    @property
    def claimed_map(self) -> FeltMap | None:
        """Map, if it claims any surface."""
        ...
