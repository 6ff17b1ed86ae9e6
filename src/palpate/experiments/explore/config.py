"""The options of an exploration; imports nothing heavy, so that `palpate --help` is quick."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from palpate.errors import InvalidValueError, positive
from palpate.experiments.kit.checks import (
    MAX_FORCE,
    MIN_FORCE_PER_TOUCH_FORCE,
    MIN_TOUCH_FORCE,
    TOUCH_DEVIATIONS,
    check_change_names,
    check_length,
    spaced,
    speed_hint,
)
from palpate.experiments.kit.options import TOUCHED, check_options, option, own_first, with_default
from palpate.experiments.kit.scene_options import ContactOptions, ObjectOptions, PressingOptions, SceneOptions

ObjectName = Literal["sphere", "ellipsoid", "box", "cylinder", "torus", "bumps", "mesh", "height-field", "scene"]

OBJECT_SIZES: dict[ObjectName, tuple[str, tuple[float, ...]]] = {
    "sphere": ("radius", (0.04,)),
    "ellipsoid": ("three semi-axes", (0.05, 0.04, 0.03)),
    "box": ("length, width and height", (0.08, 0.08, 0.04)),
    "cylinder": ("radius and length (it lies along x)", (0.03, 0.12)),
    "torus": ("radius of the ring and of its tube (it lies about z)", (0.06, 0.025)),
    "bumps": ("amplitude, wavelength and side of the square that they cover", (0.003, 0.06, 0.18)),
    "mesh": ("nothing, the file gives it", ()),
    "height-field": ("width and depth, unless the file gives them", ()),
    "scene": ("nothing, the file gives it", ()),
}
"""Sizes of each object: their meaning, and defaults [m]."""

FROM_FILE: tuple[ObjectName, ...] = ("mesh", "height-field", "scene")
"""Objects that a file describes."""

StrategyName = Literal["raster", "spiral", "contour", "taps", "active"]
_CurveName = Literal["level", "edge"]
_TurnName = Literal["left", "right"]
_MeasureName = Literal["rms", "largest"]

_SPACING: Mapping[StrategyName, float] = {
    "raster": 0.002,
    "spiral": 0.002,
    "contour": 0.002,
    "taps": 0.005,
    "active": 0.002,
}
"""Distance of rows, turns or taps, if none is given [m]. Of a contour, which is a single line, and of active rows,
which lie where they are needed, it is how finely the map is drawn."""

_ACCURACY: Mapping[_MeasureName, float] = {"rms": 2e-5, "largest": 1e-4}
"""Wanted error of the map, if none is given [m]: what `benchmarks/active.py` stops at."""

_SHORTEST_SWING = 0.1
"""Shortest swing of the force [s]: servos of 100 rad/s follow 10 Hz by halves."""

_MOST_GRID_POINTS = 1_000_000
"""Largest map that is asked for: a finer one takes minutes and shows nothing more."""

SLOWEST = 1e-3
"""Lower bound [m/s] on the live parameter `speed`: slower, the exploration seems to stand still."""

SIDE = 0.04
"""Side of the explored rectangle by default [m]."""

FASTEST = 0.1
"""Fastest exploration [m/s]: its following error limit lets the stage follow up to 0.125 m/s."""


_ANY = ("strategy", ("raster", "spiral", "contour", "taps", "active"))
_WITHIN = ("strategy", ("raster", "spiral", "taps", "active"))
_EVEN = ("strategy", ("raster", "spiral", "taps"))
_RECTANGLE = ("strategy", ("raster", "taps", "active"))
_SPIRAL, _CONTOUR, _ACTIVE = (("strategy", (name,)) for name in ("spiral", "contour", "active"))
"""Strategies that an option belongs to."""


LIVE = ("force", "speed", "force_gain")
"""Live parameters: they may be changed while an exploration runs."""


def _article_of(name: ObjectName) -> str:
    """Return the article before an object's name."""
    return "some" if name == "bumps" else "an" if name[0] in "aeiou" else "a"


