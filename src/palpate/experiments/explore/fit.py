"""The region of an object that can be touched from above, and the nearest region that fits where it cannot."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter

from palpate.controllers.paths import Point
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.config import FROM_FILE, ExploreConfig
from palpate.sim import SceneObject

_SURVEY_EXTENTS = (0.05, 0.1, 0.25, 0.5, 1.0)
"""Half sides of the square in which a better place is sought [m], until the object lies inside."""


@dataclass(frozen=True, slots=True)
class Region:
    """Region of an exploration, seen from above, for the middle of the tip.

    Attributes:
        width: Extent along x [m].
        depth: Extent along y [m].
        center: Center of the region [m].
        round: Whether it is the disc in that rectangle.
    """

    width: float
    depth: float
    center: Point
    round: bool = False

    @property
    def corners(self) -> tuple[Point, Point]:
        """Least and largest corner of the rectangle [m]."""
        (x, y), w, d = self.center, 0.5 * self.width, 0.5 * self.depth
        return (x - w, y - d), (x + w, y + d)

    @property
    def line(self) -> str:
        """Description for a report."""
        x, y = self.center
        width, depth = 1e3 * self.width, 1e3 * self.depth
        size = f"disc of radius {0.5 * width:g}" if self.round else f"{width:g} x {depth:g}"
        return f"{size} mm about x = {1e3 * x:g}, y = {1e3 * y:g} mm"

    def holds(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """Return whether places (n, 2) lie in it, shape (n,)."""
        off = np.abs(places - self.center) / (0.5 * self.width, 0.5 * self.depth)
        return np.asarray((off**2).sum(axis=1) <= 1.0 if self.round else (off <= 1.0).all(axis=1))

    def fits(self, target: SceneObject, radius: float) -> bool:
        """Return whether a tip of a radius [m] can touch the object everywhere in the region."""
        x, y = self.center
        # 41 points along each side, 1 mm of 40 mm; the outermost, which fail first, come first
        order = sorted(np.linspace(-0.5, 0.5, 41).tolist(), key=abs, reverse=True)
        return all(
            target.reachable(x + self.width * u, y + self.depth * v, radius)
            for u in order
            for v in order
            if not self.round or math.hypot(u, v) <= 0.5
        )

    def shrunk(self, factor: float) -> "Region":
        """Return the region made smaller, to three significant digits, for a disc those of its radius.

        Digits are those of the message that recommends the region: it must be accepted as printed.
        """
        if self.round:
            width = 2.0 * _rounded_down(0.5 * factor * self.width)
            return replace(self, width=width, depth=width)
        return replace(self, width=_rounded_down(factor * self.width), depth=_rounded_down(factor * self.depth))


def region_on(target: SceneObject, config: ExploreConfig) -> Region:
    """Return the region that a configuration requests; extents that it leaves out are chosen so that they fit.

    Raises:
        InvalidValueError: If the region leaves the part of the object that can be touched from above, and is not
            meant to; the message names a region that fits.
    """
    requested = Region(*config.extent, config.middle, config.strategy == "spiral")
    radius = min(config.tip)
    if config.beyond or requested.fits(target, radius):
        return requested
    any_size = config.width is None and config.depth is None and config.radius is None
    smaller = (requested.shrunk(factor) for factor in np.linspace(0.99, 0.01, 99).tolist())
    largest = next((each for each in smaller if each.fits(target, radius)), None)
    better = next((each for each in _elsewhere(target, radius, requested) if each.fits(target, radius)), None)
    if better is not None and largest is not None and better.width <= 1.02 * largest.width:
        better = None  # not worth moving to
    if better is not None and not config.center and (any_size or better.width == requested.width):
        return better
    if largest is not None and any_size:
        return largest
    raise InvalidValueError(_refusal(requested, largest, better, config))


def _refusal(requested: Region, largest: Region | None, better: Region | None, config: ExploreConfig) -> str:
    advice = []
    x, y = requested.center
    if largest is not None:
        size = f"{largest.width:.3g} x {largest.depth:.3g} m in these proportions (--width, --depth)"
        size = f"{0.5 * largest.width:.3g} m (--radius)" if requested.round else size
        advice.append(f"at most {size}" + (f" about x = {x:g}, y = {y:g} m" if x or y else ""))
    if better is not None:
        size = f" --width {better.width:.3g} --depth {better.depth:.3g}"
        size = f" --radius {0.5 * better.width:.3g}" if requested.round else size
        size = "" if better.width == requested.width else size
        advice.append(f"--center {better.center[0]:.4g} {better.center[1]:.4g}{size} fits")
    if not advice:
        advice.append("no place on it was found that does")
    if config.object not in FROM_FILE:
        advice.append("or take a larger object (--size)")
    advice.append("or go there all the same and mark what cannot be touched (--beyond)")
    shape = {"raster": "a raster", "taps": "a grid of taps", "active": "a field"}.get(config.strategy, "a spiral")
    extent = f"{requested.width:g} x {requested.depth:g} m"
    extent = f"radius {0.5 * requested.width:g} m" if requested.round else extent
    return (
        f"{shape} of {extent} leaves the part of the {config.object} that can be touched from above, less than 60 "
        f"degrees steep; {', '.join(advice)}"
    )


def _elsewhere(target: SceneObject, radius: float, requested: Region) -> Iterator[Region]:
    """Yield regions of the same proportions that may fit, the largest and nearest ones first."""
    x, y = requested.center
    along, reached = _survey(target, radius)
    step = float(along[1] - along[0])
    for factor in np.linspace(1.0, 0.1, 19).tolist():
        tried = requested if factor == 1.0 else requested.shrunk(factor)
        around = [2 * math.ceil(0.5 * side / step) + 1 for side in (tried.depth, tried.width)]
        rows, columns = np.nonzero(minimum_filter(reached, size=around, mode="constant", cval=0))
        places = sorted(
            zip(along[columns].tolist(), along[rows].tolist(), strict=True),
            key=lambda place: (place[0] - x) ** 2 + (place[1] - y) ** 2,
        )
        yield from (replace(tried, center=(float(f"{u:.4g}"), float(f"{v:.4g}"))) for u, v in places[:5])


def _survey(target: SceneObject, radius: float) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return places along x and y [m], and whether the tip can touch there, y along rows."""
    for extent in _SURVEY_EXTENTS:
        along = np.linspace(-extent, extent, 121)
        places = along.tolist()
        reached = np.array([[target.reachable(u, v, radius) for u in places] for v in places])
        if extent == _SURVEY_EXTENTS[-1] or not (reached[[0, -1]].any() or reached[:, [0, -1]].any()):
            return along, reached
    raise AssertionError("SURVEY_EXTENTS is empty")


def _rounded_down(length: float) -> float:
    """Return three significant digits of a length, never more than the length."""
    rounded = float(f"{length:.3g}")
    return rounded if rounded <= length else float(f"{rounded * (1.0 - 6e-3):.3g}")
