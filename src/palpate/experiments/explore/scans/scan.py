"""What a strategy is once it fits an object."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths import PathPlane, Point, Strategy
from palpate.errors import FloatArray
from palpate.experiments.explore.scans.effort import Effort


class Scan(Protocol):
    """A strategy that fits the object. Places are those of the middle of the tip, seen from above [m]."""

    @property
    def begin(self) -> Point:
        """Where the tip first lands [m]."""
        ...

    @property
    def corners(self) -> tuple[Point, ...]:
        """Where it goes, in order, on straight lines; round all of it where what is felt decides [m]."""
        ...

    @property
    def box(self) -> tuple[Point, Point]:
        """Least and largest place [m]."""
        ...

    @property
    def row(self) -> float:
        """Path length over which contacts share one error: each row counts as one observation of a shape [m]."""
        ...

    @property
    def length(self) -> float:
        """Of the path, seen from above, landings not counted [m]; NaN where what is felt decides."""
        ...

    @property
    def line(self) -> str:
        """What it is, for a report."""
        ...

    def passes(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """Return whether places (n, 2) lie where it is to feel everything, shape (n,)."""
        ...

    def strategy(self, plane: PathPlane, effort: Effort) -> Strategy:
        """Return a fresh one, in a plane whose coordinates are those of the middle of the tip."""
        ...

    def duration(self, effort: Effort) -> float:
        """Return about how long it takes [s]."""
        ...

    def longest(self, effort: Effort) -> float:
        """Return how long it may take [s]: then something is wrong."""
        ...
