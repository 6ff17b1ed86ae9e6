"""The report on one grasp, as one HTML file."""

import os
from html import escape

from rich.table import Table
from rich.text import Text

from palpate.atomic_file import replacing
from palpate.reporting.grasp_data import GraspReport
from palpate.reporting.terminal import key_figures

COLUMNS = ("name", "value", "unit", "note")

IGNORING = ", ignoring spin"


def write_grasp_report(report: GraspReport, path: str | os.PathLike[str]) -> None:
    """Write `report` as one HTML file that needs nothing else; a former one is replaced once the new one is whole.

    Raises:
        OSError: The file cannot be written.
    """
    text = grasp_html(report)
    with replacing(path) as file:
        file.write(text.encode("utf-8"))


def grasp_html(report: GraspReport) -> str:
    """Return `report` as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.reporting.grasp_force_picture import grasp_force_picture
    from palpate.reporting.grasp_picture import grip_picture, load_pictures, slip_picture
    from palpate.reporting.page import page, picture_cards, section, table
    from palpate.reporting.timing_picture import timing_picture
    from palpate.reporting.timing_table import timing_rows

    series, beside = report.series, report.beside
    over_time = [grip_picture(series), slip_picture(series)] if len(series.time) > 1 else []
    loads = load_pictures(report.surface, series)
    least = []
    if report.heaviest is not None:
        at = report.heaviest
        least = [
            f"<p>At {at.time:.3g} s, by what the contacts really bear.</p>",
            picture_cards([grasp_force_picture(at.grasp, at.forces, at.load, at.disturbance)]),
        ]
    ignoring = []
    if beside is not None and len(beside.time) > 1:
        figures = table(report.compared, ("name", "value", "value", "unit"))
        drawn = [grip_picture(beside, IGNORING), slip_picture(beside, IGNORING)]
        drawn += load_pictures(report.surface, beside, IGNORING)
        ignoring = [figures, picture_cards(drawn)]
    timing = table(timing_rows(report.timing), COLUMNS)
    return page(
        report.title,
        [
            f'<h1>{escape(report.title)}</h1>\n<p class="outcome">{escape(report.outcome)}</p>',
            table([(k.name, k.text, k.unit, k.note) for k in report.summary], COLUMNS),
            section("What was seen", [f"<p>{escape(text)}</p>" for text in report.account]),
            section("Over time", [picture_cards(over_time)]),
            section("Loads and what contacts bear", [picture_cards(loads)]),
            section("The least forces where the load is heaviest", least),
            section("A control that ignores spin", ignoring),
            section("Computing", [timing, picture_cards([timing_picture(report.timing)])]),
            section("Settings", [table(report.settings, ("name", "value"))]),
            "<footer>Loads that the object exerts on the fingers. Written by palpate.</footer>",
        ],
    )


def grasp_table(report: GraspReport) -> Table:
    """Return key figures for the terminal, texts as they are."""
    table = key_figures(report.title, report.outcome, report.summary)
    for name, own, other, unit in report.compared[1:]:
        table.add_row(
            Text(f"{name}, ignoring spin"), Text(other), Text(unit), Text(f"with spin {own} {unit}".strip())
        )
    return table
