"""Unit quaternions in plain floats, for what turns in every time step: MuJoCo's order, w first."""

import math

from palpate.spatial import Vector

Quaternion = tuple[float, float, float, float]
"""(w, x, y, z); maps coordinates of the turned frame to those of the frame that it is seen from."""

UNTURNED: Quaternion = (1.0, 0.0, 0.0, 0.0)

_SMALL_ANGLE = 1e-4
"""[rad] below which sin(x/2)/x is taken from its series, exact to x^4/3840 < 1e-19."""


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return a b: the turn b, then the turn a, both about axes that stand still."""
    w, x, y, z = a
    p, q, r, s = b
    return (
        w * p - x * q - y * r - z * s,
        w * q + x * p + y * s - z * r,
        w * r - x * s + y * p + z * q,
        w * s + x * r - y * q + z * p,
    )


def turn_by(rotvec: Vector) -> Quaternion:
    """Return the turn about the direction of `rotvec` by its length [rad]."""
    x, y, z = rotvec
    angle = math.sqrt(x * x + y * y + z * z)
    factor = 0.5 - angle * angle / 48.0 if angle < _SMALL_ANGLE else math.sin(0.5 * angle) / angle
    return (math.cos(0.5 * angle), factor * x, factor * y, factor * z)


def turn_between(start: Quaternion, end: Quaternion) -> Vector:
    """Return axis times angle [rad], at most half a turn, of the turn from `start` to `end`; the same for -q."""
    w, x, y, z = start
    w, x, y, z = product(end, (w, -x, -y, -z))
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return (0.0, 0.0, 0.0)
    factor = 2.0 * math.atan2(math.copysign(sine, w), abs(w)) / sine
    return (factor * x, factor * y, factor * z)


def normalised(a: Quaternion) -> Quaternion:
    """Return a / |a|: rounding of many products taken out."""
    w, x, y, z = a
    factor = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return (factor * w, factor * x, factor * y, factor * z)
