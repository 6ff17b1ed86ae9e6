"""What a growing surface is made from and what a view gets of it; both pass between processes."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, check_not_negative, check_positive
from palpate.mapping import Knowledge
from palpate.mapping.mesh_metrics import MeshMetrics


@dataclass(frozen=True, slots=True)
class SurfaceView:
    """How to make a surface from what a finger feels.

    Attributes:
        rows: Distance of the rows that it is felt in [m]; see `MapSettings.for_rows`.
        voxel: Edge of the finest grid [m]; coarser where the surface is large.
        half_compliance: Of tip and object together, half their compression per force [m/N]: a contact's centroid
            lies so deep inside the object.
        sensed_force: For which the sensed tip is compressed already [N].
        bias: Largest constant offset of contacts that calibration leaves [m].
        worst: What is coloured; what is known worse is the rim.
    """

    rows: float
    voxel: float = 5e-4
    half_compliance: float = 0.0
    sensed_force: float = 0.0
    bias: float = 0.0
    worst: Knowledge = Knowledge.OBSERVED

    def __post_init__(self) -> None:
        check_positive(self, rows="m", voxel="m")
        check_not_negative(self, half_compliance="m/N", sensed_force="N", bias="m")


@dataclass(frozen=True, slots=True, eq=False)
class GrownSurface:
    """The surface as far as it was felt.

    Attributes:
        vertices: Base frame, shape (n, 3) [m].
        normals: Outward unit normals there, shape (n, 3).
        observed: Triangles over what was felt, shape (m, 3).
        rim: Triangles beyond its edge, drawn on but not claimed, shape (r, 3).
        edge: Where the one ends: both vertices of each side, shape (k, 2).
        sd: Standard deviation of each vertex along its normal, shape (n,) [m].
        friction: Tangential over normal force at each vertex, shape (n,); NaN where none slid near by.
        metrics: Of the observed part.
        contacts: That it was made from.
    """

    vertices: FloatArray
    normals: FloatArray
    observed: npt.NDArray[np.int64]
    rim: npt.NDArray[np.int64]
    edge: npt.NDArray[np.int64]
    sd: FloatArray
    friction: FloatArray
    metrics: MeshMetrics
    contacts: int
