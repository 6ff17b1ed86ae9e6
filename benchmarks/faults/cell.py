"""A cell on the wire for whole commands: emulated arm and F/T box in a process of their own, and a robot file."""

import itertools
import math
import os
import threading
from contextlib import ExitStack, suppress
from pathlib import Path
from time import monotonic, sleep
from typing import Self

from faults.on_the_loop import REST_SPEED
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.ur import UrArm, UrSettings
from palpate.runtime.rest import RestState
from palpate.spatial import ZERO
from support.rig_cell import Cell, robot_file

FORCE_LIMIT = 20.0
"""[N]: as the robot file has it."""

TOUCHED = 0.1
"""[N]: ten times the noise of the emulated sensor, at least."""

LIFTED, LIFTING = 0.02, 0.025
"""[m] and [m/s]: within the arm's watchdog."""

_hosts = itertools.count(2)


def own_address() -> str:
    """Return a loopback address that no other emulator has."""
    return f"127.{150 + os.getpid() % 100}.{os.getpid() // 100 % 250}.{next(_hosts)}"


class EmulatedCell:
    """Runs as long as a `with` block lasts."""

    def __init__(self, folder: Path, seen_at: str | None = None, emulated_at: str | None = None) -> None:
        """Start nothing yet.

        Args:
            folder: For the robot file.
            seen_at: Address in the robot file, as of a proxy; None: that of the emulator.
            emulated_at: Address of the emulator; None: one of its own.
        """
        self.address = emulated_at or own_address()
        self._folder, self._seen_at = folder, seen_at or self.address
        self.emulator = EmulatorProcess(Cell(self.address))
        self._stack, self._asking = ExitStack(), threading.Lock()

    def __enter__(self) -> Self:
        folder = self._folder / self._seen_at
        folder.mkdir(exist_ok=True)
        self.path = robot_file(folder, self._seen_at)
        self._stack.enter_context(self.emulator)
        return self

    def __exit__(self, *raised: object) -> None:
        self._stack.close()

    def state(self) -> tuple[float, float]:
        """Return speed [m/s] and force [N], as the emulator measures them."""
        with self._asking:
            state = self.emulator.control.state()
        wrenches: list[list[float]] = state["wrenches"]  # type: ignore[assignment]
        return math.hypot(*state["velocity"]), math.hypot(*wrenches[0][:3])  # type: ignore[misc]

    def rest_within(self, seconds: float) -> RestState:
        """Wait until the arm stands; return whether it came to it in time."""
        deadline = monotonic() + seconds
        while self.state()[0] > REST_SPEED:
            if monotonic() > deadline:
                return RestState.MOVING
            sleep(5e-3)
        return RestState.AT_REST

    def free(self) -> None:
        """Draw the tip back if it presses on anything; nobody else commands the arm.

        What is tared while it presses feels too little later, and a box that is saturated cannot be tared.
        """
        if self.state()[1] > TOUCHED:
            with suppress(OSError), UrArm(self._seen_at, UrSettings(watchdog=1.0)) as arm:
                arm.move((0.0, 0.0, LIFTING), ZERO)
                sleep(LIFTED / LIFTING)
                arm.stop()

    def well(self) -> None:
        """End all faults, stops and contacts."""
        control = self.emulator.control
        for fault in ("protective_stop", "e_stop", "stall_stream", "late_start", "short_data"):
            control.fault("ur", fault, 0.0)
        self.free()
