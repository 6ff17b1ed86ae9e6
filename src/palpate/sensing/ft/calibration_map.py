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
    """wrench = C (raw - offset), as plain floats.

    Attributes:
        matrix: C, six rows of k >= 6 numbers [N per raw unit, three rows; N m per raw unit, three rows].
        offset: What the k channels show without load [raw unit].
    """

    matrix: tuple[tuple[float, ...], ...]
    offset: tuple[float, ...]

    def __post_init__(self) -> None:
        k = len(self.offset)
        if len(self.matrix) != 6 or any(len(row) != k for row in self.matrix) or k < 6:
            rows = [len(row) for row in self.matrix]
            raise InvalidValueError(
                f"calibration matrix has rows of {rows} numbers for {k} channels: must be 6 rows of k "
                "numbers, with k the number of channels, 6 or more"
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
        rows = finite_rows("raw", raw, self.channels, "raw unit")
        return np.asarray((rows - np.array(self.offset)) @ np.array(self.matrix).T)
