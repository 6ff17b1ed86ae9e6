"""The interface of an experiment to the commands that run, replay, sweep, show and compare it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.experiments.kit.metric import Finding, Metric

if TYPE_CHECKING:  # commands import this module for --help, which must be quick
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.kinematics.hand import HandKinematics
    from palpate.reporting.data import Quantity
    from palpate.reporting.report import FigureSource, Report
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
"""Function that writes a file at a path, or raises OSError."""


@dataclass(frozen=True, slots=True)
class DryRun:
    """Preview of a run, before anything moves.

    Attributes:
        task: Title of the run.
        metrics: Quantities known beforehand: durations, forces, speeds.
        files: Names of the files written besides report and log.
        notes: Remarks for the user, a sentence each.
    """

    task: str
    metrics: "tuple[Quantity, ...]"
    files: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


class Plan(Protocol):
    """Plan of a run: everything is checked and built, nothing has moved yet.

    `PlanDefaults` implements the methods below `dry_run` as most experiments need them.
    """

    @property
    def config(self) -> Any:
        """Configuration of the run, an instance of the experiment's `Config`."""
        ...

    @property
    def robot(self) -> "Robot | None":
        """Robot of the run; None for a simulation that no robot file describes."""
        ...

    @property
    def fingers(self) -> "Sequence[FingerDescription]":
        """Descriptions of the fingers for touch."""
        ...

    @property
    def limits(self) -> "Limits":
        """Limits for the supervisor."""
        ...

    @property
    def hand_kinematics(self) -> "HandKinematics | None":
        """Geometry of the hand whose fingers touch; None for a fingertip at the end of an arm."""
        ...

    @property
    def expected_duration(self) -> float:
        """Expected duration of the run [s]."""
        ...

    @property
    def longest_duration(self) -> float:
        """Duration after which the run is stopped [s]."""
        ...

    def backend(self) -> "Backend":
        """Return the robot, ready to be started once.

        Raises:
            InvalidValueError: If the robot cannot be built as its file describes, or cannot be simulated.
        """
        ...

    def controller(self) -> "Controller":
        """Return a fresh controller."""
        ...

    def attachments(self) -> Mapping[str, str]:
        """Return what a log keeps besides configuration and robot to plan the very same again, by file name."""
        ...

    def dry_run(self) -> DryRun:
        """Return the preview of the run."""
        ...

    def view(self) -> "ViewScene":
        """Return the scene for the view; commands ask the plan of a real robot's simulated twin.

        Raises:
            InvalidValueError: If nothing of the run is simulated.
        """
        ...

    @property
    def preparation(self) -> str:
        """Description of `prepared`, as "pressing, to find stiffness and delay"; empty if it does nothing."""
        ...

    def prepared(self) -> "Plan":
        """Take the measurements that the plan needs, on a scene of their own, and return the completed plan.

        Raises:
            InvalidValueError: If a measurement fails; the message names the reason.
        """
        ...

    def changes(self) -> "Sequence[Change]":
        """Return the scheduled changes of live parameters."""
        ...

    @property
    def following(self) -> "FollowingMaker":
        """Maker of the comparison between the robot's motion and its commands."""
        ...

    def guards(self) -> "tuple[Guard, ...]":
        """Return fresh guards for the supervisor, in addition to the guards of every run."""
        ...

    def observer(self, controller: Any, truth: "TruthSource | None") -> "Observer | None":
        """Return an observer that collects data for `Experiment.evaluate`; None if record and truth suffice.

        Args:
            controller: Fresh controller of this plan, which is about to run.
            truth: Source of the simulation's truth, live or from a log; None on a robot.
        """
        ...

    def companion(self) -> "Plan | None":
        """Return the plan of a second run for comparison; None without one."""
        ...

    def shown_plan(self, controller: Any) -> "PlanSource | None":
        """Return the source of the path that a view shows of this controller; None without a path."""
        ...


class PlanDefaults:
    """Default implementation of the optional methods of a `Plan`; a base class."""

    __slots__ = ()

    @property
    def hand_kinematics(self) -> "HandKinematics | None":
        """Return None: a fingertip at the end of an arm."""
        return None

    @property
    def preparation(self) -> str:
        """Empty: the plan needs no measurement."""
        return ""

    def prepared(self) -> Any:
        """Return the plan as it is."""
        return self

    def attachments(self) -> Mapping[str, str]:
        """Return nothing: configuration and robot suffice."""
        return {}

    def changes(self) -> "Sequence[Change]":
        """Return an empty tuple."""
        return ()

    @property
    def following(self) -> "FollowingMaker":
        """Commands as they are: no model of the servos is known."""
        from palpate.runtime.following import CommandedMotion

        return CommandedMotion

    def guards(self) -> "tuple[Guard, ...]":
        """Return an empty tuple."""
        return ()

    def observer(self, controller: Any, truth: "TruthSource | None") -> "Observer | None":
        """Return None: record and truth suffice."""
        return None

    def companion(self) -> Any:
        """Return an empty tuple."""
        return None

    def shown_plan(self, controller: Any) -> "PlanSource | None":
        """Return an empty tuple."""
        return None


class Result(Protocol):
    """The result of a run."""

    @property
    def run(self) -> "RunResult":
        """Ending and timing of the run."""
        ...


class Experiment(Protocol):
    """An experiment that commands run, preview, record, replay, sweep, view, compare and report."""

    @property
    def name(self) -> str:
        """Command that is typed after `palpate`."""
        ...

    @property
    def summary(self) -> str:
        """Description in one line."""
        ...

    @property
    def Config(self) -> type[Any]:
        """A frozen dataclass, light to import: its fields are the options.

        Every field has a default and a docstring; `option` states unit and bounds. The fields `robot`, `seed` and
        `out` are required.
        """
        ...

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """Metrics of a run, the most important first: for terminal, --json, report, sweeps and comparisons."""
        ...

    def plan(self, config: Any, robot: "Robot | None", attachments: Mapping[str, str]) -> Plan:
        """Check and build everything; nothing moves, no device is opened.

        Args:
            config: Configuration, an instance of `Config`.
            robot: Robot of the run; None if `config.robot` is None.
            attachments: Texts of the log of an earlier run (see `Plan.attachments`); empty for a new run.

        Raises:
            InvalidValueError: If the run cannot be carried out; the message names the remedy.
        """
        ...

    def evaluate(self, plan: Any, recorded: "Recorded") -> Result:
        """Return the result of a run that has just ended, or of its log, whatever ended the run.

        Raises:
            InvalidValueError: If nothing can be evaluated; the message names the reason.
        """
        ...

    def report(self, result: Any) -> "Report":
        """Return the report; figures are drawn only when it is written."""
        ...

    def files(self, result: Any) -> Mapping[str, Writer]:
        """Return the writers of the files besides report and log, by file name."""
        ...

    def cloud(self, result: Any) -> "Cloud | None":
        """Return the points for the log's topic /map; None for none."""
        ...


class ExperimentDefaults:
    """Report, findings, figures, files and points of a simple `Experiment`; a base class.

    Attributes:
        findings: Statements of the report that hold for some results, with their remedies.
        warm_up: Options of small runs, which `palpate warm-up` carries out to compile what the experiment uses.
    """

    name: str
    summary: str
    Config: type[Any]
    metrics: tuple[Metric, ...]
    findings: tuple[Finding, ...] = ()
    warm_up: tuple[Mapping[str, object], ...] = ()

    def figures(self, result: Any) -> "Iterator[FigureSource]":
        """Yield the figures of the report, or functions that draw one each; none by default."""
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
