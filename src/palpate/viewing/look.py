"""How the view looks: light or dark as the reader's system is, with a legend of its colours, readable when lost.

The page is viser's, which is light or dark for everybody alike. A style sheet put into the panel turns it dark for
those whose system is, and shows it when the connection is lost: viser dims the panel then, and that is all.
"""

from palpate.runtime import palette
from palpate.runtime.palette import Colour, rgb

LOST = "Connection lost: what is shown stands still. Has the view been closed?"
"""Shown over the panel when nobody serves the view any more."""

_SHEET = """<style>
@media (prefers-color-scheme: dark) {{
  :root[data-mantine-color-scheme] {{
    color-scheme: dark;
    --mantine-color-body: {card} !important; --mantine-color-text: {ink} !important;
    --mantine-color-default: {pane} !important; --mantine-color-default-border: {line} !important;
    --mantine-color-default-color: {ink} !important; --mantine-color-default-hover: {line} !important;
    --mantine-color-dimmed: {quiet} !important; --mantine-color-placeholder: {quiet} !important;
    --mantine-color-bright: {ink} !important; --mantine-color-white: {card} !important;
    --mantine-color-black: {ink} !important; --mantine-color-gray-3: {line} !important;
    --mantine-color-gray-2: {line} !important; --mantine-color-gray-6: {quiet} !important;
    --mantine-primary-color-outline: {felt} !important; --mantine-color-blue-outline: {felt} !important;
  }}
  body div[style*="background-color: rgb(255, 255, 255)"] {{ background-color: {ground} !important; }}
  .uplot-container canvas {{ filter: invert(1) hue-rotate(180deg); }}
  .uplot-container, .uplot-container * {{ color: {ink}; }}
  .palpate-legend, .palpate-legend *, .mantine-Notification-title {{ color: {ink}; }}
}}
div:has(> div[style*="pointer-events: none"] .palpate-legend)::before {{
  content: "{lost}"; display: block; padding: 0.5em 1em; font-weight: 600;
  background: {bound}; color: {white};
}}
.palpate-legend b {{ display: inline-block; width: 0.8em; height: 0.8em; border-radius: 0.2em; }}
.palpate-legend span {{ display: inline-block; margin-right: 1em; }}
</style>"""


def style_sheet() -> str:
    """Return the style sheet of the page, as HTML for the panel."""
    dark = {
        name: colour.dark
        for name, colour in {
            "card": palette.CARD,
            "ground": palette.GROUND,
            "pane": palette.PANE_COLOUR,
            "ink": palette.INK_COLOUR,
            "quiet": palette.QUIET_COLOUR,
            "line": palette.GRID_COLOUR,
            "felt": palette.FELT,
        }.items()
    }
    return _SHEET.format(**dark, lost=LOST, bound=palette.BOUND.light, white=palette.CARD.light)


def legend(length_per_newton: float, *, has_map: bool) -> str:
    """Return what the colours in the scene mean, as HTML.

    Args:
        length_per_newton: Of an arrow [m/N].
        has_map: Whether a map grows.
    """
    entries = [
        (palette.FELT, f"force felt, {1e3 * length_per_newton:g} mm per N"),
        (palette.QUIET_COLOUR, "path of the tip"),
    ]
    if has_map:  # what explores makes one, and nothing else knows where it will go
        entries.append((palette.COMMAND, "still to go"))
    words = "".join(f'<span><b style="background: {each.light}"></b> {text}</span> ' for each, text in entries)
    heights = "<span>points of the map: dark is low, yellow high</span>" if has_map else ""
    return f'<div class="palpate-legend" style="padding: 0 1em; font-size: 0.85em">{words}{heights}</div>'


def linear_rgb(colour: Colour) -> tuple[int, int, int]:
    """Return a colour as viser takes an arrow's: for linear light (the curve of sRGB, IEC 61966-2-1)."""
    red, green, blue = (_linear(each / 255.0) for each in rgb(colour))
    return round(255.0 * red), round(255.0 * green), round(255.0 * blue)


def _linear(value: float) -> float:
    return float(value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4)
