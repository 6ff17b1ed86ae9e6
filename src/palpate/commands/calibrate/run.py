"""`palpate calibrate`: identifies the values of a sensor file, from data or live."""

import contextlib
import datetime
import math
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.text import Text

from palpate.atomic_file import replacing
from palpate.commands.calibrate.config import (
    CalibrateConfig,
    MatrixConfig,
    NewSensorConfig,
    PayloadConfig,
    TareConfig,
)
from palpate.commands.calibrate.data import (
    CsvData,
    has_raw,
    has_wrenches,
    measured_poses,
    raw_readings,
    read_csv,
    wrenches,
)
from palpate.commands.calibrate.figures import bias_figures, calibration_figures, payload_figures, verdict_facts
from palpate.commands.calibrate.live import robot_backend, stage_backend, take_readings
from palpate.commands.calibrate.sensor_presets import preset_sensor
from palpate.commands.calibrate.tables import UNITS, bias_table, calibration_table, payload_table
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import BrokenAssumption, Verdict
from palpate.experiments.kit.output_folder import check_file
from palpate.sensing.ft import (
    FTPipeline,
    IdentifiedPayload,
    SensorFile,
    average_bias,
    bias_covariance,
    estimate_drift,
    fit_calibration,
    identify_payload,
    load_sensor_file,
    save_sensor_file,
    specific_force_from_gravity,
    touch_uncertainty,
    with_bias,
    with_calibration,
    with_payload,
)
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.bias import MOVED_FACTOR
from palpate.sensing.ft.calibration_checks import contradicted_axes
from palpate.sensing.ft.pose_mistakes import likely_mistake
from palpate.sensing.ft.poses import GRAVITY_SD, STANDARD_GRAVITY
from palpate.spatial import ZERO, Vector, Wrench

SURE_TOUCH = 4.0
"""Standard deviations: what is felt in the air exceeds them once in 16 000 poses."""

LONGEST_PROVENANCE = 1000
"""Characters, of a sensor file."""


def run_calibrate(config: CalibrateConfig) -> CommandResult:
    """Calibrate, print the result and update the sensor file; returns the result.

    Raises:
        InvalidValueError: The input is wrong, or what it gives cannot be relied on; the sensor file is as it was.
        OSError: The sensor file cannot be written; it is as it was.
    """
    console = Console(highlight=False, soft_wrap=True)
    match config:
        case NewSensorConfig():
            return _new(config, console)
        case MatrixConfig():
            return _matrix(config, console)
        case PayloadConfig():
            return _payload(config, console)
        case TareConfig():
            return _tare(config, console)


# --- a first file ------------------------------------------------------------------------------------------------


def _new(config: NewSensorConfig, console: Console) -> CommandResult:
    sensor = preset_sensor(config.preset, config.serial_number)
    if config.file.exists():
        raise InvalidValueError(f"{config.file} is there already: give another name, or remove it first")
    check_file(config.file, option=None)
    save_sensor_file(config.file, sensor)
    console.print(Text(f"Written: {config.file}. Read its provenance, and edit what your sensor differs in."))
    return CommandResult(
        facts={"model": sensor.model, "serial_number": sensor.serial_number}, files=(config.file,)
    )


# --- calibration matrix ------------------------------------------------------------------------------------------


