"""The client process: its loop and its worker. It stops the arm and ends when its parent process ends.

    python -m palpate.hw.ur.client_process PIPE

is started by `palpate.hw.ur.client`. Several times per cycle of the controller, the loop hands states on, sends
commands and monitors the connections; nothing in it waits for the controller. The worker does.
"""

import math
import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from ctypes import CDLL, c_ulong
from multiprocessing.connection import Connection
from queue import SimpleQueue
from time import monotonic, sleep

from palpate.hw.ur.exchange import (
    ClientPhase,
    Exchange,
    Opening,
    Order,
    Status,
    UrReply,
    UrRequest,
    UrState,
    UrTask,
)
from palpate.hw.ur.library import library_named
from palpate.hw.ur.problems import FATAL, PLAYING, Problem, UrRefusal, safety_problem
from palpate.hw.ur.rtde import cycle_rate
from palpate.hw.ur.session import RefusedError, Session
from palpate.hw.ur.state_receiver import ControllerRestartedError, ImpossibleStateError, StateReceiver

ROUNDS = 4
"""Rounds per cycle of the controller: a state is handed on half a millisecond after it came, at most."""

_KEEP_ALIVE = 0.2
"""Fraction of the watchdog's time after which it is fed, if no command did."""

_GIVE_UP = 1.0
"""[s] of silence, or after a lost connection, until the process ends: the library would begin to reconnect after
2.5 s without a state, and crash over it."""

_GIVEN_UP_FOR = {ControllerRestartedError: Problem.RESTARTED, ImpossibleStateError: Problem.RUBBISH}

_LONGEST_ROUND = 2e-3
"""[s] that a round counts for at most in the silence."""

_REASON_WITHIN = 0.01
"""[s] to wait, after a refused command, for the state that gives the reason."""

_LEAVE_WITHIN = 0.5
"""[s] to stop the arm and the script; if that hangs, the controller's watchdog stops the arm."""

_LOG = 2
"""Descriptor of the file in memory to which the library prints: both outputs are the same file here."""

_URGENT = -20
"""Niceness of the loop, and of the library's thread that receives states: before all ordinary ones (sched(7)).

Not of the worker, and no real-time priority: the library waits in busy loops, which must not starve the control
loop, or an emulator that they wait for."""

_SET_TIMER_SLACK = 29
"""PR_SET_TIMERSLACK of prctl(2), from linux/prctl.h."""

_REMEDY = "see what the library says, then `palpate recover`"


