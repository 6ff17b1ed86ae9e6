"""Prediction for a path that may leave the object."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import KDTree

from palpate.controllers import Raster
from palpate.controllers.paths import Point, Waypoints
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.scans.effort import Effort
from palpate.experiments.explore.tip_surface import TipSurface
from palpate.sim import SceneObject

CUT = 5e-3
"""It is asked so often along a path whether the tip meets the object there [m]."""

LEAST_PIECE = 2e-4
"""The first corner is no closer than this to where a path begins [m]: twice what gives a direction."""


@dataclass(frozen=True, slots=True)
class Beyond:
    """Prediction for a region that may leave the object.

    Attributes:
        begin: Where to land first: where nothing is met at the beginning, an exploration ends [m].
        missed: Places at which nothing will be met, about.
    """

    begin: Point
    missed: int


@dataclass(frozen=True, slots=True)
class BeyondPath(Beyond):
    """Prediction for a path that may leave the object.

    Attributes:
        path: From where it begins.
    """

    path: Waypoints


def missed_time(beyond: Beyond | None, effort: Effort) -> float:
    """Return the time in which nothing is met [s]."""
    return 0.0 if beyond is None else beyond.missed * effort.missing


def longest_hops(beyond: Beyond | None, length: float, effort: Effort) -> float:
    """Return how long it takes at most to look for the surface again and again along a path [s]."""
    return 0.0 if beyond is None else length / CUT * effort.hop(CUT, effort.miss)


def in_pieces(corners: Sequence[Point], longest: float) -> list[Point]:
    """Return a polygon with corners in between, so that none of its pieces is longer than `longest` [m]."""
    path = list(corners[:1])
    for a, b in pairwise(corners):
        count = max(1, math.ceil(math.dist(a, b) / longest - 1e-9))
        path += [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(1, count + 1)]
    return path


def predicted_rows(target: SceneObject, config: ExploreConfig, raster: Raster) -> Beyond | None:
    """Return the prediction for rows that may leave the object; None if they may not.

    They begin on a row, as far as possible from where nothing can be touched.

    Raises:
        InvalidValueError: None of it can be touched.
    """
    places = in_pieces(raster.corners(), min(CUT, raster.width / 4.0))
    missed = missed_places(target, config, tuple(places))
    if missed is None:
        return None
    reached = np.array([target.reachable(*place, min(config.tip)) for place in places])
    if not reached.any():
        raise _nowhere(config)
    on, off = np.array(places)[reached], np.array(places)[~reached]
    depth = KDTree(off).query(on)[0] if len(off) else -np.linalg.norm(on - raster.center, axis=1)
    x, y = on[int(np.argmax(depth))].tolist()
    return Beyond((x, min((v for _, v in raster.corners()), key=lambda v: abs(v - y))), missed)


def predicted_path(target: SceneObject, config: ExploreConfig, corners: tuple[Point, ...]) -> BeyondPath | None:
    """Return the prediction for a path that may leave the object; None if it may not.

    Raises:
        InvalidValueError: None of it can be touched.
    """
    missed = missed_places(target, config, tuple(in_pieces(corners, CUT)))
    if missed is None:
        return None
    path = list(corners)
    while len(path) > 1:
        pieces = in_pieces(path[:2], CUT)
        first = next((place for place in pieces[:-1] if target.reachable(*place, min(config.tip))), None)
        if first is not None:
            rest = path[1:] if math.dist(path[1], first) > LEAST_PIECE else path[2:]
            return BeyondPath(first, missed, Waypoints((first, *rest)))
        path.pop(0)
    raise _nowhere(config)


def _nowhere(config: ExploreConfig) -> InvalidValueError:
    return InvalidValueError(
        f"beyond: the {config.strategy} nowhere meets a part of the {config.object} that can be touched from "
        "above; move it there (--center)"
    )


def missed_places(target: SceneObject, config: ExploreConfig, places: tuple[Point, ...]) -> int | None:
    """Return the number of places at which the tip would meet nothing, where it may go there."""
    if not config.beyond:
        return None
    return int((~TipSurface.of(target, config.tip).meets(np.array(places))).sum())
