"""Options of `palpate calibrate`; imports nothing heavy, so that `palpate --help` is quick."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from palpate.errors import InvalidValueError, vector
from palpate.experiments.kit.options import check_options, option

if TYPE_CHECKING:
    from palpate.commands.command_result import CommandResult

MAX_RAW = 1e12
"""Largest magnitude of a raw channel: counts have 32 bits."""

_MAX_TARE_TIME = 600.0
"""Longest time of readings [s]: in a longer one, the zero drifts more than averaging helps."""

_TEMPERATURES = -50.0, 150.0
"""Lowest and highest temperature of a sensor [degrees Celsius]: a number beyond is in kelvins."""

_MAX_AVERAGED = 1_000_000
"""Most readings that a row is the average of."""

_MAX_TIP = 1.0
"""Largest size of a fingertip, and of its distance from the sensor [m]: more is a number in millimetres."""

PresetName = Literal["nano17", "axia80", "ft300s", "ur5e"]
"""Sensors with a data sheet: those of `palpate.sensing.ft.preset_sensor`, but for the perfect one."""

RotationOrder = Literal["base-from-sensor", "sensor-from-base"]
FlangeOrder = Literal["base-from-flange", "flange-from-base"]

_Sensor = Annotated[Path, tyro.conf.arg(metavar="SENSOR.YAML")]
_Out = Annotated[Path | None, tyro.conf.arg(metavar="NEW.YAML")]
_Channels = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")]
_Gravity = Annotated[float | None, tyro.conf.arg(metavar="G")]


def _check_direction(name: str, direction: tuple[float, float, float]) -> None:
    vector(name, direction, 3, "")
    if not 1e-3 < math.hypot(*direction) < 1e3:
        raise InvalidValueError(f"{name} = {direction}: must be a direction, with a length from 1e-3 to 1e3")


def _check_names(name: str, channels: tuple[str, ...]) -> None:
    for i, channel in enumerate(channels):
        if channel in channels[:i]:
            raise InvalidValueError(f"{name}: {channel!r} is there twice; each channel has its own column")


def _check_tip_center(name: str, center: tuple[float, float, float]) -> None:
    vector(name, center, 3, "m")
    if math.hypot(*center) > _MAX_TIP:
        raise InvalidValueError(f"{name} = {center}: must be at most {_MAX_TIP:g} m away; millimetres?")


def _check_raw_range(name: str, limits: tuple[float, float]) -> None:
    low, high = limits
    if not -MAX_RAW <= low < high <= MAX_RAW:
        raise InvalidValueError(
            f"{name} = {low:g} {high:g}: give the lower one first, at most {MAX_RAW:g} in size"
        )


@dataclass(frozen=True, slots=True)
class MatrixConfig:
    """Find the calibration matrix from known loads.

    Input: CSV with a header line, then one load per line (or several of one load: they are averaged). Columns by
    name, in any order: the raw channels raw_0, raw_1, ... (six or more; optionally with their unit, as in
    raw_0_V; or others, see --channels), and the known load fx, fy, fz, mx, my, mz, optionally with units as in
    fx_N, mx_mNm (without: N and N m). The load is what acts on the tip side of the sensor, about its origin. Or
    weights in known poses: mass_kg (or mass_g), the centre of mass in the sensor frame com_x_m, com_y_m, com_z_m
    (or _mm), and a pose as `palpate calibrate payload` takes it. A column temperature_C becomes part of the model
    if it explains something. In all directions, of both signs, and in the order in which they were taken, best a
    random one: 24 or more are wise, 14 the least that can be tested; of a sensor that is not linear, 60 or more.

    Three models are held against each other by loads that they never saw: the sensor itself, direct regression,
    and that with products of channels if the loads ask for them. The best goes into the sensor file; the old file
    is kept as SENSOR.YAML.bak. The bias is zero again: tare afterwards. A calibration that is not to be used, as
    one that does not predict loads that were left out, ends with exit code 1, and the file stays as it was.

    Example: palpate calibrate matrix --loads loads.csv --sensor sensor.yaml --raw-unit V --raw-range -10 10

    Example: palpate calibrate matrix --loads loads.csv --sensor sensor.yaml --report loads.html --tip-radius 0.008
    """

    loads: Annotated[Path, tyro.conf.arg(metavar="LOADS.CSV")]
    """CSV file with raw channels and known loads."""
    sensor: _Sensor
    """Sensor file to update; `palpate calibrate new` makes a first one."""
    out: _Out = None
    """Write here instead, and leave the sensor file as it is."""
    channels: _Channels = option((), check=_check_names)
    """Names of the raw channels' columns, in the device's order. Left out: raw_0, raw_1, ..."""
    raw_unit: Annotated[str, tyro.conf.arg(metavar="UNIT")] = ""
    """Unit of the raw channels ("V", "counts"). Left out: as in the header, or in the sensor file."""
    raw_range: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="LOW HIGH")] = option(
        None, "raw", check=_check_raw_range
    )
    """Lowest and highest reading that is not saturated [raw unit]. Left out: as in the sensor file."""
    temperature: Annotated[float | None, tyro.conf.arg(metavar="C")] = option(
        None, "degrees Celsius", within=_TEMPERATURES
    )
    """Temperature of the sensor in use [degrees Celsius], at which the calibration is to hold; the file needs a
    column temperature_C. Left out: the mean of that column."""
    rotation: RotationOrder = "base-from-sensor"
    """With weights in poses: mapping of rotations and quaternions."""
    up: tuple[float, float, float] = option((0.0, 0.0, 1.0), check=_check_direction)
    """With weights in poses: upward direction in base coordinates."""
    gravity: _Gravity = option(None, "m/s^2", bound="positive")
    """With weights in poses: local g [m/s^2]. Left out: 9.80665."""
    report: Annotated[Path | None, tyro.conf.arg(metavar="REPORT.HTML")] = None
    """Write a report, too: models, residuals, and the uncertainty of contacts."""
    tip_radius: Annotated[float | None, tyro.conf.arg(metavar="R")] = option(
        None, "m", bound="positive", within=(0.0, _MAX_TIP), remark="; millimetres?"
    )
    """With --report: radius of the round fingertip that the sensor is to carry [m]. Left out: 0.01."""
    tip_center: tuple[float, float, float] = option((0.0, 0.0, 0.02), check=_check_tip_center)
    """With --report: centre of that fingertip in the sensor frame [m]."""

    def __post_init__(self) -> None:
        check_options(self)

    def run(self) -> "CommandResult":
        """Find the calibration, print its quality, and put it into the sensor file."""
        from palpate.commands.calibrate.matrix import calibrate_matrix

        return calibrate_matrix(self)


@dataclass(frozen=True, slots=True)
class _PosesConfig:
    """Options of calibrations from static poses."""

    poses: Annotated[Path, tyro.conf.arg(metavar="POSES.CSV")]
    """CSV file with poses and wrenches."""
    sensor: _Sensor
    """Sensor file to update; `palpate calibrate new` makes a first one."""
    out: _Out = None
    """Write here instead, and leave the sensor file as it is."""
    up: tuple[float, float, float] = option((0.0, 0.0, 1.0), check=_check_direction)
    """Upward direction in base coordinates: not z for a robot on a wall."""
    gravity: _Gravity = option(None, "m/s^2", bound="positive")
    """Local g [m/s^2]: 9.780 at the equator to 9.832 at the poles. Left out: 9.80665, and the mass is uncertain by
    0.15 % on this account."""
    averaged: int = option(1, within=(1, _MAX_AVERAGED))
    """Number of readings that each row is the average of: the noise falls with the square root of this number."""
    channels: _Channels = option((), check=_check_names)
    """Names of the raw channels' columns, in the device's order. Left out: raw_0, raw_1, ..."""

    def __post_init__(self) -> None:
        check_options(self)


@dataclass(frozen=True, slots=True)
class PayloadConfig(_PosesConfig):
    """Find mass, centre of mass and bias from static poses.

    Input: CSV with a header line, then one pose per line, at rest and without contact. Columns by name: the wrench
    fx, fy, fz, mx, my, mz as the sensor shows it, no bias taken off, optionally with units as in fx_N, mx_mNm (or
    raw channels raw_0, raw_1, ..., if the sensor file has a calibration), and the pose as one of
    gx, gy, gz (direction of gravity, downwards, in the sensor frame, any length);
    qw, qx, qy, qz (a quaternion) or
    r00, r01, ..., r22 (a rotation matrix by rows), which map sensor to base coordinates, as robots give their
    tool's orientation (see --rotation).

    Eight poses are the least, best are the six sides of a cube, and more, opposite ones in turn. Rows stand in
    the order in which they were taken: a zero that drifts or jumps meanwhile becomes part of the model, and up to
    5 % bad poses are left out and named. Poses that leave something undetermined are refused (exit code 2); if an
    assumption does not hold, as with contact, wrong poses, or fewer than eight, it is named (exit code 1). The
    sensor file then stays as it was; otherwise it is updated, and the old one kept as SENSOR.YAML.bak.

    Example: palpate calibrate payload --poses poses.csv --sensor sensor.yaml
    """

    rotation: RotationOrder = "base-from-sensor"
    """Mapping of rotations and quaternions: from sensor to base coordinates, or the inverse."""

    def run(self) -> "CommandResult":
        """Find payload and bias, print them, and put them into the sensor file."""
        from palpate.commands.calibrate.run import calibrate_payload

        return calibrate_payload(self)


@dataclass(frozen=True, slots=True)
class MountingConfig(_PosesConfig):
    """Find how the sensor is turned on the flange, with mass, centre of mass and bias, from static poses.

    Input: as for `palpate calibrate payload`, but with the orientation of the robot's flange, as the controller
    gives it (qw, qx, qy, qz or r00, ..., r22): 12 poses or more, the flange turned over, opposite orientations in
    turn, each an average of some hundred readings (--averaged). Calibrate and check the matrix before: 1 % of
    cross-talk looks like half a degree. Axes that are swapped, mirrored or left-handed are refused, and named.

    Prints the rotation, as `tcp: {rotvec_rad: ...}` of a robot's arm takes it (the axes of its tip frame are the
    sensor's), and puts payload and bias into the sensor file; the old file is kept as SENSOR.YAML.bak.

    Example: palpate calibrate mounting --poses poses.csv --sensor sensor.yaml --averaged 500
    """

    rotation: FlangeOrder = "base-from-flange"
    """Mapping of rotations and quaternions: from flange to base coordinates, or the inverse."""

    def run(self) -> "CommandResult":
        """Find the rotation, print it, and put payload and bias into the sensor file."""
        from palpate.commands.calibrate.run import calibrate_mounting

        return calibrate_mounting(self)


@dataclass(frozen=True, slots=True)
class TareConfig:
    """Find the bias from readings at rest: from a CSV file, or live.

    Input of --readings: CSV with a header line, then 100 or more equally spaced readings at rest, nothing touched.
    Columns by name: fx, fy, fz, mx, my, mz as the sensor shows them, no bias taken off, optionally with units as
    in fx_N, mx_mNm; or raw channels raw_0, raw_1, ..., if the sensor file has a calibration.

    Live: --robot takes them from the first sensor of a robot that stands still, whose arm measures its
    orientation. --live stage runs the simulated stage, which stands still above an object and carries the payload
    that the sensor file names, to try it out, with a bias of your choice (--unknown-bias).

    The weight of the payload in the sensor file is taken off. Readings that moved or drifted are refused (exit
    code 2), and the sensor file stays as it was; otherwise it is updated, and the old one kept as SENSOR.YAML.bak.

    Example: palpate calibrate tare --readings rest.csv --sensor sensor.yaml --gravity-direction 0 0 -1

    Example: palpate calibrate tare --robot cell.yaml --sensor sensor.yaml --learn-noise

    Example: palpate calibrate tare --live stage --sensor sensor.yaml --unknown-bias 0.1 -0.2 0.3 0.001 0 0.002
    """

    sensor: _Sensor
    """Sensor file to update; `palpate calibrate new` makes a first one."""
    readings: Annotated[Path | None, tyro.conf.arg(metavar="REST.CSV")] = None
    """CSV file with readings at rest."""
    live: Annotated[Literal["stage"] | None, tyro.conf.arg(metavar="stage")] = None
    """Take readings now: stage is the simulated one."""
    robot: Annotated[str | None, tyro.conf.arg(metavar="ROBOT")] = None
    """Take readings now, of a robot file of kind `rig`, or an emulated robot. Nothing may be touched."""
    out: _Out = None
    """Write here instead, and leave the sensor file as it is."""
    gravity_direction: Annotated[tuple[float, float, float] | None, tyro.conf.arg(metavar="X Y Z")] = option(
        None, check=_check_direction
    )
    """With --readings: direction of gravity in the sensor frame; needed if the sensor carries a payload."""
    gravity: float = option(9.80665, "m/s^2", bound="positive")
    """Local g [m/s^2], for the payload's weight."""
    learn_noise: bool = False
    """Take the noise of the sensor from these readings, too, instead of holding them against the sensor file's:
    for the first tare of a new sensor. Whether they moved is then judged by their trend alone."""
    channels: _Channels = option((), check=_check_names)
    """Names of the raw channels' columns, in the device's order. Left out: raw_0, raw_1, ..."""
    duration: float = option(2.0, "s", bound="positive", within=(-math.inf, _MAX_TARE_TIME))
    """With --live or --robot: how long to take readings [s]."""
    force_noise: Annotated[float | None, tyro.conf.arg(metavar="SD")] = option(None, "N", bound="not negative")
    """With --live stage: standard deviation of the force noise [N]. Left out: as in the sensor file."""
    moment_noise: Annotated[float | None, tyro.conf.arg(metavar="SD")] = option(None, "N m", bound="not negative")
    """With --live stage: standard deviation of the moment noise [N m]. Left out: as in the sensor file."""
    unknown_bias: Annotated[
        tuple[float, float, float, float, float, float] | None, tyro.conf.arg(metavar="FX FY FZ MX MY MZ")
    ] = None
    """With --live stage: bias of the simulated sensor [N, N m], which the tare should find."""
    seed: int = 0
    """With --live stage: seed of the noise."""

    def __post_init__(self) -> None:
        check_options(self)
        given = sum(source is not None for source in (self.readings, self.live, self.robot))
        if given != 1:
            found = ("none", "", "both", "all")[given]
            raise InvalidValueError(
                f"{found} given of --readings REST.CSV, --live stage and --robot ROBOT: give one"
            )
        for name in ("force_noise", "moment_noise", "unknown_bias"):
            if self.live is None and getattr(self, name) is not None:
                raise InvalidValueError(f"{name} is for --live stage only: leave it out otherwise")
        if self.readings is None and self.gravity_direction is not None:
            raise InvalidValueError("gravity_direction is for --readings only: a live back end measures it")
        if self.unknown_bias is not None:
            vector("unknown_bias", self.unknown_bias, 6, "N, N m")

    def run(self) -> "CommandResult":
        """Find the bias, print it, and put it into the sensor file."""
        from palpate.commands.calibrate.run import tare

        return tare(self)


@dataclass(frozen=True, slots=True)
class NewSensorConfig:
    """Make a first sensor file, with comments and units, to start from.

    The presets are those of robot files: nano17 is a fingertip sensor (ATI Nano17 SI-12-0.12); axia80 (ATI
    Axia80-M20 SI-500-20) and ft300s (Robotiq FT 300-S) are for a robot's wrist, and ur5e is in a UR5e's flange.
    Ranges are the maker's; read the provenance in the file, and edit what your sensor differs in. A file that is
    there is not replaced.

    Example: palpate calibrate new sensor.yaml --preset nano17 --serial-number FT01234
    """

    file: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="SENSOR.YAML")]
    """File to make."""
    preset: PresetName
    """Kind of sensor."""
    serial_number: str = "unknown"
    """Serial number of your sensor."""

    def run(self) -> "CommandResult":
        """Write the file."""
        from palpate.commands.calibrate.run import new_sensor

        return new_sensor(self)
