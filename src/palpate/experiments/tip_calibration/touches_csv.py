"""Touches as a CSV file: made by hand or by a robot, columns by name, units in their names."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.bounded_file import read_text
from palpate.csv_table import BOUNDS, NumberTable, number_in, read_csv_table, short
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.tip_calibration.touches import MIN_WRENCH_SD
from palpate.sensing.tip_calibration import PlannedTouch, TargetKind, Touches, TouchTarget

PLACE = ("x_m", "y_m", "z_m")
QUATERNION = ("qw", "qx", "qy", "qz")
WRENCH = ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm")
ABOUT = ("place_x_m", "place_y_m", "place_z_m")
DIRECTION = ("direction_x", "direction_y", "direction_z")
SDS = tuple(f"sd_{name}" for name in WRENCH)

SCALES = {"m": 1.0, "mm": 1e-3, "N": 1.0, "mN": 1e-3, "Nm": 1.0, "mNm": 1e-3, "Nmm": 1e-3, "s": 1.0, "ms": 1e-3}
"""Understood units, in those of SI."""

HOLDS = (
    "target,kind,radius_m,x_m,y_m,z_m,qw,qx,qy,qz,fx_N,fy_N,fz_N,mx_Nm,my_Nm,mz_Nm and, if known, time_s, "
    "place_x_m ... direction_z and sd_fx_N ... sd_mz_Nm"
)

USUAL_SD = (0.01, 0.01, 0.01, 1e-4, 1e-4, 1e-4)
"""[N, N m] Of wrenches of which none is given: the noise of a fingertip's sensor in one reading."""

QUATERNION_TOLERANCE = 1e-3
"""Deviation of a quaternion's length from 1: logs with four decimals pass, a rotation vector does not."""

_UNIT = re.compile(r"(?P<stem>.+)_(?P<unit>[a-zA-Z]+)")


@dataclass(frozen=True, slots=True, eq=False)
class TouchesFile:
    """What a file of touches says.

    Attributes:
        touches: One row each.
        targets: That they are of.
    """

    touches: Touches
    targets: tuple[TouchTarget, ...]

    def of(self, targets: Sequence[TouchTarget]) -> Touches:
        """Return the touches of some targets, which are counted in another order; those of others are left out."""
        numbers = {target.name: i for i, target in enumerate(targets)}
        names = [self.targets[at].name for at in self.touches.target.tolist()]
        rows = [i for i, name in enumerate(names) if name in numbers]
        return replace(
            self.touches.selected(rows), target=np.array([numbers[names[i]] for i in rows], dtype=np.intp)
        )


def load_touches(path: Path, targets: Sequence[TouchTarget]) -> tuple[TouchesFile, str]:
    """Return the touches of a file, and its text; see `read_touches`.

    Raises:
        InvalidValueError: It cannot be read, or something in it is wrong.
    """
    try:
        text = read_text(path, BOUNDS, "save it as UTF-8")
    except OSError as error:
        raise InvalidValueError(f"cannot read {path}: {error.strerror}") from None
    return read_touches(text, str(path), targets), text


def read_touches(text: str, name: str, targets: Sequence[TouchTarget]) -> TouchesFile:
    """Return the touches of a text.

    Args:
        text: CSV with a header; see `HOLDS`.
        name: What messages call it.
        targets: Of which nothing but the name need be in the text.

    Raises:
        InvalidValueError: Something in it is wrong; the message names the line.
    """
    table = read_csv_table(text, name, HOLDS)
    if not table.columns:
        raise InvalidValueError(f"{name}: no names of columns: begin with {HOLDS}")
    table, factors = _in_si(table)
    quaternions = _columns(table, factors, QUATERNION)
    length = np.linalg.norm(quaternions, axis=1)
    if (np.abs(length - 1.0) > QUATERNION_TOLERANCE).any():
        i = int(np.argmax(np.abs(length - 1.0)))
        raise InvalidValueError(
            f"{name}, line {table.lines[i]}: qw,qx,qy,qz has length {length[i]:.4g}: must be 1 (limit "
            f"{QUATERNION_TOLERANCE:g}); it maps sensor to base coordinates"
        )
    found, of_row = _targets(table, factors, targets)
    count = len(table.rows)
    sd = _columns(table, factors, SDS) if set(SDS) <= set(table.columns) else np.tile(USUAL_SD, (count, 1))
    timed = "time_s" in table.columns
    time = _columns(table, factors, ("time_s",))[:, 0] if timed else np.arange(float(count))
    w, x, y, z = quaternions.T
    return TouchesFile(
        Touches(
            of_row,
            _columns(table, factors, WRENCH),
            np.maximum(sd, MIN_WRENCH_SD),
            Rotation.from_quat(np.column_stack([x, y, z, w])).as_matrix(),
            _columns(table, factors, PLACE),
            time,
        ),
        found,
    )


def touches_text(touches: Touches, targets: Sequence[TouchTarget]) -> str:
    """Return touches as CSV text; `read_touches` gives back the same numbers, but for rounding of rotations."""
    names = ("target", "kind", "radius_m", *PLACE, *QUATERNION, *WRENCH, "time_s", *ABOUT, *DIRECTION, *SDS)
    quaternions = Rotation.from_matrix(touches.rotation).as_quat()
    lines = [",".join(names)]
    for i, at in enumerate(touches.target.tolist()):
        target = targets[at]
        x, y, z, w = quaternions[i].tolist()
        numbers = (
            *touches.position[i].tolist(),
            *(w, x, y, z),
            *touches.wrench[i].tolist(),
            float(touches.time[i]),
            *target.place,
            *target.direction,
            *touches.wrench_sd[i].tolist(),
        )
        lines.append(",".join((target.name, target.kind.value, repr(target.radius), *map(repr, numbers))))
    return "\n".join(lines) + "\n"


