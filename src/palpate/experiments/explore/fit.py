"""The rectangle or disc of an object that can be touched from above, or what would fit instead."""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter

from palpate.controllers.paths import Point
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.objects import FROM_FILE
from palpate.sim import SceneObject

TRIED = 41
"""Points along each side of the rectangle at which it is asked whether the tip can touch: 1 mm of 40 mm."""

SURVEYED = 121
"""Points along each side of the square in which a better place is looked for."""

EXTENTS = (0.05, 0.1, 0.25, 0.5, 1.0)
"""Half sides of that square that are tried [m], until the object lies inside."""

BETTER = 1.02
"""Another place must have room for a rectangle larger by this to be worth moving to."""


@dataclass(frozen=True, slots=True)
class Region:
    """What is to be explored, seen from above: where the middle of the tip goes.

    Attributes:
        width: Along x [m].
        depth: Along y [m].
        center: Of both [m].
        round: Whether it is the disc in that rectangle.
    """

    width: float
    depth: float
    center: Point
    round: bool = False

    @property
    def corners(self) -> tuple[Point, Point]:
        """Of the rectangle, the least and the largest [m]."""
        (x, y), w, d = self.center, 0.5 * self.width, 0.5 * self.depth
        return (x - w, y - d), (x + w, y + d)

    @property
    def line(self) -> str:
        """What it is, for a report."""
        x, y = self.center
        about = f"about x = {1e3 * x:g}, y = {1e3 * y:g} mm"
        if self.round:
            return f"disc of radius {1e3 * 0.5 * self.width:g} mm {about}"
        return f"{1e3 * self.width:g} x {1e3 * self.depth:g} mm {about}"

    def holds(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """Return whether places (n, 2) lie in it, shape (n,)."""
        off = np.abs(places - self.center) / (0.5 * self.width, 0.5 * self.depth)
        return np.asarray((off**2).sum(axis=1) <= 1.0 if self.round else (off <= 1.0).all(axis=1))


def region_on(target: SceneObject, config: ExploreConfig) -> Region:
    """Return what a configuration wants explored of an object. What it leaves out is chosen so that it fits.

    Raises:
        InvalidValueError: It leaves the part of the object that can be touched from above, and is not meant to;
            the message names what would fit.
    """
    wanted = Region(*config.extent, config.middle, config.strategy == "spiral")
    radius = min(config.tip)
    if config.beyond or _fits(target, radius, wanted):
        return wanted
    anywhere = not config.center
    of_any_size = config.width is None and config.depth is None and config.radius is None
    largest = _largest(target, radius, wanted)
    better = _better_place(target, radius, wanted)
    if better is not None and largest is not None and better.width <= BETTER * largest.width:
        better = None
    if better is not None and anywhere and (of_any_size or better.width == wanted.width):
        return better
    if largest is not None and of_any_size:
        return largest
    raise InvalidValueError(_refusal(wanted, largest, better, config))


def _refusal(wanted: Region, largest: Region | None, better: Region | None, config: ExploreConfig) -> str:
    advice = []
    x, y = wanted.center
    if largest is not None:
        size = f"{0.5 * largest.width:.3g} m (--radius)" if wanted.round else _size(largest)
        advice.append(f"at most {size}" + (f" about x = {x:g}, y = {y:g} m" if x or y else ""))
    if better is not None:
        size = f" --radius {0.5 * better.width:.3g}" if wanted.round else _options(better)
        size = "" if better.width == wanted.width else size
        advice.append(f"--center {better.center[0]:.4g} {better.center[1]:.4g}{size} fits")
    if not advice:
        advice.append("no place on it was found that does")
    if config.object not in FROM_FILE:
        advice.append("or take a larger object (--size)")
    advice.append("or go there all the same and mark what cannot be touched (--beyond)")
    what = {"raster": "a raster", "taps": "a grid of taps", "active": "a field"}.get(config.strategy, "a spiral")
    extent = f"of radius {0.5 * wanted.width:g} m" if wanted.round else f"of {wanted.width:g} x {wanted.depth:g} m"
    return (
        f"{what} {extent} leaves the part of the {config.object} that can be touched from above, less than 60 "
        f"degrees steep; {', '.join(advice)}"
    )


def _size(region: Region) -> str:
    return f"{region.width:.3g} x {region.depth:.3g} m in these proportions (--width, --depth)"


def _options(region: Region) -> str:
    return f" --width {region.width:.3g} --depth {region.depth:.3g}"


def _fits(target: SceneObject, radius: float, region: Region) -> bool:
    """Whether the tip can touch everywhere in a region; outermost points first."""
    x, y = region.center
    steps = np.linspace(-0.5, 0.5, TRIED)
    order = sorted(steps.tolist(), key=abs, reverse=True)
    return all(
        target.reachable(x + region.width * u, y + region.depth * v, radius)
        for u in order
        for v in order
        if not region.round or math.hypot(u, v) <= 0.5
    )


def _largest(target: SceneObject, radius: float, wanted: Region) -> Region | None:
    """The largest region of the same proportions about the same middle that fits."""
    for factor in np.linspace(0.99, 0.01, 99).tolist():
        # rounded as the message prints it: what an error recommends must be accepted
        tried = _shrunk(wanted, factor)
        if _fits(target, radius, tried):
            return tried
    return None


def _better_place(target: SceneObject, radius: float, wanted: Region) -> Region | None:
    """A region of the same proportions elsewhere, as large as wanted if possible, near where it was wanted."""
    x, y = wanted.center
    along, reached = _survey(target, radius)
    step = float(along[1] - along[0])
    for factor in np.linspace(1.0, 0.1, 19).tolist():
        tried = wanted if factor == 1.0 else _shrunk(wanted, factor)
        around = [2 * math.ceil(0.5 * side / step) + 1 for side in (tried.depth, tried.width)]
        rows, columns = np.nonzero(minimum_filter(reached, size=around, mode="constant", cval=0))
        places = sorted(
            zip(along[columns].tolist(), along[rows].tolist(), strict=True),
            key=lambda place: (place[0] - x) ** 2 + (place[1] - y) ** 2,
        )
        for u, v in places[:5]:
            moved = replace(tried, center=(float(f"{u:.4g}"), float(f"{v:.4g}")))
            if _fits(target, radius, moved):
                return moved
    return None


def _survey(target: SceneObject, radius: float) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Places along x and y [m], and whether the tip can touch there, y along rows."""
    for extent in EXTENTS:
        along = np.linspace(-extent, extent, SURVEYED)
        places = along.tolist()
        reached = np.array([[target.reachable(u, v, radius) for u in places] for v in places])
        if extent == EXTENTS[-1] or not (reached[[0, -1]].any() or reached[:, [0, -1]].any()):
            return along, reached
    raise AssertionError("EXTENTS is empty")


def _shrunk(region: Region, factor: float) -> Region:
    """The region made smaller, to three significant digits, of a disc those of its radius."""
    if region.round:
        width = 2.0 * _rounded_down(0.5 * factor * region.width)
        return replace(region, width=width, depth=width)
    return replace(region, width=_rounded_down(factor * region.width), depth=_rounded_down(factor * region.depth))


def _rounded_down(length: float) -> float:
    """Three significant digits, never more than the length."""
    rounded = float(f"{length:.3g}")
    return rounded if rounded <= length else float(f"{rounded * (1.0 - 6e-3):.3g}")
