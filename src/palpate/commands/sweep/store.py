"""Runs of a sweep on disk: the folder, one small file per run, and the tables.

Each run is a file of its own, written atomically: a process that is killed at any instant loses only the runs that
it was working on.
"""

import csv
import io
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from hashlib import sha256
from importlib import import_module
from pathlib import Path

import msgspec

from palpate.atomic_file import replacing
from palpate.bounded_file import Bounds, read_bytes
from palpate.commands.sweep.plan import RunCase, SweepPlan
from palpate.commands.typed_values import plain, shown_value
from palpate.errors import InvalidValueError, shown
from palpate.experiments.kit.checks import make_folder
from palpate.experiments.kit.metric import MetricValue
from palpate.plain_text import inert_cell


class RunStatus(StrEnum):
    """Outcome of a run."""

    DONE = "done"
    """The run reached its end; its metrics count."""
    UNFINISHED = "unfinished"
    """The supervisor stopped the run, contact was lost, or time was up; its metrics do not count."""
    FAILED = "failed"
    """The run raised an exception."""
    DIED = "died"
    """The process of the run ended more than once: a crash in C, out of memory, SIGKILL."""


class RunRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Record of a run.

    Attributes:
        run: Number of the run in the sweep, from 0.
        digest: Digest of the case; it distinguishes files of another sweep.
        seed: Seed of the random numbers.
        status: Outcome of the run.
        message: Ending or error in one line.
        traceback: Traceback of an exception; else empty.
        duration: Wall time in the worker [s].
        host: Name of the computer.
        metrics: Metrics by key; they do not depend on the computer.
        versions: Versions of Python and of the packages whose arithmetic the metrics depend on.
    """

    run: int
    digest: str
    seed: int
    status: RunStatus
    message: str = ""
    traceback: str = ""
    duration: float | None = msgspec.field(name="duration_s", default=None)
    host: str = ""
    metrics: dict[str, MetricValue] = {}
    versions: dict[str, str] = {}

    @property
    def done(self) -> bool:
        """Whether the metrics count."""
        return self.status is RunStatus.DONE


def record_text(record: RunRecord) -> bytes:
    """Return the record as JSON; `read_record` restores every float to the last bit."""
    return msgspec.json.encode(record) + b"\n"


def read_record(text: bytes) -> RunRecord | None:
    """Return the record that `record_text` wrote; None for any other text, as after a power failure."""
    try:
        return msgspec.json.decode(text, type=RunRecord)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None


def without_result(case: RunCase, status: RunStatus, error: str, trace: str = "") -> RunRecord:
    """Return the record of a run whose worker left none."""
    return RunRecord(
        run=case.run,
        digest=case.digest,
        seed=case.seed,
        status=status,
        message=one_line(error),
        traceback=trace,
    )


def one_line(text: str) -> str:
    """Return a text without line breaks."""
    return " ".join(text.split())


SWEEP_FILE = "sweep.json"
"""The request."""

FILE_BOUNDS = Bounds(size=1 << 22)
"""Largest size of a request or a record; some thousand metrics take a tenth of it."""

LAYOUT_VERSION = 1
"""Version of the folder's layout."""

MOST_DIFFERENCES = 5
"""Differences that a refusal names."""

_PART = re.compile(r"\.\d{6}\.json\.[0-9a-f]{8}\.part")
"""Name of the partial file of a killed writer (`palpate.atomic_file.replacing`)."""


class SweepRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The request of a sweep, for people and for resuming it.

    Attributes:
        palpate_sweep: Version of the folder.
        experiment: Name of the experiment.
        varied: Options that were varied, with their values as typed.
        fixed: Options that were set, in the command or in an experiment file.
        first_seed: First seed of each combination.
        seeds: Number of seeds.
        runs: Number of runs.
        digest: Digest of every value that the runs depend on, defaults and files included.
    """

    palpate_sweep: int
    experiment: str
    varied: dict[str, list[str]]
    fixed: dict[str, str]
    first_seed: int
    seeds: int
    runs: int
    digest: str


def request_of(plan: SweepPlan) -> SweepRequest:
    """Return the request of a plan."""
    return SweepRequest(
        palpate_sweep=LAYOUT_VERSION,
        experiment=plan.experiment.name,
        varied={each.name: [shown_value(value) for value in each.values] for each in plan.varied},
        fixed={name: shown_value(value) for name, value in plan.fixed.items()},
        first_seed=plan.seeds.start,
        seeds=len(plan.seeds),
        runs=len(plan.runs),
        digest=sha256(" ".join(run.case.digest for run in plan.runs).encode()).hexdigest(),
    )


@dataclass(frozen=True, slots=True)
class SweepFolder:
    """A folder that is a sweep's.

    Attributes:
        path: The folder.
    """

    path: Path

    @property
    def runs(self) -> Path:
        """Folder of the runs."""
        return self.path / "runs"

    def begin(self, plan: SweepPlan) -> dict[int, RunRecord]:
        """Claim the folder for a plan, and return its finished runs by number.

        Raises:
            InvalidValueError: If the folder cannot be written, or if it belongs to another sweep; the message
                names the differences.
            OSError: If a file cannot be written.
        """
        make_folder(self.path)
        request, before = request_of(plan), self._request_before()
        if before is not None and before != request:
            raise InvalidValueError(
                f"out = {self.path}: holds another sweep: {_differences(before, request)}; {OTHER_FOLDER_REMEDY}"
            )
        self.runs.mkdir(exist_ok=True)
        if before is None:
            with replacing(self.path / SWEEP_FILE) as file:
                file.write(msgspec.json.format(msgspec.json.encode(request), indent=2) + b"\n")
        for part in self.runs.iterdir():
            if _PART.fullmatch(part.name):
                part.unlink(missing_ok=True)
        return self.finished(plan)

    def finished(self, plan: SweepPlan) -> dict[int, RunRecord]:
        """Return every finished run of a plan, by number."""
        found = {}
        for run in plan.runs:
            try:
                record = read_record(read_bytes(self._file(run.number), FILE_BOUNDS))
            except FileNotFoundError:
                continue
            # unreadable or foreign files are run again
            if record is not None and (record.run, record.digest) == (run.number, run.case.digest):
                found[run.number] = record
        return found

    def keep(self, record: RunRecord) -> None:
        """Write the record of a run.

        Raises:
            OSError: If the file cannot be written.
        """
        with replacing(self._file(record.run)) as file:
            file.write(record_text(record))

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Lock the folder until the block or this process ends.

        Raises:
            InvalidValueError: If another process works in the folder.
        """
        make_folder(self.path)
        try:
            import fcntl
        except ImportError:  # Windows: two at work there repeat each other's runs, and spoil nothing
            yield
            return
        folder = os.open(self.path, os.O_RDONLY)
        try:
            try:
                fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InvalidValueError(
                    f"out = {self.path}: another palpate sweep is at work there; wait, or choose another folder"
                ) from None
            except OSError:  # a file system without locks
                pass
            yield
        finally:
            os.close(folder)

    def _file(self, number: int) -> Path:
        return self.runs / f"{number:06d}.json"

    def _request_before(self) -> SweepRequest | None:
        file = self.path / SWEEP_FILE
        try:
            return msgspec.json.decode(read_bytes(file, FILE_BOUNDS), type=SweepRequest)
        except FileNotFoundError:
            return None
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise InvalidValueError(
                f"{file}: cannot be understood ({error}); choose another folder (--out)"
            ) from None


OTHER_FOLDER_REMEDY = "choose another folder (--out), or type what it was made with"
"""Remedy where the folder holds another sweep."""


