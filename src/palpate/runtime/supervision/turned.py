"""Rotation of a vector, compiled."""

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.spatial import Vector


@njit(error_model="numpy")
def turned_by(r: FloatArray, x: float, y: float, z: float) -> Vector:
    """Return a vector in base coordinates, by the nine numbers of a rotation, row by row."""
    return (
        r[0] * x + r[1] * y + r[2] * z,
        r[3] * x + r[4] * y + r[5] * z,
        r[6] * x + r[7] * y + r[8] * z,
    )
