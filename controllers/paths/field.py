"""Coverage of a raster that may extend beyond the object: cells felt, and cells probed without contact."""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

from palpate.controllers.paths.plane import Point
from palpate.controllers.paths.raster import Raster
from palpate.errors import positive

CELLS = 2
"""Number of cells that are skipped at least: the tip is known to be no more exactly anywhere."""

GROWTH = 4
"""So many times as much is left out after each failure: what was passed over is swept back if something is met."""


class Cell(IntEnum):
    """What is known of one cell of a row."""

    UNKNOWN = 0
    FELT = 1
    FAILED = 2
    """Tried: nothing is there, or it is too steep or blocked."""
    LEFT_OUT = 3
    """Not tried, between others that were, and not worth it for its own sake."""


@dataclass(frozen=True, slots=True)
class LandingSite:
    """One place to land.

    Attributes:
        row: Which.
        cell: Of the row.
        inwards: 1: what is still unknown lies towards larger u, -1: towards lesser u.
        edge: Cell at which the run of unknown ones begins that it is for.
        probe: Whether nothing speaks for it but that nothing is known there.
    """

    row: int
    cell: int
    inwards: int
    edge: int
    probe: bool = False


class CellGrid:
    """Rows cut into cells of about a millimetre.

    Attributes:
        rows: v of each row [m].
        count: Cells in a row.
    """

    def __init__(self, raster: Raster, left_out: float) -> None:
        """Take the raster, and how much is left out at first after a failure [m]."""
        size = positive("left_out", left_out, "m") / CELLS
        self.count = max(math.ceil(raster.width / size - 1e-9), 1)
        self.rows = tuple(v for _, v in raster.corners()[::2])
        self._size = raster.width / self.count
        self._left = raster.center[0] - 0.5 * raster.width
        self._apart = raster.depth / (raster.rows - 1)
        # between its own rim and the next row's, on a slanting rim, a row has nothing to be sought
        self._slant = math.ceil((self._apart + left_out) / self._size)
        self._states: npt.NDArray[np.int8] = np.full((len(self.rows), self.count), Cell.UNKNOWN, np.int8)
        self._offsets = [[CELLS, CELLS] for _ in self.rows]  # of the next attempt, from either end of a run

    def row(self, v: float) -> int:
        """Return the row nearest to v [m]."""
        return min(range(len(self.rows)), key=lambda row: abs(self.rows[row] - v))

    def cell(self, u: float) -> int:
        """Return the cell at u [m]; beside the field the nearest."""
        return min(max(int((u - self._left) // self._size), 0), self.count - 1)

    def place(self, row: int, cell: int) -> Point:
        """Return the middle of a cell, of the outermost ones the field's end [m]."""
        share = {0: 0.0, self.count - 1: float(self.count)}.get(cell, cell + 0.5)
        return (self._left + self._size * share, self.rows[row])

    def on_row(self, row: int, v: float) -> bool:
        """Whether a tip at v [m] is on a row, and not still travelling to it."""
        return abs(v - self.rows[row]) <= 0.25 * self._apart

    def known(self, row: int, cell: int) -> bool:
        """Whether a cell was felt, or is beside the field."""
        return not 0 <= cell < self.count or bool(self._states[row, cell] == Cell.FELT)

    def feel(self, row: int, u: float) -> None:
        """The surface was felt there."""
        self._states[row, self.cell(u)] = Cell.FELT

    def go_on(self, row: int) -> None:
        """Something was met in a row: after the next failure, little is left out again."""
        self._offsets[row] = [CELLS, CELLS]

    def stop(self, row: int, u: float, direction: int) -> None:
        """A stroke came no further than u [m]."""
        cell = self.cell(u)
        while 0 <= cell < self.count and self._states[row, cell] == Cell.FELT:
            cell += direction
        if 0 <= cell < self.count:
            self._states[row, cell] = Cell.FAILED

    def give_up(self, attempt: LandingSite) -> None:
        """An attempt has met nothing: skip what lies before it, and more of it the next time."""
        row, cell, states = attempt.row, attempt.cell, self._states[attempt.row]
        between = slice(min(attempt.edge, cell), max(attempt.edge, cell) + 1)
        if not attempt.probe:
            states[between][states[between] == Cell.UNKNOWN] = Cell.LEFT_OUT
            if cell != attempt.edge:
                self._offsets[row][0 if attempt.inwards > 0 else 1] *= GROWTH
        if states[cell] != Cell.FELT:
            states[cell] = Cell.FAILED

    def end_of_stroke(self, row: int, cell: int, direction: int) -> int:
        """Return how far a stroke from a cell should go: up to what was felt before, or the field's end."""
        end = cell
        while 0 <= end + direction < self.count:
            end += direction
            if self._states[row, end] == Cell.FELT and self._states[row, end - direction] != Cell.FELT:
                break
        return end

    def best(self, tip: Point, *, touching: bool) -> LandingSite | None:
        """Return the nearest place beside which, in the next row, the surface was felt; None if there is none.

        Args:
            tip: Where it is [m].
            touching: Whether it may slide on from there.
        """
        felt = self._states == Cell.FELT
        beside = np.zeros_like(felt)
        beside[1:] |= felt[:-1]
        beside[:-1] |= felt[1:]
        wanted = beside & (self._states == Cell.UNKNOWN)
        found: list[tuple[float, LandingSite]] = []
        for row in np.flatnonzero(wanted.any(axis=1)).tolist():
            padded = np.concatenate([[False], wanted[row], [False]])
            bounds = np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)
            for first, end in bounds.tolist():
                attempt = self._attempt(row, first, end - 1, tip, touching=touching)
                if attempt is not None:
                    found.append((math.dist(self.place(row, attempt.cell), tip), attempt))
        return min(found, key=lambda one: one[0])[1] if found else None

    def _attempt(self, row: int, first: int, last: int, tip: Point, *, touching: bool) -> LandingSite | None:
        """Where to land in a run of cells; None if it is too short to be worth it."""
        states, length = self._states[row], last - first + 1
        ends = (first - 1, last + 1)
        failed = [0 <= k < self.count and states[k] in (Cell.FAILED, Cell.LEFT_OUT) for k in ends]
        if length < CELLS or (any(failed) and length <= self._slant):
            return None
        left, right = self._offsets[row]
        if left == right:
            near = abs(self.place(row, first)[0] - tip[0]) <= abs(self.place(row, last)[0] - tip[0])
        else:
            near = left < right
        edge, inwards, offset = (first, 1, left) if near else (last, -1, right)
        if touching and edge in (0, self.count - 1):
            offset = 0  # rows end there
        if offset >= length:
            offset = length // 2
        return LandingSite(row, edge + inwards * offset, inwards, edge)

    def hidden(self) -> LandingSite | None:
        """Return the middle of the largest island that may still be hidden; None if it is as small as a gap."""
        tried = (self._states == Cell.FELT) | (self._states == Cell.FAILED)
        outside = np.pad(~tried, 1)  # an island ends with the field
        distance = np.asarray(distance_transform_edt(outside, sampling=(self._apart, self._size)))[1:-1, 1:-1]
        row, cell = (int(k) for k in np.unravel_index(int(distance.argmax()), distance.shape))
        if distance[row, cell] <= self._apart:
            return None
        return LandingSite(row, cell, 1 if 2 * cell < self.count else -1, cell, probe=True)

    def patience(self) -> int:
        """Return how often to probe in vain: as the logarithm of how much is unknown."""
        unknown = int(((self._states == Cell.UNKNOWN) | (self._states == Cell.LEFT_OUT)).sum())
        return math.ceil(math.log2(1.0 + unknown))
