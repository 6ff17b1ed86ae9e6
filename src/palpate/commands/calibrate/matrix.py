"""`palpate calibrate matrix`: the calibration of raw channels from known loads, and the report on it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from rich.console import Console

from palpate.commands.calibrate.config import MatrixConfig
from palpate.commands.calibrate.measurements import KnownLoads, known_loads, raw_readings, read_measurements
from palpate.commands.calibrate.results import (
    PER_AXIS,
    Row,
    finish,
    load_sensor,
    place_named,
    provenance,
    show_rows,
    text_table,
    today,
)
from palpate.commands.command_result import CommandResult
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Verdict
from palpate.experiments.kit.checks import check_file
from palpate.experiments.kit.run_report import command_line
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Points, Rule
from palpate.reporting.page import write_report
from palpate.reporting.report import Figures, Paragraph, Report, Section, TextTable
from palpate.runtime.palette import BOUND, FELT, QUIET_COLOUR
from palpate.sensing.ft import CalibrationChoice, CalibrationFit, SensorFile, choose_calibration, with_calibration
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.calibration_checks import LARGEST_CONDITION, LARGEST_ERROR, contradicted_axes
from palpate.sensing.ft.calibration_choice import left_out_error
from palpate.sensing.ft.payload import TWO_SIDED
from palpate.sensing.ft.poses import STANDARD_GRAVITY
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sensing.uncertainty import UncertaintyStatus, contacts_uncertainties
from palpate.surfaces import Sphere

_TIP_RADIUS = 0.01
"""Radius of the fingertip in the report, by default [m]."""

_FORCES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Forces of the contacts in the report [N]."""

_SHOWN_FORCE = 2.0
"""Force of the contacts in the report's first table [N]: contacts are explored with 1 to 3 N."""

_USED_RANGE = 0.02, 0.8
"""Least and largest share of the sensor's smallest force range at which contacts are felt."""

_TILTS = 30.0, 60.0
"""Angles between the contact's normal and the fingertip's front [degrees]."""

_DIRECTIONS = 8
"""Directions around the front at each tilt."""

_MIN_SHARE = 0.5
"""Least load of an axis that counts for it, relative to the largest of all axes in units of their ranges."""


def calibrate_matrix(config: MatrixConfig) -> CommandResult:
    """Find the calibration, print its quality, and put it into the sensor file.

    Raises:
        InvalidValueError: If the input is wrong, or leaves something undetermined.
        OSError: If the sensor file cannot be written.
    """
    console = Console(highlight=False, soft_wrap=True)
    sensor = load_sensor(config, config.loads)
    if config.report is not None:
        check_file(config.report, option="report")
    table = read_measurements(config.loads)
    known = sensor.calibration
    raw_range = config.raw_range or (known.raw_range if known else None)
    if raw_range is None:
        raise InvalidValueError(
            f"raw_range: neither given nor in {config.sensor}; give --raw-range LOW HIGH, for instance -10 10"
        )
    raw, header_unit = raw_readings(table, config.channels, raw_range)
    raw_unit = _raw_unit(config, sensor, header_unit)
    gravity = config.gravity or STANDARD_GRAVITY
    given = known_loads(table, raw, sensor.axis_limits, config.rotation, config.up, gravity)
    for j in np.flatnonzero((given.raw == given.raw[0]).all(axis=0))[:1].tolist():
        raise InvalidValueError(
            f"{config.loads}: raw channel {j + 1} of {given.raw.shape[1]} shows {given.raw[0, j]:g} in every row; "
            "is it dead?"
        )
    if config.temperature is not None and given.temperature is None:
        raise table.columns.lacking("temperature_C", example="it for --temperature")
    with place_named(config.loads):
        choice = choose_calibration(
            given.raw,
            given.wrench,
            ranges=sensor.axis_limits,
            temperature=given.temperature,
            used_at=config.temperature,
        )
    verdict = _verdict(choice.proposed, sensor, given)
    rows = _rows(choice, sensor, raw_unit)
    models = _models(choice, np.array(sensor.axis_limits))
    caption = f"proposed: {choice.proposed.model}: {choice.reason}"
    console.print(text_table("Models, by loads that they never saw", caption, models.heads, models.rows))
    show_rows(console, f"Calibration from {choice.proposed.load_count} loads", verdict, rows)
    report = () if config.report is None else (config.report,)
    for path in report:
        write_report(_report(config, sensor, choice, verdict, rows, models), path)

    def updated() -> SensorFile:
        step = f"matrix: {len(given.wrench)} known loads, {config.loads.name}, {choice.proposed.model}"
        with place_named(config.loads):
            return with_calibration(
                sensor,
                choice.proposed,
                temperature=choice.temperature,
                raw_unit=raw_unit,
                raw_range=raw_range,
                date=today(),
                provenance=provenance(sensor, step),
            )

    return finish(console, config.out or config.sensor, verdict, rows, updated, report=report)


