"""Signals, and terminals that are closed, at every stage of a command."""

import os
import signal
from time import sleep

import psutil

from faults.command import Act, Command, Expected, OnACommand
from faults.kind import Domain, Kind

STAGES = ("importing", "planning", "connecting", "running", "drawing")
APART = 0.15
"""[s] between two Ctrl-C."""
HELD = 0.4
"""[s] for which a process is stopped."""


def sent(number: int) -> Act:
    """Send a signal."""
    return lambda command: command.process.send_signal(number)


def twice(command: Command) -> None:
    """Press Ctrl-C, and again."""
    command.process.send_signal(signal.SIGINT)
    sleep(APART)
    command.process.send_signal(signal.SIGINT)


def to_all(number: int) -> Act:
    """Send a signal to the whole group, as a terminal does."""
    return lambda command: os.killpg(command.process.pid, number)


def hang_up(command: Command) -> None:
    """Close the terminal."""
    command.hang_up()


def held(command: Command) -> None:
    """Stop the process for a while, as Ctrl-Z and fg do."""
    command.process.send_signal(signal.SIGSTOP)
    sleep(HELD)
    command.process.send_signal(signal.SIGCONT)


def held_for_long(command: Command) -> None:
    """Likewise, for longer than the arm's watchdog waits."""
    command.process.send_signal(signal.SIGSTOP)
    sleep(4 * HELD)
    command.process.send_signal(signal.SIGCONT)


def child(number: int) -> Act:
    """Send a signal to the process that talks to the arm."""

    def act(command: Command) -> None:
        for each in psutil.Process(command.process.pid).children(recursive=True):
            if "client_process" in " ".join(each.cmdline()):
                each.send_signal(number)

    return act


def _coded(number: int, stage: str) -> Expected:
    """By what running.md promises: 128 + the signal; log and report are kept from when it moves."""
    kept = stage in ("running", "drawing")
    return Expected((128 + number,), log=kept, report=kept)


def _killed(stage: str) -> Expected:
    return Expected((-signal.SIGKILL,), log=stage in ("running", "drawing"))


def _of(stage: str) -> list[Kind]:
    kept = stage in ("running", "drawing")
    acts = {
        "Ctrl-C": (sent(signal.SIGINT), Expected((130,), log=kept, report=stage == "running")),
        # the second may find Python taking itself down, which ends by the signal itself: 130 to a shell, too
        "Ctrl-C twice": (twice, Expected((130, -signal.SIGINT), log=kept)),
        "Ctrl-C to the whole group": (
            to_all(signal.SIGINT),
            Expected((130,), log=kept, report=stage == "running"),
        ),
        "kill": (sent(signal.SIGTERM), _coded(signal.SIGTERM, stage)),
        "kill -HUP": (sent(signal.SIGHUP), _coded(signal.SIGHUP, stage)),
        "the terminal is closed": (hang_up, _coded(signal.SIGHUP, stage)),
        "kill -9": (sent(signal.SIGKILL), _killed(stage)),
        "Ctrl-Z and fg": (held, Expected((0, 1), log=True, report=True)),
    }
    return [
        Kind(f"{name} while {stage}", Domain.PROCESS, OnACommand(stage, act, expected))
        for name, (act, expected) in acts.items()
    ]


LOST = Expected((1,), log=True)

KINDS = (
    *(kind for stage in STAGES for kind in _of(stage)),
    Kind(
        "held for longer than the watchdog while running",
        Domain.PROCESS,
        OnACommand("running", held_for_long, Expected((0, 1), log=True)),
    ),
    *(
        Kind(
            f"{name} of the arm's client process while running",
            Domain.PROCESS,
            OnACommand("running", child(number), LOST),
        )
        for name, number in (
            ("kill -9", signal.SIGKILL),
            ("a crash", signal.SIGSEGV),
            ("a hang", signal.SIGSTOP),
        )
    ),
)
