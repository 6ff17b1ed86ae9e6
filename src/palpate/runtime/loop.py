"""The loop: read, sense, control, supervise, record, once per period."""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Protocol

from palpate.errors import InvalidValueError, positive, shown
from palpate.interruption import StopRequest, stop_requests
from palpate.runtime.data import Command, Observation, Phase, Sample
from palpate.runtime.following import CommandedMotion, FollowingMaker
from palpate.runtime.interpreter import SIMULATED_INTERVAL, SWITCH_INTERVAL, undisturbed
from palpate.runtime.live import Change, live_parameters_of
from palpate.runtime.log import Level, Recorder, RecordingSummary
from palpate.runtime.pacing import Punctuality, SimulatedTime
from palpate.runtime.protocols import Backend, Controller
from palpate.runtime.rest import REST, WATCHDOG, ArmSource, RestState, RobotRest
from palpate.runtime.result import Ending, RunResult
from palpate.runtime.standstill_check import LONGEST_STOP, StandstillCheck
from palpate.runtime.stopping import stopping_of
from palpate.runtime.supervision import Supervisor
from palpate.runtime.times import Times
from palpate.runtime.timing import RunTiming, oldest_age
from palpate.runtime.touch import Touch
from palpate.runtime.truth import truth_source
from palpate.runtime.watchdog import watchdogs_of
from palpate.runtime.wrapped_backend import unwrapped

Observer = Callable[[Sample, Observation, Command], None]
"""Sees every period after the supervisor: progress bars, truth recorders."""


