"""Height fields from files: as a grid of numbers, or as the height map that an exploration writes."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import diags_array, eye_array, kron, vstack
from scipy.sparse.linalg import spsolve

from palpate.bounded_file import read_array, read_text
from palpate.csv_table import BOUNDS, CsvTable, number_in, read_csv_table, short
from palpate.errors import FloatArray, InvalidValueError
from palpate.sim import HeightField
from palpate.sim.objects.mesh_file import LARGEST, SMALLEST

_EXTENT = re.compile(r"# *width_m *= *([^\s,]+) *,? *depth_m *= *([^\s,]+) *(?:untouched *= *(\d{1,9}) *)?")
"""First line of a grid, with its extent."""

_MIN_TOUCHED = 0.1
"""Least share of the places of an explored map's grid that have a height: the others are filled."""

LINE_CONTENT = (
    "the heights of one row of the grid, or x_m, y_m and z_m of a point below a line with these names (for a "
    "file in millimetres give --scale 0.001)"
)
"""Content of a line, for messages."""

MAX_HEIGHT = 1.0
"""Largest height [m], up or down: the reach of robots; a larger number is in another unit."""

OTHER_UNIT = (
    "is it in another unit? For a file in millimetres give --scale 0.001 (--size is in metres all the same)"
)
"""Remedy for lengths that are too large."""

MIN_SAMPLES = 4
"""Along each side of a grid, as a `HeightField` wants them."""

MAX_COORDINATE = 1e6
"""Bound on coordinates, in the unit of the file."""

GRID_TOLERANCE = 1e-6
"""Largest deviation of samples from a regular grid, over their spacing: rounding to seven digits."""


def load_heights(path: Path, metres_per_unit: float, size: tuple[float, ...]) -> HeightField:
    """Return the height field of a file, its middle over the origin, its heights as they are.

    A CSV file is one of two:

    - columns `x_m`, `y_m` and `z_m` (others are left alone) with the points of a regular grid in any order, as
      `palpate explore` writes its height_map.csv. Places without a height (nan, or not there) were not touched:
      they get the heights of a thin plate through the others;
    - the heights z alone, a line for each y, from the least on, a column for each x; the first line may be
      `# width_m=0.06 depth_m=0.04`, from the first sample to the last.

    A .npy file holds the latter as an array.

    Args:
        path: The file.
        metres_per_unit: Length of the file's unit [m].
        size: Width and depth of a file that does not give them [m]; empty if it does.

    Raises:
        InvalidValueError: If the file cannot be read, has another form, or lacks its extent.
    """
    name = str(path)
    try:
        if path.suffix.lower() == ".npy":
            return _field(name, read_array(path, BOUNDS) * metres_per_unit, size)
        text = read_text(path, BOUNDS, "a height field is a CSV or .npy file")
    except OSError as error:
        raise InvalidValueError(f"file = {name}: cannot be read: {error.strerror}") from None
    own, table = _extent(name, text), read_csv_table(text, name, LINE_CONTENT)
    untouched = 0
    if table.columns.names:
        heights, sides, untouched = _map(table)
        own = (metres_per_unit * sides[0], metres_per_unit * sides[1])
    else:
        heights = table.numbers()
    field = _field(name, heights * metres_per_unit, size if own is None else _sized(name, size, own))
    return replace(field, untouched=untouched) if untouched else field


def heights_text(field: HeightField) -> str:
    """Return a height field as CSV that gives the very same bits again."""
    rows = (",".join(map(repr, row)) for row in field.heights.tolist())
    untouched = f" untouched={field.untouched}" if field.untouched else ""
    return "\n".join([f"# width_m={field.width!r} depth_m={field.depth!r}{untouched}", *rows, ""])


def read_heights_text(text: str, name: str) -> HeightField:
    """Return the height field that `heights_text` wrote.

    Raises:
        InvalidValueError: If the text has another form.
    """
    extent = _extent(name, text)
    if extent is None:
        raise InvalidValueError(f"{name}: its first line is no `# width_m=... depth_m=...`")
    found = _EXTENT.fullmatch(text.partition("\n")[0].strip())
    untouched = int((found and found[3]) or 0)
    return HeightField(read_csv_table(text, name, LINE_CONTENT).numbers(), *extent, untouched=untouched)


def _field(name: str, heights: FloatArray, size: tuple[float, ...]) -> HeightField:
    if heights.ndim == 2 and heights.shape[1] == 3 and len(heights) >= 3 * MIN_SAMPLES:
        raise InvalidValueError(
            f"{name}: {len(heights)} rows of 3 numbers: if they are points, write x_m,y_m,z_m as the first line "
            f"of a CSV file; a grid of heights has at least {MIN_SAMPLES} columns"
        )
    if not size:
        raise InvalidValueError(
            f"{name}: has no width and depth; give --size WIDTH DEPTH in metres, or write "
            "`# width_m=... depth_m=...` as its first line"
        )
    largest = max(*size, float(np.ptp(heights)) if heights.size and np.isfinite(heights).all() else 0.0)
    if not SMALLEST <= largest <= LARGEST or min(size) < SMALLEST * GRID_TOLERANCE:
        raise InvalidValueError(
            f"{name}: {largest:.4g} m across, must be {SMALLEST:g} to {LARGEST:g} m; {OTHER_UNIT}"
        )
    highest = float(np.abs(heights[np.isfinite(heights)]).max(initial=0.0))
    if highest > MAX_HEIGHT:
        raise InvalidValueError(
            f"{name}: a height of {highest:.4g} m, must be at most {MAX_HEIGHT:g} m up or down; {OTHER_UNIT}"
        )
    try:
        return HeightField(heights, size[0], size[1])
    except InvalidValueError as error:
        raise InvalidValueError(f"{name}: {error}") from None


