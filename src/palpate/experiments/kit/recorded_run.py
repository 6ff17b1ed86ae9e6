"""One run of a plan, kept however it ends: on a robot, in simulation, or again from its log."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.experiments.kit.change_outcome import ChangeOutcome, change_outcomes
from palpate.experiments.kit.contact_truth import ContactTruth
from palpate.experiments.kit.experiment import Plan
from palpate.experiments.kit.recorded_periods import BESIDE_A_LOG, RecordedPeriods
from palpate.runtime import Backend, Observer, Phase, Record, RunResult, Supervisor, Touch, run
from palpate.runtime.live import LONGEST_ELAPSED, Change, LiveParameters, ScheduledChanges, live_parameters_of
from palpate.runtime.log import LogWriter, MemoryLog, Recorder, Sink
from palpate.runtime.loop import Live
from palpate.runtime.truth import TruthTable, truth_source

ProgressCallback = Callable[[str], None]
"""Is called with the name of each step of an evaluation, for a progress display."""


def no_progress(step: str) -> None:
    """Show no progress."""


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """The record of a finished run: the input of `Experiment.evaluate`.

    Attributes:
        run: How it ended, and its timing.
        controller: That commanded it, as it was in the end.
        observer: What the plan's own observer kept; None if it has none.
        periods: Where they are.
        companion: The same of the plan's companion, if there was one and it was run.
        progress: Is called with the name of each step of the evaluation.
    """

    run: RunResult
    controller: Any
    observer: Any
    periods: RecordedPeriods
    companion: "Recorded | None" = None
    progress: ProgressCallback = no_progress

    def record(self, finger: int = 0) -> Record:
        """Return every period, base coordinates, for one finger.

        Of a run of more than 2**18 periods, four minutes at 1 kHz, it is a share of them, evenly over time; for
        metrics that need all of them, `periods.pieces` yields them one piece after the other.
        """
        return self.periods.record(finger)

    @property
    def truth(self) -> TruthTable:
        """What really happened in each period of `record`; a table without columns on a robot."""
        return self.periods.shown().truth

    @property
    def contact_truth(self) -> ContactTruth:
        """The same of a single fingertip's contact; NaN on a robot."""
        return ContactTruth.of(self.truth, len(self.record()))

    @property
    def changes(self) -> tuple[Change, ...]:
        """Live parameters that were changed, as they took effect."""
        return tuple(self.periods.memory.changes)

    def change_outcomes(self, asked: Sequence[Change], work: Phase) -> tuple[ChangeOutcome, ...]:
        """Return which requested changes took effect, and when; `work` is the phase that they are meant for."""
        record, live = self.record(), live_parameters_of(self.controller)
        if not len(record):
            return ()
        working = np.flatnonzero(record.phase == work.value)
        return change_outcomes(
            asked,
            self.periods.memory.changes,
            {name: parameter.unit for name, parameter in live.parameters.items()},
            first=float(record.time[0]),
            work=float(record.time[working[0]]) if len(working) else None,
        )

    def live_values(self, name: str, live: LiveParameters) -> list[float]:
        """Return a live parameter in every period of `record`.

        Args:
            name: Of the parameter.
            live: Of a fresh controller of the same plan: it ramps again as it did in the run.
        """
        times = self.record().time
        if not len(times):
            return []
        return self.live_again(live, float(times[0]), thinned=self.periods.thinned)(name, times.tolist())

    def live_again(
        self, live: LiveParameters, start: float, *, thinned: bool = False
    ) -> Callable[[str, Sequence[float]], list[float]]:
        """Return what gives a live parameter at times of the run, which rise from call to call.

        Args:
            live: Of a fresh controller of the same plan.
            start: Time of the first period [s].
            thinned: Whether there were periods between these times.
        """
        changes = [replace(each, time=each.time - start) for each in self.periods.memory.changes]
        again, before = ScheduledChanges(live, changes), start

        def values(name: str, times: Sequence[float]) -> list[float]:
            nonlocal before
            found = []
            for time in times:
                while thinned and changes and before + LONGEST_ELAPSED < time:  # it ramped in between
                    before += LONGEST_ELAPSED
                    again.step(before)
                again.step(time)
                before = time
                found.append(live.value(name))
            return found

        return values


class RecordedRun:
    """A run that is carried out once; what it recorded is available however it ended.

    Attributes:
        backend: The robot.
        controller: What moves it; its live parameters take requests while it runs.
    """

    def __init__(self, plan: Plan, backend: Backend | None = None) -> None:
        """Take what to do, and who does it if not the plan's own back end.

        Raises:
            InvalidValueError: The back end cannot be built as its robot file describes.
        """
        self._plan, self.backend = plan, plan.backend() if backend is None else backend
        self.controller: Any = plan.controller()
        self._observer = plan.observer(self.controller, truth_source(self.backend))
        self._memory = MemoryLog()

    def run(
        self,
        observers: Sequence[Observer] = (),
        sinks: Sequence[Sink] = (),
        live: Live | None = None,
    ) -> RunResult:
        """Move the robot.

        Args:
            observers: Called every period, for example to show progress.
            sinks: Where to record it, beside memory.
            live: In the place of the changes that were asked for beforehand, as a log has them.

        Raises:
            KeyboardInterrupt: The robot was stopped; `recorded` still returns what there is.
        """
        plan, own = self._plan, () if self._observer is None else (self._observer,)
        if any(isinstance(sink, LogWriter) for sink in sinks):
            self._memory = MemoryLog(BESIDE_A_LOG)
        changes = plan.changes()
        if live is None and changes:
            live = ScheduledChanges(live_parameters_of(self.controller), changes)
        return run(
            self.backend,
            Touch(*plan.fingers),
            self.controller,
            Supervisor(plan.limits, plan.guards()),
            duration=plan.longest_duration,
            recorder=Recorder(self._memory, *sinks),
            live=live,
            observers=(*own, *observers),
            following=plan.following,
        )

    def recorded(
        self, result: RunResult, companion: Recorded | None = None, progress: ProgressCallback = no_progress
    ) -> Recorded:
        """Return what there is of a run that went like `result`."""
        periods = RecordedPeriods.of(self._memory, result)
        return Recorded(result, self.controller, self._observer, periods, companion, progress)


def carry_out(plan: Plan, observers: Sequence[Observer] = (), sinks: Sequence[Sink] = ()) -> Recorded:
    """Run a plan, and its companion after it if there is one.

    Args:
        plan: What to do.
        observers: Called every period of the first run.
        sinks: Where to record the first run, beside memory.

    Raises:
        InvalidValueError: The back end cannot be built as its robot file describes.
        KeyboardInterrupt: The robot was stopped. A `RecordedRun` still knows what was found until then.
    """
    first, companion = RecordedRun(plan), plan.companion()
    result = first.run(observers, sinks)
    return first.recorded(result, None if companion is None else carry_out(companion))
