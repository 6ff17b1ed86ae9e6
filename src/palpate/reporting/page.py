"""The page of a report: one HTML file without anything from outside, its parts always in the same order.

Figures are compressed data in it, and so is the library that draws them; the browser runs only these two scripts.
"""

import base64
import gzip
import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.util import find_spec
from pathlib import Path

from palpate.atomic_file import replacing
from palpate.reporting.data import FigureKind
from palpate.reporting.figure import Figure
from palpate.reporting.plots import plots
from palpate.reporting.report import (
    COLUMNS,
    NOTHING,
    FigureFailure,
    Figures,
    Paragraph,
    Part,
    QuantityTable,
    Report,
    TextTable,
)
from palpate.runtime.palette import css_variables
from palpate.version import __version__

_FOLDER = Path(__file__).parent
_STYLE, _SCRIPT = ((_FOLDER / name).read_text("utf-8") for name in ("page.css", "page.js"))

_COMPRESSION = 4
"""Level of gzip: 6 takes twice as long for 4 % less."""


@dataclass(frozen=True, slots=True)
class WrittenReport:
    """The files of a report.

    Attributes:
        files: The page, then the files of its figures.
        failures: Figures that could not be drawn; the page names them in their places.
    """

    files: tuple[Path, ...]
    failures: tuple[FigureFailure, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence for each figure that could not be drawn."""
        return tuple(map(str, self.failures))

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines for the terminal: the warnings, then one for each file."""
        return (*self.warnings, *(f"Written: {path}" for path in self.files))


class _Drawing:
    """The figures of a page while it is put together.

    Attributes:
        figures: Figures that could be drawn.
        stated: Input of `page.js` for each of them, as JSON.
        failures: Figures that could not.
    """

    def __init__(self) -> None:
        self.figures: list[Figure] = []
        self.stated: list[str] = []
        self.failures: list[FigureFailure] = []

    def card(self, figure: Figure | FigureFailure) -> str:
        """Draw a figure, and return its card, or that of its failure."""
        if isinstance(figure, Figure):
            try:
                stated = {"plots": plots(figure), "steps": figure.steps, "step": figure.step}
                self.stated.append(json.dumps(stated, separators=(",", ":"), allow_nan=False))
            except Exception as error:  # a figure never costs a finished run
                figure = FigureFailure.of(figure.title, error)
            else:
                self.figures.append(figure)
                return _card(figure, len(self.figures) - 1)
        self.failures.append(figure)
        return _failed(figure)


def report_page(report: Report) -> str:
    """Return a report as a whole HTML document: request, outcome, metrics, sections, advice."""
    return _page(report, _Drawing())


def write_report(report: Report, path: str | os.PathLike[str], figures: FigureKind | None = None) -> WrittenReport:
    """Write a report as one HTML file that needs nothing else, and its figures as files if requested.

    An earlier file is replaced once the new one is complete. A figure that cannot be drawn is named in its place
    with the error; everything else is written.

    Args:
        report: The report.
        path: Place of the page.
        figures: Kind of the figures' files in the folder "figures" beside the page; None for no such files.

    Raises:
        OSError: If a file cannot be written.
    """
    drawing = _Drawing()
    content = _page(report, drawing).encode("utf-8")
    with replacing(path) as file:
        file.write(content)
    files, failures = [Path(path)], list(drawing.failures)
    if figures is not None:
        from palpate.reporting.paper import write_figure_files  # imports matplotlib, which takes a second

        folder, taken = Path(path).parent / "figures", set[str]()
        folder.mkdir(exist_ok=True)
        for figure in drawing.figures:
            for written in write_figure_files(figure, folder, figures, taken):
                (failures if isinstance(written, FigureFailure) else files).append(written)  # type: ignore[arg-type]
    return WrittenReport(tuple(files), tuple(failures))


def _page(report: Report, drawing: _Drawing) -> str:
    repeat = [f"<p>{text(before)} {_command(command)}</p>" for before, command in report.repeat]
    body = [
        f"<h1>{text(report.title)}</h1>",
        f'<p class="asked">Asked: {text(report.asked)}</p>' if report.asked else "",
        f'<p class="outcome">{text(report.outcome)}</p>',
        _part(QuantityTable(report.metrics), "", drawing),
        *(
            _section(each.heading, [_part(part, each.heading, drawing) for part in each.parts])
            for each in report.sections
        ),
        _section("What to do", [f"<p>{text(each)}</p>" for each in report.advice or (NOTHING,)]),
        _section("How to repeat it", [*repeat, table(report.settings, ("name", "value"))]),
        f"<footer>{text(report.footer)} Written by palpate {__version__}.</footer>",
    ]
    # whatever might get into a report, the browser runs and fetches none of it
    scripts = " ".join(_hash(each) for each in (_SCRIPT, _library())) if drawing.figures else "'none'"
    policy = f"default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {scripts}"
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta HTTP-EQUIV="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{text(report.title)}</title>\n<style>{css_variables()}{_STYLE}</style>\n</head>\n<body>\n<main>",
            *(part for part in body if part),
            "</main>",
            *(_scripts(drawing) if drawing.figures else ()),
            "</body>\n</html>\n",
        ]
    )


