"""The client process's thread for what takes its time: it waits for the controller, the loop does not."""

import os
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import SimpleQueue

from palpate.hw.ur.attendance import Attendance
from palpate.hw.ur.exchange import Phase
from palpate.hw.ur.problems import Refusal
from palpate.hw.ur.requests import Answer, Request, Task
from palpate.hw.ur.session import RefusedError, Session

_REMEDY = "see what the library says, then recover()"


class Worker:
    """Does one task after the other.

    Attributes:
        left: Set when it has let go of the arm.
        leaving: Whether it was told to.
    """

    def __init__(self, pipe: Connection) -> None:
        """Make the thread, without starting it.

        Args:
            pipe: For answers.
        """
        self.left = threading.Event()
        self.leaving = False
        self._pipe, self._tasks = pipe, SimpleQueue[tuple[Request, bool]]()

    def start(self, session: Session, attendance: Attendance) -> None:
        """Begin; the thread ends with the process."""
        threading.Thread(target=self._serve, args=(session, attendance), name="UR worker", daemon=True).start()

    def ask(self, request: Request) -> None:
        """Have something done, and answered."""
        self.leaving |= request.task is Task.LEAVE
        self._tasks.put((request, True))

    def do(self, task: Task) -> None:
        """Have something done that nobody waits for."""
        self._tasks.put((Request(task), False))

    def _serve(self, session: Session, attendance: Attendance) -> None:
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, 0)  # of this thread: see the process's own niceness
        while True:
            request, answered = self._tasks.get()
            answer = _answer(request, session, attendance)
            if answered:
                with suppress(OSError):  # the arm has gone; the loop finds that
                    self._pipe.send(answer)
            if request.task is Task.LEAVE:
                self.left.set()


def _answer(request: Request, session: Session, attendance: Attendance) -> Answer:
    try:
        with session.lock:
            _perform(request, session, attendance)
    except RefusedError as refused:
        error = session.reason(refused)
        return Answer(request.number, error.problem, error.remedy)
    except Refusal as error:
        return Answer(request.number, error.problem, error.remedy)
    except Exception as error:  # the library's own are RuntimeError, ValueError, and what a socket raises
        return Answer(request.number, f"{request.task} failed: {error}", _REMEDY)
    return Answer(request.number)


def _perform(request: Request, session: Session, attendance: Attendance) -> None:
    values = request.values
    match request.task:
        case Task.BRING_UP | Task.RECOVER:
            attendance.pause(Phase.LISTENING)
            session.bring_up() if request.task is Task.BRING_UP else session.recover()
            attendance.go()
        case Task.REST | Task.END_FREE:
            session.rest()
        case Task.TARE:
            session.tare()
        case Task.PAYLOAD:
            session.set_payload(*values)
        case Task.TOOL:
            session.set_tool(*values)
        case Task.SLIDER:
            session.set_slider(*values)
        case Task.FREE:
            session.free()
            attendance.forget_commands()  # to stand still, which came before: it would end it
        case Task.LEAVE:
            attendance.pause(Phase.LEAVING)
            session.leave()
