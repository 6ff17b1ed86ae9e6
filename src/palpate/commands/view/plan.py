"""What `palpate view` shows of a plan, how fast it goes while watched, and where a recorded one was going."""

from palpate.errors import InvalidValueError
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.options import lasting
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.runtime import Backend, Command, Pacer, Sample
from palpate.runtime.live import live_parameters_of
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.real_time import RealTime
from palpate.runtime.replay import RecordedChanges
from palpate.runtime.shown_plan import PlanChange, PlanDiary
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.viewing import ViewScene


class PacedBackend(WrappedBackend[Backend]):
    """A simulation that goes so many times as fast as in reality; infinite: as fast as it can be computed."""

    def __init__(self, backend: Backend, time_scale: float) -> None:
        """Take it, and how fast."""
        super().__init__(backend)
        self._pacer = SimulatedTime() if time_scale == float("inf") else RealTime(backend.period / time_scale)

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    def step(self, command: Command) -> Sample:
        """See `Backend`."""
        sample = self.backend.step(command)
        self._pacer.wait()
        return sample


def watched_backend(plan: Plan, time_scale: float) -> Backend:
    """Return the back end of a run that is to be watched.

    Args:
        plan: Of the run.
        time_scale: Seconds of the run per second of wall time.

    Raises:
        InvalidValueError: It cannot be, or a robot that keeps real time was to go faster or slower.
    """
    backend = plan.backend()
    if isinstance(backend.pacer, SimulatedTime):
        return PacedBackend(backend, time_scale)
    if time_scale != 1.0:
        raise InvalidValueError(f"time_scale = {time_scale:g}: this robot keeps real time; leave it out")
    return backend


def shown_scene(experiment: Experiment, plan: Plan) -> ViewScene:
    """Return what there is to see of a run: of a robot that cannot be shown, what its kind shows instead.

    The object is the one that the run was given, where it was given; what it really was nobody knows.

    Raises:
        InvalidValueError: It cannot be simulated.
    """
    robot = plan.robot
    shown = None if robot is None else robot.file.backend.shown(robot)
    if shown is robot:
        return plan.view()
    return experiment.plan(lasting(plan.config), shown, plan.attachments()).view()


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
