"""The batch itself: who does which case, and what happens when one of them dies."""

import math
import pickle
import time
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from multiprocessing.connection import wait
from typing import Any, Generic

from palpate.errors import InvalidValueError
from palpate.runtime.batch.outcome import (
    BatchError,
    BatchProgress,
    Case,
    Failure,
    FailureKind,
    Outcome,
    Result,
    ShowProgress,
    Success,
    batch_bar,
)
from palpate.runtime.batch.pickling import packed
from palpate.runtime.batch.process import ParentTime, WorkerProcess, Workers
from palpate.runtime.batch.worker import Done, Raised, Ready, Refused

TICK = 0.25
"""Longest time between two calls of `progress` [s]."""

MOST_DEATHS = 2
"""A case whose process dies is run once more, as it may have been another's fault (memory); not a third time."""

FALSE_STARTS_PER_PROCESS = 2
"""Workers that die before they have done anything, in a row: then something is wrong with all of them."""


def run_batch(
    work: Callable[[Case], Result],
    cases: Sequence[Case],
    processes: int | Workers | None = None,
    progress: ShowProgress | None = None,
    prepare: Callable[[], object] | None = None,
    longest: float = math.inf,
) -> list[Outcome[Case, Result]]:
    """Do the same work on many independent cases, several at a time, each in a process of its own.

    Outcomes come in the order of the cases. What a case gives depends on the case alone, whichever worker does it
    and however many there are, if the work itself does: it must seed its own random numbers and keep nothing from
    case to case. Then it is bit for bit what a plain loop gives, but for linear algebra of hundreds of rows, which
    BLAS adds up in another order on several threads; workers have one thread each.

    - A case that raises becomes a `Failure` with its traceback; the others go on.
    - A case whose process dies (a crash in C, out of memory, SIGKILL) is run once more, last, in another process;
      it disturbs no other case. If that dies too, it is a `Failure`.
    - So is a case that takes longer than `longest`, and one whose process gives no sign of life for half a minute:
      somebody has stopped it, or it is swapped out.
    - Ctrl-C, or an exception of `progress`, ends every worker at once and is raised. So does the death of this
      process, however it comes. What was found until then is what was reported to `progress`.

    Work, cases and results travel between processes as pickles. Functions and classes of a script or a notebook
    may be used, lambdas too. All results are held here at the end: let the work reduce them ("return the RMS, not
    the record"), or write them to a file and return its name.

    A worker starts in about the time of importing what the work needs: take cases of a second or more, and the
    same `Workers` for several batches. What numba compiles is kept on disk and compiled once, unless several
    workers meet a kernel for the first time together: let `prepare` do a short case, and it is there before they
    start.

    Args:
        work: What to do with a case.
        cases: What to do it with.
        processes: How many; as many as this process may use cores, if not given. Never more than cases. Or those
            of other batches, which are left running for the next one.
        progress: Told how far it is; a bar on the terminal after two seconds, if not given; `quiet` for nothing.
        prepare: Done once here, before any worker starts.
        longest: That a case may take, wall time [s].

    Raises:
        InvalidValueError: Fewer than one process; work or a case that does not pickle, or work that cannot be
            loaded in another process.
        BatchError: No worker lives long enough to do anything.
        KeyboardInterrupt: Ctrl-C; no worker is left.
    """
    cases = tuple(cases)
    with nullcontext(processes) if isinstance(processes, Workers) else Workers(processes) as workers:
        batch = _Batch(
            packed("work", work),
            cases,
            [packed(f"cases[{i}]", case) for i, case in enumerate(cases)],
            longest,
            workers,
        )
        if prepare is not None:
            prepare()
        with batch_bar() if progress is None else nullcontext(progress) as show:
            batch.run(show)
    return batch.outcomes()


