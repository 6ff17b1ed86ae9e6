"""Tables and CSV files of studies."""

import csv
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich import box
from rich.table import Table
from scipy.stats import beta

from harness.study import Check, Errors, Row, Study

PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def grid(title: str, *headings: str, rows: Iterable[Sequence[object]] = ()) -> Table:
    """Return a table whose first column is text and whose other columns are numbers."""
    made = Table(title=title, box=box.SIMPLE, padding=(0, 1, 0, 0), title_justify="left")
    for i, heading in enumerate(headings):
        made.add_column(
            heading,
            justify="left" if not i or heading in ("method", "") else "right",
            no_wrap=not i or len(heading) < 12,
        )
    for row in rows:
        made.add_row(*map(str, row))
    return made


def study_table(study: Study) -> Table:
    """Return rows of methods: columns of cases if a method costs the same in all cases, a row per case
    otherwise."""
    cases = list(dict.fromkeys(row.case for row in study.rows))
    methods: dict[str, list[Row]] = {}
    for row in study.rows:
        methods.setdefault(row.method, []).append(row)
    heads = ("method", study.cost, "ratio")
    if len(cases) > 1 and all(
        len(rows) == len(cases) and len({row.cost for row in rows}) == 1 for rows in methods.values()
    ):
        table = grid(study.title, *heads, *(case.replace(" ", "\n", 1) for case in cases))
        for name, rows in methods.items():
            by_case = {row.case: _errors(study, row, "\n") for row in rows}
            table.add_row(name, *_cost(study, rows[0], "\n"), *(by_case.get(case, "") for case in cases))
        return table
    table = grid(study.title, "case", *heads, *(name for name, _ in study.quantities), "")
    for row in study.rows:
        cells = (_cell(each, unit, " / ") for each, (_, unit) in zip(row.errors, study.quantities, strict=True))
        table.add_row(row.case, row.method, *_cost(study, row, " "), *cells, row.note)
    return table


def checks_table(checks: Sequence[Check]) -> Table:
    """Return what was asked and what was found."""
    marks = {True: "yes", False: "[red]NO[/red]", None: ""}
    rows = ((each.what, each.asked, each.got, marks[each.kept]) for each in checks)
    return grid("Asked and found", "figure", "asked", "found", "kept", rows=rows)


def write_csv(studies: Sequence[Study], path: Path) -> None:
    """Write a line per row and quantity, in SI units."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(
            ("study", "case", "method", "cost", "ratio", "error", "typical", "largest", "failed", "note")
        )
        for study in studies:
            for row in study.rows:
                ratio = row.ratio.median if row.ratio else ""
                for (name, _), error in zip(study.quantities, row.errors, strict=True):
                    figures = (error.typical, error.largest, error.failed)
                    table.writerow((study.title, row.case, row.method, row.cost, ratio, name, *figures, row.note))


def quantity(value: float, unit: str) -> str:
    """Return a number with its unit, prefixed where it is small; a dash for NaN."""
    if not math.isfinite(value):
        return "-"
    if not unit:
        return f"{value:.2g}"
    factor, prefix = next(((f, p) for f, p in PREFIXES if abs(value) >= f), PREFIXES[-1] if value else PREFIXES[0])
    return f"{value / factor:.3g} {prefix}{unit}"


def share(held: int, of: int) -> str:
    """Return a share in per cent with its 95 % interval (Clopper & Pearson 1934)."""
    if of == 0:
        return "none"
    low = 0.0 if held == 0 else float(beta.ppf(0.025, held, of - held + 1))
    high = 1.0 if held == of else float(beta.ppf(0.975, held + 1, of - held))
    return f"{100 * held / of:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def _cost(study: Study, row: Row, between: str) -> tuple[str, str]:
    ratio = f"{row.ratio.median:.3g}{between}({row.ratio.low:.3g}-{row.ratio.high:.3g})" if row.ratio else ""
    return quantity(row.cost, study.cost_unit), ratio


def _errors(study: Study, row: Row, between: str) -> str:
    pairs = zip(row.errors, study.quantities, strict=True)
    return between.join(_cell(each, unit, between) for each, (_, unit) in pairs)


def _cell(errors: Errors, unit: str, between: str) -> str:
    """Typical and largest error, and the share of failures if there are any."""
    parts = [quantity(errors.typical, unit)]
    parts += [quantity(errors.largest, unit)] if math.isfinite(errors.largest) else []
    parts += [f"{100.0 * errors.failed:.3g} % bad"] if errors.failed else []
    return between.join(parts)
