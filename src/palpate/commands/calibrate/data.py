"""CSV files of calibration data: columns by name, units as declared, every mistake named with its line.

`palpate.commands.wrench_csv` streams wrenches; here a whole file of any numbers is needed, and raw channels may
stand in place of wrenches.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.bounded_file import read_text
from palpate.commands.calibrate.config import LARGEST_RAW, FlangeOrder, RotationOrder
from palpate.commands.wrench_csv import COMPONENTS, FORCE_UNITS, MOMENT_UNITS
from palpate.csv_table import BOUNDS, csv_fields, is_comment, short
from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.ft.poses import ROTATION_TOLERANCE, specific_force_from_gravity, specific_force_from_rotations
from palpate.spatial import Vector, Wrench

QUATERNION_TOLERANCE = 1e-3
"""Deviation of a quaternion's length from 1: logs with four decimals pass, a rotation vector does not."""

ROTATION_COLUMNS = tuple(f"r{i}{j}" for i in range(3) for j in range(3))
QUATERNION_COLUMNS = ("qw", "qx", "qy", "qz")
GRAVITY_COLUMNS = ("gx", "gy", "gz")
GRAVITY_UNITS = ("g", "m/s^2", "m/s2", "m_s2", "ms2", "mps2")
"""All mean acceleration: only the direction counts. A gyroscope's rad/s or deg/s is refused."""

_DECIMAL = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_UNIT = r"(?:[\s_\[(/]+(?P<unit>.*?)[\s\])]*)?"
_WRENCH = re.compile(r"(?P<stem>[fm][xyz])" + _UNIT, re.IGNORECASE)
_RAW = re.compile(r"raw[_ ]?(?P<number>\d{1,3})" + _UNIT, re.IGNORECASE | re.ASCII)
_GRAVITY = re.compile(r"(?P<stem>g[xyz])" + _UNIT, re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class CsvData:
    """Text of a CSV file by column.

    Attributes:
        name: Of the file, for messages.
        header_line: Line of the header.
        columns: Names, as they stand there.
        rows: Fields of every row, as many as columns.
        lines: Line of every row.
    """

    name: str
    header_line: int
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]

    def numbers(self, places: Sequence[int], factors: Sequence[float] | None = None) -> FloatArray:
        """Return columns as numbers, shape (rows, len(places)), each times its factor.

        Raises:
            InvalidValueError: A field is no finite number.
        """
        values = np.empty((len(self.rows), len(places)))
        for i, row in enumerate(self.rows):
            for j, place in enumerate(places):
                text = row[place].strip()
                number = float(text) if _DECIMAL.fullmatch(text) else math.nan
                if not math.isfinite(number):
                    kind = (
                        "finite" if text.lower().lstrip("+-") in _NOT_FINITE or _DECIMAL.fullmatch(text) else "a"
                    )
                    raise self.wrong(i, f"{self.columns[place]} = {short(text)}: must be {kind} number")
                values[i, j] = number
        return values if factors is None else values * np.array(factors)

    def wrong(self, row: int, what: str) -> InvalidValueError:
        """Return the error that something in a row is wrong."""
        return InvalidValueError(f"{self.name}, line {self.lines[row]}: {what}")

    def wrong_header(self, what: str) -> InvalidValueError:
        """Return the error that the header is wrong; it lists the columns."""
        there = ", ".join(short(column) for column in self.columns[:40])
        more = ", ..." if len(self.columns) > 40 else ""
        return InvalidValueError(f"{self.name}, line {self.header_line}: {what}; the columns are {there}{more}")


_NOT_FINITE = ("nan", "inf", "infinity")


