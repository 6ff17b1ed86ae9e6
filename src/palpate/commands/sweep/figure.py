"""Figures of a sweep: metrics against the varied options, with their spread over the seeds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from pathlib import Path

import numpy as np

from palpate.commands.sweep.plan import NAME_DIGITS
from palpate.commands.sweep.result import (
    FEWEST_SEEDS,
    HIGH,
    LOW,
    MetricSpread,
    SweepResult,
    numbers_of,
    spread_of,
)
from palpate.commands.typed_values import Varied, shown_value
from palpate.errors import FloatArray
from palpate.experiments.kit.metric import Metric, MetricValue, is_share
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Band, Cells, Colouring, Dash, Line, Mark, Points, Rule, Text, shortened
from palpate.reporting.paper import write_figure
from palpate.reporting.units import Scale, scale_of
from palpate.runtime.palette import FELT, MAP_COLOUR, QUIET_COLOUR, SIDE_BY_SIDE, Colour

LOGARITHMIC_RATIO = 20.0
"""Ratio of the largest to the smallest value at which the axis becomes logarithmic."""

AXIS_MARGIN = 0.04
"""Margin beside the first and the last number, per the distance between them."""

LONGEST_NAME = 18
"""Longest name of a value, in letters."""


@dataclass(frozen=True)
class OptionAxis:
    """An option with its values.

    Attributes:
        varied: Option with its values.
        unit: SI unit; "" for none.
    """

    varied: Varied
    unit: str

    @cached_property
    def numeric(self) -> bool:
        """Whether the values are numbers."""
        return all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.varied.values)

    @cached_property
    def words(self) -> str:
        """Name as text."""
        return self.varied.name.replace("_", " ")

    @cached_property
    def places(self) -> FloatArray:
        """Places of the values along the axis, shape (n,); words are numbered."""
        if not self.numeric:
            return np.arange(float(len(self.varied.values)))
        return np.array([self._scale.factor * float(value) for value in self.varied.values])  # type: ignore[arg-type]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Values in the unit of the axis, as distinct texts."""
        names = [self._text(value) for value in self.varied.values]
        return tuple(
            names if len(set(names)) == len(names) else (f"{i + 1}: {each}" for i, each in enumerate(names))
        )

    @cached_property
    def assignments(self) -> tuple[str, ...]:
        """Option, value and unit for each value."""
        return tuple(f"{self.words} = {each} {self._scale.unit}".rstrip() for each in self.names)

    @cached_property
    def axis(self) -> Axis:
        """Axis of the values."""
        if not self.numeric:
            ticks = tuple(zip(self.places.tolist(), self.names, strict=True))
            return Axis(self.words, low=-0.6, high=len(ticks) - 0.4, ticks=ticks)
        least, largest = float(self.places.min()), float(self.places.max())
        if least > 0.0 and largest >= LOGARITHMIC_RATIO * least:
            room = (largest / least) ** AXIS_MARGIN
            return Axis(self.words, self._scale.unit, least / room, largest * room, logarithmic=True)
        room = AXIS_MARGIN * (largest - least)
        return Axis(self.words, self._scale.unit, least - room, largest + room)

    @cached_property
    def _scale(self) -> Scale:
        if not self.numeric:
            return Scale(1.0, self.unit)
        return scale_of(self.unit, max(abs(float(value)) for value in self.varied.values))  # type: ignore[arg-type]

    def _text(self, value: object) -> str:
        if isinstance(value, float) and self.numeric:
            return f"{self._scale.factor * value:.{NAME_DIGITS}g}"
        return shortened(shown_value(value).rsplit("/", 1)[-1], LONGEST_NAME)  # of a file, its name


METRIC_LOGARITHMIC_RATIO = 100.0
"""Ratio of the largest to the smallest value at which a metric's axis becomes logarithmic."""

LEAST_SPAN = 0.01
"""Smallest span of a metric's axis, per the largest number; a smaller span shows rounding."""

SAME_LINE_SHARE = 0.01
"""Lines closer than this share of their common span look like one line."""

MAX_COLUMNS = 3
"""Panels side by side, across a screen."""