def _checked_size(name: ObjectName, size: tuple[float, ...]) -> tuple[float, ...]:
    """Return the size of an object [m], its default where none is given.

    Raises:
        InvalidValueError: If there is no such object, or it has no such size.
    """
    if name not in OBJECT_SIZES:
        raise InvalidValueError(f"object = {name!r}: must be one of {', '.join(OBJECT_SIZES)}")
    meaning, default = OBJECT_SIZES[name]
    size = size or default
    if name in FROM_FILE:
        if len(size) not in ((0, 2) if name == "height-field" else (0,)):
            raise InvalidValueError(f"size = {spaced(size)}: {_article_of(name)} {name} takes {meaning}")
    elif len(size) != len(default):
        raise InvalidValueError(
            f"size = {spaced(size)}: {_article_of(name)} {name} takes {len(default)} number"
            f"{'s' if len(default) > 1 else ''}, its {meaning} [m]; for example {spaced(default)}"
        )
    for length in size:
        check_length("size", length)
    return size


def _check_file(name: ObjectName, file: Path | None, scale: float) -> None:
    """Refuse an object without the file that must describe it, and one with a file that needs none.

    Args:
        name: Name of the object.
        file: File that describes the object.
        scale: Metres per unit of the file.

    Raises:
        InvalidValueError: If file and object do not go together, or the scale is not positive or has no file.
    """
    positive("scale", scale, "m per unit of the file")
    if name in FROM_FILE:
        if file is None:
            raise InvalidValueError(f"object = {name}: a file must describe it (--file)")
        if name == "scene" and scale != 1.0:
            raise InvalidValueError(
                f"scale = {scale:g}: a scene is in metres; scale its meshes in the file, as "
                'scale="0.001 0.001 0.001"'
            )
    elif file is not None:
        raise InvalidValueError(
            f"file = {file}: {_article_of(name)} {name} is described by --size; for a file give "
            f"--object {' or --object '.join(FROM_FILE)}"
        )
    elif scale != 1.0:
        raise InvalidValueError(f"scale = {scale:g}: is for files; {name} takes --size, in metres")


