"""Results of calibrations: each number stated once for JSON, terminal and report; and the updated sensor file."""

import contextlib
import datetime
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.atomic_file import replacing
from palpate.commands.calibrate.config import MatrixConfig, MountingConfig, PayloadConfig, TareConfig
from palpate.commands.calibrate.measurements import AXIS_UNITS
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.errors import InvalidValueError
from palpate.estimation import Verdict
from palpate.experiments.kit.checks import check_file
from palpate.reporting.data import Quantity
from palpate.reporting.report import quantity_table
from palpate.reporting.units import quantity_key
from palpate.sensing.ft import FTPipeline, SensorFile, load_sensor_file, save_sensor_file
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.payload import TWO_SIDED

PER_AXIS = "N, N m"
"""Unit of three forces and three moments."""

_SUFFIXES = {PER_AXIS: "", "N/s, N m/s": "_per_s", "N/K, N m/K": "_per_k"}
"""Units of forces and moments, and the end of their keys: forces and moments are apart, for their units differ."""

_MAX_PROVENANCE = 1000
"""Most characters of the provenance in a sensor file."""


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One result of a calibration.

    Attributes:
        key: Name in JSON, without the unit; "" for a row of tables alone.
        value: Number, array or word, in SI units.
        meaning: Name in tables; "" for JSON alone.
        unit: SI unit; `PER_AXIS` or its rates for forces and moments.
        sd: Standard deviation of each number; None without.
        note: Remark in tables.
        digits: Significant digits in tables.
    """

    key: str
    value: object
    meaning: str = ""
    unit: str = ""
    sd: object = None
    note: str = ""
    digits: int = 3

    def entries(self) -> dict[str, object]:
        """Return the entries in JSON."""
        found: dict[str, object] = {}
        values = {self.key: self.value} | ({} if self.sd is None else {f"{self.key}_sd": self.sd})
        for key, value in values.items():
            if self.unit in _SUFFIXES:
                forces, moments = np.reshape(np.asarray(value), (2, 3))
                found[f"{key}_force_n{_SUFFIXES[self.unit]}"] = forces
                found[f"{key}_moment_n_m{_SUFFIXES[self.unit]}"] = moments
            else:
                found[quantity_key(key, self.unit)] = value
        return found

    def quantities(self) -> Iterator[Quantity]:
        """Yield a quantity for each component."""
        if isinstance(self.value, str):
            yield Quantity(self.meaning, self.value, self.unit, self.note)
            return
        values = np.atleast_1d(np.asarray(self.value, np.float64)).tolist()
        sds = [None] * len(values) if self.sd is None else np.atleast_1d(np.asarray(self.sd)).tolist()
        for name, value, sd in zip("xyz" if len(values) == 3 else ("",), values, sds, strict=True):
            notes = [] if sd is None else [_interval(value, TWO_SIDED * sd)]
            text = "; ".join([*notes, *filter(None, [self.note])])
            yield Quantity(f"{self.meaning} {name}".strip(), value, self.unit, text, self.digits)


def _interval(value: float, half: float) -> str:
    return f"95 %: {value - half:.5g} to {value + half:.5g}" if math.isfinite(half) else "95 %: unbounded"


def metrics_of(rows: Iterable[Row]) -> dict[str, object]:
    """Return the entries of rows in JSON."""
    return {key: value for row in rows if row.key for key, value in row.entries().items()}


def show_rows(console: Console, title: str, verdict: Verdict, rows: Iterable[Row]) -> None:
    """Print rows: the values of each axis in columns, all others below one another."""
    axes: list[Row] = []
    others: list[Quantity] = []
    for row in (row for row in rows if row.meaning):
        if np.size(np.asarray(row.value)) != len(AXES):
            others += row.quantities()
            continue
        axes.append(row)
        if row.sd is not None:
            axes.append(Row("", TWO_SIDED * np.asarray(row.sd), "+- (95 %)", digits=2))
    outcome = "OK" if verdict.ok else "not to be used"
    if axes:
        lines = [
            (axis, unit, *(f"{np.asarray(row.value)[i]:.{row.digits}g}" for row in axes))
            for i, (axis, unit) in enumerate(zip(AXES, AXIS_UNITS, strict=True))
        ]
        heads = ("axis", "unit", *(row.meaning for row in axes))
        console.print(text_table(title, "" if others else outcome, heads, lines))
    if others:
        console.print(quantity_table(others, "" if axes else title, outcome))


def text_table(title: str, caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """Return a table of texts for the terminal; the first two columns are words."""
    table = Table(title=Text(title), caption=Text(caption), box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for i, name in enumerate(heads):
        # folded, not cut: no digit shall be hidden in a narrow terminal
        table.add_column(name, justify="left" if i < 2 else "right", overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def load_sensor(
    config: MatrixConfig | PayloadConfig | MountingConfig | TareConfig, source: Path | None
) -> SensorFile:
    """Return the sensor file of a calibration whose output can be written.

    Args:
        config: Options of the calibration.
        source: File of measurements; None if they are taken live.

    Raises:
        InvalidValueError: If the sensor file cannot be read, or the output not be written or is the source.
    """
    try:
        sensor = load_sensor_file(config.sensor)
    except OSError as error:
        raise InvalidValueError(
            f"cannot read sensor file {config.sensor}: {error.strerror}; `palpate calibrate new` makes a first one"
        ) from None
    check_file(config.out or config.sensor)
    out = config.out
    if out is not None and source is not None and out.exists() and source.exists() and out.samefile(source):
        raise InvalidValueError(f"out = {out}: is the input; give another file")
    return sensor


@contextlib.contextmanager
def place_named(place: Path | str) -> Iterator[None]:
    """Prefix messages about data with the place of the data."""
    try:
        yield
    except InvalidValueError as error:
        raise InvalidValueError(f"{place}: {error}") from None


def today() -> str:
    """Return the date in the form of sensor files."""
    return datetime.date.today().isoformat()


def provenance(sensor: SensorFile, step: str) -> str:
    """Return the newest step before the older ones, cut to the length that a sensor file takes."""
    printable = "".join(letter if letter.isprintable() else "?" for letter in step)
    return f"{printable} ({today()}); {sensor.provenance}"[:_MAX_PROVENANCE]


def finish(
    console: Console,
    target: Path,
    verdict: Verdict,
    rows: Iterable[Row],
    updated: Callable[[], SensorFile],
    *,
    notes: Iterable[str] = (),
    report: tuple[Path, ...] = (),
) -> CommandResult:
    """Write the updated sensor file if the estimate can be used, and return the result; keep the old file.

    Args:
        console: Terminal.
        target: File to write.
        verdict: Verdict on the estimate.
        rows: Results.
        updated: Function that returns the updated sensor file.
        notes: Remarks that are printed once the file is written.
        report: Report that has been written.
    """
    broken = [
        {"assumption": each.assumption.name.lower(), "finding": each.finding, "remedy": each.remedy}
        for each in verdict.broken
    ]
    facts = {"verdict": {"ok": verdict.ok, "broken": broken}}
    metrics = metrics_of(rows)
    if not verdict.ok:
        unwritten = "no sensor file was written" if report else "no file was written"
        for line in (*verdict.lines(), f"Not to be used: {unwritten}."):
            console.print(Text(line))
        return CommandResult(ExitCode.UNFINISHED, str(verdict), metrics, facts=facts, files=report)
    sensor = updated()
    files, kept = [target], ""
    if target.exists():
        backup = target.with_name(target.name + ".bak")
        with replacing(backup) as file:
            file.write(target.read_bytes())
        files, kept = [target, backup], f"; as it was: {backup}"
    save_sensor_file(target, sensor)
    console.print(Text(f"Written: {target}{kept}"))
    warnings = []
    try:
        FTPipeline(sensor)
    except InvalidValueError as error:
        warnings.append(f"before use, edit the file: {error}")
    warnings += notes
    for warning in warnings:
        console.print(Text(f"Note: {warning}"))
    return CommandResult(
        outcome=str(verdict), metrics=metrics, facts=facts, files=(*files, *report), warnings=tuple(warnings)
    )
