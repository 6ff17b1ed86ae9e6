"""From the raw channels of a sensor to the wrench: the map itself, however it was found."""

import math
from dataclasses import dataclass
from operator import mul

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.ft.arrays import finite_rows
from palpate.spatial import Wrench


@dataclass(frozen=True, slots=True)
class CalibrationMap:
    """wrench = C (u, p), u = raw - offset, p some products of two of u each; as plain floats.

    Attributes:
        matrix: C, six rows of k + m numbers, k >= 6 [N per raw unit, three rows; N m per raw unit, three rows; the
            last m columns per raw unit squared].
        offset: What the k channels show without load [raw unit].
        products: The channels of each of the m products, counted from 0; none: the sensor is linear.
    """

    matrix: tuple[tuple[float, ...], ...]
    offset: tuple[float, ...]
    products: tuple[tuple[int, int], ...] = ()

    def __post_init__(self) -> None:
        k, m = len(self.offset), len(self.products)
        if len(self.matrix) != 6 or any(len(row) != k + m for row in self.matrix) or k < 6:
            rows = [len(row) for row in self.matrix]
            beside = f" and {m} products" if m else ""
            raise InvalidValueError(
                f"calibration matrix has rows of {rows} numbers for {k} channels{beside}: must be 6 rows of k "
                "numbers, with k the number of channels, 6 or more, and one more for each product"
            )
        for n, (i, j) in enumerate(self.products):
            if not 0 <= i <= j < k or (i, j) in self.products[:n]:
                raise InvalidValueError(
                    f"product {n + 1} of channels {i} and {j}: must be two of the {k} channels, counted from 0, "
                    "the lower one first, and no pair twice"
                )
        for i, row in enumerate((*self.matrix, self.offset)):
            for j, x in enumerate(row):
                if not math.isfinite(x):
                    where = f"calibration matrix, row {i + 1}" if i < 6 else "calibration offset"
                    raise InvalidValueError(f"{where}, column {j + 1} is {x}: must be finite")

    @property
    def channels(self) -> int:
        """Number of raw channels k."""
        return len(self.offset)

    def step(self, raw: tuple[float, ...]) -> Wrench:
        """Return the wrench of one reading of k channels; for code that runs once per period.

        Raises:
            ValueError: Another number of channels.
        """
        shifted = [x - o for x, o in zip(raw, self.offset, strict=True)]
        if self.products:
            shifted += [shifted[i] * shifted[j] for i, j in self.products]
        a, b, c, d, e, f = [sum(map(mul, row, shifted)) for row in self.matrix]
        return (a, b, c, d, e, f)

    def apply(self, raw: npt.ArrayLike) -> FloatArray:
        """Return the wrenches of many readings.

        Args:
            raw: Shape (n, k) [raw unit].

        Returns:
            Shape (n, 6) [N, N m].

        Raises:
            InvalidValueError: Another shape, or not finite.
        """
        shifted = finite_rows("raw", raw, self.channels, "raw unit") - np.array(self.offset)
        bent = [shifted[:, i] * shifted[:, j] for i, j in self.products]
        return np.asarray(np.column_stack([shifted, *bent]) @ np.array(self.matrix).T)
