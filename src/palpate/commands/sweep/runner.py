"""Who does the runs: the processes of this computer, or those of a ray cluster (`ray_runner`)."""

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.commands.sweep.record import RunCase, RunRecord, RunStatus, without_result
from palpate.runtime.batch import Failure, FailureKind, Outcome, ShowProgress, run_batch


@dataclass(frozen=True, slots=True)
class LocalRunner:
    """Processes of this computer, by joblib's loky.

    Attributes:
        jobs: How many at a time; as many as there are cores, if not given.
    """

    jobs: int | None = None

    def describe(self) -> str:
        """Return where it does, for people."""
        return "on all cores" if self.jobs is None else f"{self.jobs} at a time"

    def run(self, cases: Sequence[RunCase], progress: ShowProgress, longest: float) -> None:
        """Run every case once, by `palpate.commands.sweep.attempt.attempt`.

        A case whose process dies runs again in another process; if it dies there, too, its outcome is a `Failure`.

        Args:
            cases: Runs to do.
            progress: Called once with each outcome as soon as it is known, in any order.
            longest: Longest wall time of a case [s]; a case that takes longer counts as one whose process died.

        Raises:
            BatchError: If no case can run at all.
            KeyboardInterrupt: On Ctrl-C; all processes have ended.
        """
        from palpate.commands.sweep.attempt import attempt  # with the simulator

        if cases:
            run_batch(attempt, cases, self.jobs, progress, longest=longest)


def record_of(outcome: Outcome[RunCase, RunRecord]) -> RunRecord:
    """Return what is kept of an outcome."""
    if isinstance(outcome, Failure):
        status = RunStatus.DIED if outcome.kind is FailureKind.DIED else RunStatus.FAILED
        return without_result(outcome.case, status, outcome.error, outcome.traceback)
    return outcome.result
