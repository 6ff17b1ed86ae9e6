"""Measurements for calibrations: wrenches, raw channels, poses and known loads from CSV files, and live readings.

A column `raw_0`, `raw_1`, ... holds a raw channel of the sensor. Poses are directions of gravity (gx, gy, gz),
unit quaternions (qw, qx, qy, qz) or rotation matrices by rows (r00, ..., r22).
"""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.commands.calibrate.config import MAX_RAW, FlangeOrder, RotationOrder, TareConfig
from palpate.csv_table import (
    LENGTH_UNITS,
    MASS_UNITS,
    NO_UNITS,
    QUATERNION,
    UNIT_PATTERN,
    WRENCH_EXAMPLE,
    CsvTable,
    Quantities,
    Units,
    read_csv_table,
    read_csv_text,
)
from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime import Backend, Command, WrenchSample
from palpate.sensing.ft import SensorFile
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.left_out import equal_loads
from palpate.sensing.ft.poses import ROTATION_TOLERANCE, specific_force_from_gravity, specific_force_from_rotations
from palpate.spatial import Vector, Wrench

AXIS_UNITS = ("N",) * 3 + ("N m",) * 3
"""Units of the components of a wrench."""

_ACCELERATION: Units = dict.fromkeys(("g", "m/s^2", "m/s2", "ms2", "mps2"), 1.0)
"""Units of gravity, of which only the direction counts. A gyroscope's rad/s or deg/s is refused."""

_GRAVITY: Quantities = dict.fromkeys(("gx", "gy", "gz"), _ACCELERATION)
_ROTATION: Quantities = {f"r{i}{j}": NO_UNITS for i in range(3) for j in range(3)}
_MASS: Quantities = {"mass": MASS_UNITS}
_CENTER: Quantities = dict.fromkeys(("com_x", "com_y", "com_z"), LENGTH_UNITS)
_TEMPERATURE: Quantities = {"temperature_c": NO_UNITS}
_MIN_TIP_MASS = 1e-6
"""Mass of a simulated tip if the sensor file names no payload [kg]: a simulated body needs some,
which weighs 10 uN."""

_STAGE_PERIOD = 1e-3
"""Control period of the simulated stage [s]."""

_SETTLE_TIME = 0.2
"""Time at rest before readings count [s]: 20 time constants of the stage's servos."""

_RAW = re.compile(r"raw[_ ]?(?P<number>\d{1,3})" + UNIT_PATTERN, re.IGNORECASE | re.ASCII)


def read_measurements(path: Path) -> CsvTable:
    """Return the table of a file with named columns.

    Raises:
        InvalidValueError: If the file cannot be read, is no CSV text or holds no row.
    """
    return read_csv_table(read_csv_text(path), str(path), f"columns by name, such as {WRENCH_EXAMPLE}", named=True)


def wrenches(table: CsvTable, limits: Wrench) -> FloatArray:
    """Return the wrenches of a table, shape (n, 6) [N, N m].

    Args:
        table: Table with the columns fx, fy, fz, mx, my, mz.
        limits: Ranges of the sensor [N, N m].

    Raises:
        InvalidValueError: If a column is missing or in an unknown unit, or a field is no number or out of range.
    """
    found = table.in_si(table.columns.wrench())
    _refuse_beyond(table, found, limits, "another unit, or the wrong file?")
    return found


