"""Commands that start processes of their own: what is left when one of them is killed."""

import signal
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

import psutil

from faults.cell import own_address
from faults.command import ENDS_WITHIN, OUT, Command, shared_memory
from faults.kind import Domain, Kind, Moment, Verdict, Workshop
from support.emulated_file import unhurried_file
from support.free_ports import PORTS, free

ROBOT = "ROBOT"
"""Stands in the words for a file of the emulated UR5e, at an address of its own."""

SCALE = 0.25
"""Of its time: a busy computer's stalls are shorter then."""

Ready = Callable[[Command], bool]


def moving(command: Command) -> bool:
    """Whether it records a run."""
    return bool(list(command.out.glob("*.mcap")))


def has_children(count: int) -> Ready:
    """Whether it has so many processes."""

    def ready(command: Command) -> bool:
        command.count_family()
        return len(command.family) > count

    return ready


@dataclass(frozen=True, slots=True)
class Killed:
    """One process of a command is killed: nothing of it is left; if it was not the first, that reports it.

    Attributes:
        words: Of the command.
        ready: Whether it is time.
        whom: Words in the command line of the process; empty: the first.
        number: The signal.
        codes: Exit codes of the first process.
        sockets: Whether ports of the emulated controller must be free.
    """

    words: tuple[str, ...]
    ready: Ready
    whom: str = ""
    number: int = signal.SIGKILL
    codes: tuple[int, ...] = (-signal.SIGKILL,)
    sockets: bool = False

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """See `Trial`."""
        folder = Path(tempfile.mkdtemp(dir=workshop.folder))
        address = own_address()
        robot = unhurried_file(folder, address, SCALE)
        command = Command([word.replace(ROBOT, robot) for word in self.words], folder)
        problems, before = [], shared_memory()
        try:
            deadline = monotonic() + ENDS_WITHIN
            while not self.ready(command):
                if command.process.poll() is not None or monotonic() > deadline:
                    return Verdict("", (f"was never ready: {command.shown[-200:]}",))
                sleep(0.01)
            sleep(moment.share)
            command.count_family()
            chosen = self._chosen(command, moment)
            if chosen is None:
                return Verdict("", (f"has no process {self.whom!r}",))
            chosen.send_signal(self.number)
            code = command.ended()
            if code not in self.codes:
                problems.append(f"exit code {code}, promised {' or '.join(map(str, self.codes))}")
            if "Traceback" in command.shown:
                problems.append("a traceback: " + command.shown.strip().splitlines()[-1][:120])
            problems += command.left()
            if shared_memory() > before:
                problems.append("shared memory is left")
            if self.sockets:
                problems += [f"port {port} is not free" for port in PORTS if not free(address, port)]
        finally:
            command.close()
        return Verdict(f"exit code {code}", tuple(problems))

    def _chosen(self, command: Command, moment: Moment) -> psutil.Process | None:
        if not self.whom:
            return psutil.Process(command.process.pid)
        found = []
        for pid in sorted(command.family - {command.process.pid}):
            with suppress(psutil.NoSuchProcess):
                process = psutil.Process(pid)
                if self.whom in " ".join(process.cmdline()):
                    found.append(process)
        return found[moment.seed % len(found)] if found else None


ON_EMULATED = ("regulate", "--robot", ROBOT, "--duration", "5", "--out", OUT)
SWEEP = ("sweep", "regulate", "--vary", "force=1,2,3,4", "--set", "duration=1", "--jobs", "2", "--out", OUT)
WORKER = "popen_loky"
"""In the command line of a sweep's worker, but not of the process that counts what they share."""

VIEW = ("view", "explore", "--port", "0", "--set", f"out={OUT}")
VIEW_ON_EMULATED = ("view", "regulate", "--port", "0", "--set", f"out={OUT}", f"robot={ROBOT}", "duration=5")
ENDS_WELL = (0, 1)


def _kind(name: str, killed: Killed) -> Kind:
    return Kind(name, Domain.PROCESS, killed)


KINDS = (
    _kind("kill -9 of a run on emulated-ur5e", Killed(ON_EMULATED, moving, sockets=True)),
    _kind(
        "kill -9 of its emulator",
        Killed(ON_EMULATED, moving, "spawn_main", codes=(1,), sockets=True),
    ),
    _kind("kill -9 of its client", Killed(ON_EMULATED, moving, "client_process", codes=(1,), sockets=True)),
    _kind(
        "the terminal of a run on emulated-ur5e sends SIGHUP",
        Killed(ON_EMULATED, moving, number=signal.SIGHUP, codes=(129,), sockets=True),
    ),
    _kind("kill -9 of a sweep", Killed(SWEEP, has_children(2))),
    _kind("kill of a sweep", Killed(SWEEP, has_children(2), number=signal.SIGTERM, codes=(143,))),
    _kind("kill -9 of a sweep's worker", Killed(SWEEP, has_children(2), WORKER, codes=ENDS_WELL)),
    _kind("a sweep's worker is stopped", Killed(SWEEP, has_children(2), WORKER, signal.SIGSTOP, ENDS_WELL)),
    _kind("kill -9 of a viewer", Killed(VIEW, moving)),
    _kind("kill -9 of a viewer while it starts", Killed(VIEW, has_children(1))),
    _kind("kill -9 of a viewer on emulated-ur5e", Killed(VIEW_ON_EMULATED, moving, sockets=True)),
)
"""All of them."""
