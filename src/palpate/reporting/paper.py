"""Figures as a paper prints them: vectors in the width of a column or of the page, without title and caption.

Fonts are embedded as publishers accept them (TrueType, `pdf.fonttype` 42); what has many thousand elements
is kept as pixels. Widths are those of IEEE's journals (IEEE author guidelines: 3.5 and 7.16 inch).
"""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure as PaperFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

from palpate.atomic_file import replacing
from palpate.errors import InvalidValueError
from palpate.reporting.figure import Figure, Space
from palpate.reporting.paper_flat import draw_panel
from palpate.reporting.paper_space import draw_space
from palpate.reporting.report import Figures, Report
from palpate.reporting.solids import coloured_by, quantities
from palpate.runtime.palette import INK_COLOUR

COLUMN, PAGE = 3.5, 7.16
"""Width of a column and of the page [inch]."""

PER_PIXEL = 0.0082
"""[inch] of height for each pixel that a panel is high on a screen."""

STYLE = {
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "legend.fontsize": 7.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "palpate",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK_COLOUR.light,
    "savefig.dpi": 300,
}

KINDS = ("pdf", "svg", "png")
"""Of files."""


def write_figures_of(report: Report, folder: Path, kind: str) -> tuple[Path, ...]:
    """Write each figure of a report into a folder, one file for each of its colourings.

    Args:
        report: Whose figures.
        folder: Which is there.
        kind: "pdf", "svg" or "png".

    Returns:
        The files.

    Raises:
        InvalidValueError: Another kind.
        OSError: A file cannot be written.
    """
    parts = (part for section in report.sections for part in section.parts if isinstance(part, Figures))
    names: set[str] = set()
    written = []
    for figure in (each for part in parts for each in part.draw() if each is not None):
        for name, single in _by_colouring(figure):
            numbered = next(n for n in _numbered(_file_name(name)) if n not in names)
            names.add(numbered)
            path = folder / f"{numbered}.{kind}"
            write_figure(single, path)
            written.append(path)
    return tuple(written)


def write_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as the suffix says: .pdf, .svg or .png; the same figure gives the same file.

    Raises:
        InvalidValueError: Another suffix.
        OSError: The file cannot be written.
    """
    kind = Path(path).suffix.removeprefix(".")
    if kind not in KINDS:
        raise InvalidValueError(f"{path}: its suffix must be one of {', '.join('.' + each for each in KINDS)}")
    dated = {} if kind == "png" else {"CreationDate" if kind == "pdf" else "Date": None}
    with printing(), replacing(path) as file:
        paper_figure(figure).savefig(file, format=kind, metadata=dated)


def svg_text(figure: Figure) -> str:
    """Return a figure as an SVG document."""
    text = io.StringIO()
    with printing():
        paper_figure(figure).savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


@contextmanager
def printing() -> Iterator[None]:
    """Have matplotlib draw in the style of a paper."""
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        yield


def paper_figure(figure: Figure) -> PaperFigure:
    """Return a figure as matplotlib draws it; a figure that moves shows its first step."""
    rows = -(-len(figure.panels) // figure.columns)
    heights = [
        max(each.height for each in figure.panels[i * figure.columns : (i + 1) * figure.columns])
        for i in range(rows)
    ]
    size = (PAGE if figure.wide else COLUMN, PER_PIXEL * sum(heights))
    drawn = PaperFigure(figsize=size, layout=ConstrainedLayoutEngine(w_pad=0.02, h_pad=0.02))
    grid = drawn.add_gridspec(rows, figure.columns, height_ratios=heights)
    for i, panel in enumerate(figure.panels):
        place = grid[divmod(i, figure.columns)]
        if isinstance(panel, Space):
            axes: Axes3D = drawn.add_subplot(place, projection="3d", computed_zorder=False)
            draw_space(axes, panel, figure.step)
        else:
            draw_panel(drawn.add_subplot(place), panel, figure.step)
    return drawn


def _by_colouring(figure: Figure) -> Iterator[tuple[str, Figure]]:
    """Each colouring of a figure with a name, as a figure of its own."""
    spaces = (each for each in figure.panels if isinstance(each, Space))
    choices = [found for found in (quantities(each.marks) for each in spaces) if len(found) > 1]
    for quantity in dict.fromkeys(chain(*choices)):
        panels = tuple(_coloured(each, quantity) if isinstance(each, Space) else each for each in figure.panels)
        yield f"{figure.title} {quantity}", replace(figure, panels=panels)
    if not choices:
        yield figure.title, figure


def _coloured(space: Space, quantity: str) -> Space:
    """A space coloured by a quantity, if any of its marks has it."""
    if quantity not in quantities(space.marks):
        return space
    return replace(space, marks=coloured_by(space.marks, quantity))


def _file_name(title: str) -> str:
    words = "".join(each if each.isalnum() else " " for each in title.lower()).split()
    return "-".join(words) or "figure"


def _numbered(name: str) -> Iterator[str]:
    yield name
    number = 2
    while True:
        yield f"{name}-{number}"
        number += 1
