"""A figure as data: panels with their axes and marks, independent of the place where they are shown.

`palpate.reporting.plots` draws it for the browser, `palpate.reporting.paper` as vectors for print.
"""

from dataclasses import dataclass

from palpate.reporting.marks import Mark, labelled
from palpate.reporting.solids import Solid
from palpate.runtime.palette import Colour


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis.

    Attributes:
        quantity: Name of the quantity along the axis.
        unit: Unit of its numbers; "" for a ratio or a count.
        low: Beginning; chosen from the marks if None.
        high: End; chosen from the marks if None.
        span: Minimum range, so that rounding errors do not fill the panel.
        logarithmic: Whether the scale is logarithmic.
        ticks: Places and names of the ticks; chosen automatically if empty.
        run_time: Whether the axis is the time of a run: all such axes of a report are zoomed together.
    """

    quantity: str = ""
    unit: str = ""
    low: float | None = None
    high: float | None = None
    span: float = 0.0
    logarithmic: bool = False
    ticks: tuple[tuple[float, str], ...] = ()
    run_time: bool = False

    @property
    def label(self) -> str:
        """Quantity and unit."""
        return labelled(self.quantity, self.unit)


TIME = Axis("time", "s", run_time=True)
"""Time of a run."""


@dataclass(frozen=True, slots=True)
class Panel:
    """A flat panel.

    Attributes:
        marks: Marks in drawing order.
        x: Horizontal axis.
        y: Vertical axis.
        title: Title above the panel; "" for none.
        equal: Whether both axes have the same scale.
        ground: Role of the background; None for that of the card.
        height: Height on a page [px].
    """

    marks: tuple[Mark, ...]
    x: Axis
    y: Axis
    title: str = ""
    equal: bool = False
    ground: Colour | None = None
    height: int = 300


@dataclass(frozen=True, slots=True)
class Space:
    """A panel in space, which the reader can rotate.

    Attributes:
        marks: Marks in the order of the legend.
        title: Title above the panel; "" for none.
        height: Height on a page [px].
        view: Direction from the centre to the eye; its length is the distance, in sizes of the scene.
    """

    marks: tuple[Solid, ...]
    title: str = ""
    height: int = 480
    view: tuple[float, float, float] = (0.6, -1.0, 0.8)


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure and its caption.

    Attributes:
        title: Short heading.
        caption: Sentences on the content, and on the values that are good.
        panels: Panels, row by row.
        columns: Panels side by side on a screen; a phone stacks them.
        steps: Names of the steps that the reader plays through; () for a still figure.
        step: Step that is shown first.
        wide: Whether the figure takes the width of the page.
    """

    title: str
    caption: str
    panels: tuple[Panel | Space, ...]
    columns: int = 1
    steps: tuple[str, ...] = ()
    step: int = 0
    wide: bool = False
