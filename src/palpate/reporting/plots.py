"""Figures as plotly.js draws them: one plot per panel.

`page.js` does what plotly.js cannot: switching colourings, playing steps, zooming the times of a run together.
"""

from palpate.reporting.figure import Figure, Panel, Space
from palpate.reporting.flat_plots import flat_plot
from palpate.reporting.space_plots import space_plot
from palpate.reporting.traces import Json


def plots(figure: Figure) -> list[Json]:
    """Return what `page.js` draws of a figure, panel by panel."""
    return [
        space_plot(each) if isinstance(each, Space) else flat_plot(each, _zoomed_with(each, figure))
        for each in figure.panels
    ]


def _zoomed_with(panel: Panel, figure: Figure) -> str:
    """What the x axis is zoomed with: all of the "run", its likes in the "figure", or nothing ("")."""
    if panel.x.run_time:
        return "run"
    alike = [each for each in figure.panels if isinstance(each, Panel) and each.x == panel.x]
    return "figure" if len(alike) > 1 and figure.columns == 1 else ""