LEVELS = {RestState.AT_REST: Level.INFO, RestState.MOVING: Level.FATAL, RestState.NOT_KNOWN: Level.ERROR}
"""Of the event on rest, whose source is `REST`."""


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
    following: FollowingMaker = CommandedMotion,
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
        following: Makes what compares commands with motion; a replay compares nothing.

    Raises:
        LatchedError: The supervisor has tripped earlier and was not reset.
        KeyboardInterrupt: By Ctrl-C or another signal that ends a process; `result_until` gives its result.
        Exception: What back end, touch, controller or recorder raise at the start, while nothing moves.
    """
    positive("duration", duration, "s")
    supervisor = supervisor or Supervisor()
    supervisor.start(backend.period, stopping_of(backend))
    with stop_requests() as stop:
        one = _Run(backend, touch, controller, supervisor, recorder, live, observers, following, stop)
        try:
            one.begin()
            simulated = isinstance(backend.pacer, SimulatedTime)
            with undisturbed(SIMULATED_INTERVAL if simulated else SWITCH_INTERVAL):
                one.go_on(round(duration / backend.period))
        finally:
            one.end()
        result = one.result()
        if stop.received is not None:
            raise KeyboardInterrupt(result)
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
        following: FollowingMaker,
        stop: StopRequest,
    ) -> None:
        self._backend, self._touch, self._controller = backend, touch, controller
        self._supervisor, self._recorder, self._stop = supervisor, recorder, stop
        self._live = live_parameters_of(controller) if live is None else live
        self._observers, self._follows = tuple(observers), following
        self._pacer = backend.pacer
        self._ending: Ending | None = None
        self._time = self._first_time = self._last_time = 0.0
        self._rest = RobotRest.not_known()
        self._seen = self._trip_recorded = self._aftermath_recorded = False
        self._compute, self._period_time, self._ages = Times(), Times(), Times()
        self._started: float | None = None
        self._punctuality = Punctuality()
        self._recording: RecordingSummary | None = None
        self._clock = time.perf_counter

    def begin(self) -> None:
        """Do all that is slow, and start the devices; nothing moves yet."""
        self._take(self._backend.start())
        self._first_time = self._last_time = self._time
        self._following = self._follows(self._backend.period, self._sample.arm)
        self._touch.start()
        self._now = self._touch.sense(self._sample)
        if self._recorder is not None:
            self._recorder.start(self._sample, self._now, self._backend.period, truth_source(self._backend))
            for watchdog in watchdogs_of(self._backend):
                self._tell(self._time, Level.INFO, WATCHDOG, str(watchdog))
        self._controller.start(self._now)

    def go_on(self, periods: int) -> None:
        """Run period after period until there is a reason to end, then come to rest."""
        try:
            self._pacer.start()
            index, previous = 0, 0.0
            # a reaction that has begun goes on to its own end
            while index < periods or self._supervisor.reacting:
                before = self._clock()
                if self._started is None:
                    self._started = before
                else:
                    self._period_time.append(before - previous)
                previous = before
                command = self._period(before, sense=index > 0)
                self._compute.append(self._clock() - before)
                self._ending = self._reason_to_end(command)
                if self._ending is not None or not self._advance(command):
                    break
                index += 1
            else:
                self._ending = Ending.TIME_UP
            self._last_time = self._time
            self._rest = self._brake()
        except BaseException as error:
            self._tell(self._time, Level.ERROR, "run", f"ended by {type(error).__name__}")
            # close() stops the robot in any case; a failure to brake must not hide why the run ended
            with suppress(Exception):
                self._rest = self._brake()
            raise

    def _period(self, before: float, *, sense: bool) -> Command:
        """Sense, control, supervise, record: one period without waiting."""
        supervisor, source = self._supervisor, "touch"
        self._seen = True
        try:
            if sense:
                self._now = self._touch.sense(self._sample)
            now, source = self._now, "supervisor"
            if supervisor.admits(now):
                source = "live parameters"
                self._change(now.time)
                source = "controller"
                wanted = self._controller.step(now)
                source = "supervisor"
                command = supervisor.check(now, wanted)
            else:
                command = supervisor.react(now)
            self._ages.append(oldest_age(now))
            source = "observer"
            for observer in self._observers:
                observer(self._sample, now, command)
        except Exception as error:
            supervisor.fail(self._time, source, error)
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
        if trip is None:
            return
        if not self._trip_recorded:
            self._trip_recorded = True
            self._tell(trip.time, Level.ERROR, "supervisor", str(trip))
        if trip.aftermath and not self._aftermath_recorded:
            self._aftermath_recorded = True
            self._tell(self._time, Level.INFO, "supervisor", trip.aftermath)

    def _tell(self, time: float, level: Level, source: str, text: str) -> None:
        if self._recorder is not None:
            self._recorder.event(time, level, source, text)

    def _reason_to_end(self, command: Command) -> Ending | None:
        if self._supervisor.trip is not None:
            return None if self._supervisor.reacting else Ending.TRIPPED
        if command.phase.is_final:
            return Ending.DONE if command.phase is Phase.DONE else Ending.LOST
        return None if self._stop.received is None else Ending.INTERRUPTED

    def _advance(self, command: Command) -> bool:
        """Let the back end do a period; return whether it could."""
        try:
            self._take(self._backend.step(command))
            self._following.take(command, self._now, self._sample)
        except Exception as error:
            if self._trip_recorded:  # and now this: it ends the reaction
                self._tell(self._time, Level.ERROR, "back end", type(error).__name__)
            self._supervisor.fail(self._time, "back end", error)
            self._tell_trip()
            self._ending = Ending.TRIPPED
            return False
        return True

    def _take(self, sample: Sample) -> None:
        given: object = sample  # a back end may be anybody's
        if not isinstance(given, Sample) or not isinstance(given.time, float | int):
            raise InvalidValueError(f"the back end gave {shown(given)}: must be a Sample with its time")
        self._sample, self._time, self._seen = given, given.time, False

    def _brake(self) -> RobotRest:
        """Stand still, with the grip as it is, and record how; return whether the tip came to rest.

        A device that was lost is tried again, and again. Meanwhile the arm is read alone, if that can be had.
        """
        begun, command = self._clock(), self._supervisor.standstill()
        braking = StandstillCheck(self._sample.arm, self._backend.period, self._supervisor.limits.sample_age)
        if not self._seen:
            self._watch(command)
        failure = ""
        for _ in range(braking.longest):
            try:
                self._take(self._backend.step(command))
            except Exception as error:
                failure = failure or f"could not be stopped at once: {type(error).__name__}"
                self._look_at_arm(braking)
                if self._clock() - begun > LONGEST_STOP:
                    break
            else:
                self._watch(command)
                braking.add(self._time, self._sample.arm)
            if braking.at_rest:
                break
        if failure:
            self._tell(self._time, Level.ERROR, "back end", failure)
        return braking.rest(watchdogs_of(self._backend))

    def _look_at_arm(self, braking: StandstillCheck) -> None:
        """Take the arm's state alone, where the back end gives no sample."""
        source = unwrapped(self._backend)
        try:
            if isinstance(source, ArmSource):
                alone = source.arm_alone()
                braking.add(alone.time, alone.arm)
            else:
                braking.lost()
        except Exception:
            braking.lost()

    def _watch(self, command: Command) -> None:
        """Sense and record; whatever is sensed, and whoever fails, the robot stands still."""
        before, self._seen = self._clock(), True
        with suppress(Exception):
            self._now = self._touch.sense(self._sample)
            for observer in self._observers:
                with suppress(Exception):
                    observer(self._sample, self._now, command)
            self._record(command, before)

    def end(self) -> None:
        """Leave the robot, give back what was taken from the system, and finish the log: in this order."""
        self._ended = self._clock()
        self._stop.closing = True
        try:
            self._backend.close()
        except Exception as error:
            self._rest = RobotRest.not_known(watchdogs_of(self._backend))  # somebody has to look
            self._supervisor.fail(self._time, "back end", error)
            self._ending = Ending.TRIPPED
            self._tell_trip()
        finally:
            self._stop.closing = False
            self._punctuality = self._pacer.stop()
            if self._recorder is not None:
                if self._started is not None:  # else nothing has moved
                    self._tell(self._time, LEVELS[self._rest.state], REST, str(self._rest))
                if self._ending is not None:
                    self._tell(self._time, Level.INFO, "run", f"ended: {self._ending.value}")
                self._recording = self._recorder.close()

    def result(self) -> RunResult:
        """Return how it went."""
        started = self._ended if self._started is None else self._started
        return RunResult(
            ending=self._ending or Ending.INTERRUPTED,
            trip=self._supervisor.trip,
            error=self._supervisor.error,
            rest=self._rest,
            duration=self._last_time - self._first_time,
            wall_time=self._ended - started,
            timing=RunTiming(
                compute=self._compute,
                period_time=self._period_time,
                lateness=self._punctuality.lateness,
                age=self._ages,
                overruns=self._punctuality.overruns,
                note=self._punctuality.note,
                period=self._backend.period,
            ),
            recording=self._recording,
        )
