"""Colour scales as matplotlib knows them, and their bars."""

from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize

from palpate.reporting.colour_scales import ANCHORS
from palpate.reporting.marks import Colouring, ColourScale, finite_limits


def colour_map(scale: ColourScale) -> Colormap:
    """Return a colour scale as matplotlib knows it."""
    return LinearSegmentedColormap.from_list(scale.value, list(ANCHORS[scale]))


def norm_of(colouring: Colouring) -> Normalize:
    """Return what goes from values to the length of a colour scale."""
    return Normalize(*finite_limits(colouring))


def colour_bar(axes: Axes, mapped: ScalarMappable, label: str) -> None:
    """Put a labelled colour bar below a panel."""
    figure = axes.get_figure()
    assert figure is not None
    bar = figure.colorbar(mapped, ax=axes, location="bottom", aspect=30, shrink=0.8, pad=0.02)
    bar.set_label(label)
    bar.outline.set_visible(False)
