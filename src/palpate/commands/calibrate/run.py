"""`palpate calibrate`: identifies the values of a sensor file, from data or live."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.text import Text
from scipy.spatial.transform import Rotation

from palpate.commands.calibrate.config import (
    CalibrateConfig,
    MatrixConfig,
    MountingConfig,
    NewSensorConfig,
    PayloadConfig,
    TareConfig,
)
from palpate.commands.calibrate.data import read_csv
from palpate.commands.calibrate.live import robot_backend, stage_backend, take_readings
from palpate.commands.calibrate.matrix import calibrate_matrix
from palpate.commands.calibrate.metrics import bias_metrics, mounting_metrics, payload_metrics
from palpate.commands.calibrate.sensor_presets import preset_sensor
from palpate.commands.calibrate.static_poses import identified, read_poses, zero_moved
from palpate.commands.calibrate.steps import (
    loaded,
    measured,
    named,
    not_used,
    noted,
    provenance,
    refuse_overload,
    refuse_overwriting,
    target,
    today,
    used,
    write,
)
from palpate.commands.calibrate.tables import bias_table, mounting_table, payload_table
from palpate.commands.command_result import CommandResult
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import BrokenAssumption, Verdict
from palpate.experiments.kit.checks import check_file
from palpate.sensing.ft import (
    IdentifiedMounting,
    IdentifiedPayload,
    SensorFile,
    average_bias,
    bias_covariance,
    estimate_drift,
    identify_mounting,
    identify_payload,
    save_sensor_file,
    specific_force_from_gravity,
    touch_uncertainty,
    with_bias,
    with_payload,
)
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.bias import MOVED_FACTOR
from palpate.spatial import ZERO, Vector, Wrench

SURE_TOUCH = 4.0
"""Standard deviations: what is felt in the air exceeds them once in 16 000 poses."""


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
            return calibrate_matrix(config, console)
        case PayloadConfig():
            return _payload(config, console)
        case MountingConfig():
            return _mounting(config, console)
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


# --- payload -----------------------------------------------------------------------------------------------------


def _payload(config: PayloadConfig, console: Console) -> CommandResult:
    read = read_poses(config)

    def identify(specific_force: FloatArray, wrench: FloatArray) -> IdentifiedPayload:
        return identify_payload(specific_force, wrench, **read.noise)

    with named(config.poses):
        found = identified(
            identify, read.poses.specific_force, read.wrenches, lambda: read.mistakes(None, identify)
        )
    console.print(payload_table(found, read.source))
    lost = found.payload.mass == 0.0
    verdict = found.verdict
    if lost or not verdict.ok:
        verdict = Verdict(read.mistakes(found, identify)).and_also(verdict)
    if not verdict.ok:
        return not_used(verdict, payload_metrics(found), console)
    with named(config.poses):
        updated = with_payload(
            read.sensor,
            found,
            date=today(),
            provenance=provenance(read.sensor, f"payload: {found.pose_count} poses, {config.poses.name}"),
        )
    files, warnings = write(target(config), updated, console)
    if lost:
        warnings += noted("the mass is lost in the noise; the file now has no payload.", console)
    if found.zero.bad:
        left = ", ".join(map(str, sorted(read.data.lines[i] for i in found.zero.bad)))
        warnings += noted(f"left out, as far from all others: line {left} of {config.poses.name}.", console)
    warnings = (*warnings, *zero_moved(found, console))
    return used(found.verdict, payload_metrics(found), files, warnings)


# --- mounting ----------------------------------------------------------------------------------------------------


def _mounting(config: MountingConfig, console: Console) -> CommandResult:
    """Find the rotation, print it, and put payload and bias into the sensor file."""
    read = read_poses(config)
    if read.poses.rotation_sensor_base is None:
        raise read.data.wrong_header(
            "gx, gy, gz say where gravity points in the sensor; give the flange's orientation as qw,qx,qy,qz or "
            "r00,r01,...,r22"
        )

    def identify(specific_force: FloatArray, wrench: FloatArray) -> IdentifiedMounting:
        return identify_mounting(specific_force, wrench, **read.noise)

    def mistakes(as_read: IdentifiedPayload | None) -> tuple[BrokenAssumption, ...]:
        return read.mistakes(as_read, lambda a, w: _judged(identify(a, w)))

    with named(config.poses):
        found = identified(identify, read.poses.specific_force, read.wrenches, lambda: mistakes(None))
    if found.verdict.ok and found.payload.payload.mass == 0.0:
        raise InvalidValueError(f"{config.poses}: the mass is lost in the noise: carry something heavier")
    console.print(mounting_table(found))
    console.print(payload_table(found.payload, read.source))
    metrics = mounting_metrics(found)
    if not found.verdict.ok:
        verdict = Verdict(mistakes(_judged(found))).and_also(found.verdict)
        return not_used(verdict, metrics, console)
    rotvec = Rotation.from_matrix(found.rotation_flange_sensor).as_rotvec()
    console.print(
        Text(
            "For the robot file, beside the tip's position_m: tcp: {rotvec_rad: ["
            f"{', '.join(f'{x:.6f}' for x in rotvec)}]}}. "
            f"Its angle is {np.degrees(np.linalg.norm(rotvec)):.4g} degrees; hold it against the drawing."
        )
    )
    with named(config.poses):
        updated = with_payload(
            read.sensor,
            found.payload,
            date=today(),
            provenance=provenance(
                read.sensor, f"mounting, payload: {found.payload.pose_count} poses, {config.poses.name}"
            ),
        )
    files, warnings = write(target(config), updated, console)
    return used(found.verdict, metrics, files, (*warnings, *zero_moved(found.payload, console)))


def _judged(found: IdentifiedMounting) -> IdentifiedPayload:
    """Return the payload with the verdict on all of it."""
    return replace(found.payload, verdict=found.verdict)


# --- tare --------------------------------------------------------------------------------------------------------


def _tare(config: TareConfig, console: Console) -> CommandResult:
    sensor = loaded(config.sensor)
    check_file(target(config))
    if config.readings is not None:
        refuse_overwriting(config.out, config.readings)
        specific_force = _specific_force(config, sensor)
        rows, source = measured(read_csv(config.readings), sensor, config.channels)
        place, period = str(config.readings), 1.0 / sensor.sample_rate
    elif config.robot is not None:
        with robot_backend(config.robot) as backend:
            rows, specific_force = take_readings(backend, config.duration)
        period, place, source = config.duration / len(rows), f"robot {config.robot}", "wrenches"
        refuse_overload(rows, sensor)
    else:
        backend = stage_backend(config, sensor)
        period, place, source = backend.period, "simulated stage", "wrenches"
        rows, specific_force = take_readings(backend, config.duration)
        refuse_overload(rows, sensor)
    with named(place):
        noise = _learned_noise(rows) if config.learn_noise else sensor.noise
        found = average_bias(rows, noise=noise)
        drift = estimate_drift(rows, period=period, limit=MOVED_FACTOR / (period * len(rows)) * np.array(noise))
    if config.learn_noise:
        sensor = msgspec.structs.replace(sensor, noise_force=noise[:3], noise_moment=noise[3:])
    sd = np.sqrt(np.diag(bias_covariance(sensor, found, specific_force)))
    verdict = found.verdict.and_also(drift.verdict)
    with named(place):
        updated = with_bias(
            sensor,
            found,
            specific_force,
            date=today(),
            provenance=provenance(sensor, f"bias: {found.reading_count} readings, {Path(place).name}"),
        )
    console.print(bias_table(found, drift, sd, sensor, updated, f"{place}, {source}"))
    metrics = bias_metrics(found, drift, sd, updated)
    if not verdict.ok:
        return not_used(verdict, metrics, console)
    files, warnings = write(target(config), updated, console)
    if not any(found.sd):
        warnings += noted("the readings do not change at all; is the sensor alive?", console)
    turned = SURE_TOUCH * touch_uncertainty(sensor, found, specific_force)
    if turned > sensor.contact.touch_force:
        warnings += noted(
            f"the payload's weight is uncertain: turned over, the tip may feel {turned:.2g} N in the air, more "
            f"than touch_force_N = {sensor.contact.touch_force:g}; raise it, or take more poses of the payload.",
            console,
        )
    return used(verdict, metrics, files, warnings)


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
