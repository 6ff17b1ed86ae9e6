"""The report on one replay, as one HTML file."""

import os

from palpate.commands.replay.report_data import ReplayReport
from palpate.reporting.story import story_of

FOOTER = (
    "Velocities in the robot's base frame. The samples are as recorded: this is what would have been commanded at "
    "every instant of that run, not what would have happened then."
)


def write_replay_report(report: ReplayReport, path: str | os.PathLike[str]) -> None:
    """Write `report` as one HTML file that needs nothing else, as `palpate.reporting.write_report` does.

    Raises:
        OSError: The file cannot be written.
    """
    from palpate.reporting.page import write_page  # with matplotlib, for which only those who write wait

    write_page(replay_html(report), path)


def replay_html(report: ReplayReport) -> str:
    """Return `report` as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.commands.replay.pictures import difference_picture, felt_picture, velocity_picture
    from palpate.reporting.page import picture_cards, report_page, section

    over_time = same = felt = ""
    if len(report.recorded.time):
        difference = difference_picture(report)
        over_time = picture_cards([velocity_picture(report), difference])
        same = "" if difference else "<p>No commanded velocity differs.</p>"
        felt = picture_cards([felt_picture(report)]) or "<p>Nothing was touched.</p>"
    return report_page(
        story_of(report, FOOTER),
        [section("Commands", [over_time, same]), section("Sensing", [felt])],
    )
