"""Touches as CSV files: made by hand or by a robot, columns by name and unit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.csv_table import (
    LENGTH_UNITS,
    NO_UNITS,
    TIME_UNITS,
    WRENCH,
    WRENCH_EXAMPLE,
    CsvTable,
    Quantities,
    read_csv_table,
    read_csv_text,
    short,
)
from palpate.experiments.tip_calibration.touches import MIN_WRENCH_SD
from palpate.sensing.tip_calibration import PlannedTouch, TargetKind, Touches, TouchTarget

_POSITION: Quantities = dict.fromkeys(("x", "y", "z"), LENGTH_UNITS)
_PLACE: Quantities = dict.fromkeys(("place_x", "place_y", "place_z"), LENGTH_UNITS)
_DIRECTION: Quantities = dict.fromkeys(("direction_x", "direction_y", "direction_z"), NO_UNITS)
_SDS: Quantities = {f"sd_{name}": units for name, units in WRENCH.items()}

_POSE = "x_m,y_m,z_m,qw,qx,qy,qz"
_HOLDS = (
    f"target,kind,radius_m,{_POSE},{WRENCH_EXAMPLE} and, if known, time_s, place_x_m ... direction_z and "
    "sd_fx_N ... sd_mz_Nm"
)
_WRITTEN = (
    f"target,kind,radius_m,{_POSE},{WRENCH_EXAMPLE},time_s,place_x_m,place_y_m,place_z_m,direction_x,direction_y,"
    "direction_z,sd_fx_N,sd_fy_N,sd_fz_N,sd_mx_Nm,sd_my_Nm,sd_mz_Nm"
)
"""Columns of the files that palpate writes."""

_USUAL_SD = (0.01, 0.01, 0.01, 1e-4, 1e-4, 1e-4)
"""Standard deviations of wrenches without any in the file [N, N m]: noise of one reading of a fingertip sensor."""


@dataclass(frozen=True, slots=True, eq=False)
class TouchesFile:
    """The contents of a file of touches.

    Attributes:
        touches: The touches, one per row.
        targets: Targets that the touches belong to.
    """

    touches: Touches
    targets: tuple[TouchTarget, ...]

    def of(self, targets: Sequence[TouchTarget]) -> Touches:
        """Return the touches of these targets, numbered in their order."""
        numbers = {target.name: i for i, target in enumerate(targets)}
        names = [self.targets[at].name for at in self.touches.target.tolist()]
        rows = [i for i, name in enumerate(names) if name in numbers]
        return replace(
            self.touches.selected(rows), target=np.array([numbers[names[i]] for i in rows], dtype=np.intp)
        )


def load_touches(path: Path, targets: Sequence[TouchTarget]) -> tuple[TouchesFile, str]:
    """Return the touches of a file, and the file's text.

    Raises:
        InvalidValueError: If the file cannot be read, or `read_touches` refuses it.
    """
    text = read_csv_text(path)
    return read_touches(text, str(path), targets), text


def read_touches(text: str, name: str, targets: Sequence[TouchTarget]) -> TouchesFile:
    """Return the touches of a text.

    Args:
        text: CSV text with named columns; the quaternions map sensor to base coordinates.
        name: Name of the text in messages.
        targets: Known targets, for which the text needs no more than the name.

    Raises:
        InvalidValueError: If a column is missing or a field is wrong; the message names the line.
    """
    table = read_csv_table(text, name, _HOLDS, named=True)
    columns, count = table.columns, len(table.rows)
    if "target" not in columns.names:
        raise columns.lacking("target")
    place = columns.names.index("target")
    names = [row[place].strip() for row in table.rows]
    first = {each: names.index(each) for each in names}
    known = {each.name: each for each in targets}
    found = tuple(_target(table, i, each, known.get(each)) for each, i in first.items())
    order = {each: i for i, each in enumerate(first)}
    sd = table.in_si(_SDS) if len(columns.find(_SDS)) == len(_SDS) else np.tile(_USUAL_SD, (count, 1))
    time = {"time": TIME_UNITS}
    return TouchesFile(
        Touches(
            np.array([order[each] for each in names], dtype=np.intp),
            table.in_si(WRENCH),
            np.maximum(sd, MIN_WRENCH_SD),
            table.rotations(),
            table.in_si(_POSITION),
            table.in_si(time)[:, 0] if columns.find(time) else np.arange(float(count)),
        ),
        found,
    )


def touches_text(touches: Touches, targets: Sequence[TouchTarget]) -> str:
    """Return touches as CSV text; `read_touches` gives back the same numbers, but for rounding of rotations."""
    quaternions = Rotation.from_matrix(touches.rotation).as_quat()
    lines = [_WRITTEN]
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
    lines = [f"touch,target,{_POSE},approach_x,approach_y,approach_z,force_N"]
    for i, each in enumerate(planned, 1):
        x, y, z, w = Rotation.from_matrix(each.rotation).as_quat().tolist()
        numbers = (*each.position.tolist(), w, x, y, z, *each.direction.tolist(), each.force)
        lines.append(",".join((str(i), targets[each.target].name, *(f"{number:.6g}" for number in numbers))))
    return "\n".join(lines) + "\n"


def _target(table: CsvTable, i: int, name: str, known: TouchTarget | None) -> TouchTarget:
    """Return a target from its first row; values that the row lacks are those of the known target."""
    columns, row = table.columns, [field.strip() for field in table.rows[i]]

    def numbers(quantities: Quantities) -> list[float]:
        found = columns.find(quantities)
        if any(each not in found or not row[found[each][0]] for each in quantities):
            return []
        return [
            factor * columns.number(place, row[place], table.lines[i])
            for place, factor in (found[each] for each in quantities)
        ]

    kind = row[columns.names.index("kind")] if "kind" in columns.names else ""
    kind = kind or (known.kind.value if known else "")
    if kind not in list(TargetKind):
        raise table.wrong(i, f"kind = {short(kind)}: must be one of {', '.join(TargetKind)}")
    given = known or TouchTarget(name, TargetKind.POINT, (0.0, 0.0, 0.0))
    place, direction, radius = numbers(_PLACE), numbers(_DIRECTION), numbers({"radius": LENGTH_UNITS})
    if not place and known is None:
        raise table.wrong(i, f"{short(name)}: no approximate place; give place_x_m, place_y_m, place_z_m")
    x, y, z = place or given.place
    u, v, w = direction or given.direction
    size = radius[0] if radius else given.radius
    return replace(given, kind=TargetKind(kind), place=(x, y, z), direction=(u, v, w), radius=size)