def _sized(name: str, typed: tuple[float, ...], own: tuple[float, ...]) -> tuple[float, ...]:
    if typed and max(abs(a - b) for a, b in zip(typed, own, strict=True)) > GRID_TOLERANCE * max(own):
        raise InvalidValueError(
            f"size = {typed[0]:g} {typed[1]:g}: {name} gives {own[0]:g} x {own[1]:g} m; leave --size out"
        )
    return own


def _extent(name: str, text: str) -> tuple[float, float] | None:
    """Width and depth in the first line of a grid [m]."""
    found = _EXTENT.fullmatch(text.partition("\n")[0].strip())
    if found is None:
        return None
    width, depth = number_in(found[1]), number_in(found[2])
    if width is None or depth is None:
        given = f"width_m = {short(found[1])}, depth_m = {short(found[2])}"
        raise InvalidValueError(f"{name}, line 1: {given}: must be numbers")
    return width, depth


def _map(table: CsvTable) -> tuple[FloatArray, tuple[float, float], int]:
    """Return the heights of a table of points, shape (ny, nx), their extent along x and y, and the number filled.

    Lengths are in the file's unit.
    """
    name = table.columns.table
    x, y, z = table.numbers("x_m", "y_m", "z_m").T
    column, across = _places(name, "x_m", x)
    row, along = _places(name, "y_m", y)
    ny, nx = int(row.max()) + 1, int(column.max()) + 1
    given = len(np.unique(row * nx + column))
    if given < len(z):
        raise InvalidValueError(f"{name}: {len(z) - given} points stand in it more than once; leave one of each")
    # counted before there is room for them all: points along a diagonal would take that of their square
    missing = ny * nx - given + int(np.isnan(z).sum())
    if missing > (1.0 - _MIN_TOUCHED) * ny * nx:
        raise InvalidValueError(
            f"{name}: {missing} of {ny * nx} points of its grid have no height (nan, or not there): at most "
            f"{1.0 - _MIN_TOUCHED:.0%} are filled; cut the map to where it is denser"
        )
    heights = np.full((ny, nx), np.nan)
    heights[row, column] = z
    if missing:
        touched = np.nonzero(np.isfinite(heights))
        if np.linalg.matrix_rank(np.cov(touched)) < 2:
            raise InvalidValueError(
                f"{name}: its heights lie on one line, so that the others cannot be filled; touch more"
            )
        heights = _filled(heights, along / (ny - 1), across / (nx - 1))
    return heights, (across, along), missing


def _filled(heights: FloatArray, dy: float, dx: float) -> FloatArray:
    """Return a grid with its missing heights filled by the surface of least bending through the known ones.

    The fill minimises the sum of squared second differences along y and x, and of twice the squared mixed ones: a
    thin plate. Unlike the nearest known height it has neither steps nor kinks, on which a fingertip would rest at
    two places.

    Args:
        heights: Heights, shape (ny, nx); NaN where they are missing.
        dy: Spacing of the rows.
        dx: Spacing of the columns.
    """
    ny, nx = heights.shape
    first = [diags_array([-1.0 / d, 1.0 / d], offsets=[0, 1], shape=(n - 1, n)) for n, d in ((ny, dy), (nx, dx))]
    second = [
        diags_array(np.array([1.0, -2.0, 1.0]) / d**2, offsets=[0, 1, 2], shape=(n - 2, n))
        for n, d in ((ny, dy), (nx, dx))
    ]
    mixed = kron(math.sqrt(2.0) * first[0], first[1])
    bending: Any = vstack([kron(second[0], eye_array(nx)), kron(eye_array(ny), second[1]), mixed], format="csc")
    flat = heights.ravel()
    missing = np.isnan(flat)
    free, fixed = bending[:, missing], bending[:, ~missing]
    found = flat.copy()
    found[missing] = spsolve((free.T @ free).tocsc(), -free.T @ (fixed @ flat[~missing]))
    return found.reshape(ny, nx)


def _places(name: str, column: str, values: FloatArray) -> tuple[np.ndarray, float]:
    """Index of each value on a regular grid, and the grid's extent."""
    finite = values.size > 0 and bool((np.abs(values) <= MAX_COORDINATE).all())
    levels = np.unique(values) if finite else values
    extent = float(np.ptp(levels)) if finite else 0.0
    # values of the same line of the grid may differ by rounding
    levels = (
        levels[np.concatenate([[True], np.diff(levels) > GRID_TOLERANCE * extent])] if extent > 0.0 else levels
    )
    if extent == 0.0 or len(levels) < 2:
        raise InvalidValueError(f"{name}: {column} must be numbers that span a grid")
    places = (values - levels[0]) * ((len(levels) - 1) / extent)
    off = float(np.abs(places - places.round()).max())
    if off > max(GRID_TOLERANCE, 1e-15 * len(levels)) * len(levels):
        raise InvalidValueError(
            f"{name}: {column} is on no regular grid, a value is {off:.2g} spacings off; sample it evenly"
        )
    return places.round().astype(np.int64), extent
