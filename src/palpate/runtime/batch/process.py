"""Worker processes as their parent sees them: one, and those that outlive a batch."""

import os
import pickle
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Pipe
from types import TracebackType
from typing import Self

import joblib
from joblib.externals.loky.backend import get_context

from palpate.errors import InvalidValueError
from palpate.interruption import SIGNALS
from palpate.one_thread import ONE_THREAD
from palpate.runtime.batch.worker import CASE, STOP, WORK, Message, serve

PR_SET_PDEATHSIG = 1
"""prctl(2)."""


def serve_until_orphaned(parent: int, served: bytes, *arguments: object) -> None:
    """Call what a worker is for; first see to it that it ends with its parent.

    Imports take seconds on a busy computer: this module has few, and what is served comes packed.

    Args:
        parent: Number of its process.
        served: A function, pickled.
        arguments: Of that.
    """
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.name == "posix" and os.getppid() != parent:
        return  # it died before
    pickle.loads(served)(*arguments)


JOIN_TIMEOUT = 5.0
"""For a worker to end by itself [s]: an interpreter with MuJoCo and numba takes about 0.1 s."""


STARTS_WITHIN = 120.0
"""For the first sign of life [s]: a new interpreter on a machine that is busy, or swaps."""

MOST_SILENT = 30.0
"""Between two signs of life, which are a second apart [s]: a worker that is stopped or swapped out gives none."""


class ParentTime:
    """Time in which the parent itself ran: one that was stopped with its workers must not find them late."""

    def __init__(self, most: float) -> None:
        """Begin; no two looks at the clock count as further apart than `most` [s]."""
        self._most, self._last, self.now = most, time.monotonic(), 0.0

    def look(self) -> None:
        """Look at the clock."""
        last, self._last = self._last, time.monotonic()
        self.now += min(self._last - last, self._most)


class WorkerProcess:
    """A Python of its own, started afresh (not forked: threads and locks do not survive that).

    Attributes:
        pipe: Readable when there is something to `receive`.
        ready: Whether it has loaded the work.
        index: Of the case that it is busy with.
        heard: When it last gave a sign of life, and
        begun: when it was sent that case, the parent's time [s].
    """

    def __init__(self, work: bytes, now: float = 0.0) -> None:
        """Prepare it.

        Args:
            work: What to do with a case, packed.
            now: The parent's time [s]; see `ParentTime`.
        """
        self.pipe, self._theirs = Pipe()
        self.ready = False
        self.index: int | None = None
        self.heard = self.begun = now
        self._speaks, self._surroundings = False, _surroundings()
        # sets of strings are then iterated alike in every worker
        seed = {} if os.environ.get("PYTHONHASHSEED", "").isdecimal() else {"PYTHONHASHSEED": "0"}
        arguments = (os.getpid(), pickle.dumps(serve), self._theirs, work)
        self._process = get_context("loky").Process(
            target=serve_until_orphaned, args=arguments, env=ONE_THREAD | seed
        )

    def start(self) -> None:
        """Start it.

        Raises:
            OSError: The system does not allow another process.
        """
        try:
            with _deaf_to_interrupts():
                self._process.start()
        finally:
            # the only copy is now the worker's: when it dies, however it dies, reading ends instead of waiting
            self._theirs.close()

    def renew(self, work: bytes, now: float) -> bool:
        """Give an idle worker other work, packed, at a time [s]; return whether it goes on as a new one would."""
        self.heard = self.begun = now
        try:
            while self.pipe.poll():  # what it has said since; a full pipe would stop it
                if self.receive(now) is None:
                    return False
            if self._surroundings != _surroundings():
                return False
            self.ready = False
            self.pipe.send_bytes(WORK + work)
        except OSError:
            return False
        return True

    @property
    def idle(self) -> bool:
        """Whether it waits for a case."""
        return self.ready and self.index is None

    def begin(self, index: int, case: bytes, now: float = 0.0) -> bool:
        """Send a case to an idle worker at a time [s]; return whether it still lived."""
        try:
            self.pipe.send_bytes(CASE + case)
        except OSError:
            return False
        self.index, self.begun = index, now
        return True

    def overdue(self, now: float, longest: float) -> str:
        """Return what it has not done in time; "" if nothing is late.

        Args:
            now: The parent's time [s].
            longest: That a case may take [s].
        """
        patience = MOST_SILENT if self._speaks else STARTS_WITHIN
        if now - self.heard > patience:
            return f"gave no sign of life for {patience:g} s"
        if self.index is not None and now - self.begun > longest:
            return f"was busy with one case for more than {longest:.0f} s"
        return ""

    def receive(self, now: float = 0.0) -> Message | None:
        """Return what it says at a time [s]; None if it has died."""
        try:
            message: Message = self.pipe.recv()
        except (EOFError, OSError):
            return None
        self.heard, self._speaks = now, True
        return message

    def dismiss(self) -> None:
        """Tell an idle worker to end; `bury` it then."""
        with suppress(OSError):  # it has ended already
            self.pipe.send_bytes(STOP)

    def kill(self) -> None:
        """End it at once, whatever it does; `bury` it then."""
        # not Process.kill: loky's processes have none. An exit code of None: the number is still this process's.
        if self._process.pid is not None and self._process.exitcode is None:
            os.kill(self._process.pid, getattr(signal, "SIGKILL", signal.SIGTERM))

    def bury(self) -> str:
        """Wait until it has ended, see to it that it does, and return how it did."""
        self.pipe.close()
        if self._process.pid is None:
            return "was never started"
        self._process.join(JOIN_TIMEOUT)
        if self._process.exitcode is None:
            self.kill()
            self._process.join()
        code = self._process.exitcode
        if code is not None and code < 0:
            return f"ended by {signal.Signals(-code).name}"
        return f"ended with exit code {code}"