class ConnectionMonitor:
    """The loop, one round after the other.

    Attributes:
        phase: Progress of the process; set by the worker.
        state: Newest state.
    """

    def __init__(
        self, exchange: Exchange, opening: Opening, states: StateReceiver, rest: Callable[[], None], log: int
    ) -> None:
        """Begin.

        Args:
            exchange: Memory shared with the arm.
            opening: Settings of the process.
            states: Receiver of states.
            rest: Asks the worker to bring the arm to rest.
            log: Descriptor of the file to which the library prints.
        """
        self.phase = ClientPhase.LISTENING
        self.state: UrState | None = None
        self._exchange, self._opening, self._states = exchange, opening, states
        self._rest, self._log, self._log_size = rest, log, 0
        self._problem = Problem.NONE
        self._refused_since: float | None = None
        self._followed, self._lapses = 0, 0
        self._sent, self._rounds = 0.0, 0
        self._following = self._resting = False
        self._silence, self._last_round = 0.0, monotonic()

    def pause(self, phase: ClientPhase) -> None:
        """Follow no commands: the worker is about to bring the arm up, or to leave it."""
        self.phase = phase

    def go(self) -> None:
        """Follow commands from now on, but none that was given before, and forget the problem.

        For the worker; returns when that has been published.
        """
        command = self._exchange.command()
        self._followed = 0 if command is None else command.number
        self._following = self._resting = False
        self._problem, self._refused_since = Problem.NONE, None
        self.phase = ClientPhase.READY
        rounds = self._rounds
        while self._rounds < rounds + 2:  # one may have begun before
            sleep(1e-4)

    def round(self, now: float, session: Session) -> bool:
        """Run one round; return whether to go on: not if a connection is lost for good."""
        try:
            state = self._states.take(now)
        except (ControllerRestartedError, ImpossibleStateError) as error:
            self._found(_GIVEN_UP_FOR[type(error)])
            return False
        # our own pauses do not count: the library may not have had its turn yet, either
        self._silence += min(now - self._last_round, _LONGEST_ROUND)
        self._last_round = now
        if state is not None:
            self.state, self._silence = state, 0.0
            self._exchange.write_state(state)
        self._watch(now, session)
        self._attend(now, session)
        silent = self._silence >= _GIVE_UP
        if silent:  # while it is brought up, too: the process must not end without a report
            self._found(Problem.SILENT)
        self.publish(now)
        return self._problem not in FATAL and not silent

    def publish(self, now: float) -> None:
        """Publish the condition of the process."""
        self._rounds += 1
        sampled = -math.inf if self.state is None else self.state.time
        self._exchange.write_status(Status(now, sampled, self.phase, self._problem, self._followed, self._lapses))

    def _found(self, problem: Problem) -> None:
        """Keep the first problem: others follow from it. But a silence gives way to the loss that it announces."""
        if self._problem in (Problem.NONE, Problem.SILENT) and problem is not self._problem:
            first = self._problem is Problem.NONE
            self._problem = problem
            if first and self.phase is ClientPhase.READY:
                self._rest()

    def _watch(self, now: float, session: Session) -> None:
        if self._library_reconnects() or not session.connected:
            self._found(Problem.CONTROL_LOST)
        elif not self._states.connected:
            self._found(Problem.RECEIVE_LOST)
        if self.phase is not ClientPhase.READY or self.state is None:
            return
        safety = safety_problem(self.state.robot_mode, self.state.safety_bits)
        if safety is not Problem.NONE:
            self._found(safety)
        elif self.state.runtime_state != PLAYING:
            self._found(Problem.PROGRAM_STOPPED)
        elif self._refused_since is not None and now - self._refused_since > _REASON_WITHIN:
            self._found(Problem.REFUSED)
        elif self._silence > self._opening.stale_after:
            self._found(Problem.SILENT)

    def _library_reconnects(self) -> bool:
        """Return whether the library prints that it reconnects: it would go on with that for ever."""
        size = os.fstat(self._log).st_size
        if size == self._log_size:
            return False
        text = os.pread(self._log, size - self._log_size, self._log_size)
        self._log_size = size
        return b"reconnecting" in text

    def _attend(self, now: float, session: Session) -> None:
        """Send what is to be sent, unless the worker uses the session."""
        if (
            self.phase is not ClientPhase.READY
            or self._problem is not Problem.NONE
            or self._refused_since is not None
        ):
            return
        if not session.lock.acquire(blocking=False):
            return
        try:
            self._command(now, session)
        except RefusedError:
            self._refused_since = now
        finally:
            session.lock.release()

    def _command(self, now: float, session: Session) -> None:
        command = self._exchange.command()
        if command is not None and command.number != self._followed:
            self._take(command, now, session)
        elif now - self._sent > _KEEP_ALIVE * self._opening.watchdog:
            if command is not None and self._following and session.moves:
                self._repeat(command, now, session)
            else:
                session.kick()
            self._sent = now

    def _take(self, command: Order, now: float, session: Session) -> None:
        if session.moves and not command.moves:
            if not self._resting:  # first; the command, or a newer one, comes when it is at rest
                self._resting = True
                self._rest()
            return
        self._followed, self._resting = command.number, False
        self._following = command.moves
        session.follow(command)
        self._sent = now

    def _repeat(self, command: Order, now: float, session: Session) -> None:
        if now - command.time > self._opening.watchdog:
            self._following, self._lapses = False, self._lapses + 1
            self._rest()
        else:
            session.follow(command)


