"""What a report says of a map: the mesh, what is known of its errors, and which shape it is."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.mapping import SurfaceMesh
from palpate.mapping.layers import VertexLayer


@dataclass(frozen=True, slots=True, eq=False)
class MapReport:
    """The map of an exploration, for pictures and a table.

    Attributes:
        mesh: The observed surface, n vertices.
        rows: Of a table: name, value, unit, note.
        error: Signed distance of each vertex to the true surface, shape (n,) [m], if known.
        missed: Points that could have been felt and are not observed, shape (k, 3) [m]; none if nobody knows.
        layers: What else was felt, at the vertices.

    Raises:
        InvalidValueError: `error` or a layer does not have one value per vertex, or an error is not finite.
    """

    mesh: SurfaceMesh
    rows: tuple[tuple[str, str, str, str], ...]
    error: FloatArray | None
    missed: FloatArray
    layers: tuple[VertexLayer, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.mesh.vertices)
        if self.error is not None and self.error.shape != (count,):
            raise InvalidValueError(f"error has shape {self.error.shape}: must be ({count},), one per vertex")
        if self.error is not None and not np.isfinite(self.error).all():
            raise InvalidValueError("error: must be finite [m]; give None where the truth is not known")
        for layer in self.layers:
            if len(layer) != count:
                raise InvalidValueError(
                    f"layer {layer.name} has {len(layer)} values: must be {count}, one per vertex"
                )


@dataclass(frozen=True, slots=True)
class ShapeReport:
    """Which shape a surface is.

    Attributes:
        sentence: The answer.
        rows: Of the answer's numbers: name, value, unit, note.
        candidates: Each shape: name, how far it misses, unit, verdict.
    """

    sentence: str
    rows: tuple[tuple[str, str, str, str], ...]
    candidates: tuple[tuple[str, str, str, str], ...]
