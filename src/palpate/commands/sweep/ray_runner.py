"""Runs on a ray cluster: this process hands them out and takes them in, any node does them."""

import atexit
import os
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import joblib

from palpate.commands.command_result import ExitCode
from palpate.commands.sweep.plan import RunCase
from palpate.errors import InvalidValueError
from palpate.extras import require
from palpate.one_thread import ONE_THREAD
from palpate.runtime.batch import BatchError, BatchProgress, Failure, FailureKind, Outcome, ShowProgress, Success
from palpate.runtime.batch.process import ParentTime

AUTO, LOCAL = "auto", "local"
"""Values that replace an address: the cluster of this computer; a new cluster on this computer."""

MAX_PROGRESS_INTERVAL_S = 0.25
"""Longest time between two calls of `progress` [s]."""

MOST_DEATHS = 3
"""A case whose process dies is done again, but not a third time: one more than on one computer, for on a cluster
processes also die with the node that they are on."""

CASES_PER_CORE = 2
"""Cases per core that are handed out at a time: the next one waits where the last one ends."""

OBJECT_STORE_BYTES = 100 * 2**20
"""Memory for objects that nodes share, of a cluster of our own [bytes]: ray's least is 75 MB, a run gives 1 kB."""

CLUSTER_TIMEOUT = 5.0
"""Time in which a cluster must respond [s]."""

HEAD_LOST = 4.0
"""Time without a reply after which the cluster's head counts as lost [s]; replies take milliseconds."""

LARGEST_PORT = 65535


@dataclass(frozen=True, slots=True)
class RayRunner:
    """A ray cluster.

    Attributes:
        address: Address of the cluster, `AUTO` or `LOCAL`.
        jobs: Number of runs at a time; None for one per core.
    """

    address: str
    jobs: int | None = None

    def describe(self) -> str:
        """Return where the runs take place, as text."""
        where = {AUTO: "on this computer's ray cluster", LOCAL: "on a ray cluster of its own"}
        return where.get(self.address, f"on the ray cluster at {self.address}")

    def run(self, cases: Sequence[RunCase], progress: ShowProgress, longest: float) -> None:
        """See `palpate.commands.sweep.run.LocalRunner.run`; the time of a waiting case counts, too.

        Raises:
            HeadLostError: The head of the cluster has been lost.
            MissingLibraryError: ray is not installed.
            InvalidValueError: There is no such cluster.
        """
        if not cases:
            return
        check_ray(self.address)
        if self.address == LOCAL:
            # without consent ray must neither report usage nor listen on the network: it uses the loopback device
            os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
            os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
        ray = import_module("ray")
        with self._connected(ray):
            _Round(ray, cases, self.jobs, CASES_PER_CORE * longest).run(progress)

    @contextmanager
    def _connected(self, ray: Any) -> Iterator[None]:
        options: dict[str, Any] = {
            "log_to_driver": False,
            "logging_level": "ERROR",
            # one thread per worker, and sets of strings iterated alike, as on one computer
            "runtime_env": {"env_vars": ONE_THREAD | {"PYTHONHASHSEED": "0"}},
        }
        if self.address == LOCAL:
            cores = joblib.cpu_count() if self.jobs is None else self.jobs
            options |= {
                "address": LOCAL,
                "num_cpus": cores,
                "include_dashboard": False,
                "object_store_memory": OBJECT_STORE_BYTES,
            }
        else:
            options["address"] = self.address
        try:
            ray.init(**options)
        except Exception as error:  # ray has a kind for each of its layers: no cluster, no name, other versions
            raise InvalidValueError(_unreachable(self.address, f"{type(error).__name__}: {error}")) from None
        try:
            yield
        except HeadLostError:
            atexit.register(_leave)
            raise
        except BaseException:
            ray.shutdown()
            raise
        ray.shutdown()


def _leave() -> None:
    """End the process: ray would wait for the head that is lost, or crash; its reaper ends our own cluster."""
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(ExitCode.UNFINISHED)


def check_ray(address: str) -> None:
    """Refuse an unusable cluster before planning; ray itself waits for a minute.

    Raises:
        MissingLibraryError: If ray is not installed.
        InvalidValueError: If nothing listens at the address.
    """
    require("ray", "cluster", "--ray")
    if address in (AUTO, LOCAL):
        return
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not (colon and host and port.isdecimal() and int(port) <= LARGEST_PORT):
        raise InvalidValueError(f"ray = {address}: write {AUTO}, {LOCAL}, HOST:PORT, or ray://HOST:PORT")
    try:
        socket.create_connection((host.strip("[]"), int(port)), CLUSTER_TIMEOUT).close()
    except OSError as error:
        raise InvalidValueError(_unreachable(address, str(error))) from None


def _unreachable(address: str, reason: str) -> str:
    problem = " ".join(reason.split())
    return f"ray = {address}: cannot be reached ({problem}); `ray start --head` starts one and prints it"


class HeadLostError(BatchError):
    """The head of a ray cluster does not reply any more."""