def _matrix(config: MatrixConfig, console: Console) -> CommandResult:
    sensor = _loaded(config.sensor)
    check_file(_target(config))
    _refuse_overwriting(config.out, config.loads)
    data = read_csv(config.loads)
    known = sensor.calibration
    raw_range = config.raw_range or (known.raw_range if known else None)
    if raw_range is None:
        raise InvalidValueError(
            f"raw_range: neither given nor in {config.sensor}; give --raw-range LOW HIGH, for instance -10 10"
        )
    raw, header_unit = raw_readings(data, config.channels, raw_range)
    if config.raw_unit and header_unit and config.raw_unit != header_unit:
        raise InvalidValueError(f"raw_unit = {config.raw_unit}: the header of {config.loads} has {header_unit}")
    raw_unit = config.raw_unit or header_unit or (known.raw_unit if known else "")
    if not raw_unit:
        raise InvalidValueError(
            f"raw_unit: neither given, nor in the header of {config.loads}, nor in {config.sensor}; give it, for "
            "instance --raw-unit V"
        )
    loads = wrenches(data, sensor.axis_limits)
    for j, same in enumerate((raw == raw[0]).all(axis=0)):
        if same:
            raise InvalidValueError(
                f"{config.loads}: raw channel {j + 1} of {raw.shape[1]} shows {raw[0, j]:g} in every row; is it "
                "dead?"
            )
    with _named(config.loads):
        fit = fit_calibration(raw, loads, ranges=sensor.axis_limits)
    verdict = fit.verdict
    if known is not None:
        verdict = verdict.and_also(contradicted_axes(known.map, raw, loads, np.array(sensor.axis_limits)))
    console.print(calibration_table(fit, sensor, raw_unit, verdict))
    if not verdict.ok:
        return _not_used(verdict, calibration_figures(fit), console)
    with _named(config.loads):
        updated = with_calibration(
            sensor,
            fit,
            raw_unit=raw_unit,
            raw_range=raw_range,
            date=_today(),
            provenance=_provenance(sensor, f"matrix: {len(loads)} known loads, {config.loads.name}"),
        )
    files, warnings = _write(_target(config), updated, console)
    return _used(verdict, calibration_figures(fit), files, warnings)


# --- payload -----------------------------------------------------------------------------------------------------


def _payload(config: PayloadConfig, console: Console) -> CommandResult:
    sensor = _loaded(config.sensor)
    check_file(_target(config))
    _refuse_overwriting(config.out, config.poses)
    data = read_csv(config.poses)
    rows, source = _measured(data, sensor, config.channels)

    poses = measured_poses(data, config.rotation, config.up, config.gravity or STANDARD_GRAVITY)

    def identify(specific_force: FloatArray, wrench: FloatArray) -> IdentifiedPayload:
        return identify_payload(
            specific_force,
            wrench,
            force_sd=max(sensor.noise_force) / math.sqrt(config.averaged),
            moment_sd=max(sensor.noise_moment) / math.sqrt(config.averaged),
            gravity_sd=GRAVITY_SD if config.gravity is None else 0.0,
        )

    def mistake(as_read: IdentifiedPayload | None) -> tuple[BrokenAssumption, ...]:
        if poses.rotation_sensor_base is None:
            return ()
        gravity = config.gravity or STANDARD_GRAVITY
        R = poses.rotation_sensor_base
        found = likely_mistake(R, rows, as_read, identify, gravity=gravity, up_base=config.up)
        return () if found is None else (found,)

    with _named(config.poses):
        try:
            found = identify(poses.specific_force, rows)
        except InvalidValueError as error:
            raise InvalidValueError("; ".join(map(str, (error, *mistake(None))))) from None
    console.print(payload_table(found, source))
    lost = found.payload.mass == 0.0
    verdict = found.verdict if found.verdict.ok and not lost else Verdict(mistake(found)).and_also(found.verdict)
    if not verdict.ok:
        return _not_used(verdict, payload_figures(found), console)
    with _named(config.poses):
        updated = with_payload(
            sensor,
            found,
            date=_today(),
            provenance=_provenance(sensor, f"payload: {found.pose_count} poses, {config.poses.name}"),
        )
    files, warnings = _write(_target(config), updated, console)
    if lost:
        warnings += _noted("the mass is lost in the noise; the file now has no payload.", console)
    if found.zero.bad:
        left = ", ".join(map(str, sorted(data.lines[i] for i in found.zero.bad)))
        warnings += _noted(f"left out, as far from all others: line {left} of {config.poses.name}.", console)
    if found.zero.moves:
        warnings += _noted(
            f"the zero moved by {found.zero_span_force:.2g} N and {found.zero_span_moment:.2g} N m during the "
            "poses: tare before use.",
            console,
        )
    return _used(found.verdict, payload_figures(found), files, warnings)


