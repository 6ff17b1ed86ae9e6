"""Active exploration: a coarse pass, then strokes where the map is expected to err most.

A Gaussian process of fixed length scale is as unsure everywhere between rows, whatever was felt. What was felt
tells more. Along a row, detail is seen as finely as contacts lie, so the row itself says what rows some gap apart
would miss (`missed`); a row between two others shows how well they predicted it (`innovation_error`). The first
rows thus choose the distance of the coarse pass; later, every strip between rows has an expected error, and the
stroke comes next that removes most of it per path length: details that were met first, and between them rows that
halve the widest strips, until no detail of the size that is sought can lie between two rows.
"""

import math
from dataclasses import dataclass, field

from palpate.controllers.paths.coarse import CoarseGap
from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.goal import Goal, GoalError, StopReason
from palpate.controllers.paths.legs import Hop, Leg, LegEnd, LegResult, Stroke
from palpate.controllers.paths.mark_recorder import MarkRecorder
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.missed import TouchNoise
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.controllers.paths.reached import meets, reached
from palpate.controllers.paths.row import Row, RowRecorder
from palpate.controllers.paths.strips import Columns, Expectation, Place, Strip
from palpate.errors import InvalidValueError, check_positive, positive

__all__ = ["Active", "ActiveSettings", "Goal", "GoalError"]

COLUMN = 5e-4
"""Width of the columns in which strips are judged [m]: below the finest detail that a millimetre of path tells."""

ROW_TOLERANCE = 3e-4
"""Farther from its row than this the tip is still travelling to it [m]."""

DETAIL = 0.3
"""Part of the sum of squared errors that one detail may leave. Chosen with `benchmarks/active.py tuning`: over the
16 local explorations of `--seeds 8` the median path length to the RMS goal is 0.70 of the best raster's with it,
0.75 with all."""

MARGIN = 0.6
"""Expected error over the wanted one at which the goal counts as reached. In `benchmarks/active.py tuning
--seeds 15`, of 27 local explorations to 0.1 mm 2 stop early with it and 3 with 1.0, the median path length is the
same. It does not help where no row met a detail: there 0.5 mm were left and 0.01 mm expected."""

CLEARANCE = 3e-3
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
        noise: Of the contacts.
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


class Active:
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
        """Take the rectangle [m], what is wanted, and how to go about it."""
        self.plane = plane or PathPlane()
        self._goal = goal or Goal()
        self._settings = settings or ActiveSettings.suited(self._goal.measure)
        positive("width", width, "m")
        positive("depth", depth, "m")
        self._u = (center[0] - width / 2.0, center[0] + width / 2.0)
        self._v = (center[1] - depth / 2.0, center[1] + depth / 2.0)
        self.start()

    @property
    def marks(self) -> tuple[Mark, ...]:
        """As `Strategy`."""
        return self._mark_recorder.marks

    @property
    def rows(self) -> tuple[Row, ...]:
        """What was felt so far."""
        return tuple(self._rows)

    @property
    def stop_reason(self) -> StopReason | None:
        """Why it planned no further leg; None before that, or after a loss of contact."""
        return self._stop_reason

    def start(self) -> None:
        """As `Strategy`."""
        self._stop_reason: StopReason | None = None
        own = self._settings
        self._mark_recorder = MarkRecorder()
        self._recorder = RowRecorder(own.stretch)
        self._rows: list[Row] = []
        self._coarse_gap = CoarseGap(own.noise, own.stretch, COLUMN)
        self._columns = Columns(*self._u, COLUMN, Expectation(own.noise, own.stretch, own.unknown, own.prior))
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
        """As `Strategy`."""
        self._mark_recorder.feel(felt)
        u, v, height = self.plane.flat(felt.tip)
        if self._row is not None and self._stroke is None and abs(v - self._row) <= ROW_TOLERANCE:
            slopes = self.plane.slopes(felt.normal)
            if slopes is not None:
                self._recorder.feel(u, height, *slopes)
        return False

    def next(self, ended: LegResult | None) -> Leg | None:
        """As `Strategy`. A loss ends it; a stroke that cannot be followed is marked, and its rest left out."""
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
            if math.dist((u, v), (projection * along[0], projection * along[1])) < CLEARANCE:
                return False
        return True

    def _take_row(self) -> bool:
        """Keep what was felt; return whether it was enough for a row."""
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
        """Return the distance of rows that what was felt so far asks for [m]."""
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
            or self._loud(MARGIN, tails=True)
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
            tolerance = level * DETAIL * goal.error**2 * (self._u[1] - self._u[0]) * (self._v[1] - self._v[0])
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
        return reached(self._goal, MARGIN, error, gap, area, field=field, prior=self._settings.prior)