class _Batch(Generic[Case]):
    """One batch while it runs."""

    def __init__(
        self,
        work: bytes,
        cases: tuple[Case, ...],
        packed_cases: list[bytes],
        longest: float,
        workers: Workers,
    ) -> None:
        """Take what to do, how long a case may take [s], and who does it."""
        self._work = work
        self._cases = cases
        self._packed = packed_cases
        self._waiting = deque(range(len(cases)))
        self._deaths = [0] * len(cases)
        self._outcomes: dict[int, Outcome[Case, Any]] = {}
        self._failed = 0
        self._false_starts = 0
        self._all, self._workers = workers, workers.running
        self._began = time.perf_counter()
        self._longest, self._time = longest, ParentTime(4.0 * TICK)

    def outcomes(self) -> list[Outcome[Case, Any]]:
        """Return all, in the order of the cases."""
        return [self._outcomes[index] for index in range(len(self._cases))]

    def run(self, show: ShowProgress) -> None:
        """Do all cases; if that comes to nothing, no worker is left."""
        try:
            if self._cases:
                self._all.renew(self._work, self._time.now)
            while len(self._outcomes) < len(self._cases):
                self._staff()
                speaking = set(wait([worker.pipe for worker in self._workers], TICK))
                for worker in [worker for worker in self._workers if worker.pipe in speaking]:
                    self._hear(worker, show)
                self._time.look()
                for worker in [*self._workers]:
                    if late := worker.overdue(self._time.now, self._longest):
                        self._mourn(worker, show, late)
                show(self._progress())
        except BaseException:
            self._all.kill()
            raise

    def _staff(self) -> None:
        """Have as many workers as are of use, and all of them busy."""
        for worker in self._workers:
            if self._waiting and worker.idle:
                index = self._waiting[0]
                if worker.begin(index, self._packed[index], self._time.now):
                    self._waiting.popleft()
        while len(self._workers) < min(self._all.count, len(self._cases) - len(self._outcomes)):
            worker = WorkerProcess(self._work, self._time.now)
            self._workers.append(worker)  # first: an interrupt while it starts must find it
            worker.start()

    def _hear(self, worker: WorkerProcess, show: ShowProgress) -> None:
        message = worker.receive(self._time.now)
        if message is None:
            self._mourn(worker, show)
        elif isinstance(message, Ready):
            worker.ready = True
        elif isinstance(message, Refused):
            raise InvalidValueError(
                "work cannot be loaded in another process: define it where that can import it\n"
                + message.traceback
            )
        elif isinstance(message, Done | Raised) and worker.index is not None:
            index, worker.index = worker.index, None
            self._false_starts = 0
            self._settle(index, self._outcome(index, message), show)

    def _mourn(self, worker: WorkerProcess, show: ShowProgress, late: str = "") -> None:
        """Take note of a worker that died, or end one that is late, and see to its case."""
        self._workers.remove(worker)
        worker.kill()
        how, index = worker.bury(), worker.index
        how = late or how
        if index is None:
            self._false_starts += 1
            if self._false_starts > FALSE_STARTS_PER_PROCESS * (len(self._workers) + 1):
                raise BatchError(f"{self._false_starts} workers died before they did anything; the last {how}")
            return
        self._deaths[index] += 1
        if self._deaths[index] < MOST_DEATHS:
            self._waiting.append(index)
        else:
            error = f"its process {how}, as the one before it died"
            self._settle(index, Failure(self._cases[index], FailureKind.DIED, error, ""), show)

    def _outcome(self, index: int, message: Done | Raised) -> Outcome[Case, Any]:
        case = self._cases[index]
        if isinstance(message, Raised):
            return Failure(case, FailureKind.RAISED, message.error, message.traceback)
        try:
            return Success(case, pickle.loads(message.result), message.duration)
        except Exception as error:
            line = f"the result cannot be unpickled here: {type(error).__name__}: {error}"
            return Failure(case, FailureKind.RAISED, line, traceback.format_exc())

    def _settle(self, index: int, outcome: Outcome[Case, Any], show: ShowProgress) -> None:
        self._outcomes[index] = outcome
        self._failed += isinstance(outcome, Failure)
        show(self._progress(index, outcome))

    def _progress(self, index: int | None = None, outcome: Outcome[Case, Any] | None = None) -> BatchProgress:
        elapsed = time.perf_counter() - self._began
        return BatchProgress(len(self._cases), len(self._outcomes), self._failed, elapsed, index, outcome)
