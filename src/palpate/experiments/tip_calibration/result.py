"""What came of a tip calibration."""

from collections import Counter
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from palpate.controllers.touch_sequence import TouchOutcome
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.kit.registry import ShownResult
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.experiments.tip_calibration.found_tip import TrueTip
from palpate.experiments.tip_calibration.known import KnownBefore
from palpate.experiments.tip_calibration.plan import TipPlan
from palpate.experiments.tip_calibration.still_plan import StillPlan
from palpate.robots.robot import Robot
from palpate.runtime import RunResult
from palpate.sensing.tip_calibration import PlannedTouch, TipFit, Touches

NEXT = 20
"""Touches that are planned after a calibration."""


@dataclass(frozen=True, slots=True, eq=False)
class TipCalibrationResult(ShownResult):
    """A fingertip, as touches have it.

    Attributes:
        run: How it ended, and its timing.
        config: What was asked for.
        robot: Whose fingertip it is.
        known: Before.
        touches: All, those that came first included; None if there are none.
        fit: The tip that explains them; None if none was touched.
        next_touches: Those that would tell most next.
        outcomes: How many touches of the run came to what.
        unrested: How many were left out, for the tip crept.
        true: The tip that is simulated; None if nobody knows it.
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
    true: TrueTip | None = None

    @property
    def usable(self) -> bool:
        """Whether the tip is to be used."""
        return self.fit is not None and self.fit.verdict.ok

    @property
    def judged(self) -> TrueTip | None:
        """The simulated tip, if what was found can be compared with it."""
        return (
            self.true
            if self.fit is not None and self.true is not None and self.true.comparable(self.fit)
            else None
        )

    @property
    def largest_sd(self) -> float:
        """Of places, the largest standard deviation [m]; NaN without a fit."""
        return float("nan") if self.fit is None else float(np.sqrt(np.diag(self.fit.model_covariance())[:3].max()))


def calibration_in(plan: TipPlan | StillPlan, recorded: Recorded) -> TipCalibrationResult:
    """Return what touches have found, or, without any, which to make.

    Raises:
        InvalidValueError: Nothing can be evaluated.
    """
    known, config, robot = plan.known, plan.config, plan.described
    touches, unrested = plan.touches_of(recorded)
    fit = None if touches is None else known.fit(touches)
    count = config.touch_count if fit is None else NEXT
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
        TrueTip.of(config, robot),
    )
