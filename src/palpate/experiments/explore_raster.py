"""The raster over an object, or what would fit instead."""

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter

from palpate.controllers import Raster
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore_config import FROM_FILE, ExploreConfig
from palpate.sim import SceneObject

TRIED = 41
"""Points along each side of the rectangle at which it is asked whether the tip can touch: 1 mm of 40 mm."""

SURVEYED = 121
"""Points along each side of the square in which a better place is looked for."""

EXTENTS = (0.05, 0.1, 0.25, 0.5, 1.0)
"""Half sides of that square that are tried [m], until the object lies inside."""

Rectangle = tuple[float, float, float, float]
"""Width, depth, and middle x and y [m]."""


def raster_over(target: SceneObject, config: ExploreConfig) -> Raster:
    """Return the raster over an object.

    Raises:
        InvalidValueError: It leaves the part of the object that can be touched from above; the message says what
            would fit.
    """
    wanted = (config.width, config.depth, *config.middle)
    raster = Raster(config.width, config.depth, config.spacing, config.middle)
    radius = min(config.tip)
    if _fits(target, radius, wanted):
        return raster
    x, y = config.middle
    advice = []
    largest = _largest(target, radius, wanted)
    if largest is not None:
        advice.append(
            f"at most {largest[0]:.3g} x {largest[1]:.3g} m in these proportions (--width, --depth)"
            + (f" about x = {x:g}, y = {y:g} m" if x or y else "")
        )
    better = _better_place(target, radius, wanted)
    if better is not None and (largest is None or better[0] > 1.02 * largest[0]):
        size = "" if better[0] == config.width else f" --width {better[0]:.3g} --depth {better[1]:.3g}"
        advice.append(f"--center {better[2]:.4g} {better[3]:.4g}{size} fits")
    if not advice:
        advice.append("no place on it was found that does")
    if config.object not in FROM_FILE:
        advice.append("or take a larger object (--size)")
    raise InvalidValueError(
        f"a raster of {config.width:g} x {config.depth:g} m leaves the part of the {config.object} that can be "
        f"touched from above, less than 60 degrees steep; {', '.join(advice)}"
    )


def _fits(target: SceneObject, radius: float, rectangle: Rectangle) -> bool:
    """Whether the tip can touch everywhere in a rectangle; outermost points first."""
    width, depth, x, y = rectangle
    steps = np.linspace(-0.5, 0.5, TRIED)
    order = sorted(steps.tolist(), key=abs, reverse=True)
    return all(target.reachable(x + width * u, y + depth * v, radius) for u in order for v in order)


def _largest(target: SceneObject, radius: float, rectangle: Rectangle) -> Rectangle | None:
    """The largest rectangle of the same proportions about the same middle that fits."""
    width, depth, x, y = rectangle
    for factor in np.linspace(0.99, 0.01, 99).tolist():
        # rounded as it is told: what an error recommends must be accepted
        tried = (_rounded_down(factor * width), _rounded_down(factor * depth), x, y)
        if _fits(target, radius, tried):
            return tried
    return None


def _better_place(target: SceneObject, radius: float, rectangle: Rectangle) -> Rectangle | None:
    """A rectangle of the same proportions elsewhere, as large as wanted if possible, near where it was wanted."""
    width, depth, x, y = rectangle
    along, reached = _survey(target, radius)
    step = float(along[1] - along[0])
    for factor in np.linspace(1.0, 0.1, 19).tolist():
        w, d = (width, depth) if factor == 1.0 else (_rounded_down(factor * width), _rounded_down(factor * depth))
        around = [2 * int(np.ceil(0.5 * side / step)) + 1 for side in (d, w)]
        rows, columns = np.nonzero(minimum_filter(reached, size=around, mode="constant", cval=0))
        places = sorted(
            zip(along[columns].tolist(), along[rows].tolist(), strict=True),
            key=lambda place: (place[0] - x) ** 2 + (place[1] - y) ** 2,
        )
        for u, v in places[:5]:
            place = (w, d, float(f"{u:.4g}"), float(f"{v:.4g}"))
            if _fits(target, radius, place):
                return place
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


def _rounded_down(length: float) -> float:
    """Three significant digits, never more than the length."""
    rounded = float(f"{length:.3g}")
    return rounded if rounded <= length else float(f"{rounded * (1.0 - 6e-3):.3g}")
