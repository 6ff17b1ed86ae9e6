"""A figure as data: panels with their axes and marks. It is stated once, and drawn by whoever shows it.

`palpate.reporting.plots` draws it in the reader's browser, `palpate.reporting.paper` as vectors for print.
"""

from dataclasses import dataclass

from palpate.reporting.marks import Mark, labelled
from palpate.reporting.solids import Solid
from palpate.runtime.palette import Colour


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis.

    Attributes:
        quantity: What it tells.
        unit: Of its numbers; "" for a ratio or a count.
        low: Where it begins; as the marks need if None.
        high: Where it ends, likewise.
        span: That it covers at least, so that rounding is not shown as if it were something.
        logarithmic: Whether it is.
        ticks: Places and their names; chosen by whoever draws if empty.
        run_time: Whether it is the time of a run: all such axes of a report are zoomed together.
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
"""Of a run."""


@dataclass(frozen=True, slots=True)
class Panel:
    """A flat panel.

    Attributes:
        marks: In the order in which they are drawn.
        x: Across.
        y: Upwards.
        title: Above it; "" for none.
        equal: Whether lengths along both axes are the same.
        ground: Role of the ground behind the marks; none: that of the card.
        height: [px] on a page.
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
    """A panel in space; the reader turns it.

    Attributes:
        marks: In the order of the legend.
        title: Above it; "" for none.
        height: [px] on a page.
        view: Direction from the middle to the eye; its length is that of the view, in sizes of what is shown.
    """

    marks: tuple[Solid, ...]
    title: str = ""
    height: int = 480
    view: tuple[float, float, float] = (0.6, -1.0, 0.8)


FROM_ABOVE = (0.0, -0.01, 1.4)
"""View from above, x to the right."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure with what a reader needs beside it.

    Attributes:
        title: Short heading.
        caption: What one sees and what is good, in sentences.
        panels: In order, row by row.
        columns: Panels side by side on a screen; on a phone they stand below one another.
        steps: Names of the steps that the reader plays through; none if nothing moves.
        step: Which is shown first.
        wide: Whether it takes the width of the page.
    """

    title: str
    caption: str
    panels: tuple[Panel | Space, ...]
    columns: int = 1
    steps: tuple[str, ...] = ()
    step: int = 0
    wide: bool = False
