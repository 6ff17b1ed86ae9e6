"""One run of a plan and its record: on a robot, in simulation, or again from its log."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.experiments.kit.experiment import Plan
from palpate.experiments.kit.recorded_periods import BESIDE_A_LOG, ContactTruth, RecordedPeriods
from palpate.runtime import Backend, Observer, Phase, Record, RunResult, Supervisor, Touch, run
from palpate.runtime.live import LONGEST_ELAPSED, Change, LiveParameters, ScheduledChanges, live_parameters_of
from palpate.runtime.log import LogWriter, MemoryLog, Recorder, Sink
from palpate.runtime.loop import Live
from palpate.runtime.truth import TruthTable, truth_source

ProgressCallback = Callable[[str], None]
"""Function that is called with the name of each step of an evaluation."""


def no_progress(step: str) -> None:
    """Show no progress."""


@dataclass(frozen=True, slots=True)
class ChangeOutcome:
    """One change that was requested, and when it took effect.

    Attributes:
        asked: Requested change; its time counts from the first period [s].
        unit: Unit of the value, "" for a ratio.
        made: Time at which the change took effect, from the first period [s]; None if the run ended before.
        early: Whether the change took effect before the work that it changes had begun.
    """

    asked: Change
    unit: str
    made: float | None
    early: bool = False

    @property
    def what(self) -> str:
        """The change as text, with the time at which it took effect or should have."""
        asked = self.asked
        return f"{asked.name} to {asked.value:g} {self.unit}".rstrip() + f" after {self.made or asked.time:.4g} s"


def change_outcomes(
    asked: Sequence[Change],
    made: Sequence[Change],
    units: Mapping[str, str],
    *,
    first: float,
    work: float | None,
) -> tuple[ChangeOutcome, ...]:
    """Return when each change took effect.

    Args:
        asked: Requested changes; times count from the first period.
        made: Recorded changes, in order, on the clock of the run.
        units: Units of the parameters, by name.
        first: Time of the first period [s].
        work: Time at which sweep or holding began, on the clock of the run [s]; None if it never began.
    """
    outcomes = []
    for each in sorted(asked, key=lambda change: change.time):
        found = next((done for done in made if _fulfils(done, each, first)), None)
        when = None if found is None else found.time - first
        early = found is not None and (work is None or found.time < work)
        outcomes.append(ChangeOutcome(each, units.get(each.name, ""), when, early))
    return tuple(outcomes)


def _fulfils(done: Change, asked: Change, first: float) -> bool:
    # of two in one period only the later one is made
    late_enough = done.time - first >= asked.time - 1e-9
    return late_enough and (done.name, done.value) == (asked.name, asked.value)


def change_sentences(outcomes: Sequence[ChangeOutcome], duration: float, work: str) -> tuple[str, ...]:
    """Return when the changes took effect, in sentences.

    Args:
        outcomes: Outcomes of the changes.
        duration: Duration of the run [s].
        work: Begin of the work, as in "the force was held".
    """
    kinds = (
        (
            f"Changed before {work}:",
            [each for each in outcomes if each.early],
            "; times count from the start of the run, landing included.",
        ),
        ("Changed:", [each for each in outcomes if each.made is not None and not each.early], "."),
        ("NOT changed:", [each for each in outcomes if each.made is None], f"; the run took {duration:.1f} s."),
    )
    return tuple(f"{begin} {', '.join(each.what for each in some)}{end}" for begin, some, end in kinds if some)


def change_rows(outcomes: Sequence[ChangeOutcome]) -> tuple[tuple[str, str], ...]:
    """Return the changes as settings, name and value."""
    return tuple(
        ("change while running", each.what + ("" if each.made is not None else ": not reached"))
        for each in outcomes
    )


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """The record of a finished run: the input of `Experiment.evaluate`.

    Attributes:
        run: Ending and timing.
        controller: Controller in its final state.
        observer: Observer of the plan, with its data; None if the plan has none.
        periods: Periods of the run.
        companion: Record of the plan's companion, if it was run.
        progress: Function that is called with the name of each step of the evaluation.
    """

    run: RunResult
    controller: Any
    observer: Any
    periods: RecordedPeriods
    companion: "Recorded | None" = None
    progress: ProgressCallback = no_progress

    def record(self, finger: int = 0) -> Record:
        """Return every period, base coordinates, for one finger.

        A run of more than 2**18 periods, four minutes at 1 kHz, is thinned evenly over time; `periods.pieces`
        yields all periods in pieces, for metrics that need every one.
        """
        return self.periods.record(finger)

    @property
    def truth(self) -> TruthTable:
        """Truth of the simulation in each period of `record`; a table without columns on a robot."""
        return self.periods.shown().truth

    @property
    def contact_truth(self) -> ContactTruth:
        """True contact of a single fingertip in each period of `record`; NaN on a robot."""
        return ContactTruth.of(self.truth, len(self.record()))

    @property
    def changes(self) -> tuple[Change, ...]:
        """Changes of live parameters, as they took effect."""
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
            name: Name of the parameter.
            live: Live parameters of a fresh controller of the same plan, which ramp as in the run.
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
            live: Live parameters of a fresh controller of the same plan.
            start: Time of the first period [s].
            thinned: Whether periods between these times are missing.
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
    """A run that is carried out once; its record is available whatever ended it.

    Attributes:
        backend: Robot.
        controller: Controller, whose live parameters take requests during the run.
    """

    def __init__(self, plan: Plan, backend: Backend | None = None) -> None:
        """Build back end and controller of a plan; `backend` replaces the plan's own back end.

        Raises:
            InvalidValueError: If the back end cannot be built as its robot file describes.
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
        """Carry out the run.

        Args:
            observers: Observers that are called every period, for example to show progress.
            sinks: Sinks of the recording besides memory.
            live: Source of live changes that replaces the plan's scheduled ones.

        Raises:
            KeyboardInterrupt: On Ctrl-C, once the robot is stopped; `recorded` returns the periods until then.
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
        """Return the record of the run with this ending."""
        periods = RecordedPeriods.of(self._memory, result)
        return Recorded(result, self.controller, self._observer, periods, companion, progress)


def carry_out(plan: Plan, observers: Sequence[Observer] = (), sinks: Sequence[Sink] = ()) -> Recorded:
    """Run a plan, and its companion after it if there is one.

    Args:
        plan: Plan of the run.
        observers: Observers that are called every period of the first run.
        sinks: Sinks of the first run's recording besides memory.

    Raises:
        InvalidValueError: If the back end cannot be built as its robot file describes.
        KeyboardInterrupt: On Ctrl-C, once the robot is stopped.
    """
    first, companion = RecordedRun(plan), plan.companion()
    result = first.run(observers, sinks)
    return first.recorded(result, None if companion is None else carry_out(companion))
