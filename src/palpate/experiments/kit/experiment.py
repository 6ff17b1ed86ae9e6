"""The interface of an experiment to the commands that run, replay, sweep, show and compare it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from palpate.experiments.kit.metric import Finding, Metric

if TYPE_CHECKING:  # commands import this module for --help, which must be quick
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.kinematics.hand import HandKinematics
    from palpate.reporting.data import Quantity
    from palpate.reporting.figure import Figure
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot
    from palpate.runtime import Backend, Controller, FingerDescription, Limits, Observer, RunResult
    from palpate.runtime.following import FollowingMaker
    from palpate.runtime.live import Change
    from palpate.runtime.log.standard.cloud import Cloud
    from palpate.runtime.shown_plan import PlanSource
    from palpate.runtime.supervision.guard import Guard
    from palpate.runtime.truth import TruthSource
    from palpate.viewing import ViewScene

Writer = Callable[[Path], object]
"""Writes a file at a path; raises OSError if it cannot."""


@dataclass(frozen=True, slots=True)
class DryRun:
    """What a run would do, known before anything moves.

    Attributes:
        task: What it is, for a title.
        metrics: What is known beforehand: durations, forces, speeds.
        files: Names of the files that it would write besides report and log.
        notes: What people should know before, a sentence each.
    """

    task: str
    metrics: "tuple[Quantity, ...]"
    files: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


class Plan(Protocol):
    """A run that can be carried out: everything checked and built, nothing moved yet.

    `PlanDefaults` implements the methods below `dry_run` as most experiments need them.
    """

    @property
    def config(self) -> Any:
        """What is carried out, an instance of the experiment's `Config`."""
        ...

    @property
    def robot(self) -> "Robot | None":
        """What carries it out; None for a simulation that no robot file describes."""
        ...

    @property
    def fingers(self) -> "Sequence[FingerDescription]":
        """For touch, one per finger."""
        ...

    @property
    def limits(self) -> "Limits":
        """For the supervisor."""
        ...

    @property
    def hand_kinematics(self) -> "HandKinematics | None":
        """Geometry of the hand whose fingers feel; None for a fingertip at the end of an arm."""
        ...

    @property
    def expected_duration(self) -> float:
        """About how long it takes [s]."""
        ...

    @property
    def longest_duration(self) -> float:
        """After which it is stopped [s]."""
        ...

    def backend(self) -> "Backend":
        """Return the robot, ready to be started once.

        Raises:
            InvalidValueError: It cannot be built as its file describes, or cannot be simulated.
        """
        ...

    def controller(self) -> "Controller":
        """Return a fresh controller."""
        ...

    def attachments(self) -> Mapping[str, str]:
        """Return what a log keeps besides configuration and robot to plan the very same again, by file name."""
        ...

    def dry_run(self) -> DryRun:
        """Return what it would do."""
        ...

    def view(self) -> "ViewScene":
        """Return what there is to see of it; for a rig that carries a fingertip, a plan on its twin is asked.

        Raises:
            InvalidValueError: Nothing of it is simulated.
        """
        ...

    @property
    def preparation(self) -> str:
        """What `prepared` does, as "pressing, to find stiffness and delay"; empty if it does nothing."""
        ...

    def prepared(self) -> "Plan":
        """Measure what the plan needs first, on a robot and scene of its own, and return the plan with it.

        Raises:
            InvalidValueError: The measurement has failed; the message names the reason.
        """
        ...

    def changes(self) -> "Sequence[Change]":
        """Return the changes of live parameters that were asked for beforehand."""
        ...

    @property
    def following(self) -> "FollowingMaker":
        """What compares the motion of the robot with its commands."""
        ...

    def guards(self) -> "tuple[Guard, ...]":
        """Return fresh guards for the supervisor of a run, besides those that every run has."""
        ...

    def observer(self, controller: Any, truth: "TruthSource | None") -> "Observer | None":
        """Return what keeps, every period, what `Experiment.evaluate` needs besides record and truth.

        Args:
            controller: A fresh one of this plan, which is about to run.
            truth: Source of the simulation's truth, live or from a log; None on a robot.
        """
        ...

    def companion(self) -> "Plan | None":
        """Return a second run to compare the first one with; None if none was asked for."""
        ...

    def shown_plan(self, controller: Any) -> "PlanSource | None":
        """Return the source of the path that a view shows of this controller; None if there is nothing to show."""
        ...


