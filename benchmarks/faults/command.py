"""A whole palpate command in a process of its own, on an emulated cell: something happens to it, and is judged."""

import fcntl
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import termios
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic, sleep, time

import psutil

from faults.cell import FORCE_LIMIT, EmulatedCell
from faults.kind import Moment, Verdict, Workshop
from faults.on_the_loop import FORCE_EXCESS, contradiction
from palpate.errors import PalpateError
from palpate.hw.rig import FreshlyTared
from palpate.interruption import SIGNALS
from palpate.robots.rig import assembled
from palpate.robots.robot import load_robot
from palpate.runtime.data import Command as Motion
from palpate.runtime.log import read_log
from palpate.runtime.rest import RestState

WATCHDOG = 1.0
"""[s] of the arm, as the robot file has it."""

REST_WITHIN = WATCHDOG + 0.5
"""[s] for the arm to rest after a command is gone."""

GONE_WITHIN = 15.0
"""[s] for processes to end after their parent: a client process stops the arm and ends the script first, and what
still starts looks once it has, on a busy computer after seconds."""

ENDS_WITHIN = 60.0
"""[s] for a command to end that was asked to, and for a stage to come."""

MOST_LOST = 0.5
"""[s] of a log before the process was killed."""

STAGES = {"planning": "planning", "connecting": "running, about", "drawing": "drawing the report|working out"}
"""What standard error has of each; what is running has a log."""

CONNECTING = 1.0
"""[s] that a start on the wire lasts, about."""

RUNS = 2.0
"""[s] that a run lasts, about."""

OUT = "OUT"
"""Stands in the words for the folder of a command's output."""


class Command:
    """One that runs."""

    def __init__(
        self,
        words: Sequence[str],
        folder: Path,
        prepare: Callable[[], object] | None = None,
        watch: Callable[[], object] = lambda: None,
    ) -> None:
        """Start it.

        Args:
            words: As typed, but for `OUT`.
            folder: Empty; for its output and temporary files.
            prepare: Called in its process before palpate begins: limits.
            watch: Called again and again while its end is waited for.
        """
        self._watch = watch
        self.out, self.temporary = folder / "out", folder / "tmp"
        self.temporary.mkdir()
        self._shown = (folder / "shown").open("wb+")
        self._printed = (folder / "printed").open("wb+")
        self.master, slave = os.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "palpate", *(word.replace(OUT, str(self.out)) for word in words)],
            stdin=slave,
            stdout=self._printed,
            stderr=self._shown,
            start_new_session=True,
            env=os.environ | {"TMPDIR": str(self.temporary), "COLUMNS": "200", "PYTHONFAULTHANDLER": ""},
            preexec_fn=lambda: _prepared(prepare),
        )
        os.close(slave)
        self.family = {self.process.pid}

    @property
    def shown(self) -> str:
        """What it has written to standard error."""
        return os.pread(self._shown.fileno(), 1 << 20, 0).decode(errors="replace")

    @property
    def said(self) -> str:
        """What it has written to standard output."""
        return os.pread(self._printed.fileno(), 1 << 22, 0).decode(errors="replace")

    @property
    def printed(self) -> dict[str, object]:
        """The JSON document; empty if there is none."""
        try:
            found: dict[str, object] = json.loads(self.said)
        except ValueError:
            return {}
        return found

    def wait_for(self, stage: str, share: float) -> None:
        """Wait for a stage, and on in it."""
        deadline = monotonic() + ENDS_WITHIN
        if stage == "importing":
            sleep(0.1 + 0.8 * share)
            return
        while not self._at(stage):
            if self.process.poll() is not None or monotonic() > deadline:
                raise TimeoutError(f"never came to {stage}: {self.shown[-300:]}")
            sleep(2e-3)
        sleep(share * {"running": RUNS, "connecting": CONNECTING}.get(stage, 0.1))
        self.count_family()

    def _at(self, stage: str) -> bool:
        if stage == "running":
            return bool(list(self.out.glob("*.mcap")))
        return re.search(STAGES[stage], self.shown) is not None

    def count_family(self) -> None:
        """Remember its children, to look for them when it is gone."""
        with suppress(psutil.NoSuchProcess):
            self.family |= {child.pid for child in psutil.Process(self.process.pid).children(recursive=True)}

    def ended(self) -> int | None:
        """Wait for its end; return its exit code, None if it does not come."""
        deadline = monotonic() + ENDS_WITHIN
        while self.process.poll() is None and monotonic() < deadline:
            self.count_family()
            self._watch()
            sleep(0.02)
        return self.process.poll()

    def hang_up(self) -> None:
        """Close its terminal."""
        with suppress(OSError):
            os.close(self.master)
        self.master = -1

    def left(self) -> list[str]:
        """Return what is left of its processes and temporary files."""
        deadline = monotonic() + GONE_WITHIN
        while (alive := [pid for pid in self.family if _alive(pid)]) and monotonic() < deadline:
            sleep(0.02)
        found = [f"process left: {' '.join(psutil.Process(pid).cmdline()[:5])}" for pid in alive if _alive(pid)]
        files = [path for path in self.temporary.rglob("*") if path.is_file()]
        return [*found, *(f"temporary file left: {path.name}" for path in files)]

    def close(self) -> None:
        """End it for good."""
        for pid in self.family:
            with suppress(ProcessLookupError):
                if _alive(pid):
                    os.kill(pid, signal.SIGKILL)
        self.process.wait()
        self.hang_up()
        self._shown.close()
        self._printed.close()


