"""The frame of a report: one HTML file without anything from outside, its parts always in the same order.

Figures are data in it, compressed, and so is what draws them; the browser runs nothing but these two scripts.
"""

import base64
import gzip
import hashlib
import json
import math
import os
from collections.abc import Iterable, Sequence
from functools import cache
from html import escape
from importlib.util import find_spec
from pathlib import Path

from palpate.atomic_file import replacing
from palpate.reporting.figure import Figure
from palpate.reporting.plots import plots
from palpate.reporting.report import (
    COLUMNS,
    NOTHING,
    Figures,
    Paragraph,
    Part,
    QuantityTable,
    Report,
    TextTable,
)
from palpate.runtime.palette import css_variables
from palpate.version import __version__

FOLDER = Path(__file__).parent
STYLE = (FOLDER / "page.css").read_text("utf-8")
SCRIPT = (FOLDER / "page.js").read_text("utf-8")

PACKED = 4
"""Level of compression: 6 takes twice as long for 4 % less."""

LIBRARY = "package_data/plotly.min.js"
"""Of the package plotly, which is not imported: its script is all that is needed."""


def report_page(report: Report) -> str:
    """Return a report as a whole HTML document: what was asked, how it ended, metrics, sections, what to do."""
    repeat = [f"<p>{text(before)} {_command(command)}</p>" for before, command in report.repeat]
    shown: list[Figure] = []
    return page(
        report.title,
        [
            f"<h1>{text(report.title)}</h1>",
            f'<p class="asked">Asked: {text(report.asked)}</p>' if report.asked else "",
            f'<p class="outcome">{text(report.outcome)}</p>',
            _part(QuantityTable(report.metrics), shown),
            *(section(each.heading, [_part(part, shown) for part in each.parts]) for each in report.sections),
            section("What to do", [f"<p>{text(each)}</p>" for each in report.advice or (NOTHING,)]),
            section("How to repeat it", [*repeat, table(report.settings, ("name", "value"))]),
            f"<footer>{text(report.footer)} Written by palpate {__version__}.</footer>",
        ],
        shown,
    )


def write_report(report: Report, path: str | os.PathLike[str]) -> None:
    """Write a report as one HTML file that needs nothing else; a former one is replaced once the new one is whole.

    It reads on a phone as on a screen, light or dark as the reader's system is.

    Raises:
        OSError: The file cannot be written.
    """
    with replacing(path) as file:
        file.write(report_page(report).encode("utf-8"))


def _part(part: Part, shown: list[Figure]) -> str:
    """Return a part as HTML; its figures are added to those that the page shows."""
    match part:
        case Paragraph():
            return f"<p>{text(part.text)}</p>" if part.text else ""
        case QuantityTable():
            return table([(k.name, k.text, k.unit, k.note) for k in part.metrics], COLUMNS)
        case TextTable():
            return table(part.rows, part.columns, part.heads)
        case Figures():
            return _cards([each for each in part.draw() if each is not None], shown)


def page(title: str, body: Iterable[str], figures: Sequence[Figure] = ()) -> str:
    """Return a whole HTML document; `title` is text, `body` is HTML with the cards of `figures`."""
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta HTTP-EQUIV="Content-Security-Policy" content="{_policy(drawing=bool(figures))}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{text(title)}</title>\n<style>{css_variables()}{STYLE}</style>\n</head>\n<body>\n<main>",
            *(part for part in body if part),
            "</main>",
            *(_scripts(figures) if figures else ()),
            "</body>\n</html>\n",
        ]
    )


def _policy(*, drawing: bool) -> str:
    """Content security policy: whatever might get into a report, the browser runs and fetches none of it."""
    scripts = " ".join(_hash(each) for each in (SCRIPT, _library())) if drawing else "'none'"
    return f"default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {scripts}"