def _raw_unit(config: MatrixConfig, sensor: SensorFile, in_header: str) -> str:
    if config.raw_unit and in_header and config.raw_unit != in_header:
        raise InvalidValueError(f"raw_unit = {config.raw_unit}: the header of {config.loads} has {in_header}")
    raw_unit = config.raw_unit or in_header or (sensor.calibration.raw_unit if sensor.calibration else "")
    if not raw_unit:
        raise InvalidValueError(
            f"raw_unit: neither given, nor in the header of {config.loads}, nor in {config.sensor}; give it, for "
            "instance --raw-unit V"
        )
    return raw_unit


def _verdict(fit: CalibrationFit, sensor: SensorFile, given: KnownLoads) -> Verdict:
    if sensor.calibration is None:
        return fit.verdict
    before = sensor.calibration.map
    return fit.verdict.and_also(contradicted_axes(before, given.raw, given.wrench, np.array(sensor.axis_limits)))


def _rows(choice: CalibrationChoice, sensor: SensorFile, raw_unit: str) -> list[Row]:
    fit, ranges = choice.proposed, np.array(sensor.axis_limits)
    models = [
        {
            "model": each.model,
            "verdict_ok": each.verdict.ok,
            **Row("left_out_rms", each.left_out_rms, unit=PER_AXIS).entries(),
        }
        for each in choice.fits
    ]
    rows = [
        Row("", 100.0 * left_out_error(fit, ranges), "error of loads left out", "% of the range", note="all axes"),
        Row("loads", fit.load_count),
        Row("model", fit.model),
        Row("reason", choice.reason),
        Row("models", models),
        Row("channels", fit.map.channels, "channels", note=raw_unit),
        Row("residual_rms", fit.residual_rms, "residual rms", PER_AXIS),
        Row("residual_largest", fit.residual_max, "residual max", PER_AXIS),
        Row("left_out_rms", fit.left_out_rms, "left out rms", PER_AXIS),
        Row("", LARGEST_ERROR * ranges, "limit"),
        Row("r_squared", fit.r_squared, "R squared", digits=6),
        Row("condition", fit.condition, "condition number", note=f"1 is ideal, limit {LARGEST_CONDITION:g}"),
        Row("load_condition", fit.load_condition, "condition number of the loads"),
        Row("relative_sd_at_range", fit.doubt),
        Row(
            "", 100.0 * float(fit.doubt.max()), "uncertain at full range", "%", note="standard deviation", digits=2
        ),
    ]
    if choice.temperature is not None:
        rows.append(Row("temperature_c", choice.temperature))
        rows.append(Row("", choice.temperature, "temperature", "degrees Celsius", digits=4))
    if choice.drift is not None and choice.gain is not None:
        rows += [Row("drift", choice.drift, unit="N/K, N m/K"), Row("gain_per_k", choice.gain)]
    return rows


@dataclass(frozen=True, slots=True)
class _FeltContact:
    """Uncertainty of contacts of one force: 95 %, the worst of all directions.

    Attributes:
        force: Normal force [N].
        place: Radius of the circle on the tip [m]; NaN where it is unknown.
        place_of_calibration: The part of `place` that averaging of readings does not reduce [m].
        normal_force: Half width of the interval of the normal force [N].
    """

    force: float
    place: float
    place_of_calibration: float
    normal_force: float


