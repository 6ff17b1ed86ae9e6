"""The outcome of a case, the progress of a batch, and the bar that shows it."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import Any, Generic, TypeAlias, TypeVar

from rich.console import Console

from palpate.errors import PalpateError, shown
from palpate.runtime.progress import COUNT, progress_bar

SHOWN_AFTER = 2.0
"""A shorter batch shows no bar [s]."""

Case = TypeVar("Case")
Result = TypeVar("Result")


class BatchError(PalpateError, RuntimeError):
    """A batch, or a case that was needed, came to nothing."""


class FailureKind(Enum):
    """Why a case has no result."""

    RAISED = "raised an exception"
    DIED = "ended its process, twice"


@dataclass(frozen=True, slots=True, eq=False)
class Success(Generic[Case, Result]):
    """A case that was carried out.

    Attributes:
        case: As it was given.
        result: What the work returned, a copy from the worker.
        duration: Of the work, wall time in its worker [s].
    """

    case: Case
    result: Result
    duration: float


@dataclass(frozen=True, slots=True, eq=False)
class Failure(Generic[Case]):
    """A case without a result.

    Attributes:
        case: As it was given.
        kind: What happened.
        error: In one line: the exception, or how the process ended.
        traceback: Where in the work it was raised; empty if its process ended.
    """

    case: Case
    kind: FailureKind
    error: str
    traceback: str


Outcome: TypeAlias = Success[Case, Result] | Failure[Case]


@dataclass(frozen=True, slots=True, eq=False)
class BatchProgress:
    """How far a batch is.

    Attributes:
        cases: How many there are.
        done: How many of them have an outcome, failures included.
        failed: How many failed.
        elapsed: Since the batch began, wall time [s].
        index: Of the case that has just got its outcome; None if only time has passed.
        outcome: That outcome.
    """

    cases: int
    done: int
    failed: int
    elapsed: float
    index: int | None = None
    outcome: Outcome[Any, Any] | None = None


ShowProgress: TypeAlias = Callable[[BatchProgress], None]
"""Told once per finished case, and every now and then between two."""


def results_of(outcomes: Iterable[Outcome[Case, Result]]) -> list[Result]:
    """Return the results of a batch of which every case counts.

    Raises:
        BatchError: A case failed; the message says how many, and shows the first with its traceback.
    """
    outcomes = list(outcomes)
    failures = [outcome for outcome in outcomes if isinstance(outcome, Failure)]
    if failures:
        first = failures[0]
        raise BatchError(
            f"{len(failures)} of {len(outcomes)} cases failed; the first is {shown(first.case)}, which "
            f"{first.kind.value}: {first.error}\n{first.traceback}".rstrip()
        )
    return [outcome.result for outcome in outcomes if isinstance(outcome, Success)]


def quiet(progress: BatchProgress) -> None:
    """Show nothing."""


@contextmanager
def batch_bar(console: Console | None = None) -> Iterator[ShowProgress]:
    """Show how far a batch is, from two seconds on; yields the function that `run_batch` calls.

    Args:
        console: Where to; standard error if not given. Only a terminal gets a bar.
    """
    console = Console(stderr=True) if console is None else console
    with progress_bar(console, "cases", None, COUNT, after=SHOWN_AFTER) as bar:

        def show(progress: BatchProgress) -> None:
            failed = f", {progress.failed} failed" if progress.failed else ""
            bar.show(progress.done, words=f"cases{failed}", total=progress.cases, elapsed=progress.elapsed)

        yield show
