"""What a notebook shows of a report: a piece of HTML with its first pictures inside."""

from html import escape

from palpate.reporting.report import Pictures, Report
from palpate.runtime import palette


def report_fragment(report: Report) -> str:
    """Return title, outcome, figures and the first pictures of a report, as HTML without style of its own."""
    from palpate.reporting.encode import picture_uri  # with matplotlib, for which only who shows pictures waits

    rows = "".join(
        f"<tr><th>{escape(k.name)}</th><td>{escape(k.text)}</td><td>{escape(k.unit)}</td><td>{escape(k.note)}</td></tr>"
        for k in report.figures
    )
    parts = (part for section in report.sections for part in section.parts if isinstance(part, Pictures))
    drawn = ([each for each in part.draw() if each is not None] for part in parts)
    # the theme of a notebook is unknown
    style = f"max-width: 30em; background: {palette.CARD.light}; color-scheme: light"
    return "\n".join(
        [
            f"<h4>{escape(report.title)}</h4><p>{escape(report.outcome)}</p><table>{rows}</table>",
            *(
                f'<img src="{picture_uri(each, each.full)}" alt="{escape(each.title)}" style="{style}">'
                for each in next(filter(None, drawn), [])
            ),
        ]
    )
