"""Limit surfaces of round contacts, from how their pressure is distributed, and the power norm nearest to them.

The pressure under a soft fingertip is p(r) ~ (1 - (r/a)^k)^(1/k) within the radius a of the contact (Xydas & Kao
1999): k = 2 is Hertz's, k = infinity uniform. All points slip about one instantaneous centre of rotation, at a
distance d from the middle, and friction opposes each (Goyal, Ruina & Papadopoulos 1991; Howe & Cutkosky 1996).
With a = 1, over mu f_n and mu f_n a, the contact then bears

    f_t(d) = integral of p (d - r cos t) / rho,    tau(d) = integral of p (r^2 - r d cos t) / rho,
    rho^2 = r^2 + d^2 - 2 r d cos t,

of which the integral over the angle t is elliptic. d from 0 (only spin) to infinity (only slide) is the whole
curve.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import beta, ellipe, ellipkm1

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.friction.limit_surface import LimitSurface

MIN_PRESSURE_EXPONENT = 1.0
"""A pressure that falls like a cone; below, it is cusped, like that of no fingertip."""

_CENTRES = 200
"""Centres of rotation along the curve; ten times as many change no p by 2e-5."""


def _nodes() -> tuple[FloatArray, FloatArray]:
    """Nodes and weights on (0, 1) that bunch at both ends.

    There the integrand has a root of the pressure's, or the logarithm of a centre of rotation inside the contact.
    Gauss and Legendre's nodes, 80, under s -> s^3 (10 - 15 s + 6 s^2): errors are below 1e-11.
    """
    nodes, weights = np.polynomial.legendre.leggauss(80)
    s = 0.5 * (nodes + 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2), 15.0 * (s * (1.0 - s)) ** 2 * weights


_NODES, _WEIGHTS = _nodes()
_LARGEST_BELOW_1 = 1.0 - 0.5 * float(np.finfo(np.float64).eps)
_FROM_END = _NODES[::-1]  # 1 - nodes, without cancellation: the nodes are symmetric


@dataclass(frozen=True, slots=True)
class PressureEquivalent:
    """A limit surface that stands for a distribution of pressure.

    Attributes:
        surface: With the exponent p whose largest error is least.
        largest_error: By how much the load ratio of a load on the true surface misses 1, at most.
        error_of_ellipse: The same for p = 2.
    """

    surface: LimitSurface
    largest_error: float
    error_of_ellipse: float


def fitted_limit_surface(
    pressure_exponent: float, contact_radius: float, load_exponent: float, friction: float
) -> PressureEquivalent:
    """Return the limit surface of a round contact whose pressure is known.

    Args:
        pressure_exponent: k, 1 or above: 2 is Hertz's pressure, infinity a uniform one.
        contact_radius: a at a normal force of 1 N [m]; it grows as f_n^load_exponent.
        load_exponent: gamma, 0 to 1/3.
        friction: mu.

    Raises:
        InvalidValueError: A value out of its range.
    """
    spin_length = positive("contact_radius", contact_radius, "m") * spin_radius(pressure_exponent)
    curve = limit_curve(pressure_exponent)

    def error(p: float) -> float:
        return float(np.abs(np.sum(curve**p, axis=1) ** (1.0 / p) - 1.0).max())

    best = minimize_scalar(error, bounds=(1.0, 2.0), method="bounded", options={"xatol": 1e-8})
    p = float(best.x)
    return PressureEquivalent(LimitSurface(friction, spin_length, load_exponent, p), error(p), error(2.0))


def spin_radius(pressure_exponent: float) -> float:
    """Return e / a, the mean distance of the pressure from the middle.

    It is 3 pi / 16 for Hertz's pressure and 2/3 for a uniform one.

    Args:
        pressure_exponent: k, 1 or above, infinity allowed.
    """
    k = _checked(pressure_exponent)
    if k == math.inf:
        return 2.0 / 3.0
    return float(beta(3.0 / k, 1.0 + 1.0 / k) / beta(2.0 / k, 1.0 + 1.0 / k))


def limit_curve(pressure_exponent: float, centres: int = _CENTRES) -> FloatArray:
    """Return what a contact bears from pure spin to pure slide, shape (centres + 2, 2).

    Columns are f_t / (mu f_n) and tau / (mu e f_n).

    Args:
        pressure_exponent: k, 1 or above, infinity allowed.
        centres: How many centres of rotation to take between the two.
    """
    # an even spread of angles between slide and spin of the slip
    angles = np.linspace(0.0, 0.5 * math.pi, centres + 2)[1:-1]
    loads = [load_about_centre(pressure_exponent, math.tan(angle)) for angle in angles]
    return np.vstack([[0.0, 1.0], np.array(loads) / (1.0, spin_radius(pressure_exponent)), [1.0, 0.0]])


def load_about_centre(pressure_exponent: float, distance: float) -> tuple[float, float]:
    """Return f_t / (mu f_n) and tau / (mu f_n a) of a contact that turns about a point.

    Args:
        pressure_exponent: k, 1 or above, infinity allowed.
        distance: Of the centre of rotation from the middle of the contact over its radius, above 0.
    """
    k, d = _checked(pressure_exponent), positive("distance", distance, "")
    if d < 1.0:  # on either side of the centre
        r = np.concatenate([d * _NODES, d + (1.0 - d) * _NODES])
        beyond = np.concatenate([-d * _FROM_END, (1.0 - d) * _NODES])  # r - d
        rim = np.concatenate([1.0 - d * _NODES, (1.0 - d) * _FROM_END])  # 1 - r
        weights = np.concatenate([d * _WEIGHTS, (1.0 - d) * _WEIGHTS])
    else:
        r, beyond, rim, weights = _NODES, -(d - 1.0) - _FROM_END, _FROM_END, _WEIGHTS
    weights = weights * _share(r, rim, k)
    # ellipkm1 takes 1 - m, which is 0 where r = d: times `beyond` its logarithm vanishes
    smallest = np.finfo(np.float64).tiny
    first = (r + d) * ellipe(np.minimum(4.0 * r * d / (r + d) ** 2, 1.0))
    second = beyond * ellipkm1(np.maximum((beyond / (r + d)) ** 2, smallest))
    return float(weights @ (first - second)) / (math.pi * d), float(weights @ (first + second)) / math.pi


def _share(r: FloatArray, rim: FloatArray, k: float) -> FloatArray:
    """Normal force per radius, of a whole that is 1, at r = 1 - rim."""
    if k == math.inf:
        return 2.0 * r
    return (
        r
        * (-np.expm1(k * np.log1p(-np.minimum(rim, _LARGEST_BELOW_1)))) ** (1.0 / k)
        * k
        / float(beta(2.0 / k, 1.0 + 1.0 / k))
    )


def _checked(pressure_exponent: float) -> float:
    k = positive("pressure_exponent", pressure_exponent, "", infinite_allowed=True)
    if k < MIN_PRESSURE_EXPONENT:
        raise InvalidValueError(
            f"pressure_exponent = {k:g}: must be at least {MIN_PRESSURE_EXPONENT:g}, a pressure that falls like "
            "a cone; Hertz's is 2, a uniform one infinity"
        )
    return k