def _report(
    config: MatrixConfig,
    sensor: SensorFile,
    choice: CalibrationChoice,
    verdict: Verdict,
    rows: list[Row],
    models: TextTable,
) -> Report:
    fit, ranges = choice.proposed, np.array(sensor.axis_limits)
    radius = _TIP_RADIUS if config.tip_radius is None else config.tip_radius
    felt = _felt_contacts(fit, Sphere(radius, center=np.array(config.tip_center)), ranges)
    error, *others = [row for row in rows if row.meaning and np.ndim(np.asarray(row.value)) == 0]
    worst = "95 %, the worst direction"
    at = min(felt, key=lambda each: abs(each.force - _SHOWN_FORCE), default=None)
    contacts = [] if at is None else [
        Row("", _plus_minus(1e3 * at.place), f"places at {at.force:g} N", "mm", note=worst),
        Row("", _plus_minus(at.normal_force), f"normal force at {at.force:g} N", "N", note=worst),
    ]  # fmt: skip
    center = ", ".join(f"{1e3 * x:g}" for x in config.tip_center)
    return Report(
        f"Calibration of {sensor.model} {sensor.serial_number}",
        f"{fit.model} is {'proposed' if verdict.ok else 'the best, but not to be used'}: {choice.reason}.",
        tuple(quantity for row in (error, *contacts, *others) for quantity in row.quantities()),
        (
            Section("Models, by loads that they never saw", (models,)),
            Section("Errors against the load", (Figures(lambda: [_by_load(fit, ranges)]),)),
            Section("Errors by direction", (_by_direction(fit, ranges),)),
            Section(
                f"Contacts on a round tip of {1e3 * radius:.3g} mm",
                (
                    Paragraph(
                        f"The centre of the tip is ({center}) mm from the sensor. 95 % of contacts are felt as "
                        "near, in the worst of directions up to 60 degrees from the tip's front. Averaging of "
                        "readings cannot reduce the calibration's own part."
                    ),
                    _contacts(felt),
                ),
            ),
            *_temperature(choice, ranges),
        ),
        asked=f"a calibration from {fit.load_count} known loads in {config.loads.name}",
        advice=tuple(f"{broken.finding}: {broken.remedy}." for broken in verdict.broken),
        repeat=(("The same again:", command_line("calibrate.matrix", config)),),
        footer="Wrenches are what acts on the tip side of the sensor, about its origin.",
        reached=verdict.ok,
    )


def _models(choice: CalibrationChoice, ranges: FloatArray) -> TextTable:
    rows = []
    for fit in choice.fits:
        words = "OK" if fit.verdict.ok else fit.verdict.broken[0].finding
        missed = " ".join(
            f"{axis} {100.0 * x:.2g}" for axis, x in zip(AXES, fit.left_out_rms / ranges, strict=True)
        )
        rows.append(
            (fit.model, f"{100.0 * left_out_error(fit, ranges):.3g}", "% of the range", f"{missed}; {words}")
        )
    return TextTable(rows, heads=("model", "missed by", "", "by axis; what the loads say of it"))


def _by_load(fit: CalibrationFit, ranges: FloatArray) -> Figure:
    load, missed = 100.0 * fit.loads / ranges, 100.0 * fit.left_out / ranges
    texts = tuple(f"load {i}" for i in range(len(load)))
    panels = [
        Panel(
            (
                Points(load[:, i], missed[:, i], "left out", FELT, size=6.0, texts=texts),
                Points(load[:, i], 100.0 * fit.residual[:, i] / ranges[i], "fitted", QUIET_COLOUR, size=3.0),
                *(Rule(sign * 100.0 * LARGEST_ERROR, colour=BOUND, upright=False) for sign in (1.0, -1.0)),
            ),
            Axis(f"load of {axis}", "%"),
            Axis("error", "%"),
            axis,
            height=220,
        )
        for i, axis in enumerate(AXES)
    ]
    return Figure(
        "Errors against the load",
        "In percent of each axis' range. Good is a cloud about zero without a bend, a slope or a fan; the dark "
        f"red lines are the limit of {LARGEST_ERROR:.0%}, root mean square.",
        tuple(panels),
        columns=3,
        wide=True,
    )


