"""What was measured, drawn so that what was true stays visible."""

from matplotlib.axes import Axes

from palpate.reporting.data import FloatArray
from palpate.reporting.envelope import envelope
from palpate.reporting.style import MEASURED, TRUE


def draw_true_and_measured(axes: Axes, time: FloatArray, true: FloatArray | None, measured: FloatArray) -> None:
    """Draw `measured` (n,) as a thin line on a wide pale one of `true` (n,), if known, so that both show."""
    if true is not None:
        axes.plot(*envelope(time, true), color=TRUE, linewidth=2.2, alpha=0.5, label="true")
    axes.plot(*envelope(time, measured), color=MEASURED, linewidth=0.8, label="measured")
