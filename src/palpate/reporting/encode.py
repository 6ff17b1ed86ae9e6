"""Figures as data URIs, so that a report is one file; their text and lines follow the reader's theme.

A picture is drawn once, in the light colours of `palpate.runtime.palette`, and written as SVG. There each of
these colours becomes a CSS variable, which a style sheet inside the picture sets by `prefers-color-scheme`. What
has many thousand elements is kept as pixels within it, without a ground; so nothing is stored twice.
"""

import base64
import io
import re
from types import MethodType

import matplotlib as mpl
from matplotlib.artist import allow_rasterization
from matplotlib.collections import Collection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from palpate.reporting.style import Picture
from palpate.runtime import palette

DOTS_PER_INCH = 96
"""Of a browser at 100 %."""

SHARPNESS = 2
"""Pixels per dot, for screens with small pixels."""

MATPLOTLIB = {"#000000": palette.INK_COLOUR, "#b0b0b0": palette.GRID_COLOUR, "#cccccc": palette.GRID_COLOUR}
"""Colours that matplotlib takes by itself, and what they stand for."""

_ROLES = {each.light: each for each in palette.ALL} | MATPLOTLIB
_COLOUR = re.compile(r"(?<=: )#[0-9a-f]{6}\b")
_OUTSIDE = re.compile(r"<!DOCTYPE.*?>\n?|<metadata>.*?</metadata>\n?", re.DOTALL)


def svg_text(figure: Figure, *, dense: bool = False) -> str:
    """Return `figure` as SVG whose colours follow the reader's theme. The same figure gives the same text.

    Args:
        figure: Drawn with the light colours.
        dense: Whether what is drawn in bulk is kept as pixels, `SHARPNESS` per dot.
    """
    _clear(figure, dense=dense)
    text = io.BytesIO()
    # The salt of SVG ids is only to be set here; without it they are random.
    with mpl.rc_context({"svg.hashsalt": "palpate"}):
        figure.savefig(
            text, format="svg", dpi=SHARPNESS * DOTS_PER_INCH, facecolor="none", metadata={"Date": None}
        )
    return _themed(_OUTSIDE.sub("", text.getvalue().decode("utf-8")))


def svg_uri(figure: Figure, *, dense: bool = False) -> str:
    """Return `svg_text` as a data URI."""
    text = svg_text(figure, dense=dense).encode("utf-8")
    return "data:image/svg+xml;base64," + base64.b64encode(text).decode("ascii")


def picture_uri(picture: Picture, figure: Figure) -> str:
    """Return `figure` of `picture` as a data URI."""
    return svg_uri(figure, dense=picture.dense)


def _clear(figure: Figure, *, dense: bool) -> None:
    """Take white grounds away, and let what is drawn in bulk become pixels."""
    for axes in figure.axes:
        if to_hex(axes.get_facecolor()) == palette.CARD.light:
            axes.set_facecolor("none")
        for artist in axes.get_children() if dense else ():
            if isinstance(artist, Collection):
                _make_pixels(artist)


def _make_pixels(artist: Collection) -> None:
    """Have a collection kept as pixels; three-dimensional ones override `draw`, which must allow it."""
    if not getattr(artist.draw, "_supports_rasterization", False):
        artist.draw = MethodType(allow_rasterization(type(artist).draw), artist)  # type: ignore[method-assign, no-untyped-call]
    artist.set_rasterized(True)


def _themed(svg: str) -> str:
    """Return an SVG with variables for its colours, and their values by theme."""
    used: dict[str, palette.Colour] = {}

    def variable(found: re.Match[str]) -> str:
        role = _ROLES.get(found[0])
        if role is None:
            return found[0]
        used[role.name] = role
        return f"var(--{role.name})"

    svg = _COLOUR.sub(variable, svg)
    # what matplotlib leaves to the default, black, is ink
    used[palette.INK_COLOUR.name] = palette.INK_COLOUR
    light = "".join(f"--{each.name}:{each.light};" for each in used.values())
    dark = "".join(f"--{each.name}:{each.dark};" for each in used.values())
    sheet = (
        f"<style>:root{{color-scheme:light dark;fill:var(--ink);{light}}}"
        f"@media(prefers-color-scheme:dark){{:root{{{dark}}}}}</style>"
    )
    begin = svg.index(">", svg.index("<svg")) + 1
    return svg[:begin] + sheet + svg[begin:]
