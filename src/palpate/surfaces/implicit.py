"""Any smooth convex fingertip, given by a function that is negative inside and zero on the surface."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numba.core.dispatcher import Dispatcher

from palpate.compiling import njit
from palpate.errors import FloatArray, InvalidValueError, positive, rotation_matrix, vector
from palpate.surfaces.shown import Shown

Derivatives = tuple[float, float, float, float, float, float, float, float, float, float]
"""Value, gradient (x, y, z), and second derivatives (xx, yy, zz, yz, xz, xy)."""

Evaluate = Callable[[FloatArray, float, float, float], Derivatives]
"""(parameters, x, y, z) -> Derivatives, in the surface's own frame."""

Level = Callable[[FloatArray, float, float, float], tuple[float, float, float, float]]
"""(parameters, x, y, z) -> value and gradient."""

DIFFERENCE_STEP = 6e-6
"""Cube root of the rounding unit: the best step of a central difference, relative to the size."""

GRADIENT_TOLERANCE = 1e-4
"""Largest relative difference of a user's gradient from the differences of the value."""

CHECKED_DIRECTIONS = 60
"""On so many rays from the centre a surface is checked when it is built."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Implicit(Shown):
    """What the solver needs of an implicit surface.

    Attributes:
        evaluate: Value and derivatives in the surface's own frame, compiled by numba or plain Python.
        level: Value and gradient alone, where that is cheaper.
        parameters: First argument of `evaluate`; surfaces that share `evaluate` share one compiled solver.
        center: A point inside, origin of the surface's own frame, in the sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).
        half_lengths: Distances from the centre to the surface along the axes, mean of both directions, shape (3,)
            [m].
    """

    evaluate: Evaluate = field(init=False, repr=False)
    level: Level | None = field(init=False, repr=False, default=None)
    parameters: FloatArray = field(init=False, repr=False)
    half_lengths: FloatArray = field(init=False, repr=False)
    center: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))

    def _settle(self, evaluate: Evaluate, parameters: FloatArray, size: float) -> None:
        """Check the frame, and keep what the solver needs; `size` is about the tip's radius [m]."""
        object.__setattr__(self, "center", vector("center", self.center, 3, "m"))
        object.__setattr__(self, "rotation", rotation_matrix("rotation", self.rotation))
        object.__setattr__(self, "evaluate", evaluate)
        parameters.setflags(write=False)
        object.__setattr__(self, "parameters", parameters)
        at = _Checked(evaluate, parameters, size)
        half_lengths = np.mean([(at.reach(axis), at.reach(-axis)) for axis in np.eye(3)], axis=1)
        half_lengths.setflags(write=False)
        object.__setattr__(self, "half_lengths", half_lengths)


def check_shape(evaluate: Evaluate, parameters: FloatArray, size: float) -> None:
    """Refuse what no fingertip is: an open or inwards bent surface, a gradient that is not the value's.

    Raises:
        InvalidValueError: With the place where it shows.
    """
    _Checked(evaluate, parameters, size).check_shape()