@own_first
@dataclass(frozen=True)
class ExploreConfig(PressingOptions, ObjectOptions):
    """Explore the surface of a simulated object by touch, and draw it.

    A fingertip on a six-axis force/torque sensor, carried by a simulated stage or arm (--robot), lands on the
    object, presses with a steady force and goes where a strategy leads it (--strategy): rows, a spiral, once round
    the object, single taps, or where the map is still uncertain. Every millisecond the contact is computed
    from the wrench. The points become a map with its uncertainty, their shape, PLY, STL and CSV files, and one
    HTML report with figures. What could not be felt is marked with the reason.

    All values are in SI units: metres, newtons, seconds.

    Example: palpate explore --object ellipsoid --force 2 --speed 0.05 --out runs/ellipsoid;
    or palpate explore --strategy contour --object box --curve edge;
    or palpate explore --strategy active --object bumps --accuracy 2e-5
    """

    object: ObjectName = with_default(ObjectOptions, "object", "sphere")
    """Object to touch, from above. Its middle is at the origin. The middle of a height field is over the origin,
    with the heights as they are. A mesh stands on z = 0, turned as in the file, the middle of its bounding box
    over the origin. So does the touched part of a scene, with all around it. The joints of a scene are held where
    the file puts them."""
    size: tuple[float, ...] = with_default(ObjectOptions, "size", ())
    """Size of the object [m]: a sphere's radius; an ellipsoid's three semi-axes; a box's length, width and
    height; a cylinder's radius and length; a torus's radii of ring and tube; amplitude, wavelength and side of
    bumps; a height field's width and depth, if its file has none. Left out: 40 mm; 50, 40, 30 mm; 80, 80,
    40 mm; 30, 120 mm; 60, 25 mm; 3, 60, 180 mm."""
    file: Path | None = with_default(PressingOptions, "file", None)
    """File of a mesh (STL, OBJ or PLY; closed, in metres), a height-field (CSV with columns x_m, y_m and z_m on a
    regular grid, as an exploration's height_map.csv, whose places without a height are filled smoothly; or z
    alone, a line for each y, as CSV or .npy), or a scene (MJCF, with the meshes that it names beside it)."""
    scale: float = option(1.0, fixed=TOUCHED)
    """Metres per unit of that file: 0.001 if it is in millimetres."""
    force: float = with_default(PressingOptions, "force", 2.0)
    force_swing: float = option(0.0, "N", bound="not negative")
    """Amplitude of a sine about that force [N], while the tip slides. The map then shows the stiffness of the
    object along the path, as for --force-swing 0.5. Left out: the force is constant, and stiffness stays
    unknown."""
    force_period: float = option(1.0, "s", bound="positive")
    """How long a swing takes [s]. Stiffness is a mean over the path of a whole swing, 20 mm at 20 mm/s; in a
    faster swing, contact damping is mistaken for stiffness."""
    speed: float = option(0.02, "m/s")
    """Speed along the surface [m/s]."""
    strategy: StrategyName = "raster"
    """How to explore. raster: rows over a rectangle. spiral: from the middle of a disc outwards. contour: once
    round the object. taps: single touches on a grid. active: coarse rows over a rectangle, then closer ones where
    the map would err, until it is accurate enough. Of the options from here to --beyond each strategy takes those
    that name it."""
    width: float | None = option(None, "m", of=_RECTANGLE, check=check_length)
    """raster, taps, active: extent along x, along the rows [m]: of the path of the fingertip's centre. On a
    rounded object the contacts span less. Width and depth left out: 40 mm, or as much of it as the object has
    room for."""
    depth: float | None = option(None, "m", of=_RECTANGLE, check=check_length)
    """raster, taps, active: extent along y, across the rows [m]."""
    center: tuple[float, ...] = option((), "m", of=_ANY)
    """Middle of the rectangle or disc, x and y [m]; for a contour where to land. Left out: over the origin; on a
    torus over its tube, where y is 0; elsewhere if there is no room; for a level contour beside its curve."""
    spacing: float | None = option(None, "m", of=_EVEN, check=check_length)
    """raster, spiral, taps: distance between rows, turns or taps [m]. Left out: 2 mm; of taps 5 mm."""
    radius: float | None = option(None, "m", of=_SPIRAL, check=check_length, hint="; the object's size is --size")
    """spiral: of its disc [m]. Left out: 20 mm, or as much of it as the object has room for."""
    curve: _CurveName = option("level", of=_CONTOUR)
    """contour: what to go along. level: the curve on which the fingertip keeps its height. edge: from the middle
    outwards to the first edge, and along it; on a rounded object, along where it leans by 45 degrees."""
    below: float | None = option(None, "m", of=_CONTOUR, check=check_length)
    """contour, level: how far below its height on the object's top the fingertip goes round [m]. Left out: half
    the fingertip's radius, less on a flat relief."""
    turn: _TurnName = option("left", of=_CONTOUR)
    """contour: sense of rotation, seen from above: left is counter-clockwise."""
    accuracy: float | None = option(None, "m", of=_ACTIVE, check=check_length)
    """active: wanted error of the map [m]. Left out: 0.02 mm; for --measure largest 0.1 mm."""
    measure: _MeasureName = option("rms", of=_ACTIVE)
    """active: which error --accuracy speaks of, the root mean square over the rectangle or the largest."""
    area: float = option(1.0, of=_ACTIVE)
    """active: part of the rectangle, from 0 to 1, over which --accuracy is wanted; the rest may stay unknown."""
    time: float | None = option(None, "s", of=_ACTIVE, bound="positive")
    """active: no new row begins after about so long [s]. Left out: as long as it takes."""
    beyond: bool = option(False, of=_WITHIN)
    """raster, spiral, taps, active: also go where the object may end or be too steep, as on an unknown object.
    What cannot be felt there is marked instead of being refused beforehand."""
    friction: float = with_default(SceneOptions, "friction", 0.3)
    spin_length: float = with_default(SceneOptions, "spin_length", 0.004)
    stiffness: float = with_default(ContactOptions, "stiffness", 20e3)
    """Contact stiffness [N/m]. The compliance correction takes it as known, and without --identify so does the
    controller's gain."""
    robot: str = with_default(SceneOptions, "robot", "stage")
    out: Path = Path("runs/explore")
    """Folder for the report, the points and the map."""

    def __post_init__(self) -> None:
        check_options(self)
        object.__setattr__(self, "size", _checked_size(self.object, self.size))
        _check_file(self.object, self.file, self.scale)
        if self.center and not (len(self.center) == 2 and all(map(math.isfinite, self.center))):
            raise InvalidValueError(f"center = {spaced(self.center)}: give two numbers, x and y [m]")
        self._check_force()
        if not 0.0 < self.speed <= FASTEST:
            hint = speed_hint(self.speed, FASTEST)
            raise InvalidValueError(
                f"speed = {self.speed:g} m/s: must be above 0 and at most {FASTEST:g} m/s{hint}"
            )
        self._check_strategy()
        width, depth = self.extent
        points = (width / self.map_spacing + 1.0) * (depth / self.map_spacing + 1.0)
        if points > _MOST_GRID_POINTS:
            raise InvalidValueError(
                f"spacing = {self.gap:g} m: makes a map of {points:.2g} points over {width:g} x "
                f"{depth:g} m, the limit is {_MOST_GRID_POINTS:.0e}; take rows at least "
                f"{self.gap * (points / _MOST_GRID_POINTS) ** 0.5:.2g} m apart"
            )
        check_change_names(self.change, LIVE)

    @property
    def article(self) -> str:
        """The article before the object's name."""
        return _article_of(self.object)

    @property
    def thing(self) -> str:
        """Name of the touched object, for sentences."""
        return self.touch or f"{self.article} {self.object}"

    @property
    def middle(self) -> tuple[float, float]:
        """Middle of the rows, x and y [m]."""
        if self.center:
            return (self.center[0], self.center[1])
        return (self.size[0], 0.0) if self.object == "torus" else (0.0, 0.0)

    @property
    def extent(self) -> tuple[float, float]:
        """Width and depth of the field or of its bounding rectangle [m]; of a contour the defaults."""
        if self.strategy == "spiral":
            across = 2.0 * (self.radius or SIDE / 2.0)
            return (across, across)
        return (self.width or SIDE, self.depth or SIDE)

    @property
    def gap(self) -> float:
        """Distance between neighbouring rows, turns or taps, which the map is made for [m]."""
        return _SPACING[self.strategy] if self.spacing is None else self.spacing

    @property
    def wanted_error(self) -> float:
        """Error of the map at which an active exploration ends [m]."""
        return _ACCURACY[self.measure] if self.accuracy is None else self.accuracy

    @property
    def map_spacing(self) -> float:
        """Distance of the height map's grid lines: a quarter of the rows' [m]."""
        return self.gap / 4.0

    @property
    def noise(self) -> tuple[float, float]:
        """Standard deviations of force [N] and moment [N m], each axis; 0 if the robot file decides."""
        return self.force_noise or 0.0, self.moment_noise or 0.0

    @property
    def touch_force(self) -> float:
        """Force that counts as a touch [N]."""
        return max(MIN_TOUCH_FORCE, TOUCH_DEVIATIONS * self.noise[0])

    @property
    def least_force(self) -> float:
        """Smallest set force [N]."""
        return self.force - self.force_swing

    @property
    def greatest_force(self) -> float:
        """Largest set force [N]."""
        return self.force + self.force_swing

    def _check_force(self) -> None:
        least = MIN_FORCE_PER_TOUCH_FORCE * self.touch_force
        noise = f" with a force noise of {self.force_noise:g} N" if self.force_noise else ""
        if not least * (1.0 - 1e-12) <= self.force <= MAX_FORCE:
            raise InvalidValueError(
                f"force = {self.force:g} N: must lie between {least:g} and {MAX_FORCE:g} N{noise}"
            )
        room = min(self.force - least, MAX_FORCE - self.force)
        if self.force_swing > room + 1e-12:
            raise InvalidValueError(
                f"force_swing = {self.force_swing:g} N: about {self.force:g} N at most {room:g} N, so that the "
                f"force stays between {least:g} and {MAX_FORCE:g} N{noise}"
            )
        if self.force_swing and self.force_period < _SHORTEST_SWING:
            raise InvalidValueError(
                f"force_period = {self.force_period:g} s: must be at least {_SHORTEST_SWING:g} s, for no servo "
                "would follow"
            )

    def _check_strategy(self) -> None:
        if self.below is not None and self.curve != "level":
            raise InvalidValueError(f"below = {self.below:g} m: is for --curve level; an edge has its own height")
        if not 0.0 <= self.area <= 1.0:
            hint = f"; for {self.area:g} % give {self.area / 100.0:g}" if 1.0 < self.area <= 100.0 else ""
            raise InvalidValueError(f"area = {self.area:g}: must lie between 0 and 1, all of the rectangle{hint}")
