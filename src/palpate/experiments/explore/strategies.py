"""Which strategies there are to explore by; imports nothing heavy."""

from collections.abc import Mapping
from typing import Literal

StrategyName = Literal["raster", "spiral", "contour", "taps", "active"]
CurveName = Literal["level", "edge"]
TurnName = Literal["left", "right"]
MeasureName = Literal["rms", "largest"]

SPACING: Mapping[StrategyName, float] = {
    "raster": 0.002,
    "spiral": 0.002,
    "contour": 0.002,
    "taps": 0.005,
    "active": 0.002,
}
"""Distance of rows, turns or taps, if none is given [m]. Of a contour, which is a single line, and of active rows,
which lie where they are needed, it is how finely the map is drawn."""

ACCURACY: Mapping[MeasureName, float] = {"rms": 2e-5, "largest": 1e-4}
"""Wanted error of the map, if none is given [m]: what `benchmarks/active.py` stops at."""
