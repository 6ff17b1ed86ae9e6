"""The parent's hold on one worker process."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Pipe

from joblib.externals.loky.backend import get_context

from palpate.one_thread import ONE_THREAD
from palpate.runtime.batch.worker import STOP, Message, serve

PATIENCE = 5.0
"""For a worker to end by itself [s]: an interpreter with MuJoCo and numba takes about 0.1 s."""


class WorkerProcess:
    """A Python of its own, started afresh (not forked: threads and locks do not survive that).

    Attributes:
        pipe: Readable when there is something to `receive`.
        ready: Whether it has loaded the work.
        index: Of the case that it is busy with.
    """

    def __init__(self, work: bytes) -> None:
        """Prepare it.

        Args:
            work: What to do with a case, packed.
        """
        self.pipe, self._theirs = Pipe()
        self.ready = False
        self.index: int | None = None
        # sets of strings are then iterated alike in every worker
        seed = {} if os.environ.get("PYTHONHASHSEED", "").isdecimal() else {"PYTHONHASHSEED": "0"}
        self._process = get_context("loky").Process(target=serve, args=(self._theirs, work), env=ONE_THREAD | seed)

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

    @property
    def idle(self) -> bool:
        """Whether it waits for a case."""
        return self.ready and self.index is None

    def begin(self, index: int, case: bytes) -> bool:
        """Send a case to an idle worker; return whether it still lived."""
        try:
            self.pipe.send_bytes(case)
        except OSError:
            return False
        self.index = index
        return True

    def receive(self) -> Message | None:
        """Return what it says; None if it has died."""
        try:
            message: Message = self.pipe.recv()
        except (EOFError, OSError):
            return None
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
        self._process.join(PATIENCE)
        if self._process.exitcode is None:
            self.kill()
            self._process.join()
        code = self._process.exitcode
        if code is not None and code < 0:
            return f"ended by {signal.Signals(-code).name}"
        return f"ended with exit code {code}"


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Start a process that Ctrl-C does not reach while it is still starting: the mask is inherited."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)  # an interrupt that came meanwhile comes now