class _Head:
    """Whether the head of a cluster replies: ray waits a minute for one that is lost, then ends the process.

    Attributes:
        cores: Number of cores of the cluster, which may grow.
        left: Set when the sweep has ended.
    """

    def __init__(self, ray: Any) -> None:
        """Begin to ask."""
        self._ray, self._replies, self._seen, self._at, self.cores, self.left = ray, 0, 0, 0.0, 1, False
        threading.Thread(target=self._ask, daemon=True).start()

    def _ask(self) -> None:
        while not self.left:
            with suppress(Exception):  # any error counts as no reply
                self.cores = max(1, int(self._ray.cluster_resources().get("CPU", 1)))
                self._replies += 1
            time.sleep(MAX_PROGRESS_INTERVAL_S)

    def lives(self, now: float) -> bool:
        """Return whether it has replied lately, at a time [s]."""
        if self._replies != self._seen:
            self._seen, self._at = self._replies, now
        return now - self._at < HEAD_LOST

    def check(self, now: float) -> None:
        """Look at it at a time [s].

        Raises:
            HeadLostError: If the cluster has been lost.
        """
        if not self.lives(now):
            raise HeadLostError(
                f"the head of the ray cluster has not replied for {HEAD_LOST:g} s; see that it runs (`ray status`)"
            )


@dataclass(slots=True)
class _Round:
    """The cases while they are being done."""

    ray: Any
    cases: Sequence[RunCase]
    jobs: int | None
    longest: float
    head: "_Head" = field(init=False)
    clock: ParentTime = field(default_factory=lambda: ParentTime(4.0 * MAX_PROGRESS_INTERVAL_S))
    begun: dict[Any, float] = field(default_factory=dict)
    waiting: deque[int] = field(init=False)
    handed_out: dict[Any, int] = field(default_factory=dict)
    deaths: dict[int, int] = field(default_factory=dict)
    done: int = 0
    failed: int = 0
    began: float = field(default_factory=time.perf_counter)

    def __post_init__(self) -> None:
        self.waiting, self.head = deque(range(len(self.cases))), _Head(self.ray)

    def run(self, progress: ShowProgress) -> None:
        """Do them."""
        from palpate.commands.sweep.attempt import attempt  # with the simulator

        # what dies is handed out again here, not by ray, which would not report it
        work = self.ray.remote(num_cpus=1, max_retries=0)(attempt)
        try:
            while self.done < len(self.cases):
                most = self._most()
                while self.waiting and len(self.handed_out) < most:
                    index = self.waiting.popleft()
                    reference = work.remote(self.cases[index])
                    self.handed_out[reference], self.begun[reference] = index, self.clock.now
                ready, _ = self.ray.wait(list(self.handed_out), num_returns=1, timeout=MAX_PROGRESS_INTERVAL_S)
                for reference in ready:
                    self._take(self.handed_out.pop(reference), reference, progress)
                self.clock.look()
                self.head.check(self.clock.now)
                self._give_up_late(progress)
                progress(self._progress())
        finally:
            self.head.left = True
            if self.head.lives(self.clock.now):  # a lost head cannot cancel them
                for reference in self.handed_out:
                    self.ray.cancel(reference, force=True)

    def _give_up_late(self, progress: ShowProgress) -> None:
        """Hand out overdue cases again: their worker is stopped, or hangs."""
        for reference in [each for each in self.handed_out if self.clock.now - self.begun[each] > self.longest]:
            self.ray.cancel(reference, force=True)
            self._died(self.handed_out.pop(reference), f"it took longer than {self.longest:.0f} s", progress)

    def _most(self) -> int:
        """Return the number of cases to hand out; the cluster may grow."""
        if self.jobs is not None:
            return self.jobs
        return CASES_PER_CORE * self.head.cores

    def _take(self, index: int, reference: Any, progress: ShowProgress) -> None:
        case, kinds = self.cases[index], self.ray.exceptions
        outcome: Outcome[RunCase, Any]
        try:
            record = self.ray.get(reference)
            outcome = Success(case, record, record.duration)
        except kinds.RuntimeEnvSetupError as error:
            raise BatchError(f"workers of the ray cluster do not start: {error}") from None
        except kinds.RayTaskError as error:
            # exceptions of a run are in its record; here the call failed, as for a missing package on the node
            outcome = Failure(case, FailureKind.RAISED, f"the node could not call it: {error.cause}", str(error))
        except kinds.RayError as error:
            self._died(index, type(error).__name__, progress)
            return
        self._settle(index, outcome, progress)

    def _died(self, index: int, how: str, progress: ShowProgress) -> None:
        self.deaths[index] = self.deaths.get(index, 0) + 1
        if self.deaths[index] < MOST_DEATHS:
            self.waiting.append(index)
            return
        problem = f"its process died, as {MOST_DEATHS - 1} before it: {how}"
        self._settle(index, Failure(self.cases[index], FailureKind.DIED, problem, ""), progress)

    def _settle(self, index: int, outcome: Outcome[RunCase, Any], progress: ShowProgress) -> None:
        self.done += 1
        self.failed += isinstance(outcome, Failure)
        progress(self._progress(index, outcome))

    def _progress(self, index: int | None = None, outcome: Outcome[Any, Any] | None = None) -> BatchProgress:
        elapsed = time.perf_counter() - self.began
        return BatchProgress(len(self.cases), self.done, self.failed, elapsed, index, outcome)
