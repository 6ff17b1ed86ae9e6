"""A robot behind emulated devices: starts them in a process of their own, and talks to them as to real ones."""

import math
import os
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from time import monotonic

from palpate.hw.devices import DeviceError
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.process import EmulatorProcess
from palpate.robots.emulated.truth import TruthTrace, new_memory
from palpate.runtime.closing import Closing
from palpate.runtime.data import Command, Sample
from palpate.runtime.pacing import Pacer
from palpate.runtime.protocols import Backend
from palpate.runtime.rest import ArmSource
from palpate.runtime.watchdog import DeviceWatchdog, watchdogs_of
from palpate.runtime.wrapped_backend import unwrapped
from palpate.sim.contact_truth import CONTACT_COLUMNS, Truth, truth_of_numbers
from palpate.sim.scene import Scene

Emulation = Callable[[int, int], Callable[[], Host]]
"""From the process that has made the truth's memory, and its descriptor there, to what they are to run."""


class OnTheWire(Closing):
    """A `Backend`: the emulators run from `start` to `close`, and the rig that connects to them likewise.

    Its times are the plant's: the rig's, scaled. If this process is killed, the emulators end by themselves.
    """

    def __init__(
        self, truth_columns: tuple[str, ...], emulation: Emulation, rig: Backend, time_scale: float = 1.0
    ) -> None:
        """Start nothing yet.

        Args:
            truth_columns: Names of the true values that the emulators' process reports.
            emulation: Makes what the emulators' process runs; it must be importable there.
            rig: Connects to them, once they listen.
            time_scale: Seconds of the plant per second of wall time.
        """
        self.truth_columns = truth_columns
        self._emulation, self._rig, self._scale = emulation, rig, time_scale
        self._running = ExitStack()
        self._emulator: EmulatorProcess | None = None
        self._trace: TruthTrace | None = None
        self._numbers: tuple[float, ...] = ()

    @property
    def period(self) -> float:
        """Control period, plant time [s]."""
        return self._rig.period * self._scale

    @property
    def pacer(self) -> Pacer:
        """See `Backend`: of wall time."""
        return self._rig.pacer

    @property
    def emulator(self) -> EmulatorProcess:
        """For faults and state.

        Raises:
            DeviceError: It is not started.
        """
        if self._emulator is None:
            raise DeviceError("emulated robot", "it is not started", "call start() first")
        return self._emulator

    def truth_row(self) -> tuple[float, ...]:
        """Return what really happened when the last sample's first wrench was sensed; NaN before it is known."""
        return self._numbers[: len(self.truth_columns)] or (math.nan,) * len(self.truth_columns)

    def start(self) -> Sample:
        """Start the emulators, then the rig, then the scene; a second start begins from the beginning.

        Raises:
            DeviceError: The emulators do not come up, or the rig does not.
        """
        self.close()
        with ExitStack() as running:
            memory = new_memory()
            running.callback(os.close, memory)
            self._trace = trace = TruthTrace(memory)
            running.callback(trace.close)
            running.callback(self._forget)
            self._emulator = running.enter_context(EmulatorProcess(self._emulation(os.getpid(), memory)))
            running.callback(self._rig.close)
            sample = self._taken(self._rig.start())
            trace.begin()
            self._running = running.pop_all()
        return sample

    def step(self, command: Command) -> Sample:
        """See `Backend`.

        Raises:
            DeviceError: See the rig's, and whatever else it raises.
        """
        return self._taken(self._rig.step(command))

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`: of the rig, wall time."""
        return watchdogs_of(self._rig)

    def arm_alone(self) -> Sample:
        """See `ArmSource`.

        Raises:
            DeviceError: The arm is lost, or its newest state too old.
        """
        source = unwrapped(self._rig)
        if not isinstance(source, ArmSource):
            raise DeviceError("emulated robot", "its arm cannot be read alone", "read the whole sample")
        return self._scaled(source.arm_alone())

    def close(self) -> None:
        """Stop the rig, then end the emulators; may be called more than once, and at any time."""
        self._running.close()

    def _forget(self) -> None:
        self._trace = self._emulator = None

    def _taken(self, sample: Sample) -> Sample:
        if self._trace is not None:
            age = sample.time - sample.wrenches[0].time
            self._numbers = self._trace.at(monotonic() - age)
        return self._scaled(sample)

    def _scaled(self, sample: Sample) -> Sample:
        """Return a sample of wall time in the plant's time."""
        if self._scale == 1.0:
            return sample
        factor, hand = self._scale, sample.hand
        return Sample(
            factor * sample.time,
            replace(sample.arm, time=factor * sample.arm.time),
            tuple(replace(wrench, time=factor * wrench.time) for wrench in sample.wrenches),
            None if hand is None else replace(hand, time=factor * hand.time),
        )


class EmulatedBackend(OnTheWire):
    """An arm with one fingertip, as experiments know it from `MujocoBackend`: with its scene, and its truth."""

    def __init__(self, scene: Scene, emulation: Emulation, rig: Backend, time_scale: float = 1.0) -> None:
        """Start nothing yet.

        Args:
            scene: What is simulated there: for pictures, and for what it costs.
            emulation: See `OnTheWire`, as the next two.
            rig: Connects to them.
            time_scale: Seconds of the plant per second of wall time.
        """
        super().__init__(CONTACT_COLUMNS, emulation, rig, time_scale)
        self.scene = scene

    def truth(self) -> Truth:
        """Return what really happened when the last sample's wrench was sensed."""
        return truth_of_numbers(self.truth_row())
