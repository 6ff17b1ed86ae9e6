"""Friction, stiffness and curvature of a surface, seen from above."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore.map_picture import SHOWN_PERCENT, from_above
from palpate.mapping import SurfaceMesh
from palpate.mapping.layers import VertexLayer
from palpate.reporting.style import ERROR_COLOURS, HEIGHT_COLOURS, Picture, Width, new_figure

NEGLIGIBLE = 1e-3
"""Relative standard deviation below which it is not shown."""


@dataclass(frozen=True, slots=True)
class LayerLook:
    """How a layer is shown.

    Attributes:
        title: Of the picture and of its colours.
        meaning: What it is and from what it is known, for the caption.
        deviation: Text between the median and the standard deviation.
        unit: That it is shown in; empty of a ratio.
        scale: Factor from SI to that unit.
        least: What the colours span at least, in that unit, and twice the deviation: less is the same.
        signed: Whether it may be of either sign, and colours tell which
            where there are both: zero is in their middle.
    """

    title: str
    meaning: str
    deviation: str = "±"
    unit: str = ""
    scale: float = 1.0
    least: float = 0.0
    signed: bool = False


def _curvature(title: str, meaning: str) -> LayerLook:
    # 5 / m to either side: a radius of 0.2 m, by which a row of 40 mm bends 1 mm
    return LayerLook(title, f"{meaning}; + is convex", unit="1/m", least=10.0, signed=True)


LOOKS: Mapping[str, LayerLook] = {
    "friction": LayerLook(
        "Friction", "Tangential over normal force while sliding", "scattering between neighbours by", least=0.02
    ),
    "stiffness": LayerLook(
        "Stiffness of the object",
        "Change of force over change of compression where the force varied, without the tip's share",
        unit="kN/m",
        scale=1e-3,
    ),
    "curvature_max": _curvature("Largest curvature", "Of the map, in the direction in which it is largest"),
    "curvature_min": _curvature("Smallest curvature", "Of the map, in the direction in which it is smallest"),
    "curvature_mean": _curvature("Mean curvature", "Of the map, the mean of all directions"),
    "curvature_rolled": _curvature(
        "Mean curvature, from normals", "From how the normals turned along the path, heights aside"
    ),
}
"""Layers that palpate makes, by name; see `palpate.mapping.layers`."""


def layer_picture(mesh: SurfaceMesh, layer: VertexLayer) -> Picture | None:
    """Return a layer seen from above; None if nothing is known of it.

    One that is not among `LOOKS` is shown in SI units under its own name.
    """
    look = LOOKS.get(layer.name, LayerLook(layer.name.capitalize(), layer.name.capitalize()))
    value, sd = look.scale * layer.mean, look.scale * layer.sd
    known = np.isfinite(value)
    if not known.any():
        return None
    figure = new_figure(Width.HALF, 4.7)
    unit = f" {look.unit}" if look.unit else ""
    label = look.title + (f" [{look.unit}]" if look.unit else "")
    spread = float(np.median(sd[np.isfinite(sd)])) if np.isfinite(sd).any() else 0.0
    # of one sign throughout, as on a ball, colours about zero would all be one
    least = max(look.least, 2.0 * spread)
    low, high = _limits(value[known], least, signed=False)
    both = look.signed and low < 0.0 < high
    limits = _limits(value[known], least, both)
    colours = ERROR_COLOURS if both else HEIGHT_COLOURS
    from_above(figure, figure.subplots(), mesh, value, colours, limits, label)
    significant = spread >= NEGLIGIBLE * abs(float(np.median(value[known])))
    deviation = f" {look.deviation} {spread:.2g}" if spread and significant else ""
    share = f"{100.0 * float(known.mean()):.0f}"
    grey = "" if share == "100" else f" Known on {share} % of the map."
    return Picture(
        title=look.title,
        caption=(
            f"{look.meaning}: median {float(np.median(value[known])):.3g}{deviation}{unit}. "
            f"The colours span {2.0 * SHOWN_PERCENT - 100.0:.0f} % of the values or more; one material, "
            f"or one shape, is one "
            f"colour.{grey}"
        ),
        full=figure,
        dense=True,
    )


def _limits(value: FloatArray, least: float, signed: bool) -> tuple[float, float]:
    """What the ends of the colours stand for."""
    low, high = np.percentile(value, [100.0 - SHOWN_PERCENT, SHOWN_PERCENT]).tolist()
    if signed:
        high = max(abs(low), abs(high))
        low = -high
    room = max(0.5 * (least - (high - low)), 0.0)
    return low - room, high + room
