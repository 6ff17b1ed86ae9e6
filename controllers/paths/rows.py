"""A raster that may go beyond the object: row by row from where the surface is, to its rims."""

import math
from dataclasses import dataclass
from enum import Enum, IntEnum, auto

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

from palpate.controllers.paths.features import FeatureLimits, MarkingStrategy, MarkRecorder
from palpate.controllers.paths.follow import MIN_LEFT_OUT
from palpate.controllers.paths.polygons import Raster
from palpate.controllers.paths.strategy import (
    ContactPeriod,
    Hop,
    Leg,
    LegEnd,
    LegResult,
    PathPlane,
    Point,
    Stroke,
)
from palpate.errors import InvalidValueError, positive
from palpate.spatial import dot

_MIN_SKIPPED_CELLS = 2
"""Number of cells that are skipped at least: the tip is known to be no more exactly anywhere."""

_SKIP_GROWTH = 4
"""Factor by which the skipped length grows after each failure. Skipped cells are swept afterwards if the tip meets
the object beyond them."""


class Cell(IntEnum):
    """State of one cell of a row."""

    UNKNOWN = 0
    FELT = 1
    FAILED = 2
    """Tried: nothing is there, or it is too steep or blocked."""
    LEFT_OUT = 3
    """Not tried, between others that were, and not worth it for its own sake."""


@dataclass(frozen=True, slots=True)
class _LandingSite:
    """One place to land.

    Attributes:
        row: Which.
        cell: Index in the row.
        inwards: 1 if the unknown cells lie towards larger u, -1 towards smaller u.
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
        size = positive("left_out", left_out, "m") / _MIN_SKIPPED_CELLS
        self.count = max(math.ceil(raster.width / size - 1e-9), 1)
        self.rows = tuple(v for _, v in raster.corners()[::2])
        self._size = raster.width / self.count
        self._left = raster.center[0] - 0.5 * raster.width
        self._apart = raster.depth / (raster.rows - 1)
        # between its own rim and the next row's, on a slanting rim, a row has nothing to be sought
        self._slant = math.ceil((self._apart + left_out) / self._size)
        self._states: npt.NDArray[np.int8] = np.full((len(self.rows), self.count), Cell.UNKNOWN, np.int8)
        self._offsets = [
            [_MIN_SKIPPED_CELLS, _MIN_SKIPPED_CELLS] for _ in self.rows
        ]  # of the next attempt, from either end of a run

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
        self._offsets[row] = [_MIN_SKIPPED_CELLS, _MIN_SKIPPED_CELLS]

    def stop(self, row: int, u: float, direction: int) -> None:
        """A stroke came no further than u [m]."""
        cell = self.cell(u)
        while 0 <= cell < self.count and self._states[row, cell] == Cell.FELT:
            cell += direction
        if 0 <= cell < self.count:
            self._states[row, cell] = Cell.FAILED

    def give_up(self, attempt: _LandingSite) -> None:
        """An attempt has met nothing: skip what lies before it, and more of it the next time."""
        row, cell, states = attempt.row, attempt.cell, self._states[attempt.row]
        between = slice(min(attempt.edge, cell), max(attempt.edge, cell) + 1)
        if not attempt.probe:
            states[between][states[between] == Cell.UNKNOWN] = Cell.LEFT_OUT
            if cell != attempt.edge:
                self._offsets[row][0 if attempt.inwards > 0 else 1] *= _SKIP_GROWTH
        if states[cell] != Cell.FELT:
            states[cell] = Cell.FAILED

    def end_of_stroke(self, row: int, cell: int, direction: int) -> int:
        """Return the last cell of a stroke from a cell: the first that was touched before, or the field's end."""
        end = cell
        while 0 <= end + direction < self.count:
            end += direction
            if self._states[row, end] == Cell.FELT and self._states[row, end - direction] != Cell.FELT:
                break
        return end

    def best(self, tip: Point, *, touching: bool) -> _LandingSite | None:
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
        found: list[tuple[float, _LandingSite]] = []
        for row in np.flatnonzero(wanted.any(axis=1)).tolist():
            padded = np.concatenate([[False], wanted[row], [False]])
            bounds = np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)
            for first, end in bounds.tolist():
                attempt = self._attempt(row, first, end - 1, tip, touching=touching)
                if attempt is not None:
                    found.append((math.dist(self.place(row, attempt.cell), tip), attempt))
        return min(found, key=lambda one: one[0])[1] if found else None

    def _attempt(self, row: int, first: int, last: int, tip: Point, *, touching: bool) -> _LandingSite | None:
        """Where to land in a run of cells; None if it is too short to be worth it."""
        states, length = self._states[row], last - first + 1
        ends = (first - 1, last + 1)
        failed = [0 <= k < self.count and states[k] in (Cell.FAILED, Cell.LEFT_OUT) for k in ends]
        if length < _MIN_SKIPPED_CELLS or (any(failed) and length <= self._slant):
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
        return _LandingSite(row, edge + inwards * offset, inwards, edge)

    def hidden(self) -> _LandingSite | None:
        """Return the middle of the largest island that may still be hidden; None if it is as small as a gap."""
        tried = (self._states == Cell.FELT) | (self._states == Cell.FAILED)
        outside = np.pad(~tried, 1)  # an island ends with the field
        distance = np.asarray(distance_transform_edt(outside, sampling=(self._apart, self._size)))[1:-1, 1:-1]
        row, cell = (int(k) for k in np.unravel_index(int(distance.argmax()), distance.shape))
        if distance[row, cell] <= self._apart:
            return None
        return _LandingSite(row, cell, 1 if 2 * cell < self.count else -1, cell, probe=True)

    def patience(self) -> int:
        """Return how often to probe in vain: as the logarithm of how much is unknown."""
        unknown = int(((self._states == Cell.UNKNOWN) | (self._states == Cell.LEFT_OUT)).sum())
        return math.ceil(math.log2(1.0 + unknown))


