"""Which strategies there are to explore by, and which options belong to which; imports nothing heavy."""

from collections.abc import Mapping
from typing import Literal

from palpate.experiments.kit.owned_options import check_owned

StrategyName = Literal["raster", "spiral", "contour", "taps", "active"]
CurveName = Literal["level", "edge"]
TurnName = Literal["left", "right"]
MeasureName = Literal["rms", "largest"]

STRATEGY_OPTIONS: Mapping[StrategyName, tuple[str, ...]] = {
    "raster": ("width", "depth", "center", "spacing", "beyond"),
    "spiral": ("radius", "center", "spacing", "beyond"),
    "contour": ("curve", "below", "turn", "center"),
    "taps": ("width", "depth", "center", "spacing", "beyond"),
    "active": ("width", "depth", "center", "accuracy", "measure", "area", "time", "beyond"),
}
"""Fields of `ExploreConfig` that say where a strategy goes. Any other is of no use to it, and refused."""

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


def check_options(strategy: str, given: Mapping[str, object]) -> None:
    """Refuse a strategy that there is not, and options that belong to another.

    Args:
        strategy: Its name.
        given: Options that were given, and their values.

    Raises:
        InvalidValueError: As it says.
    """
    check_owned("strategy", strategy, STRATEGY_OPTIONS, given, {"radius": "; the object's size is --size"})