MOST_TICKS = 8
"""Largest number of ticks on the axis of seeds."""


@dataclass(frozen=True, slots=True)
class _Shown:
    """A metric in one panel: option along x, option that makes lines, axis and scale."""

    result: SweepResult
    metric: Metric
    scale: Scale
    axis: Axis
    share: bool
    along: OptionAxis | None = None
    lines: OptionAxis | None = None

    @property
    def is_map(self) -> bool:
        """Whether the panel is drawn as cells because there are too many lines."""
        return self.lines is not None and len(self.lines.names) > len(SIDE_BY_SIDE)


@dataclass(frozen=True, slots=True, eq=False)
class _Row:
    """Runs along x that share a value of the other option.

    Attributes:
        line: Number of the value of the other option, from 0.
        name: Name of that value; "" without another option.
        at: Numbers of the values along x that have a run, in order, shape (k,).
        x: Places of these values, shape (k,).
        values: Metric of all runs at each place, in the unit of the axis.
        spreads: Spreads of the values.
        seeds: Smallest number of runs of a combination.
    """

    line: int
    name: str
    at: tuple[int, ...]
    x: FloatArray
    values: tuple[FloatArray, ...]
    spreads: tuple[MetricSpread, ...]
    seeds: int

    @property
    def colour(self) -> Colour:
        """Colour of the line."""
        return SIDE_BY_SIDE[self.line % len(SIDE_BY_SIDE)] if self.name else FELT

    @property
    def middle(self) -> FloatArray:
        """Medians or shares, shape (k,)."""
        return np.array([each.middle for each in self.spreads])


def figures(result: SweepResult) -> list[Figure]:
    """Return a figure of each metric."""
    return [_figure(result, metric) for metric in result.metrics]


def summary_figure(result: SweepResult) -> Figure:
    """Return all figures as one, for a file."""
    each = figures(result)
    nothing = Panel(
        (Text(0.5, 0.5, "no run has a metric to show"),), Axis(low=0.0, high=1.0), Axis(low=0.0, high=1.0)
    )
    first, *others = (panel for figure in each for panel in figure.panels) if each else (nothing,)
    title = result.plan.title
    return Figure(title, "", (replace(first, title=title), *others), each[0].columns if each else 1, wide=True)


def write_summary(result: SweepResult, path: Path) -> None:
    """Write the figure as a PNG file.

    Raises:
        OSError: The file cannot be written.
    """
    write_figure(summary_figure(result), path)


def _figure(result: SweepResult, metric: Metric) -> Figure:
    values = result.values(metric, result.plan.combinations)
    numbers = numbers_of(values)
    largest = float(np.abs(numbers).max(initial=0.0))
    scale = scale_of(metric.unit, largest)
    logarithmic = numbers.size > 0 and numbers.min() > 0.0 and largest >= METRIC_LOGARITHMIC_RATIO * numbers.min()
    axis = Axis(
        metric.meaning, scale.unit, span=LEAST_SPAN * scale.factor * largest, logarithmic=bool(logarithmic)
    )
    shown = _Shown(result, metric, scale, axis, is_share(values))
    each = [replace(shown, along=along, lines=lines) for along, lines in panel_options(result)]
    columns = min(MAX_COLUMNS, len(each))
    rows = [_rows(one) for one in each]
    return Figure(
        title=metric.meaning[:1].upper() + metric.meaning[1:],
        caption=_caption(each, [row for found in rows for row in found]) + _coinciding(each, rows),
        panels=tuple(_panel(one, found) for one, found in zip(each, rows, strict=True)),
        columns=columns,
        wide=columns > 1,
    )


def panel_options(result: SweepResult) -> list[tuple[OptionAxis | None, OptionAxis | None]]:
    """Return the option along x and the option that makes lines, for each panel."""
    varied = [OptionAxis(each, result.plan.unit(each.name)) for each in result.plan.varied if len(each.values) > 1]
    if not varied:
        return [(None, None)]
    if len(varied) != 2:
        return [(each, None) for each in varied]
    # the option with numbers, and with more of them, goes along x
    along, lines = sorted(varied, key=lambda each: (each.numeric, len(each.names)), reverse=True)
    return [(along, lines)]


