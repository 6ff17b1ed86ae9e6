"""Active exploration: a coarse pass, then strokes where the map is expected to err most.

A Gaussian process of fixed length scale is equally uncertain everywhere between rows. The contacts contain more
information. Along a row, detail is seen as finely as contacts lie, so the row itself says what rows some gap apart
would miss (`missed`); a row between two others shows how well they predicted it (`innovation_error`). The first
rows thus choose the distance of the coarse pass; later, every strip between rows has an expected error, and the
stroke comes next that removes most of it per path length: details that were met first, and between them rows that
halve the widest strips, until no detail of the size that is sought can lie between two rows.
"""

import math
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from palpate.controllers.paths.features import MarkingStrategy, MarkRecorder
from palpate.controllers.paths.felt_rows import FeltRow, RowRecorder, TouchNoise, missed_around
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
from palpate.controllers.paths.strips import Expectation, Place, Strip, StripColumns
from palpate.errors import FloatArray, InvalidValueError, check_positive, positive


class GoalError(Enum):
    """Which error a goal speaks of."""

    RMS = 2.0
    """Root mean square over the area; the value is the power with which errors count."""
    LARGEST = 4.0
    """The largest anywhere: large errors count far more than small ones."""


class StopReason(Enum):
    """Why an active exploration planned no further leg."""

    REACHED = "the map should be as accurate as asked for"
    SPENT = "the time was over"
    EXHAUSTED = "nothing was left to refine"


@dataclass(frozen=True, slots=True)
class Goal:
    """When an active exploration is done: whichever comes first.

    Attributes:
        error: Wanted error of the map [m].
        measure: Kind of the error.
        length: Path length of the tip, lifted or not [m].
        area: Part of the field over which `error` is wanted, between 0 and 1: the rest may stay unknown.
        time: Duration of the motion at `speed` [s]. A leg that has begun is finished.
        speed: Speed of the tip along the surface [m/s]; with `time` it bounds the path length.
    """

    error: float = 2e-5
    measure: GoalError = GoalError.RMS
    length: float = math.inf
    area: float = 1.0
    time: float = math.inf
    speed: float = 0.02

    def __post_init__(self) -> None:
        positive("goal error", self.error, "m")
        positive("goal length", self.length, "m", infinite_allowed=True)
        positive("goal time", self.time, "s", infinite_allowed=True)
        positive("goal speed", self.speed, "m/s")
        if not 0.0 <= self.area <= 1.0:
            raise InvalidValueError(f"goal area = {self.area:g}: must lie between 0 and 1 (all of the field)")

    @property
    def path_length(self) -> float:
        """Largest path length that `length` and `time` allow [m]."""
        return min(self.length, self.time * self.speed)


__all__ = ["meets", "reached"]

_SLIVER_SHARE = 0.01
"""Part of a field that no strip covers: rows begin and end within a stretch of where they were meant to."""


def meets(error: FloatArray, area: FloatArray, wanted: float, measure: GoalError) -> bool:
    """Return whether errors are as wanted: their largest, or their mean square.

    Args:
        error: Expected in each cell, shape (n,) [m].
        area: Areas of the cells, shape (n,) [m^2].
        wanted: Error [m].
        measure: Kind of the error.
    """
    if measure is GoalError.LARGEST:
        return bool(error.max(initial=0.0) <= wanted)
    return bool((error**2 * area).sum() <= area.sum() * wanted**2)


def reached(
    goal: Goal, margin: float, error: FloatArray, gap: FloatArray, area: FloatArray, *, field: float, prior: float
) -> bool:
    """Return whether the goal is met over as much of the field as it asks for, the best known parts first.

    Args:
        goal: Goal of the exploration.
        margin: Part of the goal's error that may be expected.
        error: Expected in each cell between two rows, shape (n,) [m].
        gap: Distance of the rows, shape (n,) [m].
        area: Areas of the cells, shape (n,) [m^2].
        field: Area of the whole field [m^2].
        prior: Cells between rows farther apart than this do not count as known [m].
    """
    wanted = goal.area * field * (1.0 - _SLIVER_SHARE)
    known = gap <= prior
    if goal.area >= 1.0 and not known.all():
        return False
    error, area = error[known], area[known]
    order = error.argsort()
    best = area[order].cumsum() <= max(wanted, area.sum() * goal.area)
    error, area = error[order][best], area[order][best]
    if area.sum() < wanted - area.max(initial=0.0):
        return False
    return meets(error, area, margin * goal.error, goal.measure)


