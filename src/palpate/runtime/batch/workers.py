"""Worker processes that outlive a batch: with their imports, kernels and scenes they wait for the next one."""

from types import TracebackType
from typing import Self

import joblib

from palpate.errors import InvalidValueError
from palpate.runtime.batch.process import WorkerProcess


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
