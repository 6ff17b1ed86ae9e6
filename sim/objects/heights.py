"""Height fields: a surface z(x, y) over a rectangle, as smooth as a cubic spline."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import mujoco
import numpy as np
from scipy.ndimage import spline_filter

from palpate.errors import FloatArray, InvalidValueError, check_positive, numbers, positive
from palpate.sim.objects.nearest import (
    HEADER,
    distances_to_heights,
    nearest_on_heights,
    spline_height,
    tightest_hollow,
)
from palpate.sim.objects.primitives import STEEPEST
from palpate.sim.objects.traced import PICTURE_COLOUR, Nearest, TracedObject, picture_name

FEWEST = 4
"""Samples along each side: what a cubic spline needs."""

RIM = 24
"""Samples added around the field before its spline is fitted: the boundary's effect falls to 0.27^24 = 2e-14."""

WAVE_SAMPLES = 60
"""Samples per wavelength of `bumps`: the spline is then within (2 pi / 60)^4 / 384 = 3e-7 of the amplitude."""


@dataclass(frozen=True, eq=False, slots=True)
class HeightField(TracedObject):
    """The surface through heights on a regular grid, about the z axis, and all below it; beside it is nothing.

    Between samples it is a bicubic spline, smooth up to its curvature. Its rim is an edge, below which walls go
    straight down, without end.

    Attributes:
        heights: z at the samples, y from -depth/2 to depth/2 along rows, x along columns, shape (ny, nx) [m].
        width: Along x, first to last sample [m].
        depth: Along y [m].
        untouched: Number of heights that are those of the nearest touched place, in a map that was explored.
    """

    heights: FloatArray = field(repr=False)
    width: float
    depth: float
    untouched: int = 0
    _packed: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_positive(self, width="m", depth="m")
        heights = numbers("heights", self.heights)
        if heights.ndim != 2 or min(heights.shape) < FEWEST:
            raise InvalidValueError(f"heights has shape {heights.shape}: must be (ny, nx), each at least {FEWEST}")
        if not np.isfinite(heights).all():
            row, column = np.argwhere(~np.isfinite(heights))[0]
            raise InvalidValueError(f"heights[{row}, {column}] = {heights[row, column]}: must be finite [m]")
        if np.ptp(heights) > max(self.width, self.depth):
            raise InvalidValueError(
                f"heights span {np.ptp(heights):.3g} m over {self.width:g} x {self.depth:g} m: if they are in "
                "millimetres, divide them by 1000"
            )
        heights.setflags(write=False)
        object.__setattr__(self, "heights", heights)
        dx, dy = self.width / (heights.shape[1] - 1), self.depth / (heights.shape[0] - 1)
        # continued by point reflection, which keeps the slope at the edges
        around = np.pad(heights, RIM, mode="reflect", reflect_type="odd")
        coefficients = spline_filter(around, order=3, mode="mirror")
        left, front = -0.5 * self.width - RIM * dx, -0.5 * self.depth - RIM * dy
        rows, columns = coefficients.shape
        packed = np.concatenate(
            [[left, front, dx, dy, columns, rows, self.width, self.depth], coefficients.ravel()]
        )
        assert len(packed) == HEADER + rows * columns
        packed.setflags(write=False)
        object.__setattr__(self, "_packed", packed)

    @property
    def top(self) -> float:
        """Largest sample [m]; between samples the spline may rise above it by a trifle."""
        return float(self.heights.max())

    @property
    def bottom(self) -> float:
        """Least sample [m], likewise."""
        return float(self.heights.min())

    @property
    def nearest(self) -> Nearest:
        """See `TracedObject`."""
        kernel: Nearest = nearest_on_heights
        return kernel

    @property
    def parameters(self) -> FloatArray:
        """See `TracedObject`."""
        return self._packed

    def check_tip(self, radius: float) -> None:
        """See `TracedObject`."""
        rows, columns = self.heights.shape
        x, y = (np.linspace(-0.5 * side, 0.5 * side, n) for side, n in ((self.width, columns), (self.depth, rows)))
        tightest = tightest_hollow(self._packed, x, y)
        if tightest * radius >= 1.0:
            raise InvalidValueError(
                f"tip radius = {radius:g} m: must be less than {1.0 / tightest:.3g} m, the radius of curvature of "
                "the height field's tightest hollow, or it touches in two places; take a smaller tip, or smooth "
                "the heights"
            )

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """See `TracedObject`; as MuJoCo's own height field."""
        name = picture_name(name)
        low, span = float(self.heights.min()), float(np.ptp(self.heights)) or 1e-6
        rows, columns = self.heights.shape
        spec.add_hfield(
            name=name,
            nrow=rows,
            ncol=columns,
            size=[0.5 * self.width, 0.5 * self.depth, span, 0.1 * max(self.width, self.depth)],
            userdata=((self.heights - low) / span).ravel(),
        )
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_HFIELD,
            hfieldname=name,
            pos=[0.0, 0.0, low],
            contype=0,
            conaffinity=0,
            rgba=PICTURE_COLOUR,
        )

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `SceneObject`. Far away, the nearest point is first looked for on a grid."""
        return np.asarray(distances_to_heights(self._packed, np.ascontiguousarray(points, dtype=np.float64)))

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `SceneObject`."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        z = [
            spline_height(self._packed, u, v)[0] if self._covers(u, v) else math.nan
            for u, v in zip(x.ravel().tolist(), y.ravel().tolist(), strict=True)
        ]
        return np.array(z).reshape(x.shape)

    def reachable(self, x: float, y: float, tip_radius: float) -> bool:
        """See `SceneObject`; the slope counts where the tip is above, and a tip's radius from the edges."""
        if not (abs(x) <= 0.5 * self.width - tip_radius and abs(y) <= 0.5 * self.depth - tip_radius):
            return False
        _, zx, zy, *_ = spline_height(self._packed, x, y)
        return math.hypot(zx, zy) <= math.tan(STEEPEST)

    def _covers(self, x: float, y: float) -> bool:
        return abs(x) <= 0.5 * self.width and abs(y) <= 0.5 * self.depth


def height_field(
    height: Callable[[FloatArray, FloatArray], FloatArray], side: float, spacing: float
) -> HeightField:
    """Return a square height field sampled from a function.

    Args:
        height: (x, y) -> z, of arrays alike [m].
        side: Of the square [m].
        spacing: Of the samples [m], about: the spline's error is that spacing^4 / 384 times the fourth derivative.

    Raises:
        InvalidValueError: A length that is not positive, or heights that are not finite.
    """
    count = max(FEWEST, 1 + math.ceil(positive("side", side, "m") / positive("spacing", spacing, "m")))
    along = np.linspace(-0.5 * side, 0.5 * side, count)
    x, y = np.meshgrid(along, along)
    return HeightField(np.broadcast_to(height(x, y), x.shape), side, side)


def bumps(amplitude: float = 0.003, wavelength: float = 0.06, side: float = 0.18) -> HeightField:
    """Return hills and hollows z = amplitude sin(2 pi x / wavelength) sin(2 pi y / wavelength).

    Args:
        amplitude: Height of a hill over the middle [m].
        wavelength: [m].
        side: Of the square that they cover [m].
    """
    rate = 2.0 * math.pi / positive("wavelength", wavelength, "m")
    positive("amplitude", amplitude, "m")
    return height_field(
        lambda x, y: np.asarray(amplitude * np.sin(rate * x) * np.sin(rate * y)), side, wavelength / WAVE_SAMPLES
    )
