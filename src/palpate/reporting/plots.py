"""Pictures as plotly.js draws them: one plot per panel.

`page.js` does what plotly.js cannot: switching colourings, playing steps, zooming the times of a run together.
"""

from palpate.reporting.flat_plots import flat_plot
from palpate.reporting.picture import Panel, Picture, Space
from palpate.reporting.space_plots import space_plot
from palpate.reporting.traces import Json


def plots(picture: Picture) -> list[Json]:
    """Return what `page.js` draws of a picture, panel by panel."""
    return [
        space_plot(each) if isinstance(each, Space) else flat_plot(each, _zoomed_with(each, picture))
        for each in picture.panels
    ]


def _zoomed_with(panel: Panel, picture: Picture) -> str:
    """What the x axis is zoomed with: all of the "run", its likes in the "picture", or nothing ("")."""
    if panel.x.run_time:
        return "run"
    alike = [each for each in picture.panels if isinstance(each, Panel) and each.x == panel.x]
    return "picture" if len(alike) > 1 and picture.columns == 1 else ""
