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
from palpate.commands.sweep.plan import SweepPlan
from palpate.commands.typed_values import plain, shown_value
from palpate.errors import InvalidValueError, shown
from palpate.experiments.kit.metric import MetricValue
from palpate.experiments.kit.output_folder import make_folder
from palpate.plain_text import inert_cell


class RunStatus(StrEnum):
    """How a run went."""

    DONE = "done"
    """To its end: its metrics count."""
    UNFINISHED = "unfinished"
    """The supervisor stopped it, contact was lost, or its time was up: it has metrics, which do not count."""
    FAILED = "failed"
    """It raised an exception."""
    DIED = "died"
    """Its process ended, more than once: a crash in C, out of memory, SIGKILL."""


@dataclass(frozen=True, slots=True, eq=False)
class RunCase:
    """What a worker is given: texts, so that it needs nothing that only the process has where it was typed.

    Attributes:
        run: Number of the run.
        digest: Of the case.
        experiment: What finds it, wherever the worker stands.
        config: Its configuration, as `palpate.experiments.kit.config_file` writes it,
        seed: but for the seed.
        folder: For report, log and files of the run; None if they are not kept.
    """

    run: int
    digest: str
    experiment: str
    config: str
    seed: int
    folder: Path | None = None


class RunRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What came of a run.

    Attributes:
        run: Its number, from 0: its place in the sweep.
        digest: Of its case, so that a file of another sweep is not mistaken for one of this.
        seed: Of its random numbers.
        status: How it went.
        message: How it ended, or what failed, in one line.
        traceback: Where that was raised; else empty.
        duration: Wall time in its process [s].
        host: Computer that did it.
        metrics: What came out, by column; the only part that is the same whoever does it.
        versions: Of Python and of the packages whose arithmetic the metrics depend on.
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
        """Whether its metrics count."""
        return self.status is RunStatus.DONE


def record_text(record: RunRecord) -> bytes:
    """Return it as JSON; `read_record` gives back the very same, every float to the last bit."""
    return msgspec.json.encode(record) + b"\n"


def read_record(text: bytes) -> RunRecord | None:
    """Return what `record_text` wrote; None if it is something else, as after a loss of power."""
    try:
        return msgspec.json.decode(text, type=RunRecord)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None


def without_result(case: RunCase, status: RunStatus, error: str, trace: str = "") -> RunRecord:
    """Return the record of a run that could not write its own."""
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

BOUNDS = Bounds(size=1 << 22)
"""Of what was asked, and of what a run has found: some thousand metrics take a tenth of it."""

VERSION = 1
"""Of the folder's layout."""

MOST_DIFFERENCES = 5
"""Differences that a refusal names."""

_PART = re.compile(r"\.\d{6}\.json\.[0-9a-f]{8}\.part")
"""What a writer that was killed leaves behind (`palpate.atomic_file.replacing`)."""


class SweepRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The request of a sweep, for people and for resuming it.

    Attributes:
        palpate_sweep: Version of the folder.
        experiment: What was done.
        varied: Options that were varied, with their values as typed.
        fixed: Options that were set, in the command or in an experiment file.
        first_seed: Of each combination,
        seeds: and how many there are.
        runs: How many there are in all.
        digest: Of every value that the runs depend on, what they have by default and the files they read included.
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
    """Return what a plan asks for."""
    return SweepRequest(
        palpate_sweep=VERSION,
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
        """Where the runs are."""
        return self.path / "runs"

    def begin(self, plan: SweepPlan) -> dict[int, RunRecord]:
        """Make the folder this plan's, and return what is finished of it, by number.

        Raises:
            InvalidValueError: The folder cannot be written, or is another sweep's: the message names what differs.
            OSError: A file cannot be written.
        """
        make_folder(self.path)
        request, before = request_of(plan), self._request_before()
        if before is not None and before != request:
            raise InvalidValueError(
                f"out = {self.path}: holds another sweep: {_differences(before, request)}; {OTHER}"
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
        """Return every run of a plan that is kept here, by number."""
        found = {}
        for run in plan.runs:
            try:
                record = read_record(read_bytes(self._file(run.number), BOUNDS))
            except FileNotFoundError:
                continue
            # what cannot be read, or is of something else, is run (again)
            if record is not None and (record.run, record.digest) == (run.number, run.case.digest):
                found[run.number] = record
        return found

    def keep(self, record: RunRecord) -> None:
        """Keep a run.

        Raises:
            OSError: It cannot be written.
        """
        with replacing(self._file(record.run)) as file:
            file.write(record_text(record))

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep others off the folder, until it is left or this process ends, however that comes.

        Raises:
            InvalidValueError: Another process is at work there.
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
            return msgspec.json.decode(read_bytes(file, BOUNDS), type=SweepRequest)
        except FileNotFoundError:
            return None
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise InvalidValueError(
                f"{file}: cannot be understood ({error}); choose another folder (--out)"
            ) from None


OTHER = "choose another folder (--out), or type what it was made with"
"""What to do about it."""


def _differences(before: SweepRequest, request: SweepRequest) -> str:
    """Return what differs, in words."""
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


FRONT = ("run",)
"""Columns before the options that were varied,"""

MIDDLE = ("seed", "status", "message", "duration_s", "host")
"""and behind them, before the metrics."""

VERSIONS = ("palpate", "python", "numpy", "scipy", "numba", "mujoco")
"""Whose versions stand in the last columns."""


def columns_of(plan: SweepPlan) -> tuple[str, ...]:
    """Return the names of all columns."""
    varied = (each.name for each in plan.varied)
    versions = (f"{name}_version" for name in VERSIONS)
    return (*FRONT, *varied, *MIDDLE, *(metric.key for metric in plan.experiment.metrics), *versions)


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
        row |= {f"{name}_version": record.versions.get(name) for name in VERSIONS}
        rows.append(row)
    return rows


def write_csv(rows: Sequence[Mapping[str, MetricValue]], columns: Sequence[str], path: Path) -> None:
    """Write rows as CSV with a heading; what is not known is empty, floats read back to the same bits.

    Raises:
        OSError: The file cannot be written.
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
        OSError: The file cannot be written.
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
    """Values of one type, as a column needs them: whole numbers among others are such, words make all words."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float} and float in kinds:
        return [None if value is None else float(value) for value in values]
    if len(kinds) > 1:
        return [None if value is None else shown_value(value) for value in values]
    return values