def _differences(before: SweepRequest, request: SweepRequest) -> str:
    """Return the differences as text."""
    differences = [
        f"{name.replace('_', ' ')} {shown(old)} there, {shown(new)} now"
        for name, old, new in (
            (name, getattr(before, name), getattr(request, name)) for name in ("experiment", "first_seed", "seeds")
        )
        if old != new
    ]
    differences += _of_mapping("varied", before.varied, request.varied) + _of_mapping(
        "set", before.fixed, request.fixed
    )
    if not differences:
        return (
            "typed alike, but not the same: a file that it reads, or a default of another version of palpate, is "
            "another now"
        )
    more = f" and {len(differences) - MOST_DIFFERENCES} more" if len(differences) > MOST_DIFFERENCES else ""
    return "; ".join(differences[:MOST_DIFFERENCES]) + more


def _of_mapping(what: str, before: Mapping[str, object], request: Mapping[str, object]) -> list[str]:
    def text(value: object) -> str:
        return ",".join(value) if isinstance(value, list) else str(value)

    differences = []
    for name in dict.fromkeys((*before, *request)):
        if before.get(name) == request.get(name):
            continue
        old, new = (f"{text(values[name])}" if name in values else f"not {what}" for values in (before, request))
        differences.append(f"{name} {old} there, {new} now")
    if not differences and list(before) != list(request):
        differences.append(f"{what} in the order {', '.join(before)} there, {', '.join(request)} now")
    return differences


FIRST_COLUMNS = ("run",)
"""Columns before the varied options."""

MIDDLE_COLUMNS = ("seed", "status", "message", "duration_s", "host")
"""Columns between the varied options and the metrics."""

VERSIONED_PACKAGES = ("palpate", "python", "numpy", "scipy", "numba", "mujoco")
"""Packages whose versions stand in the last columns."""


def columns_of(plan: SweepPlan) -> tuple[str, ...]:
    """Return the names of all columns."""
    varied = (each.name for each in plan.varied)
    versions = (f"{name}_version" for name in VERSIONED_PACKAGES)
    return (
        *FIRST_COLUMNS,
        *varied,
        *MIDDLE_COLUMNS,
        *(metric.key for metric in plan.experiment.metrics),
        *versions,
    )


def rows_of(plan: SweepPlan, records: Sequence[RunRecord]) -> list[dict[str, MetricValue]]:
    """Return one row per record, by column."""
    rows = []
    for record in records:
        values = plan.runs[record.run].combination.values
        row: dict[str, MetricValue] = {"run": record.run}
        row |= {each.name: plain(value) for each, value in zip(plan.varied, values, strict=True)}
        row |= {
            "seed": record.seed,
            "status": record.status.value,
            "message": record.message,
            "duration_s": record.duration,
            "host": record.host,
        }
        row |= {metric.key: record.metrics.get(metric.key) for metric in plan.experiment.metrics}
        row |= {f"{name}_version": record.versions.get(name) for name in VERSIONED_PACKAGES}
        rows.append(row)
    return rows


def write_csv(rows: Sequence[Mapping[str, MetricValue]], columns: Sequence[str], path: Path) -> None:
    """Write rows as CSV with a heading; unknown values are empty, floats read back to the same bits.

    Raises:
        OSError: If the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(row[name]) for name in columns] for row in rows)
    with replacing(path) as file:
        file.write(text.getvalue().encode("utf-8"))


def write_parquet(rows: Sequence[Mapping[str, MetricValue]], columns: Sequence[str], path: Path) -> bool:
    """Write rows as Parquet, if pyarrow is installed; return whether it is.

    Raises:
        OSError: If the file cannot be written.
    """
    try:
        arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        return False
    table = arrow.table({name: arrow.array(_alike([row[name] for row in rows])) for name in columns})
    with replacing(path) as file:
        parquet.write_table(table, file)
    return True


def _cell(value: MetricValue) -> str:
    if value is None:
        return ""
    return (
        str(value).lower()
        if isinstance(value, bool)
        else repr(value)
        if isinstance(value, float)
        else inert_cell(str(value))
    )


def _alike(values: list[MetricValue]) -> list[MetricValue]:
    """Return the values as one type: a float makes all numbers floats, a word makes all values words."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float} and float in kinds:
        return [None if value is None else float(value) for value in values]
    if len(kinds) > 1:
        return [None if value is None else shown_value(value) for value in values]
    return values
