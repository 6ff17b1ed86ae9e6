"""The picture of a study: cost against error, both logarithmic; below and to the left is better."""

import math
from collections.abc import Sequence

from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, LogLocator, NullFormatter

from palpate.reporting.style import SIDE_BY_SIDE, Picture, Width, legend_above, new_figure, style_axes
from studies.study import Row, Study

SHAPES = "o^sDvP"
FLOOR = 1e-17
"""Errors of zero are drawn here."""

FEW_POWERS = 200.0
"""Ratio of the largest to the least value up to which 2 and 5 are numbered, too."""


def study_picture(study: Study) -> Picture | None:
    """Return the picture; None if no row has both."""
    series: dict[str, list[Row]] = {}
    for row in study.rows:
        if math.isfinite(row.typical) and row.cost > 0.0:
            series.setdefault(row.series, []).append(row)
    if not series:
        return None
    return Picture(
        title=f"{_capital(study.cost)} against error",
        caption=f"{_capital(study.cost)} against the error {study.error}: the mark is what is "
        "typical, the line above it goes up to the largest. Both scales are logarithmic; lower is better.",
        full=_drawn(study, series, Width.FULL, 3),
        narrow=_drawn(study, series, Width.HALF, 1),
    )


def _drawn(study: Study, series: dict[str, list[Row]], width: Width, columns: int) -> Figure:
    figure = new_figure(width, 3.6 + 0.2 * math.ceil(len(series) / columns))
    axes = figure.subplots()
    for i, (name, rows) in enumerate(series.items()):
        colour, shape = SIDE_BY_SIDE[i % len(SIDE_BY_SIDE)], SHAPES[i % len(SHAPES)]
        costs = [row.cost for row in rows]
        errors = [max(row.typical, FLOOR) for row in rows]
        axes.plot(costs, errors, color=colour, marker=shape, markersize=6.0, linewidth=0.8, label=name)
        for row, error in zip(rows, errors, strict=True):
            if math.isfinite(row.worst) and row.worst > error:
                axes.plot([row.cost, row.cost], [error, row.worst], color=colour, linewidth=1.4, alpha=0.55)
    axes.margins(x=0.12)
    axes.set_xscale("log")
    axes.set_yscale("log")
    drawn = [row for rows in series.values() for row in rows]
    _tick(axes.xaxis, [row.cost for row in drawn], study.cost_unit)
    if study.error_unit:
        _tick(axes.yaxis, [max(row.typical, FLOOR) for row in drawn], study.error_unit)
    style_axes(axes, x=_words(study.cost, study.cost_unit), y=f"error {_words(study.error, study.error_unit)}")
    if len(series) > 1:
        legend_above(figure, [axes], columns)
    return figure


def _tick(axis: Axis, values: Sequence[float], unit: str) -> None:
    """Number a logarithmic axis with prefixes of its unit; between powers of ten, too, if there are few."""
    few = max(values) < FEW_POWERS * min(values)
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axis.set_major_formatter(EngFormatter(unit, sep="\N{NO-BREAK SPACE}"))
    axis.set_minor_formatter(NullFormatter())


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def _words(what: str, unit: str) -> str:
    return f"{what} [{unit}]" if unit else what
