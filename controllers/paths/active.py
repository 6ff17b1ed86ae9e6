"""Goes where the map would err most: a coarse pass, then strokes where something was felt that it would miss.

A Gaussian process of fixed length scale is as unsure everywhere between rows, whatever was felt. What was felt
tells more: along a row, detail is seen as finely as contacts lie, so the row itself says what rows some gap apart
would miss (`palpate.controllers.paths.missed`). The first row thus chooses the distance of the next; later, every
strip between rows has an expected error, and the stroke comes next that takes away most of it per way.
"""

import math
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise

from palpate.controllers.paths.diary import Diary
from palpate.controllers.paths.felt import Felt
from palpate.controllers.paths.legs import Ended, Hop, Leg, LegEnd, Stroke
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.missed import TouchNoise, typical
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.controllers.paths.row import Row, RowRecorder
from palpate.controllers.paths.strips import Columns, Expectation, Strip
from palpate.errors import InvalidValueError, positive

COLUMN = 5e-4
"""Width of the columns in which strips are judged [m]: below the finest detail that a millimetre of path tells."""

LADDER = tuple(2e-3 * 1.15**k for k in range(40))
"""Gaps tried for the coarse pass [m]; between two of them the error's law of the fourth power is used."""

SIGNAL = 4.0
"""What rows miss is extrapolated from the gap at which it is this many times the goal: above noise."""

ASIDE = 3e-4
"""Farther from its row than this the tip is still on the way to it [m]."""


class Measure(Enum):
    """Which error a goal speaks of."""

    RMS = 2.0
    """Root mean square over the area; the value is the power with which errors count."""
    LARGEST = 4.0
    """The largest anywhere: large errors count far more than small ones."""


@dataclass(frozen=True, slots=True)
class Goal:
    """When an active exploration is done: whichever comes first.

    Attributes:
        error: Wanted error of the map [m].
        measure: Of which kind.
        length: Way of the tip, lifted or not [m].
        area: Part of the field that must lie between rows at most `ActiveSettings.prior` apart before `error`
            counts.
    """

    error: float = 2e-5
    measure: Measure = Measure.RMS
    length: float = math.inf
    area: float = 1.0

    def __post_init__(self) -> None:
        positive("goal error", self.error, "m")
        positive("goal length", self.length, "m", infinite_allowed=True)
        if not 0.0 <= self.area <= 1.0:
            raise InvalidValueError(f"goal area = {self.area:g}: must lie between 0 and 1 (all of the field)")


