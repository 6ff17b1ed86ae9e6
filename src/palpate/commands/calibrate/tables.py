"""What a calibration found, as tables for the terminal."""

import math

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from palpate.errors import FloatArray
from palpate.estimation import Verdict
from palpate.sensing.ft import (
    BiasEstimate,
    CalibrationChoice,
    CalibrationFit,
    Drift,
    IdentifiedMounting,
    IdentifiedPayload,
    SensorFile,
)
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.calibration_checks import LARGEST_CONDITION, LARGEST_ERROR
from palpate.sensing.ft.payload import TWO_SIDED

UNITS = ("N",) * 3 + ("N m",) * 3


def models_table(choice: CalibrationChoice, sensor: SensorFile) -> Table:
    """Return by how much each model misses loads that were left out, in units of the range."""
    warm = "" if choice.temperature is None else f"; at {choice.temperature:.4g} degrees Celsius"
    table = _table(
        Text("Loads left out, missed by [% of the range]"),
        Text(f"proposed: {choice.proposed.model}{warm}: {choice.reason}"),
        ("model", "verdict", *AXES),
    )
    for fit in choice.fits:
        missed = 100.0 * fit.left_out_rms / np.array(sensor.axis_limits)
        table.add_row(fit.model, _words(fit.verdict), *(f"{x:.3g}" for x in missed))
    return table


def calibration_table(fit: CalibrationFit, sensor: SensorFile, raw_unit: str, verdict: Verdict) -> Table:
    """Return how good a calibration is."""
    table = _table(
        Text(f"Calibration from {fit.load_count} loads, {fit.map.channels} channels [{raw_unit}]"),
        Text(
            f"condition number {fit.condition:.3g} (limit {LARGEST_CONDITION:g}), of the loads "
            f"{fit.load_condition:.3g}; at full range the matrix is uncertain by "
            f"{TWO_SIDED * fit.doubt.max():.2%} (95 %); {_words(verdict)}"
        ),
        ("axis", "unit", "residual rms", "residual max", "left out rms", "limit", "R squared"),
    )
    for i, axis in enumerate(AXES):
        shown = (
            fit.residual_rms[i],
            fit.residual_max[i],
            fit.left_out_rms[i],
            LARGEST_ERROR * sensor.axis_limits[i],
        )
        table.add_row(axis, UNITS[i], *(f"{x:.3g}" for x in shown), f"{fit.r_squared[i]:.6f}")
    return table


def payload_table(found: IdentifiedPayload, source: str) -> Table:
    """Return a payload with its 95 % intervals."""
    table = _table(
        Text(f"Payload and bias from {found.pose_count} poses ({source})"),
        Text(
            f"condition number {found.condition:.3g}; residual rms {found.force_rms:.3g} N and "
            f"{found.moment_rms:.3g} N m; chi2 per degree of freedom {found.force_chi2:.3g} and "
            f"{found.moment_chi2:.3g} (should be 1); "
            f"zero: {_zero(found)}; mass from differences of successive poses {found.mass_by_differences:.5g} +- "
            f"{TWO_SIDED * found.mass_by_differences_sd:.2g} kg; largest residual: pose {found.worst_pose}; "
            f"{_words(found.verdict)}"
        ),
        ("what", "unit", "value", "95 % from", "to"),
    )
    entries: list[tuple[str, str, float, float]] = [("mass", "kg", found.payload.mass, found.mass_sd)]
    sds = found.center_sd.tolist()
    entries += [
        (f"centre of mass, {axis}", "m", x, sd)
        for axis, x, sd in zip("xyz", found.payload.center_of_mass, sds, strict=True)
    ]
    bias = (*found.bias_force, *found.bias_moment)
    bias_sd = np.sqrt(np.diag(found.bias_covariance)).tolist()
    entries += [(f"bias {AXES[i]}", UNITS[i], bias[i], bias_sd[i]) for i in range(6)]
    for name, unit, value, sd in entries:
        half = TWO_SIDED * sd
        table.add_row(
            name, unit, *(f"{x:.5g}" if math.isfinite(x) else "-" for x in (value, value - half, value + half))
        )
    return table


def mounting_table(found: IdentifiedMounting) -> Table:
    """Return the sensor's axes on the flange with 95 % intervals."""
    table = _table(
        Text("The sensor on the flange"),
        Text(
            f"what the poses contradict, chi2 per degree of freedom: {found.left_over_chi2:.3g} (should be 1); "
            f"{_words(found.verdict)}"
        ),
        ("axis of the sensor", "", "x of the flange", "y", "z", "+- degrees"),
    )
    half = np.degrees(TWO_SIDED * found.rotation_sd)
    for axis, column, each in zip("xyz", found.rotation_flange_sensor.T, half, strict=True):
        table.add_row(axis, "", *(f"{x:.5f}" for x in column), f"{each:.2g}")
    return table


def bias_table(
    found: BiasEstimate, drift: Drift, sd: FloatArray, before: SensorFile, after: SensorFile, source: str
) -> Table:
    """Return a bias with its standard errors, noise and drift."""
    table = _table(
        Text(f"Bias from {found.reading_count} readings ({source})"),
        Text(
            "error: standard error of the bias, the payload's included; drift per second with its 95 % "
            "interval; weight taken off"
        ),
        ("axis", "unit", "bias", "error", "was", "sd seen", "sd known", "drift/s", "+-"),
    )
    for i, axis in enumerate(AXES):
        shown = (after.bias[i], sd[i], before.bias[i], found.sd[i], before.noise[i])
        table.add_row(
            axis,
            UNITS[i],
            f"{shown[0]:.4g}",
            *(f"{x:.2g}" for x in shown[1:]),
            f"{drift.slope[i]:.1g}",
            f"{drift.half_width[i]:.1g}",
        )
    return table


def _words(verdict: Verdict) -> str:
    return "OK" if verdict.ok else "not to be used"


def _zero(found: IdentifiedPayload) -> str:
    """Name how the zero moved, and which poses were left out."""
    jumps = f", jumps before pose {', '.join(map(str, sorted(found.zero.jumps)))}" if found.zero.jumps else ""
    bad = f", left out: pose {', '.join(map(str, sorted(found.zero.bad)))}" if found.zero.bad else ""
    span = f" over {found.zero_span_force:.2g} N" if found.zero.moves else ""
    return f"drift {found.zero.drift}{jumps}{span}{bad}"


def _table(title: Text, caption: Text, columns: tuple[str, ...]) -> Table:
    """Return a table without rows; the first two columns are words."""
    table = Table(title=title, caption=caption, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for i, name in enumerate(columns):
        # folded, not cut: no digit shall be hidden in a narrow terminal
        table.add_column(name, justify="left" if i < 2 else "right", overflow="fold")
    return table
