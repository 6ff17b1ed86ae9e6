"""The frame of a report: one HTML file without anything from outside, its parts always in the same order."""

import math
import os
from collections.abc import Iterable, Sequence
from html import escape

from palpate.atomic_file import replacing
from palpate.reporting.encode import DOTS_PER_INCH, picture_uri
from palpate.reporting.report import (
    COLUMNS,
    NOTHING,
    FigureTable,
    Paragraph,
    Part,
    Pictures,
    Report,
    TextTable,
)
from palpate.reporting.style import Picture, Width
from palpate.runtime.palette import css_variables
from palpate.version import __version__

PHONE_WIDTH = 680
"""Up to this width of the window [px], pictures drawn for a phone are shown; also in `STYLE`."""

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Content security policy: whatever might get into a report, the browser runs and fetches none of it."""

STYLE = """
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 1060px; margin: 0 auto; padding: 20px 16px 48px; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0.4em 0; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; margin: 2em 0 0.6em; overflow-wrap: anywhere; }
section > * + .card, section > * + .pictures { margin-top: 16px; }
h3 { font-size: 1rem; margin: 0 0 0.4em; overflow-wrap: anywhere; }
.card + h3 { margin-top: 1.4em; }
p, li { overflow-wrap: anywhere; }
.asked { color: var(--quiet); margin: 0 0 0.3em; }
.outcome { font-size: 1.05rem; margin: 0 0 1.2em; }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 10px; }
.card { padding: 14px 16px; margin: 0; overflow-x: auto; }
.pictures { display: grid; gap: 16px; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26em), 1fr)); }
.wide { grid-column: 1 / -1; }
img { display: block; width: 100%; height: auto; margin: 0 auto; }
figcaption { color: var(--quiet); font-size: 0.9rem; margin-top: 0.6em; overflow-wrap: anywhere; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
td, th { padding: 5px 12px 5px 0; border-top: 1px solid var(--line); text-align: left; font-weight: inherit; }
td, th { vertical-align: top; overflow-wrap: anywhere; }
tr:first-child > * { border-top: 0; }
th { color: var(--quiet); font-size: 0.9rem; }
.name { width: 30%; }
td.value { font-weight: 600; text-align: right; overflow-wrap: normal; }
th.value { text-align: right; }
td.unit { white-space: nowrap; }
td.note, .quiet { color: var(--quiet); font-size: 0.9rem; }
.settings td.value { font-weight: inherit; text-align: left; overflow-wrap: anywhere; }
.side-by-side { table-layout: auto; }
.side-by-side :is(td, th) { overflow-wrap: normal; }
.side-by-side .value { min-width: 4em; }
.side-by-side .name { min-width: 8em; }
.side-by-side .note { min-width: 14em; }
code { font: 0.9em ui-monospace, monospace; overflow-wrap: anywhere; }
code span { display: inline-block; max-width: 100%; }
@media (max-width: 680px) {
  main { padding: 12px 10px 32px; }
  .card { padding: 10px 9px; }
  table:not(.side-by-side) tr { display: flex; flex-wrap: wrap; padding: 5px 0; }
  table:not(.side-by-side) tr + tr { border-top: 1px solid var(--line); }
  table:not(.side-by-side) :is(td, th) { border: 0; padding: 0 6px 0 0; }
  table:not(.side-by-side) td.name { flex: 1 1 50%; }
  table:not(.side-by-side) td.note { flex: 1 1 100%; }
  table:not(.side-by-side) td.value { margin-left: auto; text-align: left; }
  table.settings td.value { flex: 1 1 100%; margin-left: 0; }
  table.settings td.name { flex: 1 1 100%; color: var(--quiet); font-size: 0.9rem; }
}
footer { color: var(--quiet); font-size: 0.85rem; margin-top: 2.5em; overflow-wrap: anywhere; }
"""


def report_page(report: Report) -> str:
    """Return a report as a whole HTML document: what was asked, how it ended, figures, sections, what to do."""
    repeat = [f"<p>{text(before)} {_command(command)}</p>" for before, command in report.repeat]
    return page(
        report.title,
        [
            f"<h1>{text(report.title)}</h1>",
            f'<p class="asked">Asked: {text(report.asked)}</p>' if report.asked else "",
            f'<p class="outcome">{text(report.outcome)}</p>',
            _part(FigureTable(report.figures)),
            *(section(each.heading, map(_part, each.parts)) for each in report.sections),
            section("What to do", [f"<p>{text(each)}</p>" for each in report.advice or (NOTHING,)]),
            section("How to repeat it", [*repeat, table(report.settings, ("name", "value"))]),
            f"<footer>{text(report.footer)} Written by palpate {__version__}.</footer>",
        ],
    )


def write_report(report: Report, path: str | os.PathLike[str]) -> None:
    """Write a report as one HTML file that needs nothing else; a former one is replaced once the new one is whole.

    It reads on a phone as on a screen, light or dark as the reader's system is.

    Raises:
        OSError: The file cannot be written.
    """
    with replacing(path) as file:
        file.write(report_page(report).encode("utf-8"))


def _part(part: Part) -> str:
    match part:
        case Paragraph():
            return f"<p>{text(part.text)}</p>" if part.text else ""
        case FigureTable():
            return table([(k.name, k.text, k.unit, k.note) for k in part.figures], COLUMNS)
        case TextTable():
            return table(part.rows, part.columns, part.heads)
        case Pictures():
            return picture_cards(part.draw())


def page(title: str, body: Iterable[str]) -> str:
    """Return a whole HTML document; `title` is text, `body` is HTML."""
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta HTTP-EQUIV="Content-Security-Policy" content="{POLICY}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{text(title)}</title>\n<style>{css_variables()}{STYLE}</style>\n</head>\n<body>\n<main>",
            *(part for part in body if part),
            "</main>\n</body>\n</html>\n",
        ]
    )


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


def picture_cards(pictures: Iterable[Picture | None]) -> str:
    """Return the pictures that there are, side by side where there is room."""
    cards = [_card(picture) for picture in pictures if picture is not None]
    return '<div class="pictures">\n' + "\n".join(cards) + "\n</div>" if cards else ""


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


def _card(picture: Picture) -> str:
    width, height = (round(DOTS_PER_INCH * side) for side in picture.full.get_size_inches())
    source, kind = "", "card"
    if picture.narrow is not None:
        uri = picture_uri(picture, picture.narrow)
        w, h = (round(DOTS_PER_INCH * side) for side in picture.narrow.get_size_inches())
        source = f'<source media="(max-width: {PHONE_WIDTH}px)" srcset="{uri}" width="{w}" height="{h}">'
        kind = "card wide"
    # A little larger than life at most: text stays of one size across the page.
    widest = (
        "" if width > round(DOTS_PER_INCH * Width.HALF.value) else f' style="max-width: {round(1.15 * width)}px"'
    )
    image = (
        f'<img src="{picture_uri(picture, picture.full)}" width="{width}" height="{height}"{widest} '
        f'alt="{text(picture.title)}">'
    )
    return (
        f'<figure class="{kind}">\n<h3>{text(picture.title)}</h3>\n<picture>{source}{image}</picture>\n'
        f"<figcaption>{text(picture.caption)}</figcaption>\n</figure>"
    )