_TRIED_GAPS = tuple(2e-3 * 1.15**k for k in range(40))
"""Gaps tried [m]; between two of them the error's law of the fourth power is used."""

_SIGNAL_RATIO = 4.0
"""Expected error over the goal at the gap from which the error is extrapolated: well above noise."""

_MAX_MEDIANS = 3.0
"""Where more than this many medians would be missed there is a detail, for strokes of its own. A wave misses at
most 1.4 medians of itself, an ellipsoid's rim twice."""

_RIM_ERROR_RATIO = 0.008
"""Wanted error over curvature gap^2, for the free sides of the field: between the ends of two rows a smooth map
goes on straight beyond the last contact, and errs by 0.02 curvature gap^2 (spheres of `benchmarks/active.py`:
0.15 mm at R 60 mm and 20 mm). Chosen there with `--tune`, less than half of it: what is wanted here is the goal
after a caution that interpolation needs, and this does not."""

_BEND_LENGTH = 5e-3
"""Length over which curvature is taken [m]: normals of 0.13 degrees make it uncertain by 0.6 / m there."""


class _CoarseGap:
    """Remembers what rows say about gaps: that does not change."""

    def __init__(self, noise: TouchNoise, stretch: float, spacing: float) -> None:
        """Take the noise of contacts, the stretches they are averaged over [m], and where gaps are tried [m]."""
        self._noise = noise
        self._stretch = stretch
        self._spacing = spacing
        self._missed: dict[tuple[int, float], FloatArray] = {}

    def wanted(self, rows: list[FeltRow], error: float, measure: GoalError, widest: float) -> float:
        """Return the distance of rows at which the error [m] is expected, at most `widest` [m]."""
        if measure is GoalError.LARGEST:
            widest = min(widest, math.sqrt(error / (_RIM_ERROR_RATIO * max(self._curvature(rows), 1e-6))))
        for gap in _TRIED_GAPS:
            typical = self.typical(rows, gap, measure)
            if typical > _SIGNAL_RATIO * error:
                return min(widest, gap * math.sqrt(math.sqrt(error / typical)))
        return widest

    def _curvature(self, rows: list[FeltRow]) -> float:
        """Return the median curvature along the rows, over enough of them to stand out of noise [1/m]."""
        bends = [np.zeros(0)]
        for row in rows:
            step = max(round(_BEND_LENGTH / self._stretch), 1)
            if len(row) > step:
                bends.append(np.abs(row.slope[step:] - row.slope[:-step]) / (row.u[step:] - row.u[:-step]))
        every = np.concatenate(bends)
        return float(np.median(every)) if len(every) else 0.0

    def typical(self, rows: list[FeltRow], gap: float, measure: GoalError) -> float:
        """Return what rows this far apart miss between them where there is no detail [m]."""
        values = [self._along(k, row, gap) for k, row in enumerate(rows)]
        every = np.concatenate(values) if values else np.zeros(0)
        if not len(every):
            return 0.0
        usual = every[every <= _MAX_MEDIANS * np.median(every)]
        if measure is GoalError.RMS:
            return float(np.sqrt(np.mean(usual**2)))
        return float(np.quantile(usual, 0.95))

    def _along(self, index: int, row: FeltRow, gap: float) -> FloatArray:
        key = (index, gap)
        if key not in self._missed:
            known = np.zeros(0)
            if len(row) > 1 and row.u[-1] - row.u[0] >= gap:
                at = np.arange(row.u[0] + 0.5 * gap, row.u[-1] - 0.5 * gap + self._spacing, self._spacing)
                known = missed_around(row, gap, at, self._noise.missed_variance(gap, self._stretch))
            self._missed[key] = known
        return self._missed[key]


