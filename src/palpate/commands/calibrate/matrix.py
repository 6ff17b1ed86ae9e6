"""`palpate calibrate matrix`: the calibration of raw channels, from known loads."""

import numpy as np
from rich.console import Console

from palpate.commands.calibrate.config import MatrixConfig
from palpate.commands.calibrate.data import CsvData, raw_readings, read_csv
from palpate.commands.calibrate.loads import KnownLoads, known_loads
from palpate.commands.calibrate.matrix_report import MatrixFound, matrix_report
from palpate.commands.calibrate.metrics import choice_metrics
from palpate.commands.calibrate.steps import (
    loaded,
    named,
    not_used,
    provenance,
    refuse_overwriting,
    target,
    today,
    used,
    write,
)
from palpate.commands.calibrate.tables import calibration_table, models_table
from palpate.commands.command_result import CommandResult
from palpate.errors import InvalidValueError
from palpate.estimation import Verdict
from palpate.experiments.kit.checks import check_file
from palpate.reporting.page import write_report
from palpate.sensing.ft import CalibrationFit, SensorFile, choose_calibration, with_calibration
from palpate.sensing.ft.calibration_checks import contradicted_axes
from palpate.sensing.ft.poses import STANDARD_GRAVITY


def calibrate_matrix(config: MatrixConfig, console: Console) -> CommandResult:
    """Find the calibration, print how good it is, and put it into the sensor file."""
    sensor = loaded(config.sensor)
    check_file(target(config))
    refuse_overwriting(config.out, config.loads)
    if config.report is not None:
        check_file(config.report, option="report")
    data = read_csv(config.loads)
    known = sensor.calibration
    raw_range = config.raw_range or (known.raw_range if known else None)
    if raw_range is None:
        raise InvalidValueError(
            f"raw_range: neither given nor in {config.sensor}; give --raw-range LOW HIGH, for instance -10 10"
        )
    raw, header_unit = raw_readings(data, config.channels, raw_range)
    raw_unit = _raw_unit(config, sensor, header_unit)
    gravity = config.gravity or STANDARD_GRAVITY
    given = known_loads(data, raw, sensor.axis_limits, config.rotation, config.up, gravity)
    _refuse_dead(data, given)
    if config.temperature is not None and given.temperature is None:
        raise data.wrong_header("temperature: given, but there is no column temperature_C")
    with named(config.loads):
        choice = choose_calibration(
            given.raw,
            given.wrench,
            ranges=sensor.axis_limits,
            temperature=given.temperature,
            used_at=config.temperature,
        )
    verdict = _verdict(choice.proposed, sensor, given)
    console.print(models_table(choice, sensor))
    console.print(calibration_table(choice.proposed, sensor, raw_unit, verdict))
    found = MatrixFound(choice, verdict, sensor, raw_unit, config.loads.name)
    report = () if config.report is None else (config.report,)
    for path in report:
        write_report(matrix_report(found, config), path)
    metrics = choice_metrics(choice)
    if not verdict.ok:
        return not_used(verdict, metrics, console, report)
    with named(config.loads):
        updated = with_calibration(
            sensor,
            choice.proposed,
            temperature=choice.temperature,
            raw_unit=raw_unit,
            raw_range=raw_range,
            date=today(),
            provenance=provenance(
                sensor, f"matrix: {len(given.wrench)} known loads, {config.loads.name}, {choice.proposed.model}"
            ),
        )
    files, warnings = write(target(config), updated, console)
    return used(verdict, metrics, (*files, *report), warnings)


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


def _refuse_dead(data: CsvData, given: KnownLoads) -> None:
    k = given.raw.shape[1]
    for j, same in enumerate((given.raw == given.raw[0]).all(axis=0)):
        if same:
            raise InvalidValueError(
                f"{data.name}: raw channel {j + 1} of {k} shows {given.raw[0, j]:g} in every row; is it dead?"
            )


def _verdict(fit: CalibrationFit, sensor: SensorFile, given: KnownLoads) -> Verdict:
    if sensor.calibration is None:
        return fit.verdict
    before = sensor.calibration.map
    return fit.verdict.and_also(contradicted_axes(before, given.raw, given.wrench, np.array(sensor.axis_limits)))
