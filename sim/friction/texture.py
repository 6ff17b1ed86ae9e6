"""Friction that varies over a surface."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from palpate.errors import InvalidValueError, numbers, positive, vector
from palpate.spatial import Vector


class Texture(Protocol):
    """Multiplies the friction coefficient by position. Evaluated at every contact and time step: keep it cheap."""

    def factor(self, x: float, y: float, z: float) -> float:
        """Return the factor, above 0, at a point of the textured geom's own frame [m].

        MuJoCo puts the frame of a mesh geom at its centre of mass, along its principal axes.
        """
        ...


class Grating:
    """Stripes: 1 + amplitude sin(2 pi s / wavelength), s the coordinate along `direction`."""

    def __init__(self, wavelength: float, amplitude: float, direction: Vector = (1.0, 0.0, 0.0)) -> None:
        """Describe the stripes.

        Args:
            wavelength: Of the stripes [m].
            amplitude: Of the factor; from 0 to below 1, so that friction stays above 0.
            direction: Across the stripes, in the geom's frame; its length does not matter.

        Raises:
            InvalidValueError: One of them cannot be.
        """
        self._rate = 2.0 * math.pi / positive("wavelength", wavelength, "m")
        if not 0.0 <= amplitude < 1.0:
            raise InvalidValueError(f"amplitude = {amplitude}: must be at least 0 and below 1")
        self._amplitude = amplitude
        across = vector("direction", direction, 3, "")
        length = positive("length of direction", float(np.linalg.norm(across)), "")
        self._x, self._y, self._z = (across / length).tolist()

    def factor(self, x: float, y: float, z: float) -> float:
        """See `Texture`."""
        return 1.0 + self._amplitude * math.sin(self._rate * (self._x * x + self._y * y + self._z * z))


@dataclass(frozen=True, slots=True)
class _Axis:
    """Nodes of a regular grid along one coordinate."""

    first: float
    spacing: float
    last: int

    def at(self, coordinate: float) -> tuple[int, float]:
        """Return the node before a coordinate and how far it is to the next, 0 to 1; beyond the ends, the ends."""
        steps = min(max((coordinate - self.first) / self.spacing, 0.0), float(self.last))
        node = min(int(steps), self.last - 1)
        return node, steps - node


class FrictionMap:
    """Factors on a regular grid over the geom's x and y, bilinear between the nodes, constant beyond the edges."""

    def __init__(self, factors: npt.ArrayLike, spacing: float, center: tuple[float, float] = (0.0, 0.0)) -> None:
        """Take a map.

        Args:
            factors: At the nodes, shape (nx, ny), at least 2 x 2, all above 0.
            spacing: Of the nodes [m].
            center: Of the map, x and y in the geom's frame [m].

        Raises:
            InvalidValueError: One of them cannot be.
        """
        grid = numbers("factors", factors)
        if grid.ndim != 2 or min(grid.shape) < 2:
            raise InvalidValueError(f"factors have shape {grid.shape}: must be (nx, ny), at least (2, 2)")
        if not (np.isfinite(grid).all() and grid.min() > 0.0):
            raise InvalidValueError(f"factors from {grid.min():g} to {grid.max():g}: must be finite and above 0")
        positive("spacing", spacing, "m")
        middle = vector("center", center, 2, "m").tolist()
        self._rows: list[list[float]] = grid.tolist()
        self._axes = tuple(
            _Axis(c - 0.5 * spacing * (n - 1), spacing, n - 1) for c, n in zip(middle, grid.shape, strict=True)
        )

    def factor(self, x: float, y: float, z: float) -> float:
        """See `Texture`."""
        i, u = self._axes[0].at(x)
        j, v = self._axes[1].at(y)
        near, far = self._rows[i], self._rows[i + 1]
        return (1.0 - u) * ((1.0 - v) * near[j] + v * near[j + 1]) + u * ((1.0 - v) * far[j] + v * far[j + 1])
