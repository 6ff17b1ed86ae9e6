"""The loop: read, sense, control, supervise, record, once per period."""

import time
from array import array
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Protocol

import numpy as np

from palpate.errors import positive
from palpate.runtime.data import Command, Observation, Phase, Sample
from palpate.runtime.interpreter import undisturbed
from palpate.runtime.interruption import StopRequest, stop_requests
from palpate.runtime.live import Change, live_parameters_of
from palpate.runtime.log import Level, Recorder, RecordingSummary
from palpate.runtime.pacing import Punctuality
from palpate.runtime.protocols import Backend, Controller
from palpate.runtime.result import Ending, RunInterrupted, RunResult
from palpate.runtime.supervision import Supervisor
from palpate.runtime.timing import RunTiming
from palpate.runtime.touch import Touch
from palpate.spatial import norm

Observer = Callable[[Sample, Observation, Command], None]
"""Sees every period after the supervisor: progress bars, truth recorders."""

REST_SPEED = 1e-3
"""A tip slower than this [m/s] counts as stopped."""

REST_TIME = 0.02
"""for this long [s]: a turning point is not rest."""

LONGEST_STOP = 0.5
"""How long the robot is given to come to rest [s]."""


class Live(Protocol):
    """Parameters that change while the robot runs."""

    def step(self, time: float) -> Sequence[Change]:
        """Move on to a period [s]; return which requests took effect."""
        ...


def run(
    backend: Backend,
    touch: Touch,
    controller: Controller,
    supervisor: Supervisor | None = None,
    *,
    duration: float,
    recorder: Recorder | None = None,
    live: Live | None = None,
    observers: Sequence[Observer] = (),
) -> RunResult:
    """Run a controller until it is done, the supervisor objects, or the time is up.

    However it ends, the robot is brought to rest, the back end closed and the log finished. An exception of the
    controller, of touch, an observer or the back end is a trip: it comes with the result, and the supervisor has
    to be reset before it lets anything move again.

    Args:
        backend: The robot.
        touch: Its fingers.
        controller: What it is to do.
        supervisor: Its limits; safe defaults if not given.
        duration: Longest time on the back end's clock [s].
        recorder: Keeps the run.
        live: The controller's live parameters, if they are not to be stepped as they are (a replay).
        observers: Called once per period with sample, observation and command.

    Raises:
        LatchedError: The supervisor has tripped earlier and was not reset.
        RunInterrupted: By Ctrl-C or another signal that ends a process; carries the result.
        Exception: What back end, touch or controller raise at the start, while nothing moves.
    """
    positive("duration", duration, "s")
    supervisor = supervisor or Supervisor()
    supervisor.start(backend.period)
    with backend, stop_requests() as stop:
        one = _Run(backend, touch, controller, supervisor, recorder, live, observers, stop)
        try:
            one.begin()
            with undisturbed():
                one.go_on(round(duration / backend.period))
        finally:
            one.end()
    result = one.result()
    if result.ending is Ending.INTERRUPTED:
        raise RunInterrupted(result)
    return result