def planned_text(planned: Sequence[PlannedTouch], targets: Sequence[TouchTarget]) -> str:
    """Return planned touches as CSV text: the sensor's pose where the tip just touches, and how it gets there."""
    names = (
        *("touch", "target", *PLACE, *QUATERNION),
        *("approach_x", "approach_y", "approach_z", "force_N"),
    )
    lines = [",".join(names)]
    for i, each in enumerate(planned, 1):
        x, y, z, w = Rotation.from_matrix(each.rotation).as_quat().tolist()
        numbers = (*each.position.tolist(), w, x, y, z, *each.direction.tolist(), each.force)
        lines.append(",".join((str(i), targets[each.target].name, *(f"{number:.6g}" for number in numbers))))
    return "\n".join(lines) + "\n"


def _in_si(table: NumberTable) -> tuple[NumberTable, dict[str, float]]:
    """The table with the names of its columns in SI units, and by what each is to be multiplied."""
    known = {"target", "kind", "radius_m", "time_s", *PLACE, *QUATERNION, *WRENCH, *ABOUT, *DIRECTION, *SDS}
    stems = {_stem(name): name for name in known}
    columns, factors = [], {}
    for column in table.columns:
        match = _UNIT.fullmatch(column)
        unit = match["unit"] if match else ""
        own = stems.get(column if column in known else match["stem"] if match else column)
        if own is None or own in factors:
            columns.append(column)
            continue
        if column != own and (unit not in SCALES or _stem(own) == own):
            raise InvalidValueError(f"{table.name}: column {short(column)}: known units are {', '.join(SCALES)}")
        columns.append(own)
        wanted = _UNIT.fullmatch(own)
        factors[own] = 1.0 if column == own else SCALES[unit] / SCALES[wanted["unit"] if wanted else ""]
    return NumberTable(table.name, tuple(columns), table.rows, table.lines, table.holds), factors


def _stem(name: str) -> str:
    match = _UNIT.fullmatch(name)
    return match["stem"] if match and match["unit"] in SCALES else name


def _columns(table: NumberTable, factors: dict[str, float], names: Sequence[str]) -> FloatArray:
    """Columns in SI units; every number finite."""
    found: FloatArray = table.numbers(*names) * np.array([factors.get(name, 1.0) for name in names])
    bad = np.flatnonzero(~np.isfinite(found).all(axis=1))
    if len(bad):
        raise InvalidValueError(
            f"{table.name}, line {table.lines[int(bad[0])]}: {', '.join(names)} must be finite numbers"
        )
    return found


def _targets(
    table: NumberTable, factors: dict[str, float], known: Sequence[TouchTarget]
) -> tuple[tuple[TouchTarget, ...], np.ndarray[tuple[int], np.dtype[np.intp]]]:
    """The targets of a table, by name, and that of each row."""
    if "target" not in table.columns:
        raise InvalidValueError(f"{table.name}: no column target: there must be {HOLDS}")
    names = [row[table.columns.index("target")] for row in table.rows]
    targets = {each.name: each for each in known}
    found: dict[str, TouchTarget] = {}
    for i, name in enumerate(names):
        if name not in found:
            found[name] = _target(table, factors, i, name, targets.get(name))
    order = list(found)
    return tuple(found.values()), np.array([order.index(name) for name in names], dtype=np.intp)


def _target(
    table: NumberTable, factors: dict[str, float], i: int, name: str, known: TouchTarget | None
) -> TouchTarget:
    """A target from its first row; what that does not say is as it is known."""
    where = f"{table.name}, line {table.lines[i]}"
    row = dict(zip(table.columns, table.rows[i], strict=True))

    def numbers(columns: Sequence[str]) -> tuple[float, ...] | None:
        if any(not row.get(column) for column in columns):
            return None
        values = [number_in(row[column]) for column in columns]
        if None in values:
            raise InvalidValueError(f"{where}: {', '.join(columns)} must be numbers")
        return tuple(factors.get(c, 1.0) * v for c, v in zip(columns, values, strict=True) if v is not None)

    kind = row.get("kind") or (known.kind.value if known else "")
    if kind not in list(TargetKind):
        raise InvalidValueError(f"{where}: kind = {short(kind)}: must be one of {', '.join(TargetKind)}")
    place, direction, radius = numbers(ABOUT), numbers(DIRECTION), numbers(("radius_m",))
    if place is None and known is None:
        raise InvalidValueError(f"{where}: {short(name)}: where is it, about? Give {', '.join(ABOUT)}")
    x, y, z = place or (known.place if known else (0.0, 0.0, 0.0))
    u, v, w = direction or (known.direction if known else (0.0, 0.0, 0.0))
    sds = {} if known is None else {"place_sd": known.place_sd, "direction_sd": known.direction_sd}
    r = radius[0] if radius else known.radius if known else 0.0
    return TouchTarget(name, TargetKind(kind), (x, y, z), (u, v, w), r, **sds)
