"""Where a recorded run's controller was going, which it works out again from what was recorded."""

from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.runtime.live import live_parameters_of
from palpate.runtime.replay import RecordedChanges
from palpate.runtime.shown_plan import PlanChange, PlanDiary


def plans_of_log(logged: LoggedRun) -> tuple[PlanChange, ...]:
    """Return each plan of a recorded run, and from when on it was the one.

    Raises:
        InvalidValueError: The log cannot be replayed.
    """
    plan = logged.plan()
    run = RecordedRun(plan, logged.backend())
    source = plan.shown_plan(run.controller)
    if source is None:
        return ()
    diary = PlanDiary(source)
    run.run((diary,), live=RecordedChanges(live_parameters_of(run.controller), logged.log.changes))
    return diary.changes