def read_csv(path: Path) -> CsvData:
    """Return the text of a CSV file. Blank lines and lines that start with # are skipped.

    Raises:
        InvalidValueError: It cannot be read, is no CSV text, is empty, or a row is longer or shorter than the
            header.
    """
    try:
        whole = read_text(path, BOUNDS, "save it as UTF-8")
    except OSError as error:
        raise InvalidValueError(f"cannot read {path}: {error.strerror}") from None
    header: tuple[int, tuple[str, ...]] | None = None
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    for number, line in enumerate(whole.split("\n"), start=1):
        text = line.removesuffix("\r")
        if is_comment(text):
            continue
        place = f"{path}, line {number}"
        fields = tuple(csv_fields(text, place))
        if header is None:
            header = (number, _header(place, text, fields))
            continue
        if len(fields) != len(header[1]):
            raise InvalidValueError(f"{place}: {len(fields)} fields, but the header has {len(header[1])} columns")
        rows.append(fields)
        lines.append(number)
    if header is None:
        raise InvalidValueError(f"{path} is empty: it must begin with a header line")
    if not rows:
        raise InvalidValueError(f"{path} has a header but no rows")
    return CsvData(str(path), *header, tuple(rows), tuple(lines))


def wrenches(data: CsvData, limits: Wrench) -> FloatArray:
    """Return the columns fx, fy, fz, mx, my, mz, shape (n, 6) [N, N m].

    Args:
        data: The file.
        limits: Of the sensor [N, N m]: more is in another unit, or a saturated reading.

    Raises:
        InvalidValueError: A column is missing, there twice, or in an unknown unit; a field is no number or
            beyond the limits.
    """
    found: dict[str, tuple[int, float]] = {}
    for i, column in enumerate(data.columns):
        if match := _WRENCH.fullmatch(column):
            stem = match["stem"].lower()
            if stem in found:
                raise data.wrong_header(f"{stem} is there twice; keep one column for each")
            units = FORCE_UNITS if stem[0] == "f" else MOMENT_UNITS
            found[stem] = (i, _factor(data, column, stem, match["unit"], units))
    _complete(data, COMPONENTS, found, "fx_N,fy_N,fz_N,mx_Nm,my_Nm,mz_Nm")
    places, factors = zip(*(found[stem] for stem in COMPONENTS), strict=True)
    values = data.numbers(places, factors)
    bad = np.argwhere(np.abs(values) > np.array(limits))
    if len(bad):
        i, j = bad[0].tolist()
        raise data.wrong(
            i,
            f"{data.columns[places[j]]} is {values[i, j]:g} {'N' if j < 3 else 'N m'}: beyond the sensor's range "
            f"of {limits[j]:g}; another unit, or the wrong file?",
        )
    return values


def has_wrenches(data: CsvData) -> bool:
    """Return whether any column is one of a wrench."""
    return any(_WRENCH.fullmatch(column) for column in data.columns)


def has_raw(data: CsvData, channels: tuple[str, ...]) -> bool:
    """Return whether there are raw channels: any, or those that are named."""
    return bool(channels) or any(_RAW.fullmatch(column) for column in data.columns)