@dataclass(frozen=True, slots=True)
class _Checked:
    """The checks that a surface passes when it is built."""

    evaluate: Evaluate
    parameters: FloatArray
    size: float

    def value(self, point: FloatArray) -> float:
        """Value at a point of the surface's own frame."""
        return self.evaluate(self.parameters, *point.tolist())[0]

    def reach(self, direction: FloatArray) -> float:
        """Distance from the centre to the surface."""
        if not self.value(np.zeros(3)) < 0.0:
            raise InvalidValueError(
                f"value at the centre is {self.value(np.zeros(3)):g}: must be below 0, the centre lies inside"
            )
        outside = self.size
        for _ in range(60):
            if self.value(outside * direction) > 0.0:
                break
            outside *= 2.0
        else:
            raise InvalidValueError(
                f"value stays below 0 along {direction.tolist()} up to {outside:.1e} m: the surface must be closed"
            )
        inside = 0.0
        for _ in range(60):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if self.value(middle * direction) < 0.0 else (inside, middle)
        return 0.5 * (inside + outside)

    def check_shape(self) -> None:
        """Refuse wrong derivatives and surfaces that are not convex."""
        step = DIFFERENCE_STEP * self.size
        for i in range(CHECKED_DIRECTIONS):
            # points spread evenly over the sphere (Fibonacci lattice)
            z = 1.0 - 2.0 * (i + 0.5) / CHECKED_DIRECTIONS
            turn = i * math.pi * (3.0 - math.sqrt(5.0))
            direction = np.array(
                [math.sqrt(1.0 - z * z) * math.cos(turn), math.sqrt(1.0 - z * z) * math.sin(turn), z]
            )
            point = self.reach(direction) * direction
            _, gx, gy, gz, hxx, hyy, hzz, hyz, hxz, hxy = self.evaluate(self.parameters, *point.tolist())
            gradient = np.array([gx, gy, gz])
            length = float(np.linalg.norm(gradient))
            numeric = np.array(
                [(self.value(point + step * e) - self.value(point - step * e)) / (2.0 * step) for e in np.eye(3)]
            )
            if not np.linalg.norm(gradient - numeric) <= GRADIENT_TOLERANCE * np.linalg.norm(numeric):
                raise InvalidValueError(
                    f"gradient at {point.tolist()} is {gradient.tolist()}, but differences of the value give "
                    f"{numeric.tolist()}: must be the gradient of value, in the surface's own frame"
                )
            normal = gradient / length
            tangent = np.eye(3) - np.outer(normal, normal)
            hessian = np.array([[hxx, hxy, hxz], [hxy, hyy, hyz], [hxz, hyz, hzz]])
            least = float(np.linalg.eigvalsh(tangent @ hessian @ tangent)[0]) / length
            if least * self.size < -1e-4:
                raise InvalidValueError(
                    f"the surface bends inwards at {point.tolist()} (curvature {least:.2g} 1/m): must be convex"
                )


@dataclass(frozen=True, eq=False, repr=False)
class ImplicitSurface(Implicit):
    """A convex surface from a user's functions of a point, in the surface's own frame.

    Functions compiled with `numba.njit` make a compiled solver; plain Python ones work too, a thousand times
    slower. Second derivatives are differences of the gradient: they steer the iteration, not its result.

    Args:
        value: Point (3,) -> number, below 0 inside, 0 on the surface, smooth.
        gradient: Point (3,) -> its gradient, shape (3,).
        size: About the tip's radius [m]; a factor of ten more or less does no harm.
        center: A point inside, the origin of `value`'s frame, in the sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: The centre is not inside, the gradient is not that of the value, or the surface is open
            or not convex.
    """

    value: Callable[[FloatArray], float]
    gradient: Callable[[FloatArray], FloatArray]
    size: float = 0.01

    def __post_init__(self) -> None:
        size = positive("size", self.size, "m")
        for name in ("value", "gradient"):
            if not callable(getattr(self, name)):
                raise InvalidValueError(f"{name} = {getattr(self, name)!r}: must be a function of a point (3,)")
        evaluate, level = _from_functions(self.value, self.gradient)
        parameters = np.array([size * DIFFERENCE_STEP])
        try:
            evaluate(parameters, 0.1 * size, 0.2 * size, 0.3 * size)
        except Exception as error:  # whatever the user's functions, or their compilation, raise
            raise InvalidValueError(
                f"value or gradient fails at a point (3,): {str(error).splitlines()[0]}; value must return a "
                "number, gradient three"
            ) from error
        check_shape(evaluate, parameters, size)
        self._settle(evaluate, parameters, size)
        object.__setattr__(self, "level", level)


