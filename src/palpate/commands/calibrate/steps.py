"""What every step of `palpate calibrate` does: read the sensor file, judge, write it whole or not at all."""

import contextlib
import datetime
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from palpate.atomic_file import replacing
from palpate.commands.calibrate.config import MatrixConfig, MountingConfig, PayloadConfig, TareConfig
from palpate.commands.calibrate.data import CsvData, has_raw, has_wrenches, raw_readings, wrenches
from palpate.commands.calibrate.metrics import verdict_facts
from palpate.commands.calibrate.tables import UNITS
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Verdict
from palpate.sensing.ft import FTPipeline, SensorFile, load_sensor_file, save_sensor_file
from palpate.sensing.ft.arrays import AXES

LONGEST_PROVENANCE = 1000
"""Characters, of a sensor file."""


def used(
    verdict: Verdict, metrics: dict[str, object], files: tuple[Path, ...], warnings: tuple[str, ...]
) -> CommandResult:
    """Return the result of an estimate that is used."""
    return CommandResult(
        outcome=str(verdict), metrics=metrics, facts=verdict_facts(verdict), files=files, warnings=warnings
    )


def not_used(
    verdict: Verdict, metrics: dict[str, object], console: Console, report: tuple[Path, ...] = ()
) -> CommandResult:
    """Print why an estimate is not to be used; no sensor file is written."""
    for line in verdict.lines():
        console.print(Text(line))
    console.print(
        Text("Not to be used: no sensor file was written." if report else "Not to be used: no file was written.")
    )
    return CommandResult(ExitCode.UNFINISHED, str(verdict), metrics, facts=verdict_facts(verdict), files=report)


def measured(data: CsvData, sensor: SensorFile, channels: tuple[str, ...]) -> tuple[FloatArray, str]:
    """Return calibrated wrenches, shape (n, 6), and from what: raw channels are calibrated as in `FTPipeline`."""
    entry = sensor.calibration
    if has_raw(data, channels) and entry is not None:
        raw, unit = raw_readings(data, channels, entry.raw_range)
        if raw.shape[1] != entry.map.channels:
            raise data.wrong_header(f"{raw.shape[1]} raw channels, but the sensor file has {entry.map.channels}")
        if unit and unit != entry.raw_unit:
            raise data.wrong_header(f"raw channels in {unit}, but the sensor file has {entry.raw_unit}")
        rows = entry.map.apply(raw)
        refuse_overload(rows, sensor)
        return rows, "raw channels"
    if has_raw(data, channels) and not has_wrenches(data):
        raise data.wrong_header(
            "raw channels only, and the sensor file has no calibration; find it first by palpate calibrate matrix"
        )
    return wrenches(data, sensor.axis_limits), "wrenches"


def loaded(path: Path) -> SensorFile:
    """Return the sensor file."""
    try:
        return load_sensor_file(path)
    except OSError as error:
        raise InvalidValueError(
            f"cannot read sensor file {path}: {error.strerror}; `palpate calibrate new` makes a first one"
        ) from None


def target(config: MatrixConfig | PayloadConfig | MountingConfig | TareConfig) -> Path:
    """Return where the updated sensor file goes."""
    return config.out or config.sensor


def refuse_overwriting(out: Path | None, source: Path) -> None:
    """Refuse to write over the input."""
    if out is not None and out.exists() and source.exists() and out.samefile(source):
        raise InvalidValueError(f"out = {out}: is the input; give another file")


@contextlib.contextmanager
def named(place: Path | str) -> Iterator[None]:
    """Prefix the library's messages about data with their place."""
    try:
        yield
    except InvalidValueError as error:
        raise InvalidValueError(f"{place}: {error}") from None


def write(target: Path, sensor: SensorFile, console: Console) -> tuple[tuple[Path, ...], tuple[str, ...]]:
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
        return files, noted(f"before use, edit the file: {error}", console)
    return files, ()


def noted(what: str, console: Console) -> tuple[str]:
    """Print a note, and return it as a warning."""
    console.print(Text(f"Note: {what}"))
    return (what,)


def today() -> str:
    """Return the date, as sensor files have it."""
    return datetime.date.today().isoformat()


def provenance(sensor: SensorFile, what: str) -> str:
    """Return the newest step before the older ones, cut to what a sensor file takes."""
    printable = "".join(letter if letter.isprintable() else "?" for letter in what)
    return f"{printable} ({today()}); {sensor.provenance}"[:LONGEST_PROVENANCE]


def refuse_overload(rows: FloatArray, sensor: SensorFile) -> None:
    """Refuse wrenches beyond the sensor's range."""
    bad = np.argwhere(~(np.abs(rows) <= np.array(sensor.axis_limits)))
    if len(bad):
        i, j = bad[0].tolist()
        raise InvalidValueError(
            f"reading {i}: {AXES[j]} = {rows[i, j]:g} {UNITS[j]} is beyond the sensor's range of "
            f"{sensor.axis_limits[j]:g}"
        )
