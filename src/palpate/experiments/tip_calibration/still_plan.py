"""A plan in which nothing moves: touches of a file are evaluated, or the first touches are planned."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from palpate.controllers.touch_sequence import TouchOutcome
from palpate.experiments.kit.experiment import DryRun, PlanDefaults
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.tip_calibration.config import TOUCHES_TEXT, TipCalibrationConfig
from palpate.experiments.tip_calibration.files import FILE_NAMES
from palpate.experiments.tip_calibration.known import KnownBefore
from palpate.experiments.tip_calibration.touches_csv import load_touches, read_touches
from palpate.reporting.data import Quantity
from palpate.robots.fingertip import only_finger
from palpate.robots.robot import Robot
from palpate.robots.robot_kind import RobotKind
from palpate.runtime import (
    Backend,
    Command,
    Controller,
    Finger,
    FingerDescription,
    Limits,
    Observation,
    Phase,
    Sample,
)
from palpate.runtime.closing import Closing
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.tip_calibration import Touches
from palpate.spatial import IDENTITY, ZERO
from palpate.viewing import ViewScene

PERIOD = 1e-3
"""[s]"""


class NothingMoves(Closing):
    """A `Backend` of nothing: one finger that feels nothing."""

    def __init__(self) -> None:
        """Begin at time 0."""
        self._time = 0.0
        self._pacer = SimulatedTime()

    @property
    def period(self) -> float:
        """See `Backend`."""
        return PERIOD

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    def start(self) -> Sample:
        """See `Backend`."""
        self._time = 0.0
        return self._sample()

    def step(self, command: Command) -> Sample:
        """See `Backend`."""
        self._time += PERIOD
        self._pacer.wait()
        return self._sample()

    def close(self) -> None:
        """See `Backend`."""

    def _sample(self) -> Sample:
        arm = ArmSample(self._time, ZERO, IDENTITY, ZERO)
        return Sample(self._time, arm, (WrenchSample(self._time, (0.0,) * 6, ZERO),))


class NothingToDo:
    """A `Controller` that is done at once.

    Attributes:
        outcomes: Of touches: none are made.
    """

    outcomes: tuple[TouchOutcome, ...] = ()

    def start(self, first: Observation) -> None:
        """See `Controller`."""

    def step(self, now: Observation) -> Command:
        """See `Controller`."""
        return Command(phase=Phase.DONE)


@dataclass(frozen=True, slots=True, eq=False)
class StillPlan(PlanDefaults):
    """Nothing moves. A `Plan`.

    Attributes:
        config: What was asked for.
        described: The robot whose fingertip it is; it is not connected to.
        known: Before anything was touched.
        touches: Of the file; None if there are none.
        touches_file: Their text.
    """

    config: TipCalibrationConfig
    described: Robot
    known: KnownBefore
    touches: Touches | None
    touches_file: str

    @property
    def robot(self) -> None:
        """See `Plan`: nothing carries it out."""
        return

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """See `Plan`."""
        return (Finger(only_finger(self.described).surface.surface(), SensorPayload(0.0, (0.0, 0.0, 0.0))),)

    @property
    def limits(self) -> Limits:
        """See `Plan`."""
        return self.described.file.limits

    @property
    def expected_duration(self) -> float:
        """See `Plan`."""
        return 0.01

    @property
    def longest_duration(self) -> float:
        """See `Plan`."""
        return 1.0

    def touches_of(self, recorded: Recorded) -> tuple[Touches | None, int]:
        """Return the touches of the file, if there are any, all of them at rest."""
        return self.touches, 0

    def backend(self) -> Backend:
        """See `Plan`."""
        return NothingMoves()

    def controller(self) -> Controller:
        """See `Plan`."""
        return NothingToDo()

    def attachments(self) -> Mapping[str, str]:
        """See `Plan`: the robot's files, and the touches."""
        return dict(self.described.texts) | ({TOUCHES_TEXT: self.touches_file} if self.touches_file else {})

    def dry_run(self) -> DryRun:
        """See `Plan`."""
        count = 0 if self.touches is None else len(self.touches)
        metrics = (
            Quantity("touches", count, "", f"of {self.config.touches}" if count else "none: they are planned"),
            Quantity("targets", len(self.known.targets), "", ", ".join(each.name for each in self.known.targets)),
        )
        return DryRun("Calibration of a fingertip by touches: nothing moves", metrics, FILE_NAMES)

    def view(self) -> ViewScene:
        """See `Plan`: the robot as it would touch."""
        from palpate.experiments.tip_calibration.plan import plan_touches

        moving = replace(self.config, touches=None, plan=False)
        return plan_touches(moving, self.described, {}).view()


def plan_still(config: TipCalibrationConfig, robot: Robot, attachments: Mapping[str, str]) -> StillPlan:
    """Read and check the touches.

    Raises:
        InvalidValueError: The file cannot be read, or something in it is wrong.
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
