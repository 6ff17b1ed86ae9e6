"""Figure of speed against error, and the report page of several studies."""

import math
import os
import platform
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.study import Row, Study
from harness.tables import quantity
from palpate.experiments.kit.config_file import versions_text
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Line, Mark, Points, Symbol
from palpate.reporting.paper import paper_figure, printing
from palpate.reporting.report import Figures, Paragraph, Report, Section, TextTable
from palpate.reporting.units import scale_of
from palpate.runtime.palette import SIDE_BY_SIDE
from palpate.strict_yaml import read_yaml

SYMBOLS = (Symbol.DOT, Symbol.TRIANGLE, Symbol.SQUARE, Symbol.DIAMOND, Symbol.CROSS)
FLOOR = 1e-17
"""Errors of zero are drawn here."""

COLUMNS, DOTS_PER_INCH = 3, 180


def study_figure(studies: Sequence[Study]) -> Figure | None:
    """Return a panel per case and quantity, both axes logarithmic; None without any error.

    The mark is the typical error, the line above it ends at the largest one.
    """
    drawn = [row for study in studies for row in study.rows if _shown(row)]
    looks = {name: i for i, name in enumerate(dict.fromkeys(row.series or row.method for row in drawn))}
    panels, named = list[Panel](), set[str]()
    for study in studies:
        rows = [row for row in study.rows if _shown(row)]
        for k, (name, unit) in enumerate(study.quantities[: study.pictured]):
            for case in dict.fromkeys(row.case for row in rows):
                here = [row for row in rows if row.case == case and math.isfinite(row.errors[k].typical)]
                cost = scale_of(study.cost_unit, _middle([row.cost for row in here]))
                error = scale_of(unit, _middle([max(row.errors[k].typical, FLOOR) for row in here]))
                marks: list[Mark] = []
                for series in dict.fromkeys(row.series or row.method for row in here):
                    some = [row for row in here if (row.series or row.method) == series]
                    shown = "" if series in named else series
                    marks += _marks(some, k, (cost.factor, error.factor), looks[series], shown)
                    named.add(series)
                axes = Axis(study.cost, cost.unit, logarithmic=True), Axis(name, error.unit, logarithmic=True)
                panels.append(Panel(tuple(marks), *axes, title=case, height=300))
    if not panels:
        return None
    caption = "Cost against error, both logarithmic: lower left is better. The bar ends at the largest error."
    columns = min(COLUMNS, len(panels))
    return Figure(f"{studies[0].title}: cost against error", caption, tuple(panels), columns, wide=True)


def save_picture(studies: Sequence[Study], path: Path) -> None:
    """Draw all studies, with one legend below all panels."""
    picture = study_figure(studies)
    if picture is None:
        raise SystemExit("no part of this benchmark has a picture")
    with printing():
        figure = paper_figure(picture)
        handles, names = [], []
        for axes, panel in zip(figure.axes, picture.panels, strict=True):
            found = axes.get_legend_handles_labels()
            handles += found[0]
            names += found[1]
            if (legend := axes.get_legend()) is not None:
                legend.remove()
            axes.set_title(panel.title, fontsize=8.0, loc="left")
        figure.legend(handles, names, loc="outside lower center", ncols=5, frameon=False)
        figure.savefig(path, dpi=DOTS_PER_INCH)


def _marks(rows: list[Row], k: int, scale: tuple[float, float], look: int, name: str) -> list[Mark]:
    cost, error = scale
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
        metrics=(),
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
    drawn = Figures(lambda: [study_figure([study])])
    return Section(study.title, (Paragraph(study.about), drawn, TextTable(rows, columns, (*heads, ""))))


def _shown(row: Row) -> bool:
    return row.drawn and row.cost > 0.0 and any(math.isfinite(each.typical) for each in row.errors)


def _middle(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(values)))) if values else 1.0
