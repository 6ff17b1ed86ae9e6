"""Picture of speed against error, and the report page of several studies."""

import math
import os
import platform
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.study import Row, Study
from harness.tables import quantity
from palpate.commands.scale import scale_of
from palpate.experiments.kit.versions import versions_text
from palpate.reporting.marks import Line, Mark, Points, Symbol
from palpate.reporting.paper import paper_figure, printing
from palpate.reporting.picture import Axis, Panel, Picture
from palpate.reporting.report import Paragraph, Pictures, Report, Section, TextTable
from palpate.runtime.palette import SIDE_BY_SIDE
from palpate.strict_yaml import read_yaml

SYMBOLS = (Symbol.DOT, Symbol.TRIANGLE, Symbol.SQUARE, Symbol.DIAMOND, Symbol.CROSS)
FLOOR = 1e-17
"""Errors of zero are drawn here."""

COLUMNS, DOTS_PER_INCH = 3, 180


def study_picture(study: Study) -> Picture | None:
    """Return a panel per case and quantity, both axes logarithmic; None without any error.

    The mark is the typical error, the line above it ends at the largest one.
    """
    drawn = [row for row in study.rows if row.cost > 0.0 and any(map(_shown, _typical(row)))]
    if not drawn:
        return None
    looks = {name: i for i, name in enumerate(dict.fromkeys(row.series or row.method for row in drawn))}
    cost = scale_of(study.cost_unit, _middle([row.cost for row in drawn]))
    panels = []
    for k, (name, unit) in enumerate(study.quantities):
        values = [max(_typical(row)[k], FLOOR) for row in drawn if _shown(_typical(row)[k])]
        error = scale_of(unit, _middle(values)) if values else scale_of(unit, 1.0)
        for case in dict.fromkeys(row.case for row in drawn):
            marks: list[Mark] = []
            for series, look in looks.items():
                rows = [row for row in drawn if (row.case, row.series or row.method) == (case, series)]
                rows = [row for row in rows if _shown(_typical(row)[k])]
                marks += _marks(rows, k, cost.factor, error.factor, look, "" if panels else series)
            axes = Axis(study.cost, cost.unit, logarithmic=True), Axis(name, error.unit, logarithmic=True)
            panels.append(Panel(tuple(marks), *axes, title=case, height=300))
    caption = (
        "Cost against error, both logarithmic: lower left is better. The mark is typical, the bar the largest."
    )
    columns = min(COLUMNS, len(panels))
    return Picture(f"{study.title}: cost against error", caption, tuple(panels), columns, wide=True)


def save_picture(studies: Sequence[Study], path: Path) -> None:
    """Draw the first study that has a picture, with one legend below all panels."""
    picture = next(drawn for study in studies if (drawn := study_picture(study)))
    with printing():
        figure = paper_figure(picture)
        first = figure.axes[0]
        handles, names = first.get_legend_handles_labels()
        legend = first.get_legend()
        assert legend is not None
        legend.remove()
        first.set_title(picture.panels[0].title, fontsize=8.0, loc="left")
        figure.legend(handles, names, loc="outside lower center", ncols=5, frameon=False)
        figure.savefig(path, dpi=DOTS_PER_INCH)


def _marks(rows: list[Row], k: int, cost: float, error: float, look: int, name: str) -> list[Mark]:
    if not rows:
        return []
    colour, symbol = SIDE_BY_SIDE[look % len(SIDE_BY_SIDE)], SYMBOLS[look % len(SYMBOLS)]
    x = cost * np.array([row.cost for row in rows])
    y = error * np.array([max(row.errors[k].typical, FLOOR) for row in rows])
    above = np.fmax(error * np.array([row.errors[k].largest for row in rows]) - y, 0.0)
    bars, texts = np.array([np.zeros_like(y), np.nan_to_num(above)]), tuple(row.method for row in rows)
    return [
        Line(x, y, colour=colour, width=1.0),
        Points(x, y, name, colour, 7.0, symbol, y_error=bars, texts=texts),
    ]


def speed_error_report(studies: Sequence[Study], command: str) -> Report:
    """Return the report of studies; `command` repeats them."""
    found = read_yaml(versions_text())
    versions = tuple((str(k), str(v)) for k, v in found.items()) if isinstance(found, dict) else ()
    return Report(
        title="Speed against error",
        asked="cost of each method on this computer, and its error",
        outcome="Methods took turns: trust the ratios more than the times.",
        figures=(),
        sections=tuple(map(_section, studies)),
        repeat=(("All of it again:", command),),
        settings=(("computer", f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"), *versions),
        footer="Errors are measured against known truths.",
    )


def _section(study: Study) -> Section:
    heads = ["case", "method", study.cost]
    for name, _ in study.quantities:
        heads += [name, "largest"]
    rows = []
    for row in study.rows:
        cells = [row.case, row.method, quantity(row.cost, study.cost_unit)]
        for error, (_, unit) in zip(row.errors, study.quantities, strict=True):
            cells += [quantity(error.typical, unit), quantity(error.largest, unit)]
        rows.append((*cells, row.note))
    columns = ("name", "name", *["value"] * (len(heads) - 2), "note")
    drawn = Pictures(lambda: [study_picture(study)])
    return Section(study.title, (Paragraph(study.about), drawn, TextTable(rows, columns, (*heads, ""))))


def _typical(row: Row) -> tuple[float, ...]:
    return tuple(each.typical for each in row.errors)


def _shown(value: float) -> bool:
    return math.isfinite(value)


def _middle(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))
