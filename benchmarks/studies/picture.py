"""The picture of a study: cost against error, both logarithmic; below and to the left is better."""

import math
from collections.abc import Sequence

import numpy as np

from palpate.commands.scale import Scale, scale_of
from palpate.reporting.marks import Line, Mark, Points, Symbol
from palpate.reporting.picture import Axis, Panel, Picture
from palpate.runtime.palette import SIDE_BY_SIDE
from studies.study import Row, Study

SYMBOLS = (Symbol.DOT, Symbol.TRIANGLE, Symbol.SQUARE, Symbol.DIAMOND, Symbol.CROSS, Symbol.PLUS)
FLOOR = 1e-17
"""Errors of zero are drawn here."""


def study_picture(study: Study) -> Picture | None:
    """Return the picture; None if no row has both."""
    series: dict[str, list[Row]] = {}
    for row in study.rows:
        if math.isfinite(row.typical) and row.cost > 0.0:
            series.setdefault(row.series, []).append(row)
    if not series:
        return None
    drawn = [row for rows in series.values() for row in rows]
    cost = _scale(study.cost_unit, [row.cost for row in drawn])
    error = _scale(study.error_unit, [max(row.typical, FLOOR) for row in drawn])
    marks: list[Mark] = []
    for i, (name, rows) in enumerate(series.items()):
        colour, symbol = SIDE_BY_SIDE[i % len(SIDE_BY_SIDE)], SYMBOLS[i % len(SYMBOLS)]
        x = cost.factor * np.array([row.cost for row in rows])
        y = error.factor * np.array([max(row.typical, FLOOR) for row in rows])
        above = np.fmax(error.factor * np.array([row.worst for row in rows]) - y, 0.0)
        texts = tuple(row.method for row in rows)
        marks.append(Line(x, y, colour=colour, width=1.0))
        marks.append(
            Points(x, y, name, colour, 9.0, symbol, y_error=np.array([np.zeros_like(y), above]), texts=texts)
        )
    return Picture(
        title=f"{_capital(study.cost)} against error",
        caption=f"{_capital(study.cost)} against the error {study.error}: the mark is what is "
        "typical, the line above it goes up to the largest. Both scales are logarithmic; lower is better.",
        panels=(
            Panel(
                tuple(marks),
                Axis(study.cost, cost.unit, logarithmic=True),
                Axis(f"error {study.error}", error.unit, logarithmic=True),
                height=420,
            ),
        ),
        wide=True,
    )


def _scale(unit: str, values: Sequence[float]) -> Scale:
    """In which the values are read most easily: they are on a logarithmic scale, so that of their middle."""
    return scale_of(unit, float(np.exp(np.mean(np.log(values)))))


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]
