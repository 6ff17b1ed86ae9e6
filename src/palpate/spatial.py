"""Small vectors and frames for code that runs once per control period.

Plain tuples of floats: immutable, comparable bit for bit, and several times faster at this size than arrays
(`np.cross` of two 3-vectors costs about 20 us, `cross` below about 0.3 us). Batches use numpy instead. Kernels
compile some of them, too, by `njit`.
"""

import math

from palpate.errors import FloatArray

Vector = tuple[float, float, float]
"""A 3-vector; unit and frame are documented where it is used."""

Wrench = tuple[float, float, float, float, float, float]
"""(f, m): force [N], then moment [N m] about the origin of the frame it is expressed in."""

Matrix = tuple[Vector, Vector, Vector]
"""A 3x3 matrix as rows. Rotations `rotation_a_b` map coordinates in frame b to frame a."""

ZERO: Vector = (0.0, 0.0, 0.0)
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def as_vector(array: FloatArray) -> Vector:
    """Return an array of shape (3,) as a vector."""
    x, y, z = array.tolist()
    return (x, y, z)


def add(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(factor: float, a: Vector) -> Vector:
    """Return factor * a."""
    return (factor * a[0], factor * a[1], factor * a[2])


def add_scaled(a: Vector, factor: float, b: Vector) -> Vector:
    """Return a + factor * b."""
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


def dot(a: Vector, b: Vector) -> float:
    """Return the inner product of a and b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Vector) -> float:
    """Return the Euclidean length of a, without overflow."""
    return math.hypot(a[0], a[1], a[2])


def toward(a: Vector, b: Vector, most: float) -> Vector:
    """Return b, or the point at distance `most` from a towards b, if b lies farther."""
    distance = math.dist(a, b)
    return b if distance <= most else add_scaled(a, most / distance, subtract(b, a))


def unit(a: Vector) -> Vector:
    """Return a / |a|.

    Raises:
        ZeroDivisionError: a is zero and has no direction.
    """
    return scale(1.0 / norm(a), a)


def rotate(rotation: Matrix, a: Vector) -> Vector:
    """Return rotation @ a."""
    return (dot(rotation[0], a), dot(rotation[1], a), dot(rotation[2], a))


def rotate_back(rotation: Matrix, a: Vector) -> Vector:
    """Return rotation.T @ a."""
    x, y, z = rotation
    return (
        x[0] * a[0] + y[0] * a[1] + z[0] * a[2],
        x[1] * a[0] + y[1] * a[1] + z[1] * a[2],
        x[2] * a[0] + y[2] * a[1] + z[2] * a[2],
    )


def limit_norm(a: Vector, longest: float) -> Vector:
    """Return a, shortened to length `longest` if it is longer."""
    length = norm(a)
    return a if length <= longest else scale(longest / length, a)
