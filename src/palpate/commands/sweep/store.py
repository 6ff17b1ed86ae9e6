"""The folder of a sweep: its request, and each run as a file of its own, written atomically.

A process that is killed at whatever instant loses the runs that it was busy with, and nothing else.
"""

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import msgspec

from palpate.atomic_file import replacing
from palpate.bounded_file import Bounds, read_bytes
from palpate.commands.sweep.plan import SweepPlan
from palpate.commands.sweep.record import RunRecord, read_record, record_text
from palpate.commands.typed_values import shown_value
from palpate.errors import InvalidValueError, shown
from palpate.experiments.kit.output_folder import make_folder

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