@dataclass(frozen=True, slots=True)
class ActiveSettings:
    """How an active exploration goes about it. Defaults were chosen with `benchmarks/active.py --tune`.

    Attributes:
        widest: Distance of rows on a surface that seems smooth [m].
        prior: Distance of rows that every part gets before strokes are chosen [m]: half of it is how far from a
            row detail worth finding is still felt.
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
    caution: float = 0.94
    noise: TouchNoise = field(default_factory=TouchNoise)

    def __post_init__(self) -> None:
        for name, unit in (("widest", "m"), ("prior", "m"), ("finest", "m"), ("stretch", "m"), ("caution", "")):
            positive(name, getattr(self, name), unit)
        positive("unknown", self.unknown, "")
        if not self.finest < self.prior <= self.widest:
            raise InvalidValueError(
                f"finest = {self.finest:g} m, prior = {self.prior:g} m, widest = {self.widest:g} m: must grow in "
                "this order"
            )

    @classmethod
    def suited(cls, measure: Measure) -> "ActiveSettings":
        """Return the defaults for a measure: the largest error asks for closer rows than the mean does."""
        return cls() if measure is Measure.RMS else cls(widest=0.0134, caution=0.75)


class Active:
    """Explores a rectangle. All its choices follow from what it was told.

    Attributes:
        plane: In which the rectangle lies.
        way: Length of the legs asked for, lifted or not [m].
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
        return self._diary.marks

    @property
    def rows(self) -> tuple[Row, ...]:
        """What was felt so far."""
        return tuple(self._rows)

    def start(self) -> None:
        """As `Strategy`."""
        self._diary = Diary()
        self._recorder = RowRecorder(self._settings.stretch)
        self._rows: list[Row] = []
        self._queue: list[tuple[Point, Point]] = []
        self._stroke: Leg | None = None  # to follow the present hop
        self._row: float | None = None  # v of the present stroke
        self._at: Point = (self._u[0], self._v[0])
        self._coarse = True
        self._tried: list[Strip] = []
        self.way = 0.0

    def feel(self, felt: Felt) -> bool:
        """As `Strategy`."""
        self._diary.feel(felt)
        u, v, height = self.plane.flat(felt.tip)
        if self._row is not None and self._stroke is None and abs(v - self._row) <= ASIDE:
            slopes = self.plane.slopes(felt.normal)
            if slopes is not None:
                self._recorder.feel(u, height, *slopes)
        return False

    def next(self, ended: Ended | None) -> Leg | None:
        """As `Strategy`. A loss ends it; a stroke that cannot be followed is marked, and its rest left out."""
        if ended is not None:
            self._diary.end(ended)
            if ended.how is LegEnd.LOST:
                return None
            if self._stroke is not None and ended.how is LegEnd.REACHED:
                stroke, self._stroke = self._stroke, None
                return stroke
            self._stroke = None
            self._take_row()
        planned = self._plan()
        return None if planned is None else self._go(*planned)

    def _go(self, begin: Point, end: Point) -> Leg:
        self.way += math.dist(self._at, begin) + math.dist(begin, end)
        self._at, self._row = end, begin[1]
        self._stroke = Stroke((end,))
        return Hop(begin)

    def _take_row(self) -> None:
        if self._row is not None:
            row = self._recorder.take(self._row)
            if len(row) > 1:
                self._rows.append(row)

    def _plan(self) -> tuple[Point, Point] | None:
        if self.way >= self._goal.length:
            return None
        if not self._queue:
            self._queue = self._coarse_strokes() if self._coarse else []
        if not self._queue:
            self._queue = self._fine_strokes()
        return self._queue.pop(0) if self._queue else None

    def _coarse_strokes(self) -> list[tuple[Point, Point]]:
        """The next row of the first pass; then, at once, the rows between that `prior` asks for."""
        near, far = self._u
        if self._row is None:
            return [((near, self._v[0]), (far, self._v[0]))]
        if self._at[0] > 0.5 * (near + far):
            near, far = far, near
        rest = self._v[1] - self._row
        if rest > self._settings.finest:
            v = self._row + rest / max(math.ceil(rest / self._coarse_gap() - 0.15), 1)
            return [((near, v), (far, v))]
        self._coarse = False
        strokes: list[tuple[Point, Point]] = []
        levels = sorted({*self._v, *(row.v for row in self._rows)}, reverse=True)
        for high, low in pairwise(levels):
            count = math.ceil((high - low) / self._settings.prior - 0.05)
            for k in range(1, count):
                v = high - (high - low) * k / count
                strokes.append(((near, v), (far, v)))
                near, far = far, near
        return strokes

    def _coarse_gap(self) -> float:
        """Return the distance of rows that what was felt so far asks for [m]."""
        own, gap = self._settings, self._settings.widest
        quantile = 0.5 if self._goal.measure is Measure.RMS else 0.8
        for tried in LADDER:
            if tried > self._u[1] - self._u[0]:
                break
            noise = own.noise.missed_variance(tried, own.stretch)
            error = typical(self._rows, tried, COLUMN, noise, quantile)
            if error > SIGNAL * self._goal.error:
                gap = min(gap, own.caution * tried * (self._goal.error / error) ** 0.25)
                break
        return max(gap, 2.0 * own.finest)

    def _fine_strokes(self) -> list[tuple[Point, Point]]:
        """The stroke along the strip that is worth most per way; none if the goal is reached everywhere."""
        own, goal = self._settings, self._goal
        how = Expectation(own.noise, own.stretch, own.unknown)
        strips = Columns(self._rows, *self._u, COLUMN, how).strips(goal.measure.value, goal.error)
        open_strips = [s for s in strips if s.gap >= 2.0 * own.finest and s not in self._tried]
        if not open_strips or self._reached(strips):
            return []
        best = max(open_strips, key=self._worth_per_way)
        self._tried.append(best)  # what could not be felt the first time is not asked for again
        begin, end = self._ends(best)
        return [(begin, end)]

    def _ends(self, strip: Strip) -> tuple[Point, Point]:
        v = 0.5 * (strip.low + strip.high)
        a, b = (strip.begin, v), (strip.end, v)
        return (a, b) if math.dist(self._at, a) <= math.dist(self._at, b) else (b, a)

    def _worth_per_way(self, strip: Strip) -> float:
        begin, end = self._ends(strip)
        return strip.worth / (math.dist(self._at, begin) + math.dist(begin, end))

    def _reached(self, strips: list[Strip]) -> bool:
        """Whether the error that is expected meets the goal, over enough of the field."""
        width, depth = self._u[1] - self._u[0], self._v[1] - self._v[0]
        power = self._goal.measure.value
        whole = [s for s in strips if s.whole]
        near = sum((s.end - s.begin) * s.gap for s in whole if s.gap <= self._settings.prior)
        if near < (self._goal.area - 1e-9) * width * depth * 0.97:
            return False
        if self._goal.measure is Measure.LARGEST:
            return max((s.worst for s in whole), default=0.0) <= self._goal.error
        area = sum((s.end - s.begin) * s.gap for s in whole)
        return bool(sum(s.worth for s in whole) <= area * self._goal.error**power)