def raw_readings(
    data: CsvData, channels: tuple[str, ...], raw_range: tuple[float, float] | None
) -> tuple[FloatArray, str]:
    """Return the raw channels, shape (n, k), and their unit, "" if the header has none.

    Args:
        data: The file.
        channels: Names of the columns; none: raw_0, raw_1, ... in the order of their numbers.
        raw_range: Lowest and highest reading that is not saturated, if known.

    Raises:
        InvalidValueError: A column is missing, numbers leave gaps, units differ, or a reading is saturated.
    """
    unit = ""
    if channels:
        if missing := [name for name in channels if name not in data.columns]:
            raise data.wrong_header(f"no column {', '.join(missing)}")
        if twice := next((name for name in channels if data.columns.count(name) > 1), None):
            raise data.wrong_header(f"{short(twice)} is there twice; keep one")
        places = [data.columns.index(name) for name in channels]
    else:
        numbered: dict[int, tuple[int, str]] = {}
        for i, column in enumerate(data.columns):
            if match := _RAW.fullmatch(column):
                number = int(match["number"])
                if number in numbered:
                    raise data.wrong_header(f"raw channel {number} is there twice; keep one")
                numbered[number] = (i, match["unit"] or "")
        order = sorted(numbered)
        if not order:
            raise data.wrong_header(
                "no raw channels; call their columns raw_0, raw_1, ... or name them by --channels"
            )
        if gap := next((n for n in range(order[0], order[-1]) if n not in numbered), None):
            raise data.wrong_header(f"no column raw_{gap} between raw_{order[0]} and raw_{order[-1]}")
        if len(units := sorted({numbered[n][1] for n in order})) > 1:
            named = ", ".join(unit or "none" for unit in units)
            raise data.wrong_header(f"raw channels in different units ({named}): all must have one")
        unit = units[0]
        places = [numbered[n][0] for n in order]
    values = data.numbers(places)
    low, high = raw_range or (-LARGEST_RAW, LARGEST_RAW)
    bad = np.argwhere(~((values >= low) & (values <= high)))
    if len(bad):
        i, j = bad[0].tolist()
        raise data.wrong(
            i,
            f"{data.columns[places[j]]} = {values[i, j]:g}: outside {low:g} to {high:g}, so saturated; leave "
            "such rows out",
        )
    return values, unit


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredPoses:
    """Poses as a file has them.

    Attributes:
        specific_force: At rest in the sensor frame, shape (n, 3) [m/s^2].
        rotation_sensor_base: Base to sensor coordinates, shape (n, 3, 3); None if there are directions only.
    """

    specific_force: FloatArray
    rotation_sensor_base: FloatArray | None


def measured_poses(
    data: CsvData, rotation: RotationOrder | FlangeOrder, up_base: Vector, gravity: float
) -> MeasuredPoses:
    """Return the poses, of whichever kind is there, of a sensor or of a flange.

    Args:
        data: The file.
        rotation: What rotations and quaternions map.
        up_base: Upward direction in base coordinates.
        gravity: Local g [m/s^2].

    Raises:
        InvalidValueError: No pose, several, or not all of its columns; no rotation, quaternion or direction.
    """
    gravity_places = _gravity_places(data)
    lower = [column.lower() for column in data.columns]
    sets = (ROTATION_COLUMNS, QUATERNION_COLUMNS)
    begun = [names for names in sets if any(name in lower for name in names)]
    kinds = len(begun) + bool(gravity_places)
    if kinds == 0:
        raise data.wrong_header("no pose; give gx,gy,gz or qw,qx,qy,qz or r00,r01,...,r22")
    if kinds > 1:
        raise data.wrong_header("more than one kind of pose; keep one of gx.., qw.., r00..")
    if gravity_places:
        _complete(data, GRAVITY_COLUMNS, gravity_places, "gx,gy,gz")
        places = [gravity_places[name] for name in GRAVITY_COLUMNS]
        return MeasuredPoses(_from_gravity(data, places, gravity), None)
    names = begun[0]
    found = {name: lower.index(name) for name in names if name in lower}
    _complete(data, names, found, ",".join(names))
    if twice := next((name for name in names if lower.count(name) > 1), None):
        raise data.wrong_header(f"{twice} is there twice; keep one")
    values = data.numbers([found[name] for name in names])
    big = np.flatnonzero(np.abs(values).max(axis=1) > 1.0 + QUATERNION_TOLERANCE)
    if len(big):
        i = int(big[0])
        raise data.wrong(i, f"{names[0]}..{names[-1]}: an entry is larger than 1, so this is no rotation")
    R = _rotations_from_quaternions(data, values) if names is QUATERNION_COLUMNS else _rotations(data, values)
    if rotation in ("base-from-sensor", "base-from-flange"):
        R = R.transpose(0, 2, 1)
    return MeasuredPoses(specific_force_from_rotations(R, gravity=gravity, up_base=up_base), R)


