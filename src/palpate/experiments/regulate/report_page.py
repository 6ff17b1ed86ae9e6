"""The report on one regulation of force, as one HTML file."""

import os

from rich.table import Table

from palpate.experiments.regulate.report_data import RegulationReport
from palpate.reporting.story import story_of
from palpate.reporting.terminal import key_figures


def write_regulation_report(report: RegulationReport, path: str | os.PathLike[str]) -> None:
    """Write `report` as one HTML file that needs nothing else; a former one is replaced once the new one is whole.

    Raises:
        OSError: The file cannot be written.
    """
    from palpate.reporting.page import write_page  # with matplotlib, for which only those who write wait

    write_page(regulation_html(report), path)


def regulation_html(report: RegulationReport) -> str:
    """Return `report` as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.experiments.regulate.pictures import bode_picture, error_picture, step_picture
    from palpate.reporting.force_picture import force_overview
    from palpate.reporting.page import COLUMNS, picture_cards, report_page, section, table, text
    from palpate.reporting.timing_picture import timing_picture
    from palpate.reporting.timing_table import timing_rows

    over_time = [force_overview(report.series), error_picture(report.series)] if report.series.phase else []
    answers = []
    if report.steps is not None:
        answers.append(step_picture(report.steps))
    if report.tones:
        answers.append(bode_picture(report.tones, report.bandwidth))
    tones = [
        (f"{curve.name} force at {frequency:g} Hz", f"{gain:.3f}", "times", f"phase {phase:.0f} degrees")
        for curve in report.tones[:1]
        for frequency, gain, phase in zip(curve.frequency, curve.gain, curve.phase_deg, strict=True)
    ]
    timing = table(timing_rows(report.timing), COLUMNS)
    return report_page(
        story_of(report, "Forces that the surface exerts on the finger."),
        [
            section("Over time", [picture_cards(over_time)]),
            section("Answer", [picture_cards(answers), table(tones, COLUMNS)]),
            section("What limits it", [f"<p>{text(each)}</p>" for each in report.limits]),
            section("Margins", [table([(k.name, k.text, k.unit, k.note) for k in report.margins], COLUMNS)]),
            section("Computing", [timing, picture_cards([timing_picture(report.timing)])]),
        ],
    )


def regulation_table(report: RegulationReport) -> Table:
    """Return key figures and margins for the terminal."""
    return key_figures(report.title, report.outcome, (*report.summary, *report.margins))
