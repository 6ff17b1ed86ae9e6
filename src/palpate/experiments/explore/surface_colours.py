"""What the colours of a map tell: height, error, how sure it is, friction, stiffness, curvature."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore.explored_map import ExploredMap
from palpate.mapping.layers import VertexLayer
from palpate.reporting.marks import Colouring, ColourScale

MILLI, MICRO = 1e3, 1e6

HEIGHT = "height z"
ERROR_OF_MAP = "error of the map, + is outside"
ERROR_OF_POINTS = "error of single points, + is outside"
"""Quantities, as the switch between them names them."""

SHOWN_PERCENT = 99.0
"""Colours span this share of the values, so that a few outliers do not hide the rest."""

LEAST_RELIEF = 0.05
"""Colours of heights span at least this share of the horizontal extent, so that a flat surface looks flat."""

LEAST_ERROR = 1e-3
"""Colours of errors span at least this to either side [µm]: less is rounding."""


@dataclass(frozen=True, slots=True)
class LayerLook:
    """How a layer is shown.

    Attributes:
        quantity: What it is.
        unit: That it is shown in; empty of a ratio.
        scale: Factor from SI to that unit.
        least: What the colours span at least, in that unit, and twice the deviation: less is the same.
        signed: Whether it may be of either sign, and colours tell which
            where there are both: zero is in their middle.
    """

    quantity: str
    unit: str = ""
    scale: float = 1.0
    least: float = 0.0
    signed: bool = False


def _curvature(quantity: str) -> LayerLook:
    # 5 / m to either side: a radius of 0.2 m, by which a row of 40 mm bends 1 mm
    return LayerLook(quantity, unit="1/m", least=10.0, signed=True)


LOOKS: Mapping[str, LayerLook] = {
    "friction": LayerLook("friction while sliding", least=0.02),
    "stiffness": LayerLook("stiffness of the object", unit="kN/m", scale=1e-3),
    "curvature_mean": _curvature("mean curvature, + is convex"),
    "curvature_max": _curvature("largest curvature, + is convex"),
    "curvature_min": _curvature("smallest curvature, + is convex"),
    "curvature_rolled": _curvature("mean curvature, from how normals turned"),
}
"""Layers that palpate makes, by name; see `palpate.mapping.layers`."""


def map_colourings(found: ExploredMap) -> tuple[Colouring, ...]:
    """Return all that is known at the vertices of a map."""
    mesh = found.mesh
    layers = [each for each in found.layers if isinstance(each, VertexLayer)]
    return (
        height_colouring(mesh.vertices),
        *([error_colouring(ERROR_OF_MAP, found.error)] if found.truth_known else []),
        _deviation("standard deviation", mesh.sd),
        _deviation("95 % band, half its width", mesh.band()),
        *(each for each in map(layer_colouring, layers) if each is not None),
    )


def height_colouring(points: FloatArray) -> Colouring:
    """Return the heights of points (n, 3) [m], n at least 1."""
    low, high = points.min(axis=0), points.max(axis=0)
    width, depth, height = (high - low).tolist()
    middle, half = 0.5 * float(low[2] + high[2]), 0.5 * max(height, LEAST_RELIEF * max(width, depth), 1e-6)
    return Colouring(HEIGHT, MILLI * points[:, 2], "mm", MILLI * (middle - half), MILLI * (middle + half))


def error_colouring(quantity: str, error: FloatArray) -> Colouring:
    """Return signed errors (n,) [m], white where there is none."""
    size = np.abs(error[np.isfinite(error)])
    limit = max(MICRO * float(np.percentile(size, SHOWN_PERCENT)), LEAST_ERROR) if len(size) else LEAST_ERROR
    return Colouring(quantity, MICRO * error, "µm", -limit, limit, ColourScale.ERROR)


def layer_colouring(layer: VertexLayer) -> Colouring | None:
    """Return a layer; None if nothing is known of it.

    One that is not among `LOOKS` is shown in SI units under its own name.
    """
    look = LOOKS.get(layer.name, LayerLook(layer.name))
    value, sd = look.scale * layer.mean, look.scale * layer.sd
    known = np.isfinite(value)
    if not known.any():
        return None
    spread = float(np.median(sd[np.isfinite(sd)])) if np.isfinite(sd).any() else 0.0
    least = max(look.least, 2.0 * spread)
    low, high = np.percentile(value[known], [100.0 - SHOWN_PERCENT, SHOWN_PERCENT]).tolist()
    room = max(0.5 * (least - (high - low)), 0.0)
    low, high = low - room, high + room
    if look.signed and low < 0.0 < high:
        # of one sign throughout, as on a ball, colours about zero would all be one
        high = max(-low, high)
        return Colouring(look.quantity, value, look.unit, -high, high, ColourScale.ERROR)
    return Colouring(look.quantity, value, look.unit, low, high)


def _deviation(quantity: str, value: FloatArray) -> Colouring:
    largest = max(MICRO * float(np.nanpercentile(value, SHOWN_PERCENT)), LEAST_ERROR)
    return Colouring(quantity, MICRO * value, "µm", 0.0, largest)
