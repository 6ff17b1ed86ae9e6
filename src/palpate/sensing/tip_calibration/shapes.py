"""Families of convex fingertips by their support functions.

h(u) = max over the tip of u.x is how far off a plate lies that touches the tip where its outward normal is u, and
x(u) = grad h(u) is the place of that touch. Touching a point, a line or a plane is one formula with h
(`palpate.sensing.tip_calibration.contact`), and a field of small deviations is simply added to it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.solver import Surface
from palpate.surfaces import Capsule, CompliantTip, Ellipsoid, NearSphere, Sphere, Superellipsoid

Support = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""(sizes (n, k), unit normals (n, 3)) -> h (n,) [m] and x (n, 3) [m], in the tip's own axes: n tips at once."""

Made = Callable[[FloatArray, FloatArray, FloatArray], Surface]
"""(sizes, center (3,), rotation (3, 3)) -> the surface."""

Deviated = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], Surface]
"""(sizes, deviations (k,), center (3,), rotation (3, 3)) -> the surface."""

KINK = 1e-4
"""Width, in u_z, over which the end of a capsule's cylinder is rounded: its wall bulges by KINK ln 2 of its
length."""


@dataclass(frozen=True, slots=True)
class TipShape:
    """A family of fingertips, and where in it the typed one stands.

    Attributes:
        kind: As robot files name it.
        names: Of its sizes, with units: `radius_m`.
        sizes: Typed values.
        size_sd: How wrong they may be, one each, relative to them.
        support: Its support function.
        made: Makes the surface.
        deviated: Makes the surface with deviations (k,) [m] as second argument; None where none is known.
        round_about: Axes of its own about which turning it changes nothing, 3 for a sphere.
    """

    kind: str
    names: tuple[str, ...]
    sizes: tuple[float, ...]
    size_sd: tuple[float, ...]
    support: Support
    made: Made
    deviated: Deviated | None = None
    round_about: tuple[int, ...] = ()


@singledispatch
def tip_shape(surface: Surface) -> TipShape:
    """Return the family of a fingertip; strangers register theirs: `tip_shape.register`.

    Raises:
        InvalidValueError: It has none.
    """
    known = ", ".join(sorted(kind.__name__ for kind in tip_shape.registry if kind is not object))
    raise InvalidValueError(
        f"surface is a {type(surface).__name__}: touches calibrate {known}; register its support function with "
        "palpate.sensing.tip_calibration.tip_shape"
    )


@tip_shape.register
def _(surface: Sphere) -> TipShape:
    return sphere_shape(surface.radius)


@tip_shape.register
def _(surface: NearSphere) -> TipShape:
    return sphere_shape(surface.radius)


@tip_shape.register
def _(surface: Ellipsoid) -> TipShape:
    return ellipsoid_shape(tuple(surface.half_lengths))


@tip_shape.register
def _(surface: Superellipsoid) -> TipShape:
    return superellipsoid_shape(tuple(surface.semi_axes), surface.exponent)


@tip_shape.register
def _(surface: Capsule) -> TipShape:
    sphere = surface.patches[0].surface
    row = surface.patches[1].half_spaces[1]
    return capsule_shape(float(sphere.half_lengths[0]), float(row[3] - row[:3] @ sphere.center))


@tip_shape.register
def _(surface: CompliantTip) -> TipShape:
    return tip_shape(surface.surface)


SIZE_SD = 0.1
"""How wrong a typed size may be, relative: a standard deviation, wide enough not to matter where touches tell."""


def sphere_shape(radius: float) -> TipShape:
    """Return the spheres."""

    def support(sizes: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        return sizes[:, 0], sizes[:, :1] * u

    def made(sizes: FloatArray, center: FloatArray, rotation: FloatArray) -> Surface:
        return Sphere(float(sizes[0]), center=center, rotation=rotation)

    def deviated(sizes: FloatArray, deviations: FloatArray, center: FloatArray, rotation: FloatArray) -> Surface:
        return NearSphere(float(sizes[0]), deviations.tolist(), center=center, rotation=rotation)

    return TipShape("sphere", ("radius_m",), (radius,), (SIZE_SD,), support, made, deviated, (0, 1, 2))


def ellipsoid_shape(semi_axes: Sequence[float]) -> TipShape:
    """Return the ellipsoids."""

    def support(sizes: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        h = np.linalg.norm(sizes * u, axis=1)
        return h, sizes**2 * u / h[:, None]

    def made(sizes: FloatArray, center: FloatArray, rotation: FloatArray) -> Surface:
        a, b, c = sizes.tolist()
        return Ellipsoid((a, b, c), center=center, rotation=rotation)

    a, b, c = semi_axes
    names = ("semi_axis_x_m", "semi_axis_y_m", "semi_axis_z_m")
    return TipShape("ellipsoid", names, (a, b, c), (SIZE_SD,) * 3, support, made, None, _equal_pairs((a, b, c)))


def superellipsoid_shape(semi_axes: Sequence[float], exponent: float) -> TipShape:
    """Return the superellipsoids: h is the norm dual to that of the surface, with q = p/(p - 1)."""

    def support(sizes: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        axes, q = sizes[:, :3], sizes[:, 3:] / (sizes[:, 3:] - 1.0)
        w = np.abs(axes * u)
        largest = w.max(axis=1, keepdims=True)
        h = largest * ((w / largest) ** q).sum(axis=1, keepdims=True) ** (1.0 / q)
        return h[:, 0], axes * np.sign(u) * (w / h) ** (q - 1.0)

    def made(sizes: FloatArray, center: FloatArray, rotation: FloatArray) -> Surface:
        a, b, c, p = sizes.tolist()
        return Superellipsoid((a, b, c), max(p, 2.0), center=center, rotation=rotation)

    a, b, c = semi_axes
    names = ("semi_axis_x_m", "semi_axis_y_m", "semi_axis_z_m", "exponent")
    return TipShape("superellipsoid", names, (a, b, c, exponent), (SIZE_SD,) * 4, support, made)


def capsule_shape(radius: float, length: float) -> TipShape:
    """Return the thimbles: a hemisphere about the center on a cylinder down to z = -length."""

    def support(sizes: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        r, length = sizes.T
        below = -u[:, 2] / KINK
        share = 1.0 / (1.0 + np.exp(-np.clip(below, -700.0, 700.0)))
        # log(1 + e^b), without overflow; homogeneous of degree 1 by the last term of x
        soft = KINK * np.logaddexp(0.0, below)
        x = r[:, None] * u
        x[:, 2] -= length * share
        x += (length * (soft + u[:, 2] * share))[:, None] * u
        return r + length * soft, x

    def made(sizes: FloatArray, center: FloatArray, rotation: FloatArray) -> Surface:
        r, length = sizes.tolist()
        return Capsule(r, length, center, rotation)

    return TipShape(
        "capsule", ("radius_m", "length_m"), (radius, length), (SIZE_SD,) * 2, support, made, None, (2,)
    )


def _equal_pairs(axes: tuple[float, float, float]) -> tuple[int, ...]:
    """Axes of an ellipsoid about which turning it hardly changes it: the two others are equal."""
    return tuple(i for i in range(3) if abs(axes[(i + 1) % 3] - axes[(i + 2) % 3]) < 1e-3 * max(axes))
