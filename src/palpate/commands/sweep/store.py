"""The folder of a sweep: what was asked, and each run as a file of its own that is there whole or not at all.

A process that is killed at whatever instant loses the runs that it was busy with, and nothing else.
"""

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
"""What was asked."""

BOUNDS = Bounds(size=1 << 22)
"""Of what was asked, and of what a run has found: some thousand figures take a tenth of it."""

VERSION = 1
"""Of the folder's layout."""

LONGEST_TOLD = 5
"""Differences that a refusal names."""

_PART = re.compile(r"\.\d{6}\.json\.[0-9a-f]{8}\.part")
"""What a writer that was killed leaves behind (`palpate.atomic_file.replacing`)."""


class Asked(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What was asked of a sweep, for people and for whoever goes on with it.

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


def asked_of(plan: SweepPlan) -> Asked:
    """Return what a plan asks for."""
    return Asked(
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
            InvalidValueError: The folder cannot be written, or is another sweep's: the message says what differs.
            OSError: A file cannot be written.
        """
        make_folder(self.path)
        asked, before = asked_of(plan), self._asked_before()
        if before is not None and before != asked:
            raise InvalidValueError(
                f"out = {self.path}: holds another sweep: {_differences(before, asked)}; {OTHER}"
            )
        self.runs.mkdir(exist_ok=True)
        if before is None:
            with replacing(self.path / SWEEP_FILE) as file:
                file.write(msgspec.json.format(msgspec.json.encode(asked), indent=2) + b"\n")
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
        with (self.path / ".lock").open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InvalidValueError(
                    f"out = {self.path}: another palpate sweep is at work there; wait, or choose another folder"
                ) from None
            except OSError:  # a file system without locks
                yield
                return
            yield

    def _file(self, number: int) -> Path:
        return self.runs / f"{number:06d}.json"

    def _asked_before(self) -> Asked | None:
        file = self.path / SWEEP_FILE
        try:
            return msgspec.json.decode(read_bytes(file, BOUNDS), type=Asked)
        except FileNotFoundError:
            return None
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise InvalidValueError(
                f"{file}: cannot be understood ({error}); choose another folder (--out)"
            ) from None


OTHER = "choose another folder (--out), or type what it was made with"
"""What to do about it."""


def _differences(before: Asked, asked: Asked) -> str:
    """Return what differs, in words."""
    told = [
        f"{name.replace('_', ' ')} {shown(old)} there, {shown(new)} now"
        for name, old, new in (
            (name, getattr(before, name), getattr(asked, name)) for name in ("experiment", "first_seed", "seeds")
        )
        if old != new
    ]
    told += _of_mapping("varied", before.varied, asked.varied) + _of_mapping("set", before.fixed, asked.fixed)
    if not told:
        return (
            "typed alike, but not the same: a file that it reads, or a default of another version of palpate, is "
            "another now"
        )
    more = f" and {len(told) - LONGEST_TOLD} more" if len(told) > LONGEST_TOLD else ""
    return "; ".join(told[:LONGEST_TOLD]) + more


def _of_mapping(what: str, before: Mapping[str, object], asked: Mapping[str, object]) -> list[str]:
    def text(value: object) -> str:
        return ",".join(value) if isinstance(value, list) else str(value)

    told = []
    for name in dict.fromkeys((*before, *asked)):
        if before.get(name) == asked.get(name):
            continue
        old, new = (f"{text(values[name])}" if name in values else f"not {what}" for values in (before, asked))
        told.append(f"{name} {old} there, {new} now")
    if not told and list(before) != list(asked):
        told.append(f"{what} in the order {', '.join(before)} there, {', '.join(asked)} now")
    return told