def _caption(each: Sequence[_Shown], rows: Sequence[_Row]) -> str:
    result, first = each[0].result, each[0]
    count, left = len(result.plan.seeds), len(result.failures)
    seeds = "one run each" if count == 1 else f"{count} seeds each"
    few = any(row.seeds < FEWEST_SEEDS for row in rows) or count < FEWEST_SEEDS
    others = "" if len(each) == 1 else ", over all values of the other options"
    if first.along is None:
        caption = "Each point is a run, one per seed" + ("." if few else "; the line is their median.")
    elif first.share:
        caption = f"Share of the runs for which it is so, {seeds}{others}."
    elif first.is_map:
        caption = f"Medians over the seeds, {seeds}, as colours; grey where no run got to its end."
    elif few:
        joined = count > 1 and any(one.along is not None and one.along.numeric for one in each)
        caption = f"Each point is a run, {seeds}{others}" + ("; lines join their medians." if joined else ".")
    else:
        caption = f"Medians; bands hold the runs from {LOW:g} to {HIGH:g} %, {seeds}{others}."
        caption += " Where bands do not meet, the difference is hardly chance."
    if few and not result.seeds_alike:
        caption += f" Fewer than {FEWEST_SEEDS} seeds do not tell what is chance."
    return caption + (
        f" {left} run{'s' if left > 1 else ''} that did not get to the end left out." if left else ""
    )


def _coinciding(each: Sequence[_Shown], rows: Sequence[Sequence[_Row]]) -> str:
    """Return a sentence on lines that hide one another."""
    found = []
    for shown, group in zip(each, rows, strict=True):
        if shown.along is not None and shown.along.numeric and not shown.is_map:
            found += [" and ".join(row.name for row in alike) for alike in _alike(shown, group)]
    return f" Indistinguishable here: {'; '.join(found)}." if found else ""


def _alike(shown: _Shown, rows: Sequence[_Row]) -> list[list[_Row]]:
    """Return groups of two or more rows whose lines look like one."""
    if len(rows) < 2:
        return []
    heights = {id(row): np.log10(row.middle) if shown.axis.logarithmic else row.middle for row in rows}
    together = np.concatenate(list(heights.values()))
    near = SAME_LINE_SHARE * max(float(np.ptp(together)), 0.0 if shown.axis.logarithmic else shown.axis.span)
    groups: list[list[_Row]] = []
    for row in rows:
        for group in groups:
            same = np.array_equal(group[0].x, row.x)
            if same and np.abs(heights[id(group[0])] - heights[id(row)]).max() <= near:
                group.append(row)
                break
        else:
            groups.append([row])
    return [group for group in groups if len(group) > 1]


def _panel(shown: _Shown, rows: Sequence[_Row]) -> Panel:
    if shown.along is None:
        return _seeds_panel(shown)
    if shown.is_map:
        return _map_panel(shown, rows)
    covering = {id(row) for group in _alike(shown, rows) for row in group[1:]}
    marks = [
        mark for row in rows for mark in _marks(shown, row, Dash.DASHED if id(row) in covering else Dash.SOLID)
    ]
    return Panel(tuple(marks), shown.along.axis, shown.axis, height=340)


def _marks(shown: _Shown, row: _Row, dash: Dash) -> tuple[Mark, ...]:
    """Return a line with its band; every run where there are few seeds; points alone for words."""
    assert shown.along is not None
    joined, few = shown.along.numeric and len(row.x) > 1, row.seeds < FEWEST_SEEDS
    line = (Line(row.x, row.middle, row.name, row.colour, 1.0 if few else 1.8, dash),) if joined else ()
    name = "" if joined else row.name
    if few and not shown.share:
        x = np.repeat(row.x, [len(values) for values in row.values])
        return (*line, Points(x, np.concatenate(row.values), name, row.colour, 6.0))
    low, high = (np.array([getattr(each, end) for each in row.spreads]) for end in ("low", "high"))
    error = None if joined or shown.share else np.array([row.middle - low, high - row.middle])
    texts = tuple(_told(each, shown) for each in row.spreads)
    points = Points(row.x, row.middle, name, row.colour, 6.0, y_error=error, texts=texts)
    band = (Band(row.x, low, high, colour=row.colour),) if joined and not shown.share else ()
    return (*band, *line, points)