def _by_direction(fit: CalibrationFit, ranges: FloatArray) -> TextTable:
    """Return the errors of all loads that pull, or push, along an axis."""
    share, missed = fit.loads / ranges, fit.left_out / ranges
    largest = np.abs(share).max(axis=1)
    rows = []
    for i, axis in enumerate(AXES):
        for sign, name in ((1.0, f"+{axis}"), (-1.0, f"-{axis}")):
            there = (sign * share[:, i] >= _MIN_SHARE * largest) & (largest > 0.0)
            if there.any():
                rms = np.sqrt((missed[there] ** 2).mean(axis=0))
                worst = int(np.argmax(rms))
                of_all = 100.0 * float(np.sqrt((missed[there] ** 2).mean()))
                rows.append(
                    (
                        name,
                        f"{of_all:.2g}",
                        "% of the range",
                        f"{there.sum()} loads; most in {AXES[worst]}, {100.0 * rms[worst]:.2g}",
                    )
                )
            else:
                rows.append((name, "-", "", "no load"))
    return TextTable(rows, heads=("load along", "missed by", "", ""))


def _contacts(felt: tuple[_FeltContact, ...]) -> TextTable:
    rows = [
        (
            f"{each.force:g} N",
            _plus_minus(1e3 * each.place),
            "mm",
            f"of that the calibration's own {_plus_minus(1e3 * each.place_of_calibration)} mm; normal force "
            f"{_plus_minus(each.normal_force)} N",
        )
        for each in felt
    ]
    return TextTable(rows, heads=("pressed with", "place", "", ""))


def _temperature(choice: CalibrationChoice, ranges: FloatArray) -> Iterator[Section]:
    if choice.drift is None or choice.gain is None or choice.temperature is None:
        return
    rows = [
        (
            axis,
            f"{100.0 * drift / limit:+.2g}",
            "% of the range per kelvin",
            f"sensitivity {round(100.0 * gain, 4):+.2g} % per kelvin",
        )
        for axis, drift, limit, gain in zip(AXES, choice.drift, ranges, choice.gain, strict=True)
    ]
    text = (
        f"The calibration holds at {choice.temperature:.4g} degrees Celsius (--temperature chooses another). A "
        "tare takes the zero's drift off; that of the sensitivity remains."
    )
    yield Section("Temperature", (Paragraph(text), TextTable(rows, heads=("axis", "zero", "", ""))))


def _plus_minus(value: float) -> str:
    return "unknown" if np.isnan(value) else f"+-{value:.2g}"


def _felt_contacts(fit: CalibrationFit, tip: Sphere, ranges: FloatArray) -> tuple[_FeltContact, ...]:
    low, high = (share * float(ranges[:3].min()) for share in _USED_RANGE)
    return tuple(_felt_at(fit, tip, force) for force in _FORCES if low <= force <= high)


def _felt_at(fit: CalibrationFit, tip: Sphere, force: float) -> _FeltContact:
    normals = _normals(np.asarray(tip.center))
    pushed = -force * normals
    wrenches = np.hstack([pushed, np.cross(tip.center + tip.radius * normals, pushed)])
    both, lasting, forces = [], [], []
    for wrench in wrenches:
        contact = contacts_from_wrenches(tip, wrench[None])
        calibration = fit.calibration_covariance(wrench)
        whole = contacts_uncertainties(tip, contact, calibration + fit.noise)
        known = whole.status[0] == UncertaintyStatus.VALID
        both.append(_radius(whole.centroid[0]) if known else np.nan)
        lasting.append(_radius(contacts_uncertainties(tip, contact, calibration).centroid[0]))
        forces.append(TWO_SIDED * float(np.sqrt(whole.normal_force[0])))
    return _FeltContact(force, max(both), max(lasting), max(forces))


def _radius(covariance: FloatArray) -> float:
    return TWO_SIDED * float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def _normals(center: FloatArray) -> FloatArray:
    """Return outward normals around the front of a tip, which looks away from the sensor, shape (n, 3)."""
    length = float(np.linalg.norm(center))
    front = center / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    side = np.linalg.svd(front[None])[2][1:]
    rows = [front]
    for tilt in np.radians(_TILTS):
        for angle in 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS:
            across = np.cos(angle) * side[0] + np.sin(angle) * side[1]
            rows.append(np.cos(tilt) * front + np.sin(tilt) * across)
    return np.array(rows)