class PlanDefaults:
    """Default implementation of the optional methods of a `Plan`; a base class."""

    __slots__ = ()

    @property
    def hand_kinematics(self) -> "HandKinematics | None":
        """None: a fingertip at the end of an arm."""
        return None

    @property
    def preparation(self) -> str:
        """Nothing."""
        return ""

    def prepared(self) -> Any:
        """Return the plan as it is."""
        return self

    def attachments(self) -> Mapping[str, str]:
        """Return nothing: configuration and robot suffice."""
        return {}

    def changes(self) -> "Sequence[Change]":
        """Return none."""
        return ()

    @property
    def following(self) -> "FollowingMaker":
        """Of any robot: nothing is known of its servos."""
        from palpate.runtime.following import CommandedMotion

        return CommandedMotion

    def guards(self) -> "tuple[Guard, ...]":
        """Return none."""
        return ()

    def observer(self, controller: Any, truth: "TruthSource | None") -> "Observer | None":
        """Return none: record and truth suffice."""
        return None

    def companion(self) -> Any:
        """Return none."""
        return None

    def shown_plan(self, controller: Any) -> "PlanSource | None":
        """Return none."""
        return None


class Result(Protocol):
    """The result of a run."""

    @property
    def run(self) -> "RunResult":
        """How it ended, and its timing."""
        ...


class ShownResult:
    """A result that a notebook shows by outcome, key metrics and the first figure of its report; a base class.

    Attributes:
        experiment: Name of the experiment of the result, or `module:Class`.
    """

    __slots__ = ()

    experiment: ClassVar[str]

    def _repr_html_(self) -> str:
        from palpate.experiments.kit.registry import experiment_named
        from palpate.reporting.notebook import report_fragment

        return report_fragment(experiment_named(self.experiment).report(self))


class Experiment(Protocol):
    """An idea that can be run, dry-run, recorded, replayed, swept, viewed, compared and reported."""

    @property
    def name(self) -> str:
        """As typed after `palpate`."""
        ...

    @property
    def summary(self) -> str:
        """One line."""
        ...

    @property
    def Config(self) -> type[Any]:
        """A frozen dataclass, light to import: its fields are the options.

        Each has a default and a docstring below it, and `option` gives its unit and bounds. It has the fields
        `robot`, `seed` and `out`.
        """
        ...

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """Metrics of a run, the most important first: for terminal, --json, report, sweeps and comparisons."""
        ...

    def plan(self, config: Any, robot: "Robot | None", attachments: Mapping[str, str]) -> Plan:
        """Check and build everything; nothing moves, no device is opened.

        Args:
            config: What to do, an instance of `Config`.
            robot: What carries it out; None if `config.robot` is None.
            attachments: What the log of an earlier run kept (see `Plan.attachments`); empty for a new run.

        Raises:
            InvalidValueError: It cannot be carried out; the message names the remedy.
        """
        ...

    def evaluate(self, plan: Any, recorded: "Recorded") -> Result:
        """Return the result of a run, however it ended: one that has just ended, or one from its log.

        Raises:
            InvalidValueError: Nothing can be evaluated; the message names the reason.
        """
        ...

    def report(self, result: Any) -> "Report":
        """Return the report; figures are drawn only when it is written."""
        ...

    def files(self, result: Any) -> Mapping[str, Writer]:
        """Return what is written besides report and log, by file name."""
        ...

    def cloud(self, result: Any) -> "Cloud | None":
        """Return the points that the log is to have as its topic /map; None for none."""
        ...


class ExperimentDefaults:
    """Report, findings, figures, files and points of a simple `Experiment`; a base class.

    Attributes:
        findings: Statements of the report that hold for some results, with their remedies.
    """

    name: str
    summary: str
    Config: type[Any]
    metrics: tuple[Metric, ...]
    findings: tuple[Finding, ...] = ()

    def figures(self, result: Any) -> "Iterator[Figure]":
        """Yield the figures of the report; none by default."""
        yield from ()

    def report(self, result: Any) -> "Report":
        """Return the report: metrics, findings, figures, and the timing of the run."""
        from palpate.experiments.kit.run_report import report_of
        from palpate.reporting.report import Figures, Section

        figures = Section("Figures", (Figures(lambda: self.figures(result)),))
        return report_of(
            self, result, title=self.summary.rstrip("."), outcome=f"{result.run}.", sections=(figures,)
        )

    def files(self, result: Any) -> Mapping[str, Writer]:
        """Return no files."""
        return {}

    def cloud(self, result: Any) -> "Cloud | None":
        """Return no points."""
        return None
