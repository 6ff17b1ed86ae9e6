"""The report on the friction of a surface, as one HTML file."""

import os
from collections.abc import Sequence
from dataclasses import replace

from rich.table import Table

from palpate.experiments.friction.report_data import FrictionReport, Measured, RecognitionReport
from palpate.reporting.interval_words import interval_words, value_words
from palpate.reporting.story import story_of
from palpate.reporting.terminal import key_figures

MOST_MATCHES = 20
"""Materials whose posterior is written down."""

OVER_TIME = (
    "Normal force found by touch, and asked for while it rubbed, above the speed of the fingertip; the ground "
    "shows what the controller was doing. Good is a force that stays at what was asked for."
)
"""Caption of the forces over time: unlike other reports', they are shown without the simulation's."""


def write_friction_report(report: FrictionReport, path: str | os.PathLike[str]) -> None:
    """Write `report` as one HTML file that needs nothing else; a former one is replaced once the new one is whole.

    Raises:
        OSError: The file cannot be written.
    """
    from palpate.reporting.page import write_page  # with matplotlib, for which only those who write wait

    write_page(friction_html(report), path)


def friction_html(report: FrictionReport) -> str:
    """Return `report` as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.experiments.friction.pictures import (
        length_picture,
        speed_picture,
        stroke_picture,
        surface_picture,
    )
    from palpate.reporting.force_picture import force_overview
    from palpate.reporting.page import COLUMNS, picture_cards, report_page, section, table
    from palpate.reporting.timing_picture import timing_picture
    from palpate.reporting.timing_table import timing_rows

    told = [
        stroke_picture(report.strokes, report.friction, bent=report.bent),
        None if report.surface is None else surface_picture(report.surface),
        length_picture(report.lengths, report.growth),
        speed_picture(report.speeds, report.curve, creeping=report.creeping),
    ]
    forces = force_overview(report.series) if report.series.phase else None
    over_time = [None if forces is None else replace(forces, caption=OVER_TIME)]
    timing = table(timing_rows(report.timing), COLUMNS)
    return report_page(
        story_of(
            report,
            "Loads that the surface exerts on the finger. Intervals are to hold the true value in 95 of 100 runs: "
            "they count calibration and drift of the sensor too.",
        ),
        [
            section("Which surface it may be", _recognition(report.recognition)),
            section("What was felt", [picture_cards(told)]),
            section("At each load", [table(_load_rows(report), COLUMNS)]),
            section("At each speed", [table(_speed_rows(report), COLUMNS)]),
            section("Over time", [picture_cards(over_time)]),
            section("Computing", [timing, picture_cards([timing_picture(report.timing)])]),
        ],
    )


def friction_table(report: FrictionReport) -> Table:
    """Return the key figures for the terminal."""
    return key_figures(report.title, report.outcome, report.summary)


def _recognition(found: RecognitionReport | None) -> list[str]:
    from palpate.experiments.friction.confusion_picture import confusion_picture
    from palpate.reporting.page import COLUMNS, picture_cards, table, text

    if found is None:
        return []
    rows = [
        (
            each.name,
            _percent(each.posterior),
            "",
            f"ln likelihood {_below(each.likelihood)}; {_percent(each.fit)} of its own touches fit no better",
        )
        for each in found.matches[:MOST_MATCHES]
    ]
    # of what none fits, no share is a result
    columns = COLUMNS if found.fits else ("name", "unit", "unit", "note")
    likely = f"probability, {'if it is' if found.fits else 'were it'} one of these"
    heads = ("material", likely, "", "how likely the rubs are of it; how seldom it would be as far off itself")
    matrix = [] if found.confusion is None else [confusion_picture(found.confusion)]
    setting = f"<p>{text(found.setting)}</p>" if found.setting else ""
    return [f"<p>{text(found.words)}</p>", table(rows, columns, heads), setting, picture_cards(matrix)]


def _below(likelihood: float) -> str:
    return "the largest" if likelihood == 0.0 else f"{-likelihood:.1f} below the largest"


def _percent(share: float) -> str:
    if 0.0 < share < 1e-3:
        return "below 0.1 %"
    return "above 99.9 %" if 0.999 < share < 1.0 else f"{100.0 * share:.3g} %"


def _load_rows(report: FrictionReport) -> list[tuple[str, str, str, str]]:
    return [
        *_rows(report.friction, "mu", "N", 1.0),
        *_rows(report.lengths, "e", "N", 1.0, "mm", 1e3),
    ]


def _speed_rows(report: FrictionReport) -> list[tuple[str, str, str, str]]:
    # a single one stands among the loads
    return _rows(report.speeds, "mu", "mm/s", 1e3) if len(report.speeds) > 1 else []


def _rows(
    told: Sequence[Measured], name: str, at_unit: str, at_factor: float, unit: str = "", factor: float = 1.0
) -> list[tuple[str, str, str, str]]:
    rows = []
    for each in told:
        true = "" if each.true is None else f"; true {factor * each.true:.4g}"
        if each.bound:
            why = each.why or "it never slipped"
            value, note = f"at least {factor * each.value:.3g}", f"{why}: a lower bound"
        else:
            of_it = factor * each.value, factor * each.lower, factor * each.upper
            value, note = value_words(*of_it), interval_words(*of_it)
        rows.append((f"{name} at {at_factor * each.at:.3g} {at_unit}", value, unit, note + true))
    return rows