@dataclass(frozen=True, slots=True)
class Expected:
    """What is promised.

    Attributes:
        codes: Exit codes.
        log: Whether there is to be one that can be read.
        report: Whether there is to be a report.
    """

    codes: tuple[int, ...]
    log: bool = False
    report: bool = False


Act = Callable[[Command], None]


@dataclass(frozen=True, slots=True)
class OnACommand:
    """Something happens to a command at a stage.

    Attributes:
        stage: importing, planning, connecting, running or drawing.
        act: What happens.
        expected: What must come of it.
        prepare: See `Command`.
    """

    stage: str
    act: Act
    expected: Expected
    prepare: Callable[[], object] | None = field(default=None)

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """Start the command, do it, and look at everything."""
        cell = workshop.shared(EmulatedCell(workshop.folder), "cell")
        cell.well()
        folder = Path(tempfile.mkdtemp(dir=workshop.folder))
        before = shared_memory()
        words = ["regulate", "--robot", str(cell.path), "--duration", "1", "--assumed-stiffness", "2000", "--json"]
        words += ["--out", OUT]
        forces = [0.0]
        command = Command(words, folder, self.prepare, lambda: forces.append(cell.state()[1]))
        try:
            command.wait_for(self.stage, moment.share)
            began = time()
            self.act(command)
            code = command.ended()
            problems = self._problems(cell, command, code, began)
            if max(forces) > FORCE_EXCESS * FORCE_LIMIT:
                problems.append(f"true force {max(forces):.1f} N at a limit of {FORCE_LIMIT:g} N")
        finally:
            command.close()
        if shared_memory() > before:
            problems.append("shared memory is left")
        problems += next_run(cell)
        return Verdict(f"exit code {code}", tuple(problems))

    def _problems(self, cell: EmulatedCell, command: Command, code: int | None, began: float) -> list[str]:
        """Return what is not as promised."""
        expected, found = self.expected, list[str]()
        if code not in expected.codes:
            found.append(f"exit code {code}, promised {' or '.join(map(str, expected.codes))}")
        if "Traceback" in command.shown:
            found.append("a traceback: " + command.shown.strip().splitlines()[-1][:120])
        rest = cell.rest_within(REST_WITHIN)
        if rest is not RestState.AT_REST:
            found.append("the arm moves after the end")
        found += contradiction(reported_rest(command.printed), rest)
        if expected.log:
            found += _log_problems(command.out, began if code == -signal.SIGKILL else None)
        if expected.report and not (command.out / "report.html").is_file():
            found.append("no report")
        found += [f"left in the folder: {path.name}" for path in command.out.rglob("*.part")]
        return [*found, *command.left()]


def reported_rest(printed: dict[str, object]) -> RestState:
    """Return what the document of a command says of the robot's rest; not known if it says nothing."""
    outcome = str(printed.get("rest", "") or printed.get("outcome", "")).lower()
    if "not known" in outcome or "unknown" in outcome:
        return RestState.NOT_KNOWN
    if "did not come to rest" in outcome or "moving" in outcome:
        return RestState.MOVING
    return RestState.AT_REST if "at rest" in outcome else RestState.NOT_KNOWN


def _log_problems(folder: Path, killed: float | None) -> list[str]:
    """Return what is wrong with a log; `killed` is when its process was, on the wall clock."""
    logs = sorted(folder.glob("*.mcap"))
    if not logs:
        return ["no log"]
    try:
        log = read_log(logs[-1])
        last = float(log.record().time[-1])
    except (PalpateError, IndexError) as error:
        return [f"the log cannot be read: {error}"]
    if killed is None:
        return [] if log.complete else ["the log was not finished"]
    lost = killed - (1e-9 * log.heading.wall_start + last - log.heading.first_time)
    return [f"the last {lost:.2f} s are not in the log"] if lost > MOST_LOST else []


def shared_memory() -> int:
    """Return how many pieces of ours there are."""
    return len([path for path in Path("/dev/shm").iterdir() if "palpate" in path.name])


def next_run(cell: EmulatedCell) -> list[str]:
    """Return why a rig cannot be started and moved once it is free of what it touched; nothing if it can."""
    cell.free()
    robot = load_robot(str(cell.path))
    try:
        with FreshlyTared(assembled(robot, robot.file.period)) as rig:
            rig.start()
            rig.pacer.start()
            try:
                for _ in range(20):
                    rig.step(Motion((0.0, 0.0, 0.005)))
            finally:
                rig.pacer.stop()
    except OSError as error:
        return [f"the next run does not work: {error}"]
    return []


def _prepared(prepare: Callable[[], object] | None) -> None:
    """In the child: the terminal is its controlling one, no signal is ignored, and limits hold."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    if prepare is not None:
        prepare()


def _alive(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