def raw_readings(
    table: CsvTable, channels: tuple[str, ...], raw_range: tuple[float, float] | None
) -> tuple[FloatArray, str]:
    """Return the raw channels, shape (n, k), and their unit, "" if the header has none.

    Args:
        table: Table with raw channels.
        channels: Names of the columns; if empty, raw_0, raw_1, ... in the order of their numbers.
        raw_range: Lowest and highest reading that is not saturated, if known.

    Raises:
        InvalidValueError: If a column is missing, numbers leave gaps, units differ, or a reading is saturated.
    """
    columns, unit = table.columns, ""
    if channels:
        table.numbers(*channels)
        places = [columns.names.index(name) for name in channels]
    else:
        numbered: dict[int, tuple[int, str]] = {}
        for place, name in enumerate(columns.names):
            if match := _RAW.fullmatch(name):
                number = int(match["number"])
                if number in numbered:
                    raise columns.wrong(f"raw channel {number} is there twice; keep one")
                numbered[number] = place, match["unit"] or ""
        order = sorted(numbered)
        if not order:
            there = ", ".join(map(repr, columns.names[:40]))
            raise columns.wrong(
                f"no raw channels: there are {there}; call their columns raw_0, raw_1, ... or name them by "
                "--channels"
            )
        if gap := next((n for n in range(order[0], order[-1]) if n not in numbered), None):
            raise columns.lacking(f"raw_{gap}", example=f"all from raw_{order[0]} to raw_{order[-1]}")
        units = sorted({unit for _, unit in numbered.values()})
        if len(units) > 1:
            named = ", ".join(each or "none" for each in units)
            raise columns.wrong(f"raw channels in different units ({named}): all must have one")
        unit, places = units[0], [numbered[n][0] for n in order]
    values = table.finite(places)
    low, high = raw_range or (-MAX_RAW, MAX_RAW)
    for i, j in np.argwhere((values < low) | (values > high))[:1].tolist():
        raise table.wrong(
            i,
            f"{columns.names[places[j]]} = {values[i, j]:g}: outside {low:g} to {high:g}, so saturated; leave "
            "such rows out",
        )
    return values, unit


def calibrated_wrenches(table: CsvTable, sensor: SensorFile, channels: tuple[str, ...]) -> tuple[FloatArray, str]:
    """Return calibrated wrenches, shape (n, 6) [N, N m], and their source in words.

    Raw channels are calibrated as in `FTPipeline`.

    Raises:
        InvalidValueError: If the table has neither, or raw channels that do not belong to the sensor file.
    """
    columns, entry = table.columns, sensor.calibration
    if not channels and not any(_RAW.fullmatch(name) for name in columns.names):
        return wrenches(table, sensor.axis_limits), "wrenches"
    if entry is None:
        if columns.find(columns.wrench()):
            return wrenches(table, sensor.axis_limits), "wrenches"
        raise columns.wrong(
            "raw channels only, and the sensor file has no calibration; find it first by palpate calibrate matrix"
        )
    raw, unit = raw_readings(table, channels, entry.raw_range)
    if raw.shape[1] != entry.map.channels:
        raise columns.wrong(f"{raw.shape[1]} raw channels, but the sensor file has {entry.map.channels}")
    if unit and unit != entry.raw_unit:
        raise columns.wrong(f"raw channels in {unit}, but the sensor file has {entry.raw_unit}")
    rows = entry.map.apply(raw)
    refuse_overload(rows, sensor)
    return rows, "raw channels"


def refuse_overload(rows: FloatArray, sensor: SensorFile) -> None:
    """Refuse wrenches beyond the sensor's range.

    Raises:
        InvalidValueError: If a wrench is beyond the range.
    """
    for i, j in np.argwhere(~(np.abs(rows) <= np.array(sensor.axis_limits)))[:1].tolist():
        raise InvalidValueError(
            f"reading {i}: {AXES[j]} = {rows[i, j]:g} {AXIS_UNITS[j]} is beyond the sensor's range of "
            f"{sensor.axis_limits[j]:g}"
        )


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredPoses:
    """Poses of a table.

    Attributes:
        specific_force: Specific force at rest in the sensor frame, shape (n, 3) [m/s^2].
        rotation_sensor_base: Rotations from base to sensor coordinates, shape (n, 3, 3); None if the table has
            directions of gravity.
    """

    specific_force: FloatArray
    rotation_sensor_base: FloatArray | None


