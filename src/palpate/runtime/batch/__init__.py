"""Many independent runs over processes: cases in, outcomes out, in the same order and with the same numbers."""

from palpate.runtime.batch.bar import batch_bar, quiet
from palpate.runtime.batch.outcome import (
    BatchError,
    BatchProgress,
    Failure,
    FailureKind,
    Outcome,
    ShowProgress,
    Success,
    results_of,
)
from palpate.runtime.batch.run import run_batch
from palpate.runtime.batch.workers import Workers

__all__ = [
    "BatchError",
    "BatchProgress",
    "Failure",
    "FailureKind",
    "Outcome",
    "ShowProgress",
    "Success",
    "Workers",
    "batch_bar",
    "quiet",
    "results_of",
    "run_batch",
]
