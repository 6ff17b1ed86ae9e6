"""What runs in a worker process: one case after the other, until asked to stop or orphaned."""

import atexit
import os
import pickle
import queue
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, TypeAlias

from palpate.interruption import SIGNALS
from palpate.runtime.batch.pickling import packed

CASE, WORK, STOP = b"c", b"w", b""
"""Before a case, before other work, and instead of both: end."""


@dataclass(frozen=True, slots=True)
class Ready:
    """The work is loaded, its modules imported."""


@dataclass(frozen=True, slots=True)
class Refused:
    """The work cannot be loaded here.

    Attributes:
        traceback: Why.
    """

    traceback: str


@dataclass(frozen=True, slots=True)
class Done:
    """A case was carried out.

    Attributes:
        result: Packed.
        duration: Wall time [s].
    """

    result: bytes
    duration: float


@dataclass(frozen=True, slots=True)
class Raised:
    """A case raised an exception.

    Attributes:
        error: In one line.
        traceback: From the work on.
    """

    error: str
    traceback: str


@dataclass(frozen=True, slots=True)
class Alive:
    """This process runs, whatever it is busy with."""


Message: TypeAlias = Ready | Refused | Done | Raised | Alive

BEAT = 1.0
"""Time between two signs of life [s]."""


class _Parent:
    """Is sent messages, from any thread."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe, self._lock = pipe, threading.Lock()

    def send(self, message: Message) -> None:
        with self._lock:
            self._pipe.send(message)


def serve(pipe: Connection, work: bytes) -> None:
    """Carry out cases as they come.

    Args:
        pipe: To the parent: cases and other work in, messages out.
        work: What to do with a case, packed.
    """
    born = time.time()
    # Ctrl-C in a terminal, and its closing, reach every process: the parent decides
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    inbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    parent = _Parent(pipe)
    threading.Thread(target=_listen, args=(pipe, inbox, parent), daemon=True).start()
    call = _loaded(work, parent)
    while call is not None and (sent := inbox.get()) != STOP:
        if sent[:1] == CASE:
            parent.send(_attempt(call, sent[1:]))
        else:  # a new process imports what there is now
            call = None if _outdated(born) else _loaded(sent[1:], parent)
    _end()


def _loaded(work: bytes, parent: _Parent) -> Callable[[Any], object] | None:
    """Return what to do with a case, and tell the parent; None if it cannot be loaded."""
    try:
        call: Callable[[Any], object] = pickle.loads(work)
    except Exception:
        parent.send(Refused(traceback.format_exc()))
        return None
    parent.send(Ready())
    return call


def _outdated(born: float) -> bool:
    """Whether a file of an imported module has changed since this process began [s since the epoch]."""
    for module in [*sys.modules.values()]:
        try:
            found = os.stat(getattr(module, "__file__", None) or "")
        except (OSError, TypeError, ValueError):
            continue  # built in, or gone
        if max(found.st_mtime, found.st_ctime) > born:
            return True
    return False


def _end() -> None:
    """End this process as Python does, but without taking MuJoCo and numba apart, which takes half a second."""
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(0)


def _listen(pipe: Connection, inbox: "queue.SimpleQueue[bytes]", parent: _Parent) -> None:
    """Take in cases, and give signs of life; end this process at once, in mid-case, if the parent was killed."""
    while True:
        try:
            parent.send(Alive())
            if pipe.poll(BEAT):
                inbox.put(pipe.recv_bytes())
        except (EOFError, OSError):
            os._exit(1)


def _attempt(call: Callable[[Any], object], case: bytes) -> Done | Raised:
    began = time.perf_counter()
    try:
        result = call(pickle.loads(case))
        duration = time.perf_counter() - began
        return Done(packed("result", result), duration)
    except BaseException as error:  # also SystemExit: it ends the case, not the worker
        return _raised(error)


def _raised(error: BaseException) -> Raised:
    where = error.__traceback__
    if where is not None and where.tb_next is not None:
        where = where.tb_next  # from the work on: how it was called is of no interest
    text = "".join(traceback.format_exception(type(error), error, where))
    return Raised("".join(traceback.format_exception_only(error)).strip(), text)
