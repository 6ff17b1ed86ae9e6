"""The report on one grasp, as one HTML file."""

import os

from rich.table import Table
from rich.text import Text

from palpate.experiments.grasp.report_data import GraspReport
from palpate.reporting.story import story_of
from palpate.reporting.terminal import key_figures

IGNORING = ", ignoring spin"


def write_grasp_report(report: GraspReport, path: str | os.PathLike[str]) -> None:
    """Write `report` as one HTML file that needs nothing else; a former one is replaced once the new one is whole.

    Raises:
        OSError: The file cannot be written.
    """
    from palpate.reporting.page import write_page  # with matplotlib, for which only those who write wait

    write_page(grasp_html(report), path)


def grasp_html(report: GraspReport) -> str:
    """Return `report` as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.experiments.grasp.pictures import felt_grip_picture, grip_picture, load_pictures, slip_picture
    from palpate.reporting.grasp_force_picture import grasp_force_picture
    from palpate.reporting.page import COLUMNS, picture_cards, report_page, section, table, text
    from palpate.reporting.timing_picture import timing_picture
    from palpate.reporting.timing_table import timing_rows

    series, beside = report.series, report.beside
    over_time = []
    if len(series.time) > 1:
        known = report.truth_known
        over_time = [grip_picture(series), slip_picture(series)] if known else [felt_grip_picture(series)]
    loads = load_pictures(report.surface, series, "" if report.truth_known else ", as believed")
    least = []
    if report.heaviest is not None:
        at = report.heaviest
        least = [
            f"<p>At {at.time:.3g} s, by what the contacts really bear.</p>",
            picture_cards([grasp_force_picture(at.grasp, at.forces, at.load, at.disturbance)]),
        ]
    ignoring = []
    if beside is not None and len(beside.time) > 1:
        heads, *rows = report.compared or (("", "", "", ""),)
        figures = table(rows, ("name", "value", "value", "unit"), heads)
        drawn = [grip_picture(beside, IGNORING), slip_picture(beside, IGNORING)]
        drawn += load_pictures(report.surface, beside, IGNORING)
        ignoring = [figures, picture_cards(drawn)]
    timing = table(timing_rows(report.timing), COLUMNS)
    return report_page(
        story_of(report, "Loads that the object exerts on the fingers."),
        [
            section("What was seen", [f"<p>{text(each)}</p>" for each in report.account]),
            section("Over time", [picture_cards(over_time)]),
            section("Loads and what contacts bear", [picture_cards(loads)]),
            section("The least forces where the load is heaviest", least),
            section("A control that ignores spin", ignoring),
            section("Computing", [timing, picture_cards([timing_picture(report.timing)])]),
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