class _Run:
    """One run of the loop, and what it knows of itself."""

    def __init__(
        self,
        backend: Backend,
        touch: Touch,
        controller: Controller,
        supervisor: Supervisor,
        recorder: Recorder | None,
        live: Live | None,
        observers: Sequence[Observer],
        stop: StopRequest,
    ) -> None:
        self._backend, self._touch, self._controller = backend, touch, controller
        self._supervisor, self._recorder, self._stop = supervisor, recorder, stop
        self._live = live_parameters_of(controller) if live is None else live
        self._observers = tuple(observers)
        self._pacer = backend.pacer
        self._ending: Ending | None = None
        self._stopped = False
        self._seen = False
        self._tripped = False
        self._starts, self._compute = array("d"), array("d")
        self._punctuality = Punctuality()
        self._recording: RecordingSummary | None = None
        self._clock = time.perf_counter

    def begin(self) -> None:
        """Do all that is slow, and start the devices; nothing moves yet."""
        self._sample = self._backend.start()
        self._first_time = self._sample.time
        self._touch.start()
        self._now = self._touch.sense(self._sample)
        if self._recorder is not None:
            self._recorder.start(self._sample, self._now, self._backend.period)
        self._controller.start(self._now)
        self._pacer.start()

    def go_on(self, periods: int) -> None:
        """Run period after period until there is a reason to end, then come to rest."""
        try:
            for index in range(periods):
                before = self._clock()
                self._starts.append(before)
                command = self._period(before, sense=index > 0)
                self._compute.append(self._clock() - before)
                self._ending = self._reason_to_end(command)
                if self._ending is not None:
                    break
                if not self._advance(command):
                    break
            else:
                self._ending = Ending.TIME_UP
            self._come_to_rest()
        except BaseException as error:
            self._tell(self._sample.time, Level.ERROR, "run", f"ended by {type(error).__name__}")
            # close() stops the robot in any case; a failure to brake must not hide why the run ended
            with suppress(Exception):
                self._brake()
            raise

    def _period(self, before: float, *, sense: bool) -> Command:
        """Sense, control, supervise, record: one period without waiting."""
        supervisor, source = self._supervisor, "touch"
        try:
            self._seen = True
            if sense:
                self._now = self._touch.sense(self._sample)
            now = self._now
            if supervisor.admits(now):
                source = "live parameters"
                self._change(now.time)
                source = "controller"
                wanted = self._controller.step(now)
                source = "supervisor"
                command = supervisor.check(now, wanted)
            else:
                command = supervisor.react(now)
            source = "observer"
            for observer in self._observers:
                observer(self._sample, now, command)
        except Exception as error:
            supervisor.fail(self._sample.time, source, error)
            command = supervisor.standstill()
            if source == "touch":  # what was sampled makes no sense: there is no observation to go with it
                self._tell_trip()
                return command
        self._record(command, before)
        return command

    def _change(self, time: float) -> None:
        for change in self._live.step(time):
            if self._recorder is not None:
                self._recorder.change(time, change.name, change.value)

    def _record(self, command: Command, before: float) -> None:
        if self._recorder is not None:
            taken = self._clock() - before
            self._recorder.record(self._sample, self._now, command, taken, self._pacer.lateness)
        if self._supervisor.trip is not None:
            self._tell_trip()

    def _tell_trip(self) -> None:
        trip = self._supervisor.trip
        if trip is not None and not self._tripped:
            self._tripped = True
            self._tell(trip.time, Level.ERROR, "supervisor", str(trip))

    def _tell(self, time: float, level: Level, source: str, text: str) -> None:
        if self._recorder is not None:
            self._recorder.event(time, level, source, text)

    def _reason_to_end(self, command: Command) -> Ending | None:
        if self._supervisor.trip is not None:
            return Ending.TRIPPED if self._supervisor.finished else None
        if command.phase.is_final:
            return Ending.DONE if command.phase is Phase.DONE else Ending.LOST
        return None if self._stop.received is None else Ending.INTERRUPTED

    def _advance(self, command: Command) -> bool:
        """Let the back end do a period; return whether it could."""
        try:
            self._sample = self._backend.step(command)
        except Exception as error:
            self._supervisor.fail(self._sample.time, "back end", error)
            self._tell_trip()
            self._ending = Ending.TRIPPED
            return False
        self._seen = False
        return True

    def _come_to_rest(self) -> None:
        """Stand still, with the grip as it is, and record how; a device that was lost is tried again."""
        self._last_time = self._sample.time
        try:
            self._stopped = self._brake()
        except Exception as error:
            self._tell(self._sample.time, Level.ERROR, "back end", f"could not be brought to rest: {error}")

    def _brake(self) -> bool:
        slow, period = 0, self._backend.period
        command = self._supervisor.standstill()
        if not self._seen:
            self._watch(command)
        wanted = max(1, round(REST_TIME / period))
        for _ in range(max(wanted, round(LONGEST_STOP / period))):
            self._sample = self._backend.step(command)
            self._watch(command)
            slow = slow + 1 if norm(self._sample.arm.velocity_base_tip) < REST_SPEED else 0
            if slow >= wanted:
                return True
        return False

    def _watch(self, command: Command) -> None:
        """Sense and record; whatever is sensed, the robot stands still."""
        before = self._clock()
        with suppress(Exception):
            self._now = self._touch.sense(self._sample)
            for observer in self._observers:
                observer(self._sample, self._now, command)
            self._record(command, before)

    def end(self) -> None:
        """Give back what was taken from the system, and finish the log."""
        self._ended = self._clock()
        self._punctuality = self._pacer.stop()
        if self._recorder is not None:
            if self._ending is not None:
                self._tell(self._sample.time, Level.INFO, "run", f"ended: {self._ending.value}")
            self._recording = self._recorder.close()

    def result(self) -> RunResult:
        """Return how it went."""
        starts = np.frombuffer(self._starts)
        started = self._starts[0] if self._starts else self._ended
        return RunResult(
            ending=self._ending or Ending.TIME_UP,
            trip=self._supervisor.trip,
            error=self._supervisor.error,
            stopped=self._stopped,
            duration=self._last_time - self._first_time,
            wall_time=self._ended - started,
            timing=RunTiming(
                compute=np.array(self._compute),
                period_time=np.diff(starts),
                lateness=self._punctuality.lateness,
                overruns=self._punctuality.overruns,
                note=self._punctuality.note,
                period=self._backend.period,
            ),
            recording=self._recording,
        )