class Worker:
    """Thread that does one task after the other.

    Attributes:
        left: Set when the arm is released.
        leaving: Whether the process was asked to leave.
    """

    def __init__(self, pipe: Connection) -> None:
        """Make the thread, without starting it.

        Args:
            pipe: Pipe for replies.
        """
        self.left = threading.Event()
        self.leaving = False
        self._pipe, self._tasks = pipe, SimpleQueue[tuple[UrRequest, bool]]()

    def start(self, session: Session, monitor: ConnectionMonitor) -> None:
        """Begin; the thread ends with the process."""
        threading.Thread(target=self._serve, args=(session, monitor), name="UR worker", daemon=True).start()

    def ask(self, request: UrRequest) -> None:
        """Queue a request to be carried out and replied to."""
        self.leaving |= request.task is UrTask.LEAVE
        self._tasks.put((request, True))

    def do(self, task: UrTask) -> None:
        """Queue a task without a reply."""
        self._tasks.put((UrRequest(task), False))

    def _serve(self, session: Session, monitor: ConnectionMonitor) -> None:
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, 0)  # of this thread: see _URGENT
        while True:
            request, expects_reply = self._tasks.get()
            reply = _reply(request, session, monitor)
            if expects_reply:
                with suppress(OSError):  # the arm has gone; the loop finds that
                    self._pipe.send(reply)
            if request.task is UrTask.LEAVE:
                self.left.set()


def _reply(request: UrRequest, session: Session, monitor: ConnectionMonitor) -> UrReply:
    try:
        with session.lock:
            _perform(request.task, session, monitor)
    except RefusedError as refused:
        error = session.reason(refused)
        return UrReply(request.number, error.problem, error.remedy)
    except UrRefusal as error:
        return UrReply(request.number, error.problem, error.remedy)
    except Exception as error:  # the library raises RuntimeError, ValueError, and the errors of a socket
        return UrReply(request.number, f"{request.task} failed: {error}", _REMEDY)
    return UrReply(request.number)


def _perform(task: UrTask, session: Session, monitor: ConnectionMonitor) -> None:
    match task:
        case UrTask.BRING_UP | UrTask.RECOVER:
            monitor.pause(ClientPhase.LISTENING)
            session.bring_up() if task is UrTask.BRING_UP else session.recover()
            monitor.go()
        case UrTask.REST:
            session.rest()
        case UrTask.TARE:
            session.tare()
        case UrTask.LEAVE:
            monitor.pause(ClientPhase.LEAVING)
            session.leave()


def main() -> None:
    """Serve one arm."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # Ctrl-C and the like are for the arm's process, which reports them
    with suppress(OSError):  # threads inherit it; the worker gives it back
        os.setpriority(os.PRIO_PROCESS, 0, _URGENT)
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


def _serve(opening: Opening, exchange: Exchange, pipe: Connection, parent: int) -> None:
    library, rate = library_named(opening.library), cycle_rate(opening.version)
    exchange.write_status(Status(monotonic(), 0.0, ClientPhase.STARTING, Problem.NONE, 0, 0))
    receiver = library.receiver(opening.address, rate)
    if not receiver.isConnected():  # refused: the library makes a dead object of it, without a message
        raise ConnectionError("the controller refused to send states")
    states = StateReceiver(receiver, library.echo(opening.address, rate), rate)
    worker = Worker(pipe)
    monitor = ConnectionMonitor(exchange, opening, states, lambda: worker.do(UrTask.REST), _LOG)
    session = Session(opening, library, lambda: monitor.state)
    worker.start(session, monitor)
    _run(monitor, session, worker, pipe, parent, 1.0 / (ROUNDS * rate))
    if session.connected:
        if not worker.leaving:
            worker.do(UrTask.LEAVE)
        worker.left.wait(_LEAVE_WITHIN)


def _run(
    monitor: ConnectionMonitor, session: Session, worker: Worker, pipe: Connection, parent: int, period: float
) -> None:
    """Go round until the arm has been left, the parent is gone, or a connection is lost."""
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