def _gravity_places(data: CsvData) -> dict[str, int]:
    found: dict[str, int] = {}
    for i, column in enumerate(data.columns):
        if match := _GRAVITY.fullmatch(column):
            stem, unit = match["stem"].lower(), match["unit"]
            if (column.lower() != stem) and unit not in GRAVITY_UNITS:
                raise data.wrong_header(
                    f"column {short(column)}: unit {short(unit or '')} is none of acceleration; {stem} is the "
                    f"direction of gravity, without unit or in {', '.join(GRAVITY_UNITS)}"
                )
            if stem in found:
                raise data.wrong_header(f"{stem} is there twice; keep one")
            found[stem] = i
    return found


def _from_gravity(data: CsvData, places: Sequence[int], gravity: float) -> FloatArray:
    down = data.numbers(places)
    largest = np.abs(down).max(axis=1)
    bad = np.flatnonzero(~((largest > 1e-3) & (largest < 1e3)))
    if len(bad):
        i = int(bad[0])
        raise data.wrong(i, "gx, gy, gz: must be a direction, with a length from 1e-3 to 1e3")
    return specific_force_from_gravity(down, gravity=gravity)


def _rotations(data: CsvData, values: FloatArray) -> FloatArray:
    R = values.reshape(-1, 3, 3)
    defect = np.abs(R.transpose(0, 2, 1) @ R - np.eye(3)).max(axis=(1, 2))
    bad = np.flatnonzero((defect > ROTATION_TOLERANCE) | (np.linalg.det(R) < 0.0))
    if len(bad):
        i = int(bad[0])
        what = "a reflection" if defect[i] <= ROTATION_TOLERANCE else f"not orthonormal by {defect[i]:.1e}"
        raise data.wrong(
            i,
            f"r00..r22 is no rotation but {what} (limit {ROTATION_TOLERANCE:.0e}: give six decimals or more, in "
            "rows)",
        )
    return R


def _rotations_from_quaternions(data: CsvData, quat_wxyz: FloatArray) -> FloatArray:
    length = np.linalg.norm(quat_wxyz, axis=1)
    bad = np.flatnonzero(np.abs(length - 1.0) > QUATERNION_TOLERANCE)
    if len(bad):
        i = int(bad[0])
        raise data.wrong(i, f"qw,qx,qy,qz has length {length[i]:.4g}: must be 1 (limit {QUATERNION_TOLERANCE:g})")
    w, x, y, z = (quat_wxyz / length[:, None]).T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def _complete(
    data: CsvData, names: Sequence[str], found: dict[str, int] | dict[str, tuple[int, float]], example: str
) -> None:
    if missing := [name for name in names if name not in found]:
        raise data.wrong_header(f"no column {', '.join(missing)} (for example {example})")


def _factor(data: CsvData, column: str, stem: str, unit: str | None, units: dict[str, float]) -> float:
    if not unit:
        if column.lower() == stem:
            return 1.0
        raise data.wrong_header(f"column {short(column)} names no unit; known are {', '.join(units)}")
    spelled = unit.replace("µ", "u").replace("μ", "u").replace("·", ".").replace(" ", "").replace("_", "")
    if spelled not in units:
        raise data.wrong_header(
            f"column {short(column)}: unit {short(unit)} is not known; known for {stem} are {', '.join(units)}"
        )
    return units[spelled]


def _header(place: str, text: str, fields: tuple[str, ...]) -> tuple[str, ...]:
    columns = tuple(field.strip() for field in fields)
    if all(_DECIMAL.fullmatch(column) for column in columns):
        raise InvalidValueError(f"{place}: numbers where the header should be; put the names of the columns first")
    if len(columns) == 1 and (separator := next((c for c in ";\t" if c in text), None)):
        raise InvalidValueError(f"{place}: columns must be separated by commas, not {separator!r}")
    return columns
