"""`palpate calibrate new`, `payload`, `mounting` and `tare`: the values of a sensor file, from data or live."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.text import Text
from scipy.spatial.transform import Rotation

from palpate.commands.calibrate.config import (
    MountingConfig,
    NewSensorConfig,
    PayloadConfig,
    PresetName,
    TareConfig,
)
from palpate.commands.calibrate.measurements import (
    MeasuredPoses,
    calibrated_wrenches,
    measured_poses,
    read_measurements,
    refuse_overload,
    robot_backend,
    stage_backend,
    take_readings,
)
from palpate.commands.calibrate.results import (
    PER_AXIS,
    Row,
    finish,
    load_sensor,
    place_named,
    provenance,
    show_rows,
    today,
)
from palpate.commands.command_result import CommandResult
from palpate.csv_table import CsvTable
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Verdict
from palpate.experiments.kit.checks import check_file
from palpate.sensing.ft import (
    Butterworth,
    ContactEntry,
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
from palpate.sensing.ft.payload import TWO_SIDED
from palpate.sensing.ft.pose_mistakes import likely_mistake
from palpate.sensing.ft.poses import GRAVITY_SD, STANDARD_GRAVITY
from palpate.sensing.ft.preset_sensor import PresetSensor
from palpate.spatial import ZERO, Vector, Wrench

_TOUCH_SIGMAS = 4.0
"""Standard deviations of a force in the air, which exceeds them once in 16 000 poses."""


def _console() -> Console:
    return Console(highlight=False, soft_wrap=True)


_WRIST_POSES = "100 static poses of an ATI wrist sensor (github.com/leledeyuan00/Gravity-Compensation-F-T-sensor)"
"""Evaluated by `palpate.sensing.ft.identify_payload`: white residuals of 0.024 N and 0.57 mN m, 1.166 kg. Without
drift in the model they are 0.29 N and 1.25 mN m, and the mass 6 % more."""

_MEASURE = "measure yours: palpate calibrate tare --learn-noise"

_MEASURED_BETTER: Mapping[str, Mapping[str, object]] = {
    "nano17": {
        "provenance": "template: ranges from ATI's data sheet; noise is the data sheet's resolution, 1/320 N and "
        f"1/64 N mm ({_MEASURE}); sample rate and contact thresholds are palpate's choice",
        "sample_rate": 1000.0,
        "noise_force": (1 / 320, 1 / 320, 1 / 320),
        "noise_moment": (1e-3 / 64, 1e-3 / 64, 1e-3 / 64),
        "contact": ContactEntry(touch_force=0.05, release_force=0.025, touch_time=0.003, release_time=0.003),
    },
    "axia80": {
        "provenance": "template: ranges from ATI manual 9610-05-Ethernet Axia-09, table 4.8; noise is the white "
        f"part of {_WRIST_POSES}, 0.03 N and 0.6 mN m ({_MEASURE}); their zero drifted by 1.9 N in the first 50 "
        "and jumped by 0.3 N after them, so that the contact threshold is above that; sample rate and filter are "
        "palpate's choice",
        "sample_rate": 500.0,
        "noise_force": (0.03, 0.03, 0.03),
        "noise_moment": (6e-4, 6e-4, 6e-4),
        "filters": (Butterworth(30.0),),
        "contact": ContactEntry(touch_force=2.0, release_force=1.0, touch_time=0.01, release_time=0.01),
    },
}
"""Values of sensor files, by preset, that replace those of the simulated sensor."""


def preset_sensor(preset: PresetName, serial_number: str = "unknown") -> SensorFile:
    """Return the sensor file of a sensor as its maker describes it.

    Presets, names and ranges are those of simulated sensors in robot files.
    """
    # imported here: the simulator takes a second that the other tasks need not wait for
    from palpate.sim.sensor.description import sensor_file
    from palpate.sim.sensor.presets import UR_RATE, sensor_preset

    model = sensor_preset(PresetSensor(preset))
    rate = UR_RATE if model.clock is None else model.clock.rate
    file = sensor_file(model, 1.0 / rate, serial_number=serial_number)
    name = file.model.removesuffix(", simulated")
    own = _MEASURED_BETTER.get(preset, {"provenance": f"template: {file.provenance} ({_MEASURE})"})
    return msgspec.structs.replace(file, model=name, device_delay=0.0, device_rate=None, **own)


def new_sensor(config: NewSensorConfig) -> CommandResult:
    """Write a first sensor file.

    Raises:
        InvalidValueError: If the file exists or cannot be written.
    """
    sensor = preset_sensor(config.preset, config.serial_number)
    if config.file.exists():
        raise InvalidValueError(f"{config.file} is there already: give another name, or remove it first")
    check_file(config.file, option=None)
    save_sensor_file(config.file, sensor)
    _console().print(Text(f"Written: {config.file}. Read its provenance, and edit what your sensor differs in."))
    return CommandResult(
        facts={"model": sensor.model, "serial_number": sensor.serial_number}, files=(config.file,)
    )


# --- payload and mounting ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _PoseReadings:
    """Readings of a sensor in n static poses.

    Attributes:
        config: Options.
        sensor: Sensor file before the calibration.
        table: The file of poses.
        wrenches: Calibrated readings, shape (n, 6) [N, N m].
        source: Columns that the wrenches come from, in words.
        poses: The poses.
        gravity: Local g [m/s^2].
        noise: Standard deviations of forces [N], moments [N m] and of g, relative.
    """

    config: PayloadConfig | MountingConfig
    sensor: SensorFile
    table: CsvTable
    wrenches: FloatArray
    source: str
    poses: MeasuredPoses
    gravity: float
    noise: dict[str, float]

    def judged(
        self,
        found: IdentifiedPayload | None,
        identify: Callable[[FloatArray, FloatArray], IdentifiedPayload],
        verdict: Verdict,
    ) -> Verdict:
        """Return a verdict that begins with the likely mistake in the orientations, if there is one."""
        rotation = self.poses.rotation_sensor_base
        if rotation is None:
            return verdict
        gravity, up = self.gravity, self.config.up
        mistake = likely_mistake(rotation, self.wrenches, found, identify, gravity=gravity, up_base=up)
        return verdict if mistake is None else Verdict((mistake,)).and_also(verdict)

    @contextmanager
    def mistakes_named(self, identify: Callable[[FloatArray, FloatArray], IdentifiedPayload]) -> Iterator[None]:
        """Add the likely mistake in the orientations to the refusal of an identification."""
        try:
            yield
        except InvalidValueError as error:
            mistakes = self.judged(None, identify, Verdict()).broken
            raise InvalidValueError("; ".join([f"{self.config.poses}: {error}", *map(str, mistakes)])) from None

    def updated(self, found: IdentifiedPayload, step: str) -> SensorFile:
        """Return the sensor file with a payload."""
        origin = provenance(self.sensor, f"{step}: {found.pose_count} poses, {self.config.poses.name}")
        with place_named(self.config.poses):
            return with_payload(self.sensor, found, date=today(), provenance=origin)


def _read_poses(config: PayloadConfig | MountingConfig) -> _PoseReadings:
    sensor = load_sensor(config, config.poses)
    table = read_measurements(config.poses)
    rows, source = calibrated_wrenches(table, sensor, config.channels)
    gravity = config.gravity or STANDARD_GRAVITY
    root = math.sqrt(config.averaged)
    noise = {
        "force_sd": max(sensor.noise_force) / root,
        "moment_sd": max(sensor.noise_moment) / root,
        "gravity_sd": GRAVITY_SD if config.gravity is None else 0.0,
    }
    poses = measured_poses(table, config.rotation, config.up, gravity)
    return _PoseReadings(config, sensor, table, rows, source, poses, gravity, noise)


def calibrate_payload(config: PayloadConfig) -> CommandResult:
    """Find payload and bias, print them, and put them into the sensor file.

    Raises:
        InvalidValueError: If the input is wrong, or leaves something undetermined.
        OSError: If the sensor file cannot be written.
    """
    read, console = _read_poses(config), _console()

    def identify(specific_force: FloatArray, wrench: FloatArray) -> IdentifiedPayload:
        return identify_payload(specific_force, wrench, **read.noise)

    with read.mistakes_named(identify):
        found = identify(read.poses.specific_force, read.wrenches)
    rows = _payload_rows(found)
    show_rows(console, f"Payload and bias from {found.pose_count} poses ({read.source})", found.verdict, rows)
    lost = found.payload.mass == 0.0
    verdict = found.verdict
    if lost or not verdict.ok:
        verdict = read.judged(found, identify, verdict)
    notes = ["the mass is lost in the noise; the file now has no payload."] if lost else []
    if found.zero.bad:
        left = ", ".join(map(str, sorted(read.table.lines[i] for i in found.zero.bad)))
        notes.append(f"left out, as far from all others: line {left} of {config.poses.name}.")
    notes += _zero_notes(found)
    target = config.out or config.sensor
    return finish(console, target, verdict, rows, lambda: read.updated(found, "payload"), notes=notes)


def calibrate_mounting(config: MountingConfig) -> CommandResult:
    """Find the rotation, print it, and put payload and bias into the sensor file.

    Raises:
        InvalidValueError: If the input is wrong, or leaves something undetermined.
        OSError: If the sensor file cannot be written.
    """
    read, console = _read_poses(config), _console()
    if read.poses.rotation_sensor_base is None:
        raise read.table.columns.wrong(
            "gx, gy, gz say where gravity points in the sensor; give the flange's orientation as qw,qx,qy,qz or "
            "r00,r01,...,r22"
        )

    def identify(specific_force: FloatArray, wrench: FloatArray) -> IdentifiedMounting:
        return identify_mounting(specific_force, wrench, **read.noise)

    def judged_payload(specific_force: FloatArray, wrench: FloatArray) -> IdentifiedPayload:
        mounting = identify(specific_force, wrench)
        return replace(mounting.payload, verdict=mounting.verdict)

    with read.mistakes_named(judged_payload):
        found = identify(read.poses.specific_force, read.wrenches)
    if found.verdict.ok and found.payload.payload.mass == 0.0:
        raise InvalidValueError(f"{config.poses}: the mass is lost in the noise: carry something heavier")
    verdict = found.verdict
    if not verdict.ok:
        verdict = read.judged(replace(found.payload, verdict=verdict), judged_payload, verdict)
    rotation, payload = _mounting_rows(found), _payload_rows(found.payload)
    show_rows(console, "The sensor on the flange", found.verdict, rotation)
    title = f"Payload and bias from {found.payload.pose_count} poses ({read.source})"
    show_rows(console, title, found.payload.verdict, payload)
    if verdict.ok:
        rotvec = Rotation.from_matrix(found.rotation_flange_sensor).as_rotvec()
        console.print(
            Text(
                "For the robot file, beside the tip's position_m: tcp: {rotvec_rad: ["
                f"{', '.join(f'{x:.6f}' for x in rotvec)}]}}. "
                f"Its angle is {np.degrees(np.linalg.norm(rotvec)):.4g} degrees; hold it against the drawing."
            )
        )
    return finish(
        console,
        config.out or config.sensor,
        verdict,
        (*rotation, *payload),
        lambda: read.updated(found.payload, "mounting, payload"),
        notes=_zero_notes(found.payload),
    )


def _payload_rows(found: IdentifiedPayload) -> list[Row]:
    zero = found.zero
    jumps = f", jumps before pose {', '.join(map(str, sorted(zero.jumps)))}" if zero.jumps else ""
    bad = f", left out: pose {', '.join(map(str, sorted(zero.bad)))}" if zero.bad else ""
    span = f" over {found.zero_span_force:.2g} N" if zero.moves else ""
    mass, mass_sd = found.mass_by_differences, found.mass_by_differences_sd
    bias, bias_sd = (*found.bias_force, *found.bias_moment), np.sqrt(np.diag(found.bias_covariance))
    return [
        Row("mass", found.payload.mass, "mass", "kg", found.mass_sd, digits=5),
        Row("mass_by_differences", mass, "mass from differences of successive poses", "kg", mass_sd, digits=5),
        Row("center_of_mass", found.payload.center_of_mass, "centre of mass,", "m", found.center_sd, digits=5),
        Row("bias", bias, "bias", PER_AXIS, bias_sd, digits=5),
        Row("poses", found.pose_count),
        Row("zero_drift", str(zero.drift)),
        Row("", f"drift {zero.drift}{jumps}{span}{bad}", "zero"),
        Row("zero_jumps_before_pose", zero.jumps),
        Row("zero_span_force", found.zero_span_force, unit="N"),
        Row("zero_span_moment", found.zero_span_moment, unit="N m"),
        Row("bad_poses", zero.bad),
        Row("residual_rms_force", found.force_rms, "residual force, rms", "N"),
        Row("residual_rms_moment", found.moment_rms, "residual moment, rms", "N m"),
        Row("residuals_force", found.residuals[:, :3], unit="N"),
        Row("residuals_moment", found.residuals[:, 3:], unit="N m"),
        Row("worst_pose", found.worst_pose, "pose with the largest residual"),
        Row("chi2_force", found.force_chi2, "chi2 of forces", note="per degree of freedom; should be 1"),
        Row("chi2_moment", found.moment_chi2, "chi2 of moments", note="per degree of freedom; should be 1"),
        Row("condition", found.condition, "condition number"),
    ]


def _mounting_rows(found: IdentifiedMounting) -> list[Row]:
    R, half = found.rotation_flange_sensor, np.degrees(TWO_SIDED * found.rotation_sd)
    axes = zip("xyz", R.T, half, strict=True)
    return [
        *(
            Row(
                "",
                " ".join(f"{x:.5f}" for x in column),
                f"axis {axis} of the sensor, in the flange",
                note=f"95 %: +- {each:.2g} degrees",
            )
            for axis, column, each in axes
        ),
        Row("rotation_flange_sensor", R),
        Row("rotvec", Rotation.from_matrix(R).as_rotvec(), unit="rad"),
        Row("rotation_sd", found.rotation_sd, unit="rad"),
        Row(
            "left_over_chi2",
            found.left_over_chi2,
            "chi2 of contradictions between poses",
            note="per degree of freedom; should be 1",
        ),
    ]


def _zero_notes(found: IdentifiedPayload) -> tuple[str, ...]:
    if not found.zero.moves:
        return ()
    return (
        f"the zero moved by {found.zero_span_force:.2g} N and {found.zero_span_moment:.2g} N m during the poses: "
        "tare before use.",
    )


# --- tare --------------------------------------------------------------------------------------------------------


def tare(config: TareConfig) -> CommandResult:
    """Find the bias, print it, and put it into the sensor file.

    Raises:
        InvalidValueError: If the input is wrong, or the readings do not rest.
        OSError: If the sensor file cannot be written.
    """
    sensor, console = load_sensor(config, config.readings), _console()
    if config.readings is not None:
        specific_force = _specific_force(config, sensor)
        table = read_measurements(config.readings)
        readings, source = calibrated_wrenches(table, sensor, config.channels)
        place, period = str(config.readings), 1.0 / sensor.sample_rate
    else:
        source = "wrenches"
        if config.robot is not None:
            with robot_backend(config.robot) as backend:
                readings, specific_force = take_readings(backend, config.duration)
            period, place = config.duration / len(readings), f"robot {config.robot}"
        else:
            backend = stage_backend(config, sensor)
            period, place = backend.period, "simulated stage"
            readings, specific_force = take_readings(backend, config.duration)
        refuse_overload(readings, sensor)
    with place_named(place):
        noise = _learned_noise(readings) if config.learn_noise else sensor.noise
        found = average_bias(readings, noise=noise)
        limit = MOVED_FACTOR / (period * len(readings)) * np.array(noise)
        drift = estimate_drift(readings, period=period, limit=limit)
    if config.learn_noise:
        sensor = msgspec.structs.replace(sensor, noise_force=noise[:3], noise_moment=noise[3:])
    sd = np.sqrt(np.diag(bias_covariance(sensor, found, specific_force)))
    origin = provenance(sensor, f"bias: {found.reading_count} readings, {Path(place).name}")
    with place_named(place):
        updated = with_bias(sensor, found, specific_force, date=today(), provenance=origin)
    verdict = found.verdict.and_also(drift.verdict)
    rate = "N/s, N m/s"
    rows = [
        Row("readings", found.reading_count),
        Row("bias", updated.bias, "bias", PER_AXIS, digits=4),
        Row("standard_error", sd, "error", PER_AXIS, digits=2),
        Row("", sensor.bias, "was", digits=2),
        Row("noise_sd", found.sd, "sd seen", PER_AXIS, digits=2),
        Row("", sensor.noise, "sd known", digits=2),
        Row("drift", drift.slope, "drift/s", rate, digits=1),
        Row("drift_half_width", drift.half_width, "+- (95 %)", rate, digits=1),
    ]
    title = f"Bias from {found.reading_count} readings ({place}, {source}), weight off, with standard error"
    show_rows(console, title, verdict, rows)
    notes = [] if any(found.sd) else ["the readings do not change at all; is the sensor alive?"]
    turned = _TOUCH_SIGMAS * touch_uncertainty(sensor, found, specific_force)
    if turned > sensor.contact.touch_force:
        notes.append(
            f"the payload's weight is uncertain: turned over, the tip may feel {turned:.2g} N in the air, more "
            f"than touch_force_N = {sensor.contact.touch_force:g}; raise it, or take more poses of the payload."
        )
    return finish(console, config.out or config.sensor, verdict, rows, lambda: updated, notes=notes)


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
