"""Evaluation of a log: the run is planned again, and its samples pass through touch, controller and observer."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from itertools import islice
from types import MappingProxyType
from typing import Any

from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import EXPERIMENT_TEXT, experiment_in, read_config
from palpate.experiments.kit.experiment import Experiment, Plan, Result
from palpate.experiments.kit.options import lasting, spec_of
from palpate.experiments.kit.recorded_periods import RecordedPeriods
from palpate.experiments.kit.recorded_run import ProgressCallback, RecordedRun, no_progress
from palpate.experiments.kit.registry import experiment_named
from palpate.open_kinds import name_of_kind
from palpate.robots.robot import ROBOT_TEXT, Robot, read_robot
from palpate.robots.values import load_named_robot
from palpate.runtime import Backend, Ending, RunResult
from palpate.runtime.live import live_parameters_of
from palpate.runtime.log import Log, RecordingSummary
from palpate.runtime.replay import RecordedChanges, replayed_backend
from palpate.runtime.replay_extent import extent_of
from palpate.runtime.rest import rest_in

NOTHING_SET: Mapping[str, object] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class LoggedRun:
    """Log of a run, with its experiment and configuration.

    Attributes:
        log: Log as read.
        experiment: Experiment of the run.
        config: Configuration without options of the recorded run alone (live changes, a companion).
    """

    log: Log
    experiment: Experiment
    config: Any

    @classmethod
    def of(cls, log: Log) -> "LoggedRun":
        """Return experiment and configuration of a log.

        Raises:
            InvalidValueError: If the log has no experiment, or if it is not installed or has another version.
        """
        if EXPERIMENT_TEXT not in log.attachments:
            raise InvalidValueError(
                f"{log.path} is no log of an experiment: it has no {EXPERIMENT_TEXT}, so that sensing and "
                "control are unknown; palpate.runtime.replay replays any log with a given touch and controller"
            )
        text = log.attachments[EXPERIMENT_TEXT]
        experiment = experiment_named(experiment_in(text))
        try:
            config = read_config(text, experiment.Config)
        except InvalidValueError as error:
            raise InvalidValueError(
                f"{log.path}: its {EXPERIMENT_TEXT} cannot be read; was it written by another version? {error}"
            ) from None
        return cls(log, experiment, lasting(config))

    def plan(
        self, config: Any = None, settings: Mapping[str, object] = NOTHING_SET, robot: Robot | None = None
    ) -> Plan:
        """Return the run's plan.

        Args:
            config: Configuration that replaces the recorded one.
            settings: Changed options by name.
            robot: Robot that replaces the robot of the log and of `settings`.

        Raises:
            InvalidValueError: If the run cannot be planned with these.
        """
        texts = dict(self.log.attachments)
        for each in fields(self.config):
            if each.name in settings and spec_of(each).kept:
                texts.pop(spec_of(each).kept, None)
        recorded = read_robot(texts) if ROBOT_TEXT in texts else None
        if robot is None and settings.get("robot") is not None:
            robot = load_named_robot(str(settings["robot"]))
            _check_kind(robot, recorded)
        robot = robot or recorded
        return self.experiment.plan(self.config if config is None else config, robot, texts)

    def backend(self) -> Backend:
        """Return a back end that replays the recorded samples, with the recorded truth if there is one.

        Raises:
            InvalidValueError: If there is nothing to replay.
        """
        log = self.log
        samples = islice(log.samples(), extent_of(log).count)
        return replayed_backend(samples, log.heading.period, log.truth)

    def evaluate(self, progress: ProgressCallback = no_progress) -> Result:
        """Return the result of the run, evaluated from its log alone.

        Raises:
            InvalidValueError: If the run cannot be planned again or evaluated.
        """
        plan = self.plan()
        run = RecordedRun(plan, self.backend())
        result = run.run(live=RecordedChanges(live_parameters_of(run.controller), self.log.changes))
        recorded = run.recorded(self._as_it_ended(result), progress=progress)
        return self.experiment.evaluate(plan, replace(recorded, periods=RecordedPeriods.of_log(self.log)))

    def _as_it_ended(self, again: RunResult) -> RunResult:
        """Return the ending of the recorded run, with the timing of this one."""
        endings = [event.text.removeprefix("ended: ") for event in self.log.events if event.source == "run"]
        ending = Ending(endings[-1]) if endings and endings[-1] in list(Ending) else Ending.INTERRUPTED
        kept = RecordingSummary(self.log.path, len(self.log))
        return replace(again, ending=ending, trip=None, error=None, rest=rest_in(self.log.events), recording=kept)


def _check_kind(robot: Robot, recorded: Robot | None) -> None:
    """Refuse a robot whose back end differs in kind from the one that took the samples."""
    kinds = [name_of_kind(each.file.backend) for each in (robot, recorded) if each is not None]
    if len(set(kinds)) > 1:
        raise InvalidValueError(
            f"robot = {robot.file.name}: its back end is {kinds[0]}, and the samples are as recorded, of "
            f"{kinds[1]}; name a robot of that kind, as one with other limits"
        )
