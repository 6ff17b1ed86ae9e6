"""Figures as data URIs, so that a report is one file."""

import base64
import io

import matplotlib as mpl
from matplotlib.figure import Figure

from palpate.reporting.style import Picture

DOTS_PER_INCH = 96
"""Of a browser at 100 %."""

SHARPNESS = 2
"""Pixels per dot, for screens with small pixels."""


def svg_uri(figure: Figure) -> str:
    """Return `figure` as lines. The same figure gives the same text."""
    text = io.BytesIO()
    # The salt of SVG ids is only to be set here; without it they are random.
    with mpl.rc_context({"svg.hashsalt": "palpate"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(text.getvalue()).decode("ascii")


def png_uri(figure: Figure) -> str:
    """Return `figure` as pixels, `SHARPNESS` per dot."""
    pixels = io.BytesIO()
    figure.savefig(pixels, format="png", dpi=SHARPNESS * DOTS_PER_INCH)
    return "data:image/png;base64," + base64.b64encode(pixels.getvalue()).decode("ascii")


def picture_uri(picture: Picture, figure: Figure) -> str:
    """Return `figure` of `picture` in the form that suits it."""
    return png_uri(figure) if picture.dense else svg_uri(figure)