def _part(part: Part, heading: str, drawing: _Drawing) -> str:
    match part:
        case Paragraph():
            return f"<p>{text(part.text)}</p>" if part.text else ""
        case QuantityTable():
            return table([(k.name, k.text, k.unit, k.note) for k in part.metrics], COLUMNS)
        case TextTable():
            return table(part.rows, part.columns, part.heads)
        case Figures():
            cards = "\n".join(drawing.card(each) for each in part.drawn(heading))
            return f'<div class="figures">\n{cards}\n</div>' if cards else ""


def _scripts(drawing: _Drawing) -> tuple[str, ...]:
    """The library that draws, the figures, and the script that draws them."""
    stated = _packed(f"[{','.join(drawing.stated)}]")
    return (
        f'<script type="application/gzip" id="library">{_packed_library()}</script>',
        f'<script type="application/gzip" id="figures">{stated}</script>',
        f"<script>{_SCRIPT}</script>",
    )


@cache
def _library() -> str:
    """The script of the package plotly, which is not imported: nothing else of it is needed."""
    found = find_spec("plotly")
    assert found is not None
    assert found.submodule_search_locations is not None
    return Path(found.submodule_search_locations[0], "package_data/plotly.min.js").read_text("utf-8")


@cache
def _packed_library() -> str:
    return _packed(_library())


def _packed(content: str) -> str:
    return base64.b64encode(gzip.compress(content.encode("utf-8"), _COMPRESSION, mtime=0)).decode("ascii")


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode('utf-8')).digest()).decode('ascii')}'"


def text(typed: str) -> str:
    """Return a text as HTML: markup and control characters are shown, not obeyed."""
    return escape("".join(_shown(letter) for letter in typed))


def table(rows: Iterable[tuple[str, ...]], columns: Sequence[str], heads: Sequence[str] = ()) -> str:
    """Return a table of texts as HTML; "" without rows.

    Args:
        rows: Rows of texts.
        columns: CSS class of each column.
        heads: Headings of the columns; () for none.
    """
    lines = [_row("td", row, columns) for row in rows]
    if not lines:
        return ""
    if heads:
        lines.insert(0, _row("th", heads, columns))
    kind = ' class="side-by-side"' if columns.count("value") > 1 else ""
    if tuple(columns) == ("name", "value"):
        kind = ' class="settings"'
    return f'<div class="card"><table{kind}>\n' + "\n".join(lines) + "\n</table></div>"


def _section(heading: str, parts: Iterable[str]) -> str:
    content = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{text(heading)}</h2>\n{content}\n</section>" if content else ""


def _row(tag: str, row: Sequence[str], columns: Sequence[str]) -> str:
    cells = (f'<{tag} class="{c}">{text(t)}</{tag}>' for c, t in zip(columns, row, strict=True))
    return "<tr>" + "".join(cells) + "</tr>"


def _command(typed: str) -> str:
    """A command line without breaks after the dashes of an option."""
    return "<code>" + " ".join(f"<span>{text(word)}</span>" for word in typed.split(" ")) + "</code>"


def _shown(letter: str) -> str:
    """A letter, or its replacement: HTML has no NUL, and some letters turn the direction of all that follow."""
    code = ord(letter)
    hidden = (code < 32 and letter not in "\t\n") or 0x7F <= code < 0xA0 or 0xD800 <= code < 0xE000
    turning = 0x202A <= code <= 0x202E or 0x2066 <= code <= 0x2069
    return "\N{REPLACEMENT CHARACTER}" if hidden or turning else letter


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


def _failed(failure: FigureFailure) -> str:
    return (
        f'<div class="card wide">\n<h3>{text(failure.title)}</h3>\n'
        f'<p class="quiet">This figure could not be drawn: {text(failure.error)}<br>{text(failure.place)}</p>\n'
        "</div>"
    )
