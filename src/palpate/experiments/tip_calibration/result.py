"""The result of a tip calibration."""

from collections import Counter
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.controllers.touch_sequence import TouchOutcome
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.kit.registry import ShownResult
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.experiments.tip_calibration.found_tip import simulated_tip
from palpate.experiments.tip_calibration.known import KnownBefore
from palpate.experiments.tip_calibration.plan import TipPlan
from palpate.experiments.tip_calibration.still_plan import StillPlan
from palpate.robots.robot import Robot
from palpate.runtime import RunResult
from palpate.sensing.tip_calibration import PlannedTouch, TipFit, Touches, TypedTip

_NEXT_COUNT = 20
"""Number of touches that are planned after a calibration."""


class TrueErrors(NamedTuple):
    """Errors of the found tip against the simulated one.

    Attributes:
        size: Largest error of a length [m].
        center: Distance of the centres [m].
        turn: Angle between the axes [rad]; None for a sphere.
        stiffness: Relative error of the stiffness.
    """

    size: float
    center: float
    turn: float | None
    stiffness: float


@dataclass(frozen=True, slots=True, eq=False)
class TipCalibrationResult(ShownResult):
    """The result of a tip calibration.

    Attributes:
        run: Ending and timing of the run.
        config: Options of the calibration.
        robot: Robot that carries the fingertip.
        known: Prior knowledge of tip and targets.
        touches: All touches, the first ones included; None without any.
        fit: Tip that explains the touches; None without touches.
        next_touches: Most informative next touches.
        outcomes: Number of touches of the run by their outcome.
        unrested: Number of touches that were left out, for the tip crept.
        true: Simulated tip; None where it is not known.
    """

    experiment: ClassVar[str] = "calibrate.tip"

    run: RunResult
    config: TipCalibrationConfig
    robot: Robot
    known: KnownBefore
    touches: Touches | None
    fit: TipFit | None
    next_touches: tuple[PlannedTouch, ...]
    outcomes: "Counter[TouchOutcome]" = field(default_factory=Counter)
    unrested: int = 0
    true: TypedTip | None = None

    @property
    def usable(self) -> bool:
        """Whether the tip is to be used."""
        return self.fit is not None and self.fit.verdict.ok

    @property
    def errors(self) -> TrueErrors | None:
        """Errors against the simulated tip; None without one of the same family of shapes."""
        fit, true = self.fit, self.true
        if fit is None or true is None or fit.unknowns.tip.shape.kind != true.shape.kind:
            return None
        lengths = [name.endswith("_m") for name in true.shape.names]
        turn = Rotation.from_matrix(true.rotation.T @ fit.rotation).as_rotvec()
        turn[list(true.shape.round_about)] = 0.0
        is_sphere = len(true.shape.round_about) == 3
        return TrueErrors(
            float(np.abs(fit.sizes - np.array(true.shape.sizes))[lengths].max()),
            float(np.linalg.norm(fit.center - true.center)),
            None if is_sphere else float(np.linalg.norm(turn)),
            abs(float(fit.unknowns.skin(fit.values)[0]) / true.stiffness - 1.0),
        )

    @property
    def largest_sd(self) -> float:
        """Largest standard deviation of the centre along an axis [m]; NaN without a fit."""
        return float("nan") if self.fit is None else float(np.sqrt(np.diag(self.fit.model_covariance())[:3].max()))


def calibration_in(plan: TipPlan | StillPlan, recorded: Recorded) -> TipCalibrationResult:
    """Return the found tip, or, without touches, the touches to make.

    Raises:
        InvalidValueError: If nothing can be evaluated.
    """
    known, config, robot = plan.known, plan.config, plan.described
    touches, unrested = plan.touches_of(recorded)
    fit = None if touches is None else known.fit(touches)
    count = config.touch_count if fit is None else _NEXT_COUNT
    return TipCalibrationResult(
        recorded.run,
        config,
        robot,
        known,
        touches,
        fit,
        tuple(known.telling(count, fit)),
        Counter(recorded.controller.outcomes),
        unrested,
        simulated_tip(config, robot),
    )