def measured_poses(
    table: CsvTable, rotation: RotationOrder | FlangeOrder, up_base: Vector, gravity: float
) -> MeasuredPoses:
    """Return the poses of a sensor or of a flange.

    Args:
        table: Table with one kind of pose.
        rotation: Coordinates that rotations and quaternions map from and to.
        up_base: Upward direction in base coordinates.
        gravity: Local g [m/s^2].

    Raises:
        InvalidValueError: If the table has no kind of pose, several or a part of one, or a pose is none.
    """
    columns = table.columns
    kinds = [kind for kind in (_GRAVITY, _ROTATION, QUATERNION) if columns.find(kind)]
    if not kinds:
        raise columns.lacking("of a pose", example="gx,gy,gz or qw,qx,qy,qz or r00,r01,...,r22")
    if len(kinds) > 1:
        raise columns.wrong("more than one kind of pose; keep one of gx.., qw.., r00..")
    if kinds[0] is _GRAVITY:
        down = table.in_si(_GRAVITY)
        largest = np.abs(down).max(axis=1)
        for i in np.flatnonzero((largest <= 1e-3) | (largest >= 1e3))[:1].tolist():
            raise table.wrong(i, "gx, gy, gz: must be a direction, with a length from 1e-3 to 1e3")
        return MeasuredPoses(specific_force_from_gravity(down, gravity=gravity), None)
    R = table.rotations() if kinds[0] is QUATERNION else _rotation_matrices(table)
    if rotation in ("base-from-sensor", "base-from-flange"):
        R = R.transpose(0, 2, 1)
    return MeasuredPoses(specific_force_from_rotations(R, gravity=gravity, up_base=up_base), R)


def _rotation_matrices(table: CsvTable) -> FloatArray:
    R = table.in_si(_ROTATION).reshape(-1, 3, 3)
    with np.errstate(over="ignore", invalid="ignore"):
        defect = np.abs(R.transpose(0, 2, 1) @ R - np.eye(3)).max(axis=(1, 2))
    for i in np.flatnonzero(~(defect <= ROTATION_TOLERANCE) | (np.linalg.det(R) < 0.0))[:1].tolist():
        what = "a reflection" if defect[i] <= ROTATION_TOLERANCE else f"not orthonormal by {defect[i]:.1e}"
        raise table.wrong(
            i,
            f"r00..r22 is no rotation but {what} (limit {ROTATION_TOLERANCE:.0e}: give six decimals or more, by "
            "rows)",
        )
    return R


@dataclass(frozen=True, slots=True, eq=False)
class KnownLoads:
    """Known loads, each the average over the rows that were taken of it in one go.

    Attributes:
        raw: Raw channels, shape (n, k) [raw unit].
        wrench: Loads, shape (n, 6) [N, N m].
        temperature: Temperatures, shape (n,) [degrees Celsius]; None if the table has none.
    """

    raw: FloatArray
    wrench: FloatArray
    temperature: FloatArray | None


def known_loads(
    table: CsvTable, raw: FloatArray, limits: Wrench, rotation: RotationOrder, up_base: Vector, gravity: float
) -> KnownLoads:
    """Return the known loads of a table: wrenches, or weights in known poses.

    Successive rows of one load are readings of it, not loads: their average counts, once.

    Args:
        table: Table of loads.
        raw: Raw channels of the table, shape (rows, k).
        limits: Ranges of the sensor [N, N m].
        rotation: Coordinates that rotations and quaternions map from and to.
        up_base: Upward direction in base coordinates.
        gravity: Local g [m/s^2].

    Raises:
        InvalidValueError: If the table has neither wrenches nor weights in poses, or a row is wrong.
    """
    columns = table.columns
    if columns.find(columns.wrench()) or not columns.find(_MASS):
        wrench = wrenches(table, limits)
    else:
        wrench = _weight_wrenches(table, limits, measured_poses(table, rotation, up_base, gravity).specific_force)
    values = [raw, wrench]
    warm = bool(columns.find(_TEMPERATURE))
    if warm:
        values.append(table.in_si(_TEMPERATURE))
    changes = np.flatnonzero(np.diff(equal_loads(wrench))) + 1
    mean = np.array([rows.mean(axis=0) for rows in np.split(np.hstack(values), changes)])
    k = raw.shape[1]
    return KnownLoads(mean[:, :k], mean[:, k : k + 6], mean[:, k + 6] if warm else None)


def _weight_wrenches(table: CsvTable, limits: Wrench, specific_force: FloatArray) -> FloatArray:
    """Return the wrenches of weights on the tip side of a sensor at rest, shape (n, 6) [N, N m]."""
    if missing := [f"{name}_m" for name in _CENTER if name not in table.columns.find(_CENTER)]:
        raise table.columns.lacking(*missing, example="the centre of mass in the sensor frame beside mass_kg")
    mass, center = table.in_si(_MASS), table.in_si(_CENTER)
    for i in np.flatnonzero(mass[:, 0] < 0.0)[:1].tolist():
        raise table.wrong(i, f"the mass is {mass[i, 0]:g} kg: must be 0 or more")
    force = -mass * specific_force
    wrench = np.hstack([force, np.cross(center, force)])
    _refuse_beyond(table, wrench, limits, "grams for kilograms, or millimetres for metres?")
    return wrench