# --- tare --------------------------------------------------------------------------------------------------------


def _tare(config: TareConfig, console: Console) -> CommandResult:
    sensor = _loaded(config.sensor)
    check_file(_target(config))
    if config.readings is not None:
        _refuse_overwriting(config.out, config.readings)
        specific_force = _specific_force(config, sensor)
        rows, source = _measured(read_csv(config.readings), sensor, config.channels)
        place, period = str(config.readings), 1.0 / sensor.sample_rate
    elif config.robot is not None:
        with robot_backend(config.robot) as backend:
            rows, specific_force = take_readings(backend, config.duration)
        period, place, source = config.duration / len(rows), f"robot {config.robot}", "wrenches"
        _refuse_overload(rows, sensor)
    else:
        backend = stage_backend(config, sensor)
        period, place, source = backend.period, "simulated stage", "wrenches"
        rows, specific_force = take_readings(backend, config.duration)
        _refuse_overload(rows, sensor)
    with _named(place):
        noise = _learned_noise(rows) if config.learn_noise else sensor.noise
        found = average_bias(rows, noise=noise)
        drift = estimate_drift(rows, period=period, limit=MOVED_FACTOR / (period * len(rows)) * np.array(noise))
    if config.learn_noise:
        sensor = msgspec.structs.replace(sensor, noise_force=noise[:3], noise_moment=noise[3:])
    sd = np.sqrt(np.diag(bias_covariance(sensor, found, specific_force)))
    verdict = found.verdict.and_also(drift.verdict)
    with _named(place):
        updated = with_bias(
            sensor,
            found,
            specific_force,
            date=_today(),
            provenance=_provenance(sensor, f"bias: {found.reading_count} readings, {Path(place).name}"),
        )
    console.print(bias_table(found, drift, sd, sensor, updated, f"{place}, {source}"))
    figures = bias_figures(found, drift, sd, updated)
    if not verdict.ok:
        return _not_used(verdict, figures, console)
    files, warnings = _write(_target(config), updated, console)
    if not any(found.sd):
        warnings += _noted("the readings do not change at all; is the sensor alive?", console)
    turned = SURE_TOUCH * touch_uncertainty(sensor, found, specific_force)
    if turned > sensor.contact.touch_force:
        warnings += _noted(
            f"the payload's weight is uncertain: turned over, the tip may feel {turned:.2g} N in the air, more "
            f"than touch_force_N = {sensor.contact.touch_force:g}; raise it, or take more poses of the payload.",
            console,
        )
    return _used(verdict, figures, files, warnings)


def _specific_force(config: TareConfig, sensor: SensorFile) -> Vector:
    if config.gravity_direction is not None:
        x, y, z = specific_force_from_gravity([config.gravity_direction], gravity=config.gravity)[0].tolist()
        return (x, y, z)
    if sensor.payload.mass > 0.0:
        raise InvalidValueError(
            f"gravity_direction: not given, but the sensor carries {sensor.payload.mass:g} kg, whose weight must "
            "come off; give the direction of gravity in the sensor frame, for instance --gravity-direction 0 0 -1"
        )
    return ZERO


def _learned_noise(rows: FloatArray) -> Wrench:
    sd = rows.std(axis=0, ddof=1) if len(rows) > 1 else np.zeros(6)
    if not (sd > 0.0).all():
        dead = AXES[int(np.argmin(sd))]
        raise InvalidValueError(
            f"the readings of {dead} do not change at all: no noise to learn; is the sensor alive?"
        )
    a, b, c, d, e, f = sd.tolist()
    return (a, b, c, d, e, f)


def _refuse_overload(rows: FloatArray, sensor: SensorFile) -> None:
    bad = np.argwhere(~(np.abs(rows) <= np.array(sensor.axis_limits)))
    if len(bad):
        i, j = bad[0].tolist()
        raise InvalidValueError(
            f"reading {i}: {AXES[j]} = {rows[i, j]:g} {UNITS[j]} is beyond the sensor's range of "
            f"{sensor.axis_limits[j]:g}"
        )