_ROLL_ANGLE = math.radians(35.0)
"""A tip that rolled so far over an edge turns round. Less is a crease, beyond which the surface may go on. Until
it rests it rolls on by 15 degrees (20 mm/s, 4 mm tip, 20 ms lag, 0.5 m/s^2), to where a stroke may still begin."""


class _Edge:
    """Notices that the tip rolls over an edge: it moves, and the contact stays where it is."""

    def __init__(self) -> None:
        self._limits = FeatureLimits()
        self._least_cos = math.cos(_ROLL_ANGLE)
        self._anchor: ContactPeriod | None = None

    def feel(self, felt: ContactPeriod) -> bool:
        """Take one period; return whether it has rolled over one."""
        anchor = self._anchor
        if anchor is None:
            self._anchor = felt
            return False
        went, moved = math.dist(felt.tip, anchor.tip), math.dist(felt.contact, anchor.contact)
        if went > self._limits.window and self._limits.contrast * moved > went:
            self._anchor = felt
        return dot(felt.normal, anchor.normal) < self._least_cos and self._limits.contrast * moved < went


class _Stage(Enum):
    """Purpose of the present leg."""

    LANDING = auto()
    OUTWARDS = auto()
    """From the landing to the near rim."""
    BACK = auto()
    """To where it landed, again."""
    ACROSS = auto()
    SLIDING = auto()
    """Along the field's end to the next row, and across."""


