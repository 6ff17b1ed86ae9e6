"""What runs in the client process. It ends with whoever started it, and lets go of the arm before.

    python -m palpate.hw.ur.client_process PIPE

is not for people: `palpate.hw.ur.client` starts it.
"""

import os
import signal
import sys
from contextlib import suppress
from ctypes import CDLL, c_ulong
from multiprocessing.connection import Connection
from time import monotonic, sleep

from palpate.hw.ur.connection_monitor import ConnectionMonitor
from palpate.hw.ur.exchange import ClientPhase, Exchange, Status
from palpate.hw.ur.library import library_named
from palpate.hw.ur.problems import Problem
from palpate.hw.ur.requests import Opening, UrTask
from palpate.hw.ur.session import Session
from palpate.hw.ur.state_receiver import StateReceiver
from palpate.hw.ur.version import cycle_rate, has_raw_wrench
from palpate.hw.ur.worker import Worker

ROUNDS = 4
"""Per cycle of the controller: a state is handed on half a millisecond after it came, at most."""

_LEAVE_WITHIN = 0.5
"""[s] to stop the arm and the script; what hangs is left to the controller's watchdog."""

_LOG = 2
"""The library prints to standard error; both outputs are the same file here."""

_URGENT = -20
"""Niceness of the loop, and of the library's thread that receives states: before all ordinary ones (sched(7)).

Not of the worker, and no real-time priority: the library waits in busy loops, which must not starve the control
loop, or an emulator that they wait for."""

_SET_TIMER_SLACK = 29
"""PR_SET_TIMERSLACK of prctl(2), from linux/prctl.h."""


def main() -> None:
    """Serve one arm."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # Ctrl-C and the like are for the arm's process, which tells us
    _be_urgent()
    CDLL(None).prctl(_SET_TIMER_SLACK, c_ulong(1), 0, 0, 0)
    parent = os.getppid()
    pipe = Connection(int(sys.argv[1]))
    opening: Opening = pipe.recv()
    exchange = Exchange(opening.memory)
    try:
        _serve(opening, exchange, pipe, parent)
    except BaseException as error:
        sys.stderr.write(f"{type(error).__name__}: {error}\n")
        exchange.write_status(Status(monotonic(), 0.0, ClientPhase.LEAVING, Problem.FAILED, 0, 0))
        os._exit(1)
    os._exit(0)  # the library's destructors would take another second, and a storm of reconnections go on


def _be_urgent() -> None:
    """Run before others, as far as that is allowed: the states' age is what it is late by.

    Threads inherit it; the worker gives it back.
    """
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _URGENT)


def _serve(opening: Opening, exchange: Exchange, pipe: Connection, parent: int) -> None:
    library, version = library_named(opening.library), opening.version
    exchange.write_status(Status(monotonic(), 0.0, ClientPhase.STARTING, Problem.NONE, 0, 0))
    rate = cycle_rate(version)
    receiver = library.receiver(opening.address, rate, version)
    if not receiver.isConnected():  # refused: the library makes a dead object of it, without a word
        raise ConnectionError("the controller refused to send states")
    echo = library.echo(opening.address, rate)
    state_receiver = StateReceiver(receiver, echo, rate, raw_wrench=has_raw_wrench(version))
    worker = Worker(pipe)
    monitor = ConnectionMonitor(exchange, opening, state_receiver, lambda: worker.do(UrTask.REST), _LOG)
    session = Session(opening, library, monitor.newest)
    worker.start(session, monitor)
    _rounds(monitor, session, worker, pipe, parent, 1.0 / (ROUNDS * rate))
    if session.connected:
        if not worker.leaving:
            worker.do(UrTask.LEAVE)
        worker.left.wait(_LEAVE_WITHIN)


def _rounds(
    monitor: ConnectionMonitor, session: Session, worker: Worker, pipe: Connection, parent: int, period: float
) -> None:
    """Go round until the arm has been left, whoever started us is gone, or a connection is lost."""
    while not worker.left.is_set():
        if not monitor.round(monotonic(), session):
            monitor.pause(ClientPhase.LEAVING)
            monitor.publish(monotonic())
            return
        try:
            while pipe.poll(0.0):
                worker.ask(pipe.recv())
        except (EOFError, OSError):
            return
        if os.getppid() != parent:
            return
        sleep(period)


if __name__ == "__main__":
    main()
