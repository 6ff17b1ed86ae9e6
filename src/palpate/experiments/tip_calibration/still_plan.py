"""A plan in which nothing moves: touches of a file are evaluated, or the first touches are planned."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import count

from palpate.controllers.touch_sequence import TouchOutcome
from palpate.experiments.kit.experiment import DryRun, PlanDefaults
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.tip_calibration.config import TOUCHES_TEXT, TipCalibrationConfig
from palpate.experiments.tip_calibration.findings import FILE_NAMES
from palpate.experiments.tip_calibration.known import KnownBefore
from palpate.experiments.tip_calibration.touches_csv import load_touches, read_touches
from palpate.reporting.data import Quantity
from palpate.robots.fingertip import only_finger
from palpate.robots.robot import Robot
from palpate.robots.robot_kind import RobotKind
from palpate.runtime import Backend, Command, Finger, FingerDescription, Limits, Observation, Phase, Sample
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.runtime.replay import ReplayBackend
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.tip_calibration import Touches
from palpate.spatial import IDENTITY, ZERO
from palpate.viewing import ViewScene

_PERIOD_S = 1e-3
"""Control period [s]."""


def _samples_at_rest() -> Iterator[Sample]:
    """Yield samples of an unloaded finger at rest."""
    for i in count():
        time = i * _PERIOD_S
        arm = ArmSample(time, ZERO, IDENTITY, ZERO)
        yield Sample(time, arm, (WrenchSample(time, (0.0,) * 6, ZERO),))


class NothingToDo:
    """A `Controller` that ends the run in its first period.

    Attributes:
        outcomes: Outcomes of touches; always empty.
    """

    outcomes: tuple[TouchOutcome, ...] = ()

    def start(self, first: Observation) -> None:
        """Do nothing."""

    def step(self, now: Observation) -> Command:
        """Return the command that ends the run."""
        return Command(phase=Phase.DONE)


@dataclass(frozen=True, eq=False)
class StillPlan(PlanDefaults):
    """Touches that were made before, without a motion. A `Plan`.

    Attributes:
        config: Configuration.
        described: Robot whose fingertip is calibrated; its devices are not connected.
        known: Prior knowledge of tip and targets.
        touches: Touches of the file; None without a file.
        touches_file: Text of the file.
        robot: None: nothing moves.
        expected_duration: Expected duration [s].
        longest_duration: Time after which the run is stopped [s].
    """

    config: TipCalibrationConfig
    described: Robot
    known: KnownBefore
    touches: Touches | None
    touches_file: str
    robot: None = None
    expected_duration: float = 0.01
    longest_duration: float = 1.0

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """Finger without a payload."""
        return (Finger(only_finger(self.described).surface.surface(), SensorPayload(0.0, (0.0, 0.0, 0.0))),)

    @property
    def limits(self) -> Limits:
        """Limits of the described robot."""
        return self.described.file.limits

    def touches_of(self, recorded: Recorded) -> tuple[Touches | None, int]:
        """Return the touches of the file, if there are any, all of them at rest."""
        return self.touches, 0

    def backend(self) -> Backend:
        """Return a back end of samples at rest."""
        return ReplayBackend(_samples_at_rest(), _PERIOD_S)

    def controller(self) -> NothingToDo:
        """Return a controller that ends the run."""
        return NothingToDo()

    def attachments(self) -> Mapping[str, str]:
        """Return the robot's files, and the touches."""
        return dict(self.described.texts) | ({TOUCHES_TEXT: self.touches_file} if self.touches_file else {})

    def dry_run(self) -> DryRun:
        """Return the numbers of touches and targets."""
        touches = 0 if self.touches is None else len(self.touches)
        metrics = (
            Quantity("touches", touches, "", f"of {self.config.touches}" if touches else "none: they are planned"),
            Quantity("targets", len(self.known.targets), "", ", ".join(each.name for each in self.known.targets)),
        )
        return DryRun("Calibration of a fingertip by touches: nothing moves", metrics, FILE_NAMES)

    def view(self) -> ViewScene:
        """Return the robot as it would touch."""
        from palpate.experiments.tip_calibration.plan import plan_touches

        moving = replace(self.config, touches=None, plan=False)
        return plan_touches(moving, self.described, {}).view()


def plan_still(config: TipCalibrationConfig, robot: Robot, attachments: Mapping[str, str]) -> StillPlan:
    """Read and check the touches.

    Raises:
        InvalidValueError: If the file cannot be read, or its content is wrong.
    """
    turns = RobotKind.TURNS if config.touches is not None else robot.file.backend.TURNS  # by hand all turns
    known = KnownBefore.of(config, robot, turns=turns)
    kept = attachments.get(TOUCHES_TEXT)
    if kept is not None:
        file, text = read_touches(kept, TOUCHES_TEXT, known.targets), kept
    elif config.touches is not None:
        file, text = load_touches(config.touches, known.targets)
    else:
        return StillPlan(config, robot, known, None, "")
    return StillPlan(config, robot, replace(known, targets=file.targets), file.touches, text)