class RasterRows(MarkingStrategy):
    """Sweeps the rows of a raster on an object that may be smaller than it, of any outline, and with holes.

    Where a row ends at a rim, the next one is begun a little inwards of it, swept out to its own rim and then
    across, without a second landing if the rim is a sharp edge. Whatever a neighbouring row felt is looked for in
    a row, from both of its ends inwards: `left_out` from them, then ever farther, so that the number of tries
    grows with the logarithm of the row's length, and is one where the rim is as foreseen. When nothing is left to
    be found like that, it probes the middle of the largest island that may still be hidden: what it meets it
    explores likewise. It ends when as many probes one after the other as the logarithm of what is unknown met
    nothing: smaller islands than lie between such probes may be missed.

    A loss ends it; so do a first landing and another one in the middle that meet nothing.
    """

    def __init__(
        self,
        raster: Raster,
        plane: PathPlane | None = None,
        begin: Point | None = None,
        left_out: float = MIN_LEFT_OUT,
    ) -> None:
        """Take the field.

        Args:
            raster: Rows of the field.
            plane: Plane of the path.
            begin: Where to land first [m]; the raster's first corner, if not given.
            left_out: How far inwards of a rim the tip lands [m].

        Raises:
            InvalidValueError: The first landing is beside the raster.
        """
        self.plane = plane or PathPlane()
        self._raster, self._left_out = raster, left_out
        self._begin = begin or raster.corners()[0]
        off = [abs(a - b) for a, b in zip(self._begin, raster.center, strict=True)]
        if not (off[0] <= 0.5 * raster.width + 1e-9 and off[1] <= 0.5 * raster.depth + 1e-9):
            raise InvalidValueError(f"begin = {self._begin} m: must lie in the raster")
        self.start()

    def start(self) -> None:
        """Forget all contacts and begin again."""
        self._mark_recorder = MarkRecorder()
        self._field = CellGrid(self._raster, self._left_out)
        self._doing = _Stage.LANDING
        self._attempt = self._at(self._begin)
        self._aim = self._begin  # where it should land
        self._met = False  # ever
        self._found = False  # by the present attempt
        self._edge: _Edge | None = None  # while the tip goes outwards
        self._turned = False  # the last leg ended because the tip was over it
        self._vain = 0  # attempts before anything was met, later probes since

    def feel(self, felt: ContactPeriod) -> bool:
        """Record one period in contact; return whether the leg has found its end."""
        self._mark_recorder.feel(felt)
        u, v, _ = self.plane.flat(felt.tip)
        self._found = self._met = True
        if self._field.on_row(self._attempt.row, v):
            self._field.feel(self._attempt.row, u)
        self._turned = self._edge is not None and self._edge.feel(felt)
        return self._turned

    def next(self, ended: LegResult | None) -> Leg | None:
        """Return the next leg, or None at the end."""
        if ended is None:
            return self._land(self._begin)
        u, v, height = self.plane.flat(ended.tip)
        landing = self._doing in (_Stage.LANDING, _Stage.BACK)
        turned, self._turned, self._edge = self._turned, False, None
        self._mark_recorder.end(ended, self.plane.base(self._aim, height) if landing else None)
        if ended.how is LegEnd.LOST:
            return None
        if ended.how is LegEnd.REACHED:
            match self._doing:
                case _Stage.LANDING:
                    return self._outwards() or self._across()
                case _Stage.OUTWARDS | _Stage.BACK:
                    if turned:
                        self._field.stop(self._attempt.row, u, -self._attempt.inwards)
                    return self._across()
                case _:
                    return self._choose((u, v), touching=True)
        return self._after_failure(u, v)

    def _after_failure(self, u: float, v: float) -> Leg | None:
        attempt, field = self._attempt, self._field
        if self._doing is _Stage.SLIDING and not field.on_row(attempt.row, v):
            field.give_up(attempt)
        elif self._doing not in (_Stage.LANDING, _Stage.BACK) and self._found:
            direction = -attempt.inwards if self._doing is _Stage.OUTWARDS else attempt.inwards
            field.stop(attempt.row, u, direction)
            if self._doing is _Stage.OUTWARDS:
                self._doing, self._aim = _Stage.BACK, field.place(attempt.row, attempt.cell)
                return Hop(self._aim)
        return self._choose((u, v), touching=False)

    def _choose(self, tip: Point, *, touching: bool) -> Leg | None:
        """The next attempt, once the present one is over."""
        field, before = self._field, self._attempt
        if not self._found:
            field.give_up(before)
            self._vain += before.probe or not self._met
        else:
            field.go_on(before.row)
            self._vain = 0
        if not self._met:
            center = self._raster.center
            if self._vain > 1 or math.dist(center, self._begin) <= self._left_out:
                return None
            self._attempt = self._at(center)
            return self._land(center)
        attempt = field.best(tip, touching=touching)
        if attempt is None and self._vain < field.patience():
            attempt = field.hidden()
        if attempt is None:
            return None
        self._attempt, self._found = attempt, False
        place = field.place(attempt.row, attempt.cell)
        near = abs(attempt.row - before.row) == 1 and abs(place[0] - tip[0]) <= self._left_out
        if touching and near and attempt.cell == attempt.edge:
            self._doing = _Stage.SLIDING
            return Stroke((place, field.place(attempt.row, self._end(attempt.inwards))))
        return self._land(place)

    def _at(self, place: Point) -> _LandingSite:
        """An attempt without a preferred place."""
        row, cell = self._field.row(place[1]), self._field.cell(place[0])
        return _LandingSite(row, cell, 1 if 2 * cell < self._field.count else -1, cell, probe=True)

    def _land(self, place: Point) -> Leg:
        self._doing, self._aim, self._found = _Stage.LANDING, place, False
        return Hop(place)

    def _outwards(self) -> Leg | None:
        """To the rim behind; None if that is where it landed."""
        attempt = self._attempt
        if self._field.known(attempt.row, attempt.cell - attempt.inwards):
            return None
        self._doing, self._edge = _Stage.OUTWARDS, _Edge()
        return self._sweep(-attempt.inwards)

    def _across(self) -> Leg:
        self._doing = _Stage.ACROSS
        return self._sweep(self._attempt.inwards)

    def _sweep(self, direction: int) -> Leg:
        """A stroke on the row, whose first corner is where the tip landed: the first landing may be beside it."""
        attempt, field = self._attempt, self._field
        end = field.place(attempt.row, self._end(direction))
        begin = field.place(attempt.row, attempt.cell)
        return Stroke((begin, end) if begin != end else (end,))

    def _end(self, direction: int) -> int:
        return self._field.end_of_stroke(self._attempt.row, self._attempt.cell, direction)
