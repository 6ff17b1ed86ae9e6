"""Several runs in one figure: metrics as bars, lines over one another, and how errors are spread."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.commands.compare.compared_metric import ComparedMetric
from palpate.errors import FloatArray
from palpate.experiments.kit.comparable import ErrorSample
from palpate.reporting.figure import TIME, Axis, Figure, Panel
from palpate.reporting.marks import Bars, Dash, Line, Rule, shortened
from palpate.runtime.palette import SIDE_BY_SIDE, Colour

LONGEST_NAME, LONGEST_TICK = 32, 14
"""Letters of a run's name in a legend, and beside a bar."""

SHOWN_PERCENT = 99.5
"""Of all errors within the axis: a few outliers do not hide the rest."""

BINS = 60

ALIKE = 0.05
"""Metrics that differ by less, per the largest, are not shown as bars."""

COLUMNS = 3
"""Of bars, across a screen."""

THICK = 0.7
"""Of a bar, per distance to the next."""


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One line of one run.

    Attributes:
        run: Whose, from 0.
        time: Since its first period, shape (n,) [s].
        y: Shape (n,), may hold NaN.
        is_set_force: Whether it is the set force, drawn dashed.
    """

    run: int
    time: FloatArray
    y: FloatArray
    is_set_force: bool = False


def bars_figure(metrics: Sequence[ComparedMetric], names: Sequence[str]) -> Figure | None:
    """Return those metrics as bars that are numbers in which the runs differ; None if there are none."""
    panels = tuple(_bars(metric, names) for metric in metrics if _differs(metric))
    if not panels:
        return None
    return Figure(
        title="Metrics as bars",
        caption=f"Metrics of which two runs differ by more than {100.0 * ALIKE:g} %; all are in the table.",
        panels=panels,
        columns=min(COLUMNS, len(panels)),
        wide=True,
    )


def overlay_figure(
    title: str, caption: str, y: Axis, curves: Sequence[Curve], names: Sequence[str]
) -> Figure | None:
    """Return the runs' lines over one another, each in its run's colour; None if there is none."""
    if not any(np.isfinite(curve.y).any() for curve in curves):
        return None
    return Figure(title, caption, (Panel(tuple(_line(curve, names) for curve in curves), TIME, y),), wide=True)


def spread_figure(samples: Sequence[ErrorSample | None], names: Sequence[str]) -> Figure | None:
    """Return the shares of each run's errors; None if no run has any."""
    known = [(run, each) for run, each in enumerate(samples) if each is not None and len(each.values)]
    if not known:
        return None
    together = np.concatenate([each.values for _, each in known])
    low, high = np.percentile(together, [100.0 - SHOWN_PERCENT, SHOWN_PERCENT]).tolist()
    room = max(0.05 * (high - low), 1e-9)
    bins = np.linspace(low - room, high + room, BINS + 1)
    lines = []
    for run, each in known:
        count, _ = np.histogram(np.clip(each.values, bins[0], bins[-1]), bins)
        share = 100.0 * count / len(each.values)
        steps = np.concatenate([[0.0], np.repeat(share, 2), [0.0]])
        lines.append(Line(np.repeat(bins, 2), steps, shortened(names[run], LONGEST_NAME), colour_of(run)))
    first = known[0][1]
    panel = Panel((Rule(0.0), *lines), Axis(first.quantity, first.unit), Axis("share of the points", "%", low=0.0))
    return Figure(first.title, first.caption, (panel,))


def colour_of(run: int) -> Colour:
    """Return the colour of a run, from 0."""
    return SIDE_BY_SIDE[run % len(SIDE_BY_SIDE)]


def _line(curve: Curve, names: Sequence[str]) -> Line:
    name, again = shortened(names[curve.run], LONGEST_NAME), curve.run // len(SIDE_BY_SIDE) % 2
    if curve.is_set_force:
        return Line(curve.time, curve.y, f"{name}, set", colour_of(curve.run), dash=Dash.DASHED)
    dash = Dash.DOTTED if again else Dash.SOLID
    return Line(curve.time, curve.y, name, colour_of(curve.run), width=1.2, dash=dash, opacity=0.8)


def _differs(metric: ComparedMetric) -> bool:
    known = [value for value in metric.values if not isinstance(value, str) and math.isfinite(value)]
    return len(known) > 1 and max(known) - min(known) > ALIKE * max(map(abs, known))


def _bars(metric: ComparedMetric, names: Sequence[str]) -> Panel:
    """The first run above."""
    at = np.arange(len(names))[::-1].astype(np.float64)
    ticks = tuple((float(i), shortened(name, LONGEST_TICK)) for i, name in zip(at, names, strict=True))
    bars = tuple(
        Bars(
            at[run : run + 1], np.array([metric.scale.factor * value]), np.array([THICK]), "", colour_of(run), True
        )
        for run, value in enumerate(metric.values)
        if not isinstance(value, str) and math.isfinite(value)
    )
    y = Axis(low=-0.6, high=len(names) - 0.4, ticks=ticks)
    return Panel(bars, Axis(metric.name, metric.scale.unit), y, height=76 + 24 * len(names))
