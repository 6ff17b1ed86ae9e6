"""Start, query and terminate the UR client process.

The library that talks to the controller may crash, hang, and stop all threads for half a second: it runs in a
process of its own. After a crash, its exit code and its last messages remain.
"""

import os
import subprocess
import sys
import threading
from contextlib import suppress
from multiprocessing import Pipe
from time import monotonic, sleep

from palpate.hw.devices import DeviceError, WireError
from palpate.hw.ur.exchange import ClientPhase, Exchange, Status, UrReply, UrRequest, UrTask, new_memory
from palpate.hw.ur.problems import FATAL, WORDS, Problem, device_error
from palpate.hw.ur.rtde import Version
from palpate.hw.ur.settings import UrSettings

LEAVE_WITHIN = 3.0
"""[s] to stop the arm and to end; then it is killed, and the controller's watchdog stops the arm."""

HANG_TIME_S = 0.5
"""[s] without a beat after which the process is given up: even on a busy machine it runs more often."""

_KILLED_WITHIN = 5.0
_SHOWN = 300
"""Characters of its last output that an error message repeats."""


class Client:
    """One client process.

    Attributes:
        exchange: Memory shared with it.
    """

    def __init__(self, device: str, address: str, settings: UrSettings, version: Version, library: str) -> None:
        """Start it, without waiting for it.

        Args:
            device: Name of the device for messages.
            address: Host name or IP address of the controller.
            settings: Settings of the arm.
            version: Version of the controller.
            library: Name of the module that makes connections.
        """
        import fcntl  # not above: simulations run where there is no such module

        self._device, self._start_within = device, settings.start_within
        self._asking, self._asked = threading.Lock(), 0
        self._log = os.memfd_create("palpate-ur-log")
        fcntl.fcntl(self._log, fcntl.F_SETFL, os.O_APPEND)
        memory = new_memory()
        self._pipe, theirs = Pipe()
        try:
            self.exchange = Exchange(memory)
            self._process = subprocess.Popen(
                # -P: files in the working folder may have the names of Python's modules
                [sys.executable, "-P", "-m", "palpate.hw.ur.client_process", str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=self._log,
                pass_fds=(theirs.fileno(), memory),
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                start_new_session=True,  # Ctrl-C is for the loop, which brings the arm to rest first
            )
            self._pipe.send(settings.opening(address, version, library, memory))
        finally:
            os.close(memory)
            theirs.close()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def status(self) -> Status:
        """Return its condition.

        Raises:
            DeviceError: If it has ended, or reports why the arm does not go on.
        """
        status = self.exchange.status()
        if status is not None and status.problem not in (Problem.NONE, Problem.FAILED):
            raise device_error(self._device, status.problem)
        code = self._process.poll()
        if code is not None:
            raise self._dead(code)
        return status or Status(0.0, 0.0, ClientPhase.STARTING, Problem.NONE, 0, 0)

    @property
    def responsive(self) -> bool:
        """Whether it runs its rounds, and is not about to end."""
        status = self.exchange.status()
        if self._process.poll() is not None or status is None:
            return False
        return (
            status.phase < ClientPhase.LEAVING
            and status.problem not in FATAL
            and monotonic() - status.beat < HANG_TIME_S
        )

    def wait_for(self, phase: ClientPhase, deadline: float) -> None:
        """Wait until the client reaches `phase`.

        Raises:
            DeviceError: If it ended, or has not reached it by `deadline` (`time.monotonic`).
        """
        while self.status().phase < phase:
            if monotonic() > deadline:
                raise DeviceError(
                    self._device,
                    f"the process that talks to it is not up within {self._start_within:g} s{self._last_output()}",
                    "see that controller and network are up and fast enough, or allow a longer start_within",
                )
            sleep(1e-3)

    def ask(self, task: UrTask, within: float) -> None:
        """Have a task done.

        Raises:
            DeviceError: If it failed, or was not done within `within` [s]; then the process hangs, and is killed.
        """
        with self._asking:
            try:
                self._asked += 1
                self._pipe.send(UrRequest(task, self._asked))
                reply = self._reply_by(monotonic() + within)
            except (EOFError, BrokenPipeError, ConnectionResetError) as error:
                raise self._lost() from error
        if reply is None:
            self._kill()
            raise WireError(
                self._device,
                f"no reply to {task} within {within:.1f} s{self._last_output()}",
                "see that the controller is up, then `palpate recover`",
            )
        if reply.problem:
            raise DeviceError(self._device, reply.problem, reply.remedy)

    def close(self) -> None:
        """Stop the arm and end the process, by force if it does not; may be called more than once."""
        if self._process.poll() is None:
            with suppress(DeviceError):
                self.ask(UrTask.LEAVE, LEAVE_WITHIN)
        self._pipe.close()  # it ends when the other end is closed
        try:
            self._process.wait(LEAVE_WITHIN)
        except subprocess.TimeoutExpired:
            self._kill()
        if self._log >= 0:
            self.exchange.close()
            os.close(self._log)
            self._log = -1

    def _reply_by(self, deadline: float) -> UrReply | None:
        while self._pipe.poll(max(0.0, deadline - monotonic())):
            reply: UrReply = self._pipe.recv()
            if reply.number == self._asked:
                return reply
        return None

    def _kill(self) -> None:
        self._process.kill()
        self._process.wait(_KILLED_WITHIN)

    def _lost(self) -> DeviceError:
        """Return why it no longer replies."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(LEAVE_WITHIN)
        try:
            self.status()
        except DeviceError as error:
            return error
        return device_error(self._device, Problem.FAILED)

    def _dead(self, code: int) -> DeviceError:
        how = f"was ended by signal {-code}" if code < 0 else f"ended with {code}"
        return DeviceError(
            self._device,
            f"the process that talks to it {how}; the controller's watchdog stopped the arm{self._last_output()}",
            WORDS[Problem.FAILED][1],
        )

    def _last_output(self) -> str:
        if self._log < 0:
            return ""
        size = os.fstat(self._log).st_size
        lines = os.pread(self._log, _SHOWN, max(0, size - _SHOWN)).decode(errors="replace").split("\n")
        output = " | ".join(filter(None, map(str.strip, lines)))
        return f" (its last output: {output})" if output else ""