def _from_functions(value: Any, gradient: Any) -> tuple[Evaluate, Level]:
    compiled = isinstance(value, Dispatcher) and isinstance(gradient, Dispatcher)

    def evaluate(parameters: FloatArray, x: float, y: float, z: float) -> Derivatives:
        # one-sided differences: they steer the iteration only, and halve the calls
        step = parameters[0]
        point = np.array([x, y, z])
        at = gradient(point)
        gx, gy, gz = at[0], at[1], at[2]
        point[0] = x + step
        ahead = gradient(point)
        hxx, hyx, hzx = (ahead[0] - gx) / step, (ahead[1] - gy) / step, (ahead[2] - gz) / step
        point[0], point[1] = x, y + step
        ahead = gradient(point)
        hxy, hyy, hzy = (ahead[0] - gx) / step, (ahead[1] - gy) / step, (ahead[2] - gz) / step
        point[1], point[2] = y, z + step
        ahead = gradient(point)
        hxz, hyz, hzz = (ahead[0] - gx) / step, (ahead[1] - gy) / step, (ahead[2] - gz) / step
        point[2] = z
        mixed = (0.5 * (hyz + hzy), 0.5 * (hxz + hzx), 0.5 * (hxy + hyx))
        return (value(point), gx, gy, gz, hxx, hyy, hzz, mixed[0], mixed[1], mixed[2])

    def level(parameters: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float, float]:
        point = np.array([x, y, z])
        g = gradient(point)
        return (value(point), g[0], g[1], g[2])

    if not compiled:
        return evaluate, level
    jitted: tuple[Any, Any] = (njit(evaluate), njit(level))
    return cast(tuple[Evaluate, Level], jitted)


@njit(error_model="numpy", cache=True)
def evaluate_superellipsoid(parameters: Any, x: Any, y: Any, z: Any) -> Any:
    """The norm (|x/a|^p + |y/b|^p + |z/c|^p)^(1/p) - 1 and its derivatives; parameters (a, b, c, p)."""
    a, b, c, p = parameters[0], parameters[1], parameters[2], parameters[3]
    u, v, w = abs(x) / a, abs(y) / b, abs(z) / c
    largest = max(max(u, v), w)
    if largest == 0.0:
        return (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    u, v, w = u / largest, v / largest, w / largest
    size = (u**p + v**p + w**p) ** (1.0 / p)
    u, v, w = u / size, v / size, w / size  # u^p + v^p + w^p = 1 from here on
    norm = largest * size
    gx = math.copysign(u ** (p - 1.0) / a, x)
    gy = math.copysign(v ** (p - 1.0) / b, y)
    gz = math.copysign(w ** (p - 1.0) / c, z)
    k = (p - 1.0) / norm
    return (
        norm - 1.0,
        gx,
        gy,
        gz,
        k * (u ** (p - 2.0) / (a * a) - gx * gx),
        k * (v ** (p - 2.0) / (b * b) - gy * gy),
        k * (w ** (p - 2.0) / (c * c) - gz * gz),
        -k * gy * gz,
        -k * gx * gz,
        -k * gx * gy,
    )


MAX_ANGULAR = 10.0
"""Largest exponent of a superellipsoid: beyond, its edges are sharper than the solver is tested on."""


@dataclass(frozen=True, eq=False, repr=False)
class Superellipsoid(Implicit):
    """|x/a|^p + |y/b|^p + |z/c|^p = 1: an ellipsoid for p = 2, ever more a box with growing p.

    Args:
        semi_axes: a, b, c [m].
        exponent: p, from 2 to `MAX_ANGULAR`; for a box with round edges take a `RoundedBox`.
        center: Sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: A semi-axis is not positive, or the exponent out of range.
    """

    semi_axes: Sequence[float]
    exponent: float

    def __post_init__(self) -> None:
        axes = vector("semi_axes", self.semi_axes, 3, "m")
        for i, length in enumerate(axes.tolist()):
            positive(f"semi_axes[{i}]", length, "m")
        object.__setattr__(self, "semi_axes", tuple(axes.tolist()))
        exponent = positive("exponent", self.exponent, "")
        if not 2.0 <= exponent <= MAX_ANGULAR:
            raise InvalidValueError(f"exponent = {exponent:g}: must lie between 2 and {MAX_ANGULAR:g}")
        self._settle(evaluate_superellipsoid, np.array([*axes, exponent]), float(axes.max()))