def _scripts(figures: Sequence[Figure]) -> tuple[str, ...]:
    """What draws, and what is drawn."""
    stated = json.dumps(
        [{"plots": plots(each), "steps": each.steps, "step": each.step} for each in figures],
        separators=(",", ":"),
        allow_nan=False,
    )
    return (
        f'<script type="application/gzip" id="library">{_packed_library()}</script>',
        f'<script type="application/gzip" id="figures">{_packed(stated, PACKED)}</script>',
        f"<script>{SCRIPT}</script>",
    )


@cache
def _library() -> str:
    found = find_spec("plotly")
    assert found is not None
    assert found.submodule_search_locations is not None
    return Path(found.submodule_search_locations[0], LIBRARY).read_text("utf-8")


@cache
def _packed_library() -> str:
    return _packed(_library(), PACKED)


def _packed(content: str, level: int) -> str:
    return base64.b64encode(gzip.compress(content.encode("utf-8"), level, mtime=0)).decode("ascii")


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode('utf-8')).digest()).decode('ascii')}'"


def text(typed: str) -> str:
    """Return text as HTML: markup is shown, not taken for such, and so are characters that nobody sees."""
    return escape("".join(_shown(letter) for letter in typed))


def section(heading: str, parts: Iterable[str]) -> str:
    """Return a section of HTML `parts` under a heading of text, or nothing if all of them are empty."""
    content = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{text(heading)}</h2>\n{content}\n</section>" if content else ""


def table(rows: Iterable[tuple[str, ...]], columns: Sequence[str], heads: Sequence[str] = ()) -> str:
    """Return a table of text.

    Args:
        rows: Of texts.
        columns: The CSS class of each column.
        heads: Over the columns; none if left out.
    """
    lines = [_row("td", row, columns) for row in rows]
    if not lines:
        return ""
    if heads:
        lines.insert(0, _row("th", heads, columns))
    kind = ""
    if tuple(columns) == ("name", "value"):
        kind = ' class="settings"'
    elif columns.count("value") > 1:
        kind = ' class="side-by-side"'
    return f'<div class="card"><table{kind}>\n' + "\n".join(lines) + "\n</table></div>"


def _cards(figures: Sequence[Figure], shown: list[Figure]) -> str:
    """Return the cards of figures side by side where there is room."""
    cards = []
    for figure in figures:
        cards.append(_card(figure, len(shown)))
        shown.append(figure)
    return '<div class="figures">\n' + "\n".join(cards) + "\n</div>" if cards else ""


def _row(tag: str, row: Sequence[str], columns: Sequence[str]) -> str:
    cells = (f'<{tag} class="{c}">{text(t)}</{tag}>' for c, t in zip(columns, row, strict=True))
    return "<tr>" + "".join(cells) + "</tr>"


def _command(typed: str) -> str:
    """What to type, with no break after the dashes of an option."""
    return "<code>" + " ".join(f"<span>{text(word)}</span>" for word in typed.split(" ")) + "</code>"


def _is_number(shown: str) -> bool:
    try:
        return math.isfinite(float(shown.replace(" ", "")))
    except ValueError:
        return False


def _shown(letter: str) -> str:
    """A letter, or what stands for it: HTML has no NUL, and some letters turn the direction of all that follow."""
    code = ord(letter)
    if (code < 32 and letter not in "\t\n") or 0x7F <= code < 0xA0 or 0xD800 <= code < 0xE000:
        return "\N{REPLACEMENT CHARACTER}"
    return "\N{REPLACEMENT CHARACTER}" if 0x202A <= code <= 0x202E or 0x2066 <= code <= 0x2069 else letter


def _card(figure: Figure, number: int) -> str:
    kind = "card wide" if figure.wide else "card"
    panels = "".join(f'<div class="plot" style="height: {each.height}px"></div>' for each in figure.panels)
    return (
        f'<figure class="{kind}" data-figure="{number}" aria-label="{text(figure.title)}">\n'
        f"<h3>{text(figure.title)}</h3>\n"
        f'<div class="plots" style="--columns: {figure.columns}">{panels}</div>\n<div class="controls"></div>\n'
        f"<noscript>Figures need JavaScript, which comes with this file.</noscript>\n"
        f"<figcaption>{text(figure.caption)}</figcaption>\n</figure>"
    )