class Workers:
    """Processes for several batches, one after the other; a context manager, after which none is left.

    Each is started when it is first needed. The next batch goes on with it, unless a new one could do something
    else: the folder, `sys.path` or environment of this process are others than when it was started, or a file of a
    module that it has imported has changed. As within a batch, what the work gives must not depend on what was
    done before.

    Example: with Workers(2) as workers: found = [results_of(run_batch(part, cases, workers)) for part in parts]

    Attributes:
        count: How many there are at most.
        running: All there are.
    """

    def __init__(self, count: int | None = None) -> None:
        """Start none yet.

        Args:
            count: How many at most; as many as this process may use cores, if not given.

        Raises:
            InvalidValueError: Fewer than one.
        """
        count = joblib.cpu_count() if count is None else count
        if not isinstance(count, int) or isinstance(count, bool) or count < 1:
            raise InvalidValueError(f"processes = {count!r}: must be a whole number, 1 or above")
        self.count = count
        self.running: list[WorkerProcess] = []

    def renew(self, work: bytes, now: float) -> None:
        """Give other work, packed, to those that wait, at a time [s]; end those that cannot take it."""
        for worker in [*self.running]:
            if not worker.renew(work, now):
                worker.kill()
                worker.bury()
                self.running.remove(worker)

    def kill(self) -> None:
        """End all at once, whatever they do."""
        for worker in self.running:
            worker.kill()
        self._bury()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        """End all."""
        for worker in self.running:
            worker.dismiss()
        self._bury()

    def _bury(self) -> None:
        for worker in self.running:
            worker.bury()
        self.running.clear()


def _surroundings() -> tuple[str, tuple[str, ...], dict[str, str]]:
    """Return what a process inherits: the folder it works in, where it imports from, its environment."""
    return os.getcwd(), tuple(sys.path), dict(os.environ)


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Start a process that no signal reaches while it is still starting: the mask is inherited."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)  # what came meanwhile comes now
