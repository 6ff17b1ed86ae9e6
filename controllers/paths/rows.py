"""A raster that may go beyond the object: row by row from where the surface is, to its rims."""

import math
from enum import Enum, auto

from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.features import FeatureLimits
from palpate.controllers.paths.field import CellGrid, LandingSite
from palpate.controllers.paths.follow import LEFT_OUT
from palpate.controllers.paths.legs import Hop, Leg, LegEnd, LegResult, Stroke
from palpate.controllers.paths.mark_recorder import MarkRecorder
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.controllers.paths.raster import Raster
from palpate.errors import InvalidValueError
from palpate.spatial import dot

ROLLED = math.radians(35.0)
"""A tip that rolled so far over an edge turns round. Less is a crease, beyond which the surface may go on. Until
it rests it rolls on by 15 degrees (20 mm/s, 4 mm tip, 20 ms lag, 0.5 m/s^2), to where a stroke may still begin."""


class _Edge:
    """Notices that the tip rolls over an edge: it moves, and the contact stays where it is."""

    def __init__(self) -> None:
        self._limits = FeatureLimits()
        self._least_cos = math.cos(ROLLED)
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
    """What the present leg is for."""

    LANDING = auto()
    OUTWARDS = auto()
    """From the landing to the near rim."""
    BACK = auto()
    """To where it landed, again."""
    ACROSS = auto()
    SLIDING = auto()
    """Along the field's end to the next row, and across."""


class RasterRows:
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
        left_out: float = LEFT_OUT,
    ) -> None:
        """Take the field.

        Args:
            raster: Its rows.
            plane: Of the path.
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

    @property
    def marks(self) -> tuple[Mark, ...]:
        """As `Strategy`."""
        return self._mark_recorder.marks

    def start(self) -> None:
        """As `Strategy`."""
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
        """As `Strategy`."""
        self._mark_recorder.feel(felt)
        u, v, _ = self.plane.flat(felt.tip)
        self._found = self._met = True
        if self._field.on_row(self._attempt.row, v):
            self._field.feel(self._attempt.row, u)
        self._turned = self._edge is not None and self._edge.feel(felt)
        return self._turned

    def next(self, ended: LegResult | None) -> Leg | None:
        """As `Strategy`."""
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

    def _at(self, place: Point) -> LandingSite:
        """An attempt without a preferred place."""
        row, cell = self._field.row(place[1]), self._field.cell(place[0])
        return LandingSite(row, cell, 1 if 2 * cell < self._field.count else -1, cell, probe=True)

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