def _told(spread: MetricSpread, shown: _Shown) -> str:
    runs = f"{spread.count} run{'s' if spread.count > 1 else ''}"
    if shown.share:
        return f"share of {runs}"
    return f"median of {runs}; {LOW:g} to {HIGH:g} %: {spread.low:.4g} to {spread.high:.4g} {shown.scale.unit}"


def _seeds_panel(shown: _Shown) -> Panel:
    done = [record for record in shown.result.records if record.done]
    pairs = [(float(record.seed), record.metrics.get(shown.metric.key)) for record in done]
    known = [(seed, shown.scale.factor * value) for seed, value in pairs if isinstance(value, bool | int | float)]
    seeds, values = (np.array([pair[i] for pair in known]) for i in (0, 1))
    middle = float(np.median(values)) if len(values) >= FEWEST_SEEDS else None
    all_seeds = shown.result.plan.seeds
    ticks = tuple((float(seed), str(seed)) for seed in all_seeds[:: -(-len(all_seeds) // MOST_TICKS)])
    rule = () if middle is None else (Rule(middle, "median", QUIET_COLOUR, upright=False),)
    points = Points(seeds, values, texts=tuple(f"seed {seed:.0f}" for seed in seeds))
    return Panel(
        (*rule, points), Axis("seed", low=all_seeds[0] - 0.5, high=all_seeds[-1] + 0.5, ticks=ticks), shown.axis
    )


def _map_panel(shown: _Shown, rows: Sequence[_Row]) -> Panel:
    along, lines = shown.along, shown.lines
    assert along is not None
    assert lines is not None
    field = np.full((len(lines.names), len(along.names)), np.nan)
    for row in rows:
        field[row.line, list(row.at)] = row.middle
    across, upwards = np.argsort(along.places), np.argsort(lines.places)[::-1]
    colouring = Colouring(shown.axis.quantity, np.ravel(field[np.ix_(upwards, across)]), shown.axis.unit)
    cells = Cells(colouring, tuple(along.names[i] for i in across), tuple(lines.names[i] for i in upwards))
    x, y = (Axis(axis.quantity, axis.unit) for axis in (along.axis, lines.axis))
    return Panel((cells,), x, y, ground=MAP_COLOUR, height=400)


def _rows(shown: _Shown) -> list[_Row]:
    """Return the rows of a panel: one for each value of the other option that has a run."""
    along, lines, plan = shown.along, shown.lines, shown.result.plan
    if along is None:
        return []
    names = [each.name for each in plan.varied]
    groups: Sequence[object] = (None,) if lines is None else lines.varied.values
    shift = 0.0 if along.numeric or lines is None else 0.5 / len(groups)
    runs: dict[
        tuple[int, int], list[list[MetricValue]]
    ] = {}  # by line and place along x, those of each combination
    for combination, found in zip(plan.combinations, shown.result.by_combination(shown.metric), strict=True):
        line = 0 if lines is None else groups.index(combination.values[names.index(lines.varied.name)])
        at = along.varied.values.index(combination.values[names.index(along.varied.name)])
        if len(numbers_of(found)):
            runs.setdefault((line, at), []).append(found)
    rows = []
    for line in range(len(groups)):
        known = [at for at in np.argsort(along.places).tolist() if (line, at) in runs]
        if not known:
            continue
        each = [list(chain.from_iterable(runs[line, at])) for at in known]
        rows.append(
            _Row(
                line,
                "" if lines is None else lines.assignments[line],
                tuple(known),
                along.places[known] + shift * (line - 0.5 * (len(groups) - 1)),
                tuple(shown.scale.factor * numbers_of(values) for values in each),
                tuple(spread_of(values).scaled(shown.scale.factor) for values in each),
                min(len(numbers_of(found)) for at in known for found in runs[line, at]),
            )
        )
    return rows
