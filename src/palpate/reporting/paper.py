"""Pictures as a paper prints them: vectors in the width of a column or of the page, without title and caption.

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
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

from palpate.atomic_file import replacing
from palpate.errors import InvalidValueError
from palpate.reporting.paper_flat import draw_panel
from palpate.reporting.paper_space import draw_space
from palpate.reporting.picture import Picture, Space
from palpate.reporting.report import Pictures, Report
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


def write_pictures(report: Report, folder: Path, kind: str) -> tuple[Path, ...]:
    """Write each picture of a report into a folder, one file for each of its colourings.

    Args:
        report: Whose pictures.
        folder: Which is there.
        kind: "pdf", "svg" or "png".

    Returns:
        The files.

    Raises:
        InvalidValueError: Another kind.
        OSError: A file cannot be written.
    """
    parts = (part for section in report.sections for part in section.parts if isinstance(part, Pictures))
    names: set[str] = set()
    written = []
    for picture in (each for part in parts for each in part.draw() if each is not None):
        for name, single in _by_colouring(picture):
            numbered = next(n for n in _numbered(_file_name(name)) if n not in names)
            names.add(numbered)
            path = folder / f"{numbered}.{kind}"
            write_picture(single, path)
            written.append(path)
    return tuple(written)


def write_picture(picture: Picture, path: str | os.PathLike[str]) -> None:
    """Write a picture as the suffix says: .pdf, .svg or .png; the same picture gives the same file.

    Raises:
        InvalidValueError: Another suffix.
        OSError: The file cannot be written.
    """
    kind = Path(path).suffix.removeprefix(".")
    if kind not in KINDS:
        raise InvalidValueError(f"{path}: its suffix must be one of {', '.join('.' + each for each in KINDS)}")
    dated = {} if kind == "png" else {"CreationDate" if kind == "pdf" else "Date": None}
    with printing(), replacing(path) as file:
        paper_figure(picture).savefig(file, format=kind, metadata=dated)


def svg_text(picture: Picture) -> str:
    """Return a picture as an SVG document."""
    text = io.StringIO()
    with printing():
        paper_figure(picture).savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


@contextmanager
def printing() -> Iterator[None]:
    """Have matplotlib draw in the style of a paper."""
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        yield


def paper_figure(picture: Picture) -> Figure:
    """Return a picture as matplotlib's figure; of what moves, the step that is shown first."""
    rows = -(-len(picture.panels) // picture.columns)
    heights = [
        max(each.height for each in picture.panels[i * picture.columns : (i + 1) * picture.columns])
        for i in range(rows)
    ]
    size = (PAGE if picture.wide else COLUMN, PER_PIXEL * sum(heights))
    figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(w_pad=0.02, h_pad=0.02))
    grid = figure.add_gridspec(rows, picture.columns, height_ratios=heights)
    for i, panel in enumerate(picture.panels):
        place = grid[divmod(i, picture.columns)]
        if isinstance(panel, Space):
            axes: Axes3D = figure.add_subplot(place, projection="3d", computed_zorder=False)
            draw_space(axes, panel, picture.step)
        else:
            draw_panel(figure.add_subplot(place), panel, picture.step)
    return figure


def _by_colouring(picture: Picture) -> Iterator[tuple[str, Picture]]:
    """Each colouring of a picture with a name, as a picture of its own."""
    spaces = (each for each in picture.panels if isinstance(each, Space))
    choices = [found for found in (quantities(each.marks) for each in spaces) if len(found) > 1]
    for quantity in dict.fromkeys(chain(*choices)):
        panels = tuple(_coloured(each, quantity) if isinstance(each, Space) else each for each in picture.panels)
        yield f"{picture.title} {quantity}", replace(picture, panels=panels)
    if not choices:
        yield picture.title, picture


def _coloured(space: Space, quantity: str) -> Space:
    """A space coloured by a quantity, if any of its marks has it."""
    if quantity not in quantities(space.marks):
        return space
    return replace(space, marks=coloured_by(space.marks, quantity))


def _file_name(title: str) -> str:
    words = "".join(each if each.isalnum() else " " for each in title.lower()).split()
    return "-".join(words) or "picture"


def _numbered(name: str) -> Iterator[str]:
    yield name
    number = 2
    while True:
        yield f"{name}-{number}"
        number += 1
