"""The frame of a report: one HTML file without anything from outside."""

from collections.abc import Iterable
from html import escape

from palpate.reporting.encode import DOTS_PER_INCH, picture_uri
from palpate.reporting.style import Picture, Width

PHONE_WIDTH = 680
"""Up to this width of the window [px], pictures drawn for a phone are shown; also in `STYLE`."""

STYLE = """
:root {
  color-scheme: light dark;
  --ground: #f5f6f8; --card: #fff; --ink: #22272e; --quiet: #5f6875; --line: #dfe3e8;
}
@media (prefers-color-scheme: dark) {
  :root { --ground: #14171b; --card: #1d2126; --ink: #e6e9ed; --quiet: #9aa4b1; --line: #333a43; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 1060px; margin: 0 auto; padding: 20px 16px 48px; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0.4em 0; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; margin: 2em 0 0.6em; }
section > * + .card, section > * + .pictures { margin-top: 16px; }
h3 { font-size: 1rem; margin: 0 0 0.4em; }
.outcome { font-size: 1.05rem; margin: 0 0 1.2em; overflow-wrap: anywhere; }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 10px; }
.card { padding: 14px 16px; margin: 0; }
.pictures { display: grid; gap: 16px; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26em), 1fr)); }
.wide { grid-column: 1 / -1; }
img { display: block; width: 100%; height: auto; margin: 0 auto; background: #fff; border-radius: 6px; }
figcaption { color: var(--quiet); font-size: 0.9rem; margin-top: 0.6em; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
td { padding: 5px 12px 5px 0; border-top: 1px solid var(--line); }
td { vertical-align: top; overflow-wrap: anywhere; }
tr:first-child td { border-top: 0; }
td.name { width: 30%; }
td.value { font-weight: 600; text-align: right; overflow-wrap: normal; }
td.unit { white-space: nowrap; }
td.note { color: var(--quiet); font-size: 0.9rem; }
@media (max-width: 680px) {
  main { padding: 12px 10px 32px; }
  .card { padding: 10px; }
  tr { display: flex; flex-wrap: wrap; border-top: 1px solid var(--line); padding: 5px 0; }
  tr:first-child { border-top: 0; }
  td { border: 0; padding: 0 6px 0 0; }
  td.name { flex: 1 1 50%; }
  td.note { flex: 1 1 100%; }
  td.value { margin-left: auto; text-align: left; }
}
footer { color: var(--quiet); font-size: 0.85rem; margin-top: 2.5em; }
"""


def page(title: str, body: Iterable[str]) -> str:
    """Return a whole HTML document; `title` is text, `body` is HTML."""
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>",
            *body,
            "</main>\n</body>\n</html>\n",
        ]
    )


def section(heading: str, parts: Iterable[str]) -> str:
    """Return a section of HTML `parts` under a heading of text, or nothing if all of them are empty."""
    content = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(heading)}</h2>\n{content}\n</section>" if content else ""


def table(rows: Iterable[tuple[str, ...]], columns: tuple[str, ...]) -> str:
    """Return a table of text; `columns` names the CSS class of each column."""
    lines = [
        "<tr>" + "".join(f'<td class="{c}">{escape(t)}</td>' for c, t in zip(columns, row, strict=True)) + "</tr>"
        for row in rows
    ]
    return '<div class="card"><table>\n' + "\n".join(lines) + "\n</table></div>" if lines else ""


def picture_cards(pictures: Iterable[Picture | None]) -> str:
    """Return the pictures that there are, side by side where there is room."""
    cards = [_card(picture) for picture in pictures if picture is not None]
    return '<div class="pictures">\n' + "\n".join(cards) + "\n</div>" if cards else ""


def _card(picture: Picture) -> str:
    width, height = (round(DOTS_PER_INCH * side) for side in picture.full.get_size_inches())
    source, kind = "", "card"
    if picture.narrow is not None:
        uri = picture_uri(picture, picture.narrow)
        w, h = (round(DOTS_PER_INCH * side) for side in picture.narrow.get_size_inches())
        source = f'<source media="(max-width: {PHONE_WIDTH}px)" srcset="{uri}" width="{w}" height="{h}">'
        kind = "card wide"
    # A little larger than life at most: text stays of one size across the page.
    widest = "" if width > DOTS_PER_INCH * Width.HALF.value else f' style="max-width: {round(1.15 * width)}px"'
    image = (
        f'<img src="{picture_uri(picture, picture.full)}" width="{width}" height="{height}"{widest} '
        f'alt="{escape(picture.title)}">'
    )
    return (
        f'<figure class="{kind}">\n<h3>{escape(picture.title)}</h3>\n<picture>{source}{image}</picture>\n'
        f"<figcaption>{escape(picture.caption)}</figcaption>\n</figure>"
    )
