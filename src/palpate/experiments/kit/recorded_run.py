"""One run of a plan, kept in memory with the truth beside it, however it ends."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from palpate.experiments.kit.change_account import ChangeAccount, account_of_changes
from palpate.experiments.kit.truth_recorder import TruthRecord, TruthRecorder
from palpate.runtime import (
    Backend,
    Controller,
    FingerDescription,
    Limits,
    Observer,
    Phase,
    Record,
    RunResult,
    Supervisor,
    Touch,
    run,
)
from palpate.runtime.live import Change, LiveParameters, ScheduledChanges
from palpate.runtime.log import MemoryLog, Recorder, Sink


class TunableController(Controller, Protocol):
    """A controller with live parameters."""

    @property
    def live(self) -> LiveParameters:
        """What may be changed while it runs."""
        ...


class Runnable(Protocol):
    """What of a plan a run needs."""

    @property
    def backend(self) -> Backend:
        """The robot."""
        ...

    @property
    def finger(self) -> FingerDescription:
        """For touch."""
        ...

    @property
    def limits(self) -> Limits:
        """For the supervisor."""
        ...

    def changes(self) -> tuple[Change, ...]:
        """Changes of live parameters that were asked for beforehand."""
        ...


class RecordedRun:
    """It is run once; what came of it is told, however it ended."""

    def __init__(self, planned: Runnable, controller: TunableController) -> None:
        """Take what to do, and who does it."""
        self._planned, self._controller = planned, controller
        self._memory = MemoryLog()
        self._truth = TruthRecorder(planned.backend)

    def run(self, duration: float, observers: Sequence[Observer] = (), sinks: Sequence[Sink] = ()) -> RunResult:
        """Move the robot.

        Args:
            duration: Longest time [s].
            observers: Called every period, for example to show progress.
            sinks: Where to record it, beside memory.

        Raises:
            KeyboardInterrupt: The robot was stopped; what was found until then is here.
        """
        planned = self._planned
        return run(
            planned.backend,
            Touch(planned.finger),
            self._controller,
            Supervisor(planned.limits),
            duration=duration,
            recorder=Recorder(self._memory, *sinks),
            live=ScheduledChanges(self._controller.live, planned.changes()),
            observers=(self._truth, *observers),
        )

    def record(self) -> Record:
        """Return every period so far."""
        return self._memory.record()

    def truth(self) -> TruthRecord:
        """Return what really happened in them; that in which an exception ended the run nobody has observed."""
        return self._truth.record().continued(len(self.record()))

    @property
    def changes(self) -> tuple[Change, ...]:
        """Live parameters that were changed, as they took effect."""
        return tuple(self._memory.changes)

    def account_of_changes(self, work: Phase) -> tuple[ChangeAccount, ...]:
        """Return what became of the changes that were asked for beforehand; `work` is what they are made for."""
        record, live = self.record(), self._controller.live
        if not len(record):
            return ()
        working = np.flatnonzero(record.phase == work.value)
        return account_of_changes(
            self._planned.changes(),
            self._memory.changes,
            {name: parameter.unit for name, parameter in live.parameters.items()},
            first=float(record.time[0]),
            work=float(record.time[working[0]]) if len(working) else None,
        )

    def live_values(self, name: str, live: LiveParameters) -> list[float]:
        """Return a live parameter in every period.

        Args:
            name: Of the parameter.
            live: Of a fresh controller of the same plan: it ramps again as it did in the run.
        """
        return live_values(name, live, self._memory.changes, self.record().time.tolist())


def live_values(name: str, live: LiveParameters, changes: Sequence[Change], times: Sequence[float]) -> list[float]:
    """Return a live parameter at the times of a run.

    Args:
        name: Of the parameter.
        live: Of a fresh controller.
        changes: As they were recorded, on the clock of `times`.
        times: Of the run's periods [s].
    """
    again = ScheduledChanges(live, [replace(change, time=change.time - times[0]) for change in changes])
    values = []
    for time in times:
        again.step(time)
        values.append(live.value(name))
    return values
