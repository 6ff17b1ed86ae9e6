"""One run of a sweep: its case, and the record of it in one small file."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import msgspec

from palpate.experiments.kit.metric import MetricValue


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