def _refuse_beyond(table: CsvTable, wrench: FloatArray, limits: Wrench, remedy: str) -> None:
    for i, j in np.argwhere(np.abs(wrench) > np.array(limits))[:1].tolist():
        raise table.wrong(
            i,
            f"{AXES[j]} is {wrench[i, j]:g} {AXIS_UNITS[j]}: beyond the sensor's range of {limits[j]:g}; {remedy}",
        )


# --- live readings -----------------------------------------------------------------------------------------------


def take_readings(backend: Backend, duration: float) -> tuple[FloatArray, Vector]:
    """Return the readings of a back end's first sensor while it stands still, and close the back end.

    Args:
        backend: Simulated or real back end.
        duration: Time of readings [s], after `_SETTLE_TIME`.

    Returns:
        Wrenches as the device gives them, shape (n, 6) [N, N m], and the mean specific force [m/s^2], both in the
        sensor frame. A sample that the device had not renewed since the period before counts once.

    Raises:
        InvalidValueError: If the back end has no sensor, or no new reading.
    """
    taken: list[WrenchSample] = []
    stands = Command()  # no velocity
    with backend:
        backend.pacer.start()
        try:
            sample = backend.start()
            if not sample.wrenches:
                raise InvalidValueError("the back end has no force/torque sensor")
            for _ in range(math.ceil(_SETTLE_TIME / backend.period)):
                sample = backend.step(stands)
            before = sample.wrenches[0].time
            for _ in range(math.ceil(duration / backend.period)):
                reading = backend.step(stands).wrenches[0]
                if reading.time != before:
                    taken.append(reading)
                before = reading.time
        finally:
            backend.pacer.stop()
    if not taken:
        raise InvalidValueError(f"the sensor gave no new reading in {duration:g} s")
    x, y, z = np.mean([reading.acceleration for reading in taken], axis=0).tolist()
    return np.array([reading.wrench for reading in taken]), (x, y, z)


@contextmanager
def robot_backend(name: str) -> Iterator[Backend]:
    """Give the devices of a robot, not tared; the emulators of an emulated robot run meanwhile.

    Args:
        name: Name of a robot with real or emulated devices.

    Raises:
        InvalidValueError: If there is no such robot, it has no devices, or its first sensor gives raw channels.
        DeviceError: If emulators do not start.
    """
    # imported here: clients of devices take a second that the other tasks need not wait for
    from palpate.robots.rig import assembled
    from palpate.robots.values import named_devices

    with named_devices(name) as robot:
        rig = assembled(robot, robot.file.period)
        if not rig.fingers[0].gives_wrenches:
            raise InvalidValueError(
                f"robot = {name}: its sensor file calibrates raw channels, which are not tared here; give "
                "--readings, with columns raw_0, raw_1, ..."
            )
        yield rig


def stage_backend(config: TareConfig, sensor: SensorFile) -> Backend:
    """Return the simulated stage, above an object, with payload and noise of the sensor file.

    Raises:
        InvalidValueError: If the stage cannot carry that payload.
    """
    # imported here: the simulator takes a second that the other tasks need not wait for
    from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Tip, build_scene, white_noise
    from palpate.surfaces import Sphere

    radius, clearance = 0.008, 0.01
    center = sensor.payload.center_of_mass
    tip = Tip(Sphere(radius, center=np.array(center)), max(sensor.payload.mass, _MIN_TIP_MASS))
    target = SphereObject(0.04)
    height = target.top + radius + clearance + abs(center[2])
    law = ContactLaw(stiffness=20e3, friction=0.3, spin_length=0.004, smallest_force=0.2)
    force = max(sensor.noise_force) if config.force_noise is None else config.force_noise
    moment = max(sensor.noise_moment) if config.moment_noise is None else config.moment_noise
    shown = white_noise(force, moment, config.seed)
    if config.unknown_bias is not None:
        shown = replace(shown, model=replace(shown.model, bias=config.unknown_bias))
    return MujocoBackend(build_scene(tip, target, law, (0.0, 0.0, height)), _STAGE_PERIOD, shown)
