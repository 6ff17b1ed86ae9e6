"""The client process's thread for what takes its time: it waits for the controller, the loop does not."""

import os
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import SimpleQueue

from palpate.hw.ur.connection_monitor import ConnectionMonitor
from palpate.hw.ur.exchange import ClientPhase
from palpate.hw.ur.problems import UrRefusal
from palpate.hw.ur.requests import UrReply, UrRequest, UrTask
from palpate.hw.ur.session import RefusedError, Session

_REMEDY = "see what the library says, then `palpate recover`"


class Worker:
    """Does one task after the other.

    Attributes:
        left: Set when it has let go of the arm.
        leaving: Whether it was asked to.
    """

    def __init__(self, pipe: Connection) -> None:
        """Make the thread, without starting it.

        Args:
            pipe: For replies.
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
        """Have something done that nobody waits for."""
        self._tasks.put((UrRequest(task), False))

    def _serve(self, session: Session, monitor: ConnectionMonitor) -> None:
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, 0)  # of this thread: see the process's own niceness
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
            _perform(request, session, monitor)
    except RefusedError as refused:
        error = session.reason(refused)
        return UrReply(request.number, error.problem, error.remedy)
    except UrRefusal as error:
        return UrReply(request.number, error.problem, error.remedy)
    except Exception as error:  # the library's own are RuntimeError, ValueError, and what a socket raises
        return UrReply(request.number, f"{request.task} failed: {error}", _REMEDY)
    return UrReply(request.number)


def _perform(request: UrRequest, session: Session, monitor: ConnectionMonitor) -> None:
    values = request.values
    match request.task:
        case UrTask.BRING_UP | UrTask.RECOVER:
            monitor.pause(ClientPhase.LISTENING)
            session.bring_up() if request.task is UrTask.BRING_UP else session.recover()
            monitor.go()
        case UrTask.REST | UrTask.END_FREE:
            session.rest()
        case UrTask.TARE:
            session.tare()
        case UrTask.PAYLOAD:
            session.set_payload(*values)
        case UrTask.TOOL:
            session.set_tool(*values)
        case UrTask.SLIDER:
            session.set_slider(*values)
        case UrTask.FREE:
            session.free()
            monitor.forget_commands()  # to stand still, which came before: it would end it
        case UrTask.LEAVE:
            monitor.pause(ClientPhase.LEAVING)
            session.leave()