__all__ = ["Active", "ActiveSettings", "Goal", "GoalError"]

_COLUMN_WIDTH = 5e-4
"""Width of the columns in which strips are judged [m]: below the finest detail that a millimetre of path shows."""

_ROW_TOLERANCE = 3e-4
"""Farther from its row than this the tip is still travelling to it [m]."""

_MAX_DETAIL_SHARE = 0.3
"""Part of the sum of squared errors that one detail may leave. Chosen with `benchmarks/active.py tuning`: over the
16 local explorations of `--seeds 8` the median path length to the RMS goal is 0.70 of the best raster's with it,
0.75 with all."""

_GOAL_MARGIN = 0.6
"""Expected error over the wanted one at which the goal counts as reached. In `benchmarks/active.py tuning
--seeds 15`, of 27 local explorations to 0.1 mm 2 stop early with it and 3 with 1.0, the median path length is the
same. It does not help where no row met a detail: there 0.5 mm were left and 0.01 mm expected."""

_OBSTACLE_DISTANCE = 3e-3
"""Before a stroke the tip is lifted past places closer than this to where a leg did not end well [m]."""


@dataclass(frozen=True, slots=True)
class ActiveSettings:
    """How an active exploration goes about it. Defaults were chosen with `benchmarks/active.py tuning`.

    Attributes:
        widest: Distance of rows on a surface that seems smooth [m].
        prior: Distance of rows that every part gets before the wanted error may end the exploration [m]: half of
            it is how far from a row detail worth finding is still felt.
        finest: Rows are not laid closer than this [m].
        stretch: Contacts are averaged over it [m].
        unknown: Error expected of detail that no row met, per gap.
        caution: Factor on the gap that the first rows ask for.
        noise: Random errors of the contacts.
    """

    widest: float = 0.0201
    prior: float = 0.0067
    finest: float = 5e-4
    stretch: float = 6e-4
    unknown: float = 1e-3
    caution: float = 1.0
    noise: TouchNoise = field(default_factory=TouchNoise)

    def __post_init__(self) -> None:
        check_positive(self, widest="m", prior="m", finest="m", stretch="m", caution="", unknown="")
        if not self.finest < self.prior <= self.widest:
            raise InvalidValueError(
                f"finest = {self.finest:g} m, prior = {self.prior:g} m, widest = {self.widest:g} m: must grow in "
                "this order"
            )

    @classmethod
    def suited(cls, measure: GoalError) -> "ActiveSettings":
        """Return the defaults for a measure: the largest error asks for closer rows than the mean does."""
        return cls() if measure is GoalError.RMS else cls(caution=0.85)


