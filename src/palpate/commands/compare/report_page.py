"""The report on several runs side by side, as one HTML file."""

import os
from collections.abc import Sequence

from palpate.commands.compare.report_data import ComparisonReport
from palpate.reporting.story import Story

ALIKE = "Nothing was asked differently."


def write_comparison_report(report: ComparisonReport, path: str | os.PathLike[str]) -> None:
    """Write `report` as one HTML file that needs nothing else; a former one is replaced once the new one is whole.

    Raises:
        OSError: The file cannot be written.
    """
    from palpate.reporting.page import write_page  # with matplotlib, for which only those who write wait

    write_page(comparison_html(report), path)


def comparison_html(report: ComparisonReport) -> str:
    """Return `report` as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.commands.compare.run_pictures import overlay_picture, spreads_picture
    from palpate.reporting.page import picture_cards, report_page, section, table

    count = len(report.names)
    asked = table(
        report.differences, ("name", "unit", *("value",) * count), ("asked differently", "unit", *report.names)
    )
    drawn = [
        *(overlay_picture(each, report.names) for each in report.overlays),
        *(spreads_picture(each, report.names) for each in report.spreads),
    ]
    return report_page(
        Story(
            report.title,
            report.asked,
            report.outcome,
            (),
            report.advice,
            report.repeat,
            report.settings,
            "Figures and pictures are computed anew from the runs' logs, the same way for each.",
        ),
        [
            section("What was asked differently", [asked or f"<p>{ALIKE}</p>"]),
            section("Figures side by side", [_figures(report)]),
            section("Over one another", [picture_cards(drawn)]),
        ],
    )


def compared_heads(names: Sequence[str]) -> tuple[str, ...]:
    """Return the heads of a table of figures side by side."""
    less = (f"{name} less {names[0]}" for name in names[1:])
    return ("figure", "unit", *names, *less, "what is good")


def _figures(report: ComparisonReport) -> str:
    from palpate.reporting.page import table

    count = len(report.names)
    rows = [(f.name, f.unit, *f.shown, *f.differences, f.note) for f in report.figures]
    return table(rows, ("name", "unit", *("value",) * (2 * count - 1), "note"), compared_heads(report.names))
