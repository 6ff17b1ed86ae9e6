"""Many independent runs over processes: cases in, outcomes out, in the same order and with the same numbers."""

from palpate.runtime.batch.outcome import (
    BatchError,
    BatchProgress,
    Failure,
    FailureKind,
    Outcome,
    ShowProgress,
    Success,
    batch_bar,
    quiet,
    results_of,
)
from palpate.runtime.batch.process import Workers
from palpate.runtime.batch.run import run_batch

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