class Active(MarkingStrategy):
    """Explores a rectangle. All its choices follow from the reports it was given.

    Attributes:
        plane: In which the rectangle lies.
        path_length: Total length of the requested legs, lifted or not [m].
    """

    def __init__(
        self,
        width: float,
        depth: float,
        goal: Goal | None = None,
        *,
        center: Point = (0.0, 0.0),
        settings: ActiveSettings | None = None,
        plane: PathPlane | None = None,
    ) -> None:
        """Take the rectangle [m], the goal, and the settings."""
        self.plane = plane or PathPlane()
        self._goal = goal or Goal()
        self._settings = settings or ActiveSettings.suited(self._goal.measure)
        positive("width", width, "m")
        positive("depth", depth, "m")
        self._u = (center[0] - width / 2.0, center[0] + width / 2.0)
        self._v = (center[1] - depth / 2.0, center[1] + depth / 2.0)
        self.start()

    @property
    def rows(self) -> tuple[FeltRow, ...]:
        """Rows so far."""
        return tuple(self._rows)

    @property
    def stop_reason(self) -> StopReason | None:
        """Why it planned no further leg; None before that, or after a loss of contact."""
        return self._stop_reason

    def start(self) -> None:
        """Forget all contacts and begin again."""
        self._stop_reason: StopReason | None = None
        own = self._settings
        self._mark_recorder = MarkRecorder()
        self._recorder = RowRecorder(own.stretch)
        self._rows: list[FeltRow] = []
        self._coarse_gap = _CoarseGap(own.noise, own.stretch, _COLUMN_WIDTH)
        self._columns = StripColumns(
            *self._u, _COLUMN_WIDTH, Expectation(own.noise, own.stretch, own.unknown, own.prior)
        )
        self._stroke: Leg | None = None  # to follow the present hop
        self._row: float | None = None  # v of the present stroke
        self._at: Point = (self._u[0], self._v[0])
        self._coarse = True
        self._tried: set[Place] = set()
        self._sliding = False  # the tip is on the surface
        self._slid: tuple[Point, Point] | None = None  # the present stroke, if the tip slid to its beginning
        self._failed = False  # the last leg did not end well
        self._obstacles: list[Point] = []  # where legs did not end well
        self.path_length = 0.0

    def feel(self, felt: ContactPeriod) -> bool:
        """Record one period in contact; return whether the leg has found its end."""
        self._mark_recorder.feel(felt)
        u, v, height = self.plane.flat(felt.tip)
        if self._row is not None and self._stroke is None and abs(v - self._row) <= _ROW_TOLERANCE:
            slopes = self.plane.slopes(felt.normal)
            if slopes is not None:
                self._recorder.feel(u, height, *slopes)
        return False

    def next(self, ended: LegResult | None) -> Leg | None:
        """Return the next leg, or None at the end.

        A loss ends the exploration. A stroke that cannot be followed is marked, and its rest left out.
        """
        if ended is not None:
            self._mark_recorder.end(ended)
            if ended.how is LegEnd.LOST:
                return None
            self._failed = ended.how is not LegEnd.REACHED
            self._sliding = self._sliding or not self._failed
            if self._failed:
                u, v, _ = self.plane.flat(ended.tip)
                self._obstacles.append((u, v))
            if self._stroke is not None and not self._failed:
                stroke, self._stroke = self._stroke, None
                return stroke
            self._stroke = None
            felt = self._take_row()
            again, self._slid = self._slid, None
            if self._failed and again is not None and not felt:  # stopped before it got there: from above, then
                return self._go(*again)
        planned = self._plan()
        return None if planned is None else self._go(*planned)

    def _go(self, begin: Point, end: Point) -> Leg:
        self.path_length += math.dist(self._at, begin) + math.dist(begin, end)
        slid = self._sliding and not self._failed and self._clear(self._at, begin)
        self._at, self._row = end, begin[1]
        if slid:
            self._slid = (begin, end)
            return Stroke((begin, end))
        self._stroke = Stroke((end,))
        return Hop(begin)

    def _clear(self, begin: Point, end: Point) -> bool:
        """Whether the tip may slide from one point to the other: not past where it could not go on before."""
        length = math.dist(begin, end)
        along = ((end[0] - begin[0]) / length, (end[1] - begin[1]) / length) if length > 0.0 else (0.0, 0.0)
        for place in self._obstacles:
            u, v = place[0] - begin[0], place[1] - begin[1]
            projection = min(max(u * along[0] + v * along[1], 0.0), length)
            if math.dist((u, v), (projection * along[0], projection * along[1])) < _OBSTACLE_DISTANCE:
                return False
        return True

    def _take_row(self) -> bool:
        """Keep the contacts of the stroke; return whether they are enough for a row."""
        if self._row is None:
            return False
        row = self._recorder.take(self._row)
        if len(row) > 1:
            self._rows.append(row)
        return len(row) > 1

    def _plan(self) -> tuple[Point, Point] | None:
        if self.path_length >= self._goal.path_length:
            self._stop_reason = StopReason.SPENT
            return None
        return (self._coarse_stroke() if self._coarse else None) or self._fine_stroke()

    def _coarse_stroke(self) -> tuple[Point, Point] | None:
        """The next row of the first pass; None at its end."""
        near, far = self._u
        if self._row is None:
            return (near, self._v[0]), (far, self._v[0])
        if self._at[0] > 0.5 * (near + far):
            near, far = far, near
        rest = self._v[1] - self._row
        if rest > self._settings.finest:
            v = self._row + rest / max(math.ceil(rest / self._gap() - 0.15), 1)
            return (near, v), (far, v)
        self._coarse = False
        return None

    def _gap(self) -> float:
        """Return the distance of rows that the contacts so far require [m]."""
        own, goal = self._settings, self._goal
        gap = self._coarse_gap.wanted(self._rows, goal.error * own.caution**4, goal.measure, own.widest)
        return max(gap, 2.0 * own.finest)

    def _fine_stroke(self) -> tuple[Point, Point] | None:
        """The stroke that is worth most per path length; None if the goal is reached, or nothing is left."""
        own = self._settings
        if not self._rows:
            return None
        self._columns.take(self._rows)
        if self._reached():
            self._stop_reason = StopReason.REACHED
            return None
        open_strips = (
            ([] if self._known() else self._loud(1.0, tails=False))
            or self._whole(own.prior)
            or self._loud(_GOAL_MARGIN, tails=True)
            or self._whole(2.0 * own.finest)
        )
        if not open_strips:
            self._stop_reason = StopReason.EXHAUSTED
            return None
        best = max(open_strips, key=self._worth_per_length)
        self._tried.add(best.place)  # what could not be felt the first time is not asked for again
        return self._ends(best)

    def _loud(self, level: float, *, tails: bool) -> list[Strip]:
        """Return the strokes that details ask for, to bring their errors to `level` of the goal."""
        goal = self._goal
        error = level * goal.error
        tolerance = error
        if goal.measure is GoalError.RMS:
            tolerance = (
                level * _MAX_DETAIL_SHARE * goal.error**2 * (self._u[1] - self._u[0]) * (self._v[1] - self._v[0])
            )
        found = self._columns.loud(goal.measure.value, error, tolerance, tails=tails)
        return [s for s in found if s.gap >= 2.0 * self._settings.finest and s.place not in self._tried]

    def _whole(self, gap: float) -> list[Strip]:
        """Return the strips that are wider than a gap [m]."""
        found = self._columns.whole(self._goal.measure.value)
        return [s for s in found if s.gap > gap and s.place not in self._tried]

    def _ends(self, strip: Strip) -> tuple[Point, Point]:
        v, middle = strip.v, 0.5 * (strip.begin + strip.end)
        # a detail is about as long as the gap in which it was noticed, and its flanks count
        gap = 2.0 * min(v - strip.low, strip.high - v)
        half = max(0.5 * (strip.end - strip.begin) + strip.beside, 0.5 * gap)
        # what would be left of the strip at the end of the field is not worth coming back for
        near, far = self._u[0] + 0.5 * gap, self._u[1] - 0.5 * gap
        a = (middle - half if middle - half > near else self._u[0], v)
        b = (middle + half if middle + half < far else self._u[1], v)
        return (a, b) if math.dist(self._at, a) <= math.dist(self._at, b) else (b, a)

    def _worth_per_length(self, strip: Strip) -> float:
        begin, end = self._ends(strip)
        return strip.worth / (math.dist(self._at, begin) + math.dist(begin, end))

    def _known(self) -> bool:
        """Whether the details that were met leave no more than the goal allows."""
        error, _, area = self._columns.cells(tails=False)
        return meets(error, area, self._goal.error, self._goal.measure)

    def _reached(self) -> bool:
        field = (self._u[1] - self._u[0]) * (self._v[1] - self._v[0])
        error, gap, area = self._columns.cells()
        return reached(self._goal, _GOAL_MARGIN, error, gap, area, field=field, prior=self._settings.prior)
