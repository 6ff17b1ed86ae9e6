"""The report on one replay, as one HTML file."""

import os
from html import escape

from palpate.atomic_file import replacing
from palpate.reporting.replay_data import ReplayReport

FOOTER = (
    "Velocities in the robot's base frame. The samples are as recorded: this is what would have been commanded at "
    "every instant of that run, not what would have happened then."
)


def write_replay_report(report: ReplayReport, path: str | os.PathLike[str]) -> None:
    """Write `report` as one HTML file that needs nothing else, as `palpate.reporting.write_report` does.

    Raises:
        OSError: The file cannot be written.
    """
    text = replay_html(report)
    with replacing(path) as file:
        file.write(text.encode("utf-8"))


def replay_html(report: ReplayReport) -> str:
    """Return `report` as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.reporting.page import page, picture_cards, section, table
    from palpate.reporting.replay_pictures import difference_picture, sensed_picture, velocity_picture

    over_time = same = sensed = ""
    if len(report.recorded.time):
        difference = difference_picture(report)
        over_time = picture_cards([velocity_picture(report), difference])
        same = "" if difference else "<p>No commanded velocity differs.</p>"
        sensed = picture_cards([sensed_picture(report)]) or "<p>Nothing was touched.</p>"
    figures = [(k.name, k.text, k.unit, k.note) for k in report.summary]
    return page(
        report.title,
        [
            f'<h1>{escape(report.title)}</h1>\n<p class="outcome">{escape(report.outcome)}</p>',
            table(figures, ("name", "value", "unit", "note")),
            section("Commands", [over_time, same]),
            section("Sensing", [sensed]),
            section("Settings", [table(report.settings, ("name", "value"))]),
            f"<footer>{FOOTER} Written by palpate.</footer>",
        ],
    )
