"""The map as a view shows it: the points that were touched, thinned out, growing as the run goes on."""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, positive

MOST_POINTS = 60_000
"""Beyond, the map gets coarser: a browser on a laptop turns this many smoothly, and no eye distinguishes more."""

CHUNK = 2_000
"""Points that are sent together: of a growing map only the last chunk is sent again."""


class TouchMap:
    """At most one point per cube of a grid."""

    def __init__(self, spacing: float) -> None:
        """Begin empty.

        Args:
            spacing: Edge of the grid's cubes [m].
        """
        self._finest = positive("spacing", spacing, "m")
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self.spacing = self._finest
        self._taken: set[tuple[int, ...]] = set()
        self._points: list[FloatArray] = []
        self._count = 0
        self.coarsened = 0

    def __len__(self) -> int:
        """Number of points."""
        return self._count

    @property
    def points(self) -> FloatArray:
        """In the order in which they were touched, shape (n, 3) [m]."""
        return np.concatenate(self._points) if self._points else np.empty((0, 3))

    def add(self, points: FloatArray) -> None:
        """Add points (n, 3) [m], all finite."""
        new = self._new(points)
        if len(new):
            self._points.append(new)
            self._count += len(new)
        while self._count > MOST_POINTS:
            self._coarsen()

    def chunk(self, number: int) -> FloatArray:
        """Return the points of one chunk, shape (up to `CHUNK`, 3) [m]."""
        if len(self._points) > 1:
            self._points = [self.points]
        return self.points[number * CHUNK : (number + 1) * CHUNK]

    @property
    def chunks(self) -> int:
        """How many chunks there are."""
        return -(-self._count // CHUNK)

    def _new(self, points: FloatArray) -> FloatArray:
        cubes: npt.NDArray[np.int64] = np.floor(points / self.spacing).astype(np.int64)
        # neighbours in time mostly share a cube: most are gone before Python looks at them
        change = np.ones(len(cubes), bool)
        change[1:] = (cubes[1:] != cubes[:-1]).any(axis=1)
        kept = []
        for i in np.flatnonzero(change).tolist():
            cube = tuple(cubes[i].tolist())
            if cube not in self._taken:
                self._taken.add(cube)
                kept.append(i)
        return points[kept]

    def _coarsen(self) -> None:
        everything = self.points
        self.spacing *= 2.0
        self._taken.clear()
        kept = self._new(everything)
        self._points, self._count = [kept], len(kept)
        self.coarsened += 1
