"""What a notebook shows of a report: a piece of HTML with its first picture inside."""

import base64
from html import escape

from palpate.reporting.report import Figures, Report
from palpate.runtime import palette


def report_fragment(report: Report) -> str:
    """Return title, outcome, metrics and the first picture of a report, as HTML without style of its own."""
    rows = "".join(
        f"<tr><th>{escape(k.name)}</th><td>{escape(k.text)}</td><td>{escape(k.unit)}</td><td>{escape(k.note)}</td></tr>"
        for k in report.metrics
    )
    head = f"<h4>{escape(report.title)}</h4><p>{escape(report.outcome)}</p><table>{rows}</table>"
    parts = (part for section in report.sections for part in section.parts if isinstance(part, Figures))
    first = next((each for part in parts for each in part.draw() if each is not None), None)
    if first is None:
        return head
    from palpate.reporting.paper import svg_text  # with matplotlib, for which only those who show pictures wait

    source = base64.b64encode(svg_text(first).encode("utf-8")).decode("ascii")
    # the theme of a notebook is unknown
    style = f"max-width: 45em; width: 100%; background: {palette.CARD.light}; color-scheme: light"
    image = f'<img src="data:image/svg+xml;base64,{source}" alt="{escape(first.title)}" style="{style}">'
    return f"{head}\n{image}"
