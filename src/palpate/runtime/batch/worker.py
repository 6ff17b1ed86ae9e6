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

STOP = b""
"""Instead of a case: end. No pickle is empty."""


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
        pipe: To the parent: cases in, messages out.
        work: What to do with a case, packed.
    """
    # Ctrl-C in a terminal, and its closing, reach every process: the parent decides
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    inbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    parent = _Parent(pipe)
    threading.Thread(target=_listen, args=(pipe, inbox, parent), daemon=True).start()
    try:
        call = pickle.loads(work)
    except Exception:
        parent.send(Refused(traceback.format_exc()))
        return
    parent.send(Ready())
    while (case := inbox.get()) != STOP:
        parent.send(_attempt(call, case))
    _end()


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
