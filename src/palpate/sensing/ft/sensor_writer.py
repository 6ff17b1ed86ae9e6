"""Writing sensor files: commented, exact, whole or not at all."""

import json
import os

from palpate.atomic_file import replacing
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.filter_specs import FilterSpec, Notch
from palpate.sensing.ft.sensor_file import CalibrationEntry, PayloadEntry, ProductEntry, SensorFile


def save_sensor_file(path: str | os.PathLike[str], sensor: SensorFile) -> None:
    """Write a sensor file; a file that is there is replaced in one step, or stays as it was.

    Raises:
        OSError: The folder does not exist or cannot be written to.
    """
    text = sensor_text(sensor)
    with replacing(path) as file:
        file.write(text.encode("utf-8"))


def sensor_text(sensor: SensorFile) -> str:
    """Return the text of a sensor file; every number reads back to the same bits."""
    lines = [
        "# A force/torque sensor, for palpate. SI units, named at the end of each key.",
        "# Wrenches are what acts on the tip side of the sensor, about its origin: Fx Fy Fz, then Mx My Mz.",
        f"palpate_sensor: {sensor.palpate_sensor}",
        f"model: {_text(sensor.model)}",
        f"serial_number: {_text(sensor.serial_number)}",
        f"date: {_text(sensor.date)}",
        f"provenance: {_text(sensor.provenance)}",
        "",
        f"sample_rate_Hz: {_number(sensor.sample_rate)}",
        *_device_rate(sensor.device_rate),
        f"device_delay_s: {_number(sensor.device_delay)}  # from the load to its reading",
        "",
        "# Largest loads it bears, each axis by itself, x y z",
        f"force_range_N: {_row(sensor.force_range)}",
        f"moment_range_Nm: {_row(sensor.moment_range)}",
        "# Standard deviation of one reading at rest",
        f"noise_force_N: {_row(sensor.noise_force)}",
        f"noise_moment_Nm: {_row(sensor.noise_moment)}",
        "# What it shows with no load and no payload",
        f"bias_force_N: {_row(sensor.bias_force)}",
        f"bias_moment_Nm: {_row(sensor.bias_moment)}",
        "",
        "payload:  # what it carries; center of mass in the sensor frame",
        f"  mass_kg: {_number(sensor.payload.mass)}",
        f"  center_of_mass_m: {_row(sensor.payload.center_of_mass)}",
        *_payload_sd(sensor.payload),
        "",
        "contact:  # above touch_force_N for touch_time_s it touches, below release_force_N it has let go",
        f"  touch_force_N: {_number(sensor.contact.touch_force)}",
        f"  release_force_N: {_number(sensor.contact.release_force)}",
        f"  touch_time_s: {_number(sensor.contact.touch_time)}",
        f"  release_time_s: {_number(sensor.contact.release_time)}",
        "",
        *_filters(sensor.filters),
    ]
    if sensor.calibration is not None:
        lines += ["", *_calibration(sensor.calibration)]
    return "\n".join(lines) + "\n"


def _device_rate(rate: float | None) -> list[str]:
    return [] if rate is None else [f"device_rate_Hz: {_number(rate)}  # of its own samples; read more often"]


def _payload_sd(payload: PayloadEntry) -> list[str]:
    if payload.mass_sd == 0.0:
        return []
    return [
        f"  mass_sd_kg: {_number(payload.mass_sd)}  # standard deviations: a tare counts them",
        f"  center_of_mass_sd_m: {_row(payload.center_of_mass_sd)}",
    ]


def _filters(filters: tuple[FilterSpec, ...]) -> list[str]:
    note = "  # butterworth, critically_damped, first_order: cutoff_Hz; notch: center_Hz, quality"
    if not filters:
        return [f"filters: []{note}"]
    return [f"filters:{note}", *(f"  - {_filter(stage)}" for stage in filters)]


def _filter(stage: FilterSpec) -> str:
    kind = f"kind: {type(stage).__struct_config__.tag}"
    if isinstance(stage, Notch):
        return f"{{{kind}, center_Hz: {_number(stage.center)}, quality: {_number(stage.quality)}}}"
    return f"{{{kind}, cutoff_Hz: {_number(stage.cutoff)}}}"


def _calibration(entry: CalibrationEntry) -> list[str]:
    condition = "null" if entry.condition is None else _number(entry.condition)
    bent = " + sum of column u_i u_j, u = raw - offset, channels counted from 0" if entry.products else ""
    return [
        f"calibration:  # wrench = matrix (raw - offset){bent}",
        f"  raw_unit: {_text(entry.raw_unit)}",
        f"  range_raw_unit: {_row(entry.raw_range)}  # readings outside are saturated",
        f"  offset_raw_unit: {_row(entry.offset)}",
        f"  condition: {condition}  # of the sensor, loads scaled; 1 is ideal",
        "  matrix_N_Nm_per_raw_unit:",
        *(f"    - {_row(row)}  # {axis}" for axis, row in zip(AXES, entry.matrix, strict=True)),
        *_products(entry.products),
        *(
            []
            if entry.temperature is None
            else [f"  temperature_C: {_number(entry.temperature)}  # where it holds"]
        ),
    ]


def _products(products: tuple[ProductEntry, ...]) -> list[str]:
    if not products:
        return []
    rows = [
        f"    - {{channels: {list(each.channels)}, column_N_Nm_per_raw_unit2: {_row(each.column)}}}"
        for each in products
    ]
    return ["  products:  # Fx Fy Fz Mx My Mz", *rows]


def _row(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(map(_number, values)) + "]"


def _number(value: float) -> str:
    # The shortest digits that read back to the same bits.
    return repr(float(value))


def _text(value: str) -> str:
    # JSON's quoting is YAML's, for printable text.
    return json.dumps(value, ensure_ascii=False)
