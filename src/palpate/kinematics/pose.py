"""Poses and turns in plain floats, for code that runs once per control period.

The functions of rotations are compiled, too, by `njit` in `palpate.kinematics.reference_kernel`: they keep to what
numba understands.
"""

import math
from dataclasses import dataclass

from palpate.errors import rotation_matrix, vector
from palpate.spatial import IDENTITY, ZERO, Matrix, Vector, add, rotate, rotate_back, scale

_SMALL_ANGLE = 1e-4
"""[rad] below which sin(x)/x and (1 - cos(x))/x^2 are taken from their series, exact to x^4/120 < 1e-18."""

_NEAR_HALF_TURN = -0.9
"""Cosine of the angle below which a turn's axis is read from the symmetric part of its matrix."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a frame b is, seen from a frame a: maps coordinates in b to a. Called `pose_a_b`.

    Attributes:
        position: Origin of b in a [m].
        rotation: Columns are the axes of b in a.
    """

    position: Vector = ZERO
    rotation: Matrix = IDENTITY

    def __matmul__(self, other: "Pose") -> "Pose":
        """Return pose_a_c from pose_a_b and pose_b_c."""
        return Pose(
            add(self.position, rotate(self.rotation, other.position)), times(self.rotation, other.rotation)
        )

    def inverse(self) -> "Pose":
        """Return pose_b_a."""
        return Pose(scale(-1.0, rotate_back(self.rotation, self.position)), transposed(self.rotation))


def checked_pose(name: str, pose: Pose) -> Pose:
    """Return the pose if its position is finite and its rotation one.

    Raises:
        InvalidValueError: Otherwise.
    """
    vector(f"{name}.position", pose.position, 3, "m")
    rotation_matrix(f"{name}.rotation", pose.rotation)
    return pose


def times(a: Matrix, b: Matrix) -> Matrix:
    """Return the product a b."""
    (b00, b01, b02), (b10, b11, b12), (b20, b21, b22) = b
    (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = a
    return (
        (x0 * b00 + y0 * b10 + z0 * b20, x0 * b01 + y0 * b11 + z0 * b21, x0 * b02 + y0 * b12 + z0 * b22),
        (x1 * b00 + y1 * b10 + z1 * b20, x1 * b01 + y1 * b11 + z1 * b21, x1 * b02 + y1 * b12 + z1 * b22),
        (x2 * b00 + y2 * b10 + z2 * b20, x2 * b01 + y2 * b11 + z2 * b21, x2 * b02 + y2 * b12 + z2 * b22),
    )


def transposed(a: Matrix) -> Matrix:
    """Return the transpose: the inverse, for rotations."""
    return ((a[0][0], a[1][0], a[2][0]), (a[0][1], a[1][1], a[2][1]), (a[0][2], a[1][2], a[2][2]))


def rotation_from_rotvec(rotvec: Vector) -> Matrix:
    """Return the turn about the direction of `rotvec` by its length [rad] (Rodrigues)."""
    x, y, z = rotvec
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < _SMALL_ANGLE:
        s, c = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        # 1 - cos(x) = 2 sin(x/2)^2 does not cancel
        s, c = math.sin(angle) / angle, 0.5 * (math.sin(0.5 * angle) / (0.5 * angle)) ** 2
    return (
        (1.0 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y),
        (c * x * y + s * z, 1.0 - c * (x * x + z * z), c * y * z - s * x),
        (c * x * z - s * y, c * y * z + s * x, 1.0 - c * (x * x + y * y)),
    )


def rotvec_from_rotation(rotation: Matrix) -> Vector:
    """Return axis times angle [rad] of a rotation, the angle in [0, pi]; inverse of `rotation_from_rotvec`."""
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = rotation
    # twice the sine times the axis
    x, y, z = r21 - r12, r02 - r20, r10 - r01
    sine, cosine = 0.5 * math.sqrt(x * x + y * y + z * z), 0.5 * (r00 + r11 + r22 - 1.0)
    angle = math.atan2(sine, cosine)
    if cosine > _NEAR_HALF_TURN:
        factor = 0.5 if sine < _SMALL_ANGLE else 0.5 * angle / sine
        return (factor * x, factor * y, factor * z)
    # near half a turn the sine is small: (R + R')/2 - cos I = (1 - cos) axis axis', whose largest column is safe
    columns = (
        (r00 - cosine, 0.5 * (r01 + r10), 0.5 * (r02 + r20)),
        (0.5 * (r01 + r10), r11 - cosine, 0.5 * (r12 + r21)),
        (0.5 * (r02 + r20), 0.5 * (r12 + r21), r22 - cosine),
    )
    largest, (a, b, c) = 0.0, columns[0]
    for u, v, w in columns:
        square = u * u + v * v + w * w
        if square > largest:
            largest, a, b, c = square, u, v, w
    factor = angle / math.sqrt(largest)
    if a * x + b * y + c * z < 0.0:
        factor = -factor
    return (factor * a, factor * b, factor * c)


def orthonormal(rotation: Matrix) -> Matrix:
    """Return a rotation that has gathered rounding, made orthonormal again.

    One Newton step R (3 I - R'R) / 2 towards the nearest rotation (Higham 1986): squares the defect.
    """
    return times(rotation, newton_factor(times(transposed(rotation), rotation)))


def newton_factor(square: Matrix) -> Matrix:
    """Return (3 I - R'R) / 2 of R'R."""
    (a, b, c), (d, e, f), (g, h, i) = square
    return (
        (1.5 - 0.5 * a, -0.5 * b, -0.5 * c),
        (-0.5 * d, 1.5 - 0.5 * e, -0.5 * f),
        (-0.5 * g, -0.5 * h, 1.5 - 0.5 * i),
    )