# --- what the tasks share ----------------------------------------------------------------------------------------


def _used(
    verdict: Verdict, figures: dict[str, object], files: tuple[Path, ...], warnings: tuple[str, ...]
) -> CommandResult:
    return CommandResult(
        outcome=str(verdict), figures=figures, facts=verdict_facts(verdict), files=files, warnings=warnings
    )


def _not_used(verdict: Verdict, figures: dict[str, object], console: Console) -> CommandResult:
    """Print why an estimate is not to be used; no file is written."""
    for line in verdict.lines():
        console.print(Text(line))
    console.print(Text("Not to be used: no file was written."))
    return CommandResult(ExitCode.UNFINISHED, str(verdict), figures, facts=verdict_facts(verdict))


def _measured(data: CsvData, sensor: SensorFile, channels: tuple[str, ...]) -> tuple[FloatArray, str]:
    """Return calibrated wrenches, shape (n, 6), and from what: raw channels are calibrated as in `FTPipeline`."""
    entry = sensor.calibration
    if has_raw(data, channels) and entry is not None:
        raw, unit = raw_readings(data, channels, entry.raw_range)
        if raw.shape[1] != entry.map.channels:
            raise data.wrong_header(f"{raw.shape[1]} raw channels, but the sensor file has {entry.map.channels}")
        if unit and unit != entry.raw_unit:
            raise data.wrong_header(f"raw channels in {unit}, but the sensor file has {entry.raw_unit}")
        rows = entry.map.apply(raw)
        _refuse_overload(rows, sensor)
        return rows, "raw channels"
    if has_raw(data, channels) and not has_wrenches(data):
        raise data.wrong_header(
            "raw channels only, and the sensor file has no calibration; find it first by palpate calibrate matrix"
        )
    return wrenches(data, sensor.axis_limits), "wrenches"


def _loaded(path: Path) -> SensorFile:
    try:
        return load_sensor_file(path)
    except OSError as error:
        raise InvalidValueError(
            f"cannot read sensor file {path}: {error.strerror}; `palpate calibrate new` makes a first one"
        ) from None


def _target(config: MatrixConfig | PayloadConfig | TareConfig) -> Path:
    """Where the updated sensor file goes."""
    return config.out or config.sensor


def _refuse_overwriting(out: Path | None, source: Path) -> None:
    if out is not None and out.exists() and source.exists() and out.samefile(source):
        raise InvalidValueError(f"out = {out}: is the input; give another file")


@contextlib.contextmanager
def _named(place: Path | str) -> Iterator[None]:
    """Prefix the library's messages about data with their place."""
    try:
        yield
    except InvalidValueError as error:
        raise InvalidValueError(f"{place}: {error}") from None


def _write(target: Path, sensor: SensorFile, console: Console) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Write the sensor file whole or not at all; a file that is there is kept as .bak.

    Returns:
        The files, and what was noted.
    """
    kept = ""
    files: tuple[Path, ...] = (target,)
    if target.exists():
        backup = target.with_name(target.name + ".bak")
        with replacing(backup) as file:
            file.write(target.read_bytes())
        kept, files = f"; as it was: {backup}", (target, backup)
    save_sensor_file(target, sensor)
    console.print(Text(f"Written: {target}{kept}"))
    try:
        FTPipeline(sensor)
    except InvalidValueError as error:
        return files, _noted(f"before use, edit the file: {error}", console)
    return files, ()


def _noted(what: str, console: Console) -> tuple[str]:
    console.print(Text(f"Note: {what}"))
    return (what,)


def _today() -> str:
    return datetime.date.today().isoformat()


def _provenance(sensor: SensorFile, what: str) -> str:
    """Return the newest step before the older ones, cut to what a sensor file takes."""
    printable = "".join(letter if letter.isprintable() else "?" for letter in what)
    return f"{printable} ({_today()}); {sensor.provenance}"[:LONGEST_PROVENANCE]
