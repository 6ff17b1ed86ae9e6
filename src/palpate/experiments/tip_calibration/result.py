"""What came of a tip calibration."""

from collections import Counter
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from palpate.controllers.touch_sequence import TouchOutcome
from palpate.errors import InvalidValueError
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.kit.shown_result import ShownResult
from palpate.experiments.tip_calibration.config import TipConfig
from palpate.experiments.tip_calibration.felt import joined_touches
from palpate.experiments.tip_calibration.found_tip import TrueTip
from palpate.experiments.tip_calibration.known import KnownBefore
from palpate.experiments.tip_calibration.plan import TipPlan, felt_in
from palpate.experiments.tip_calibration.still_plan import StillPlan
from palpate.robots.robot import Robot
from palpate.runtime import RunResult
from palpate.sensing.tip_calibration import PlannedTouch, TipFit, Touches

NEXT = 20
"""Touches that are planned after a calibration."""


@dataclass(frozen=True, slots=True, eq=False)
class TipCalibration(ShownResult):
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
    config: TipConfig
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


def calibration_in(plan: TipPlan, recorded: Recorded) -> TipCalibration:
    """Return what a run of touches has found.

    Raises:
        InvalidValueError: Nothing can be evaluated.
    """
    known, first = plan.known, plan.first
    try:
        felt = felt_in(plan, recorded.periods.pieces(), recorded.controller)
    except InvalidValueError:
        if first is None:
            raise
        touches, unrested = first, 0
    else:
        touches = felt.touches if first is None else joined_touches(first, felt.touches)
        unrested = len(felt.unrested)
    fit = known.fit(touches)
    return TipCalibration(
        recorded.run,
        plan.config,
        plan.robot,
        known,
        touches,
        fit,
        tuple(known.telling(NEXT, fit)),
        Counter(recorded.controller.outcomes),
        unrested,
        TrueTip.of(plan.config, plan.robot),
    )


def evaluation_in(plan: StillPlan, recorded: Recorded) -> TipCalibration:
    """Return what the touches of a file have found, or which to make.

    Raises:
        InvalidValueError: The touches cannot be.
    """
    known = plan.known
    fit = None if plan.touches is None else known.fit(plan.touches)
    count = NEXT if fit is not None else plan.config.touch_count
    return TipCalibration(
        recorded.run,
        plan.config,
        plan.described,
        known,
        plan.touches,
        fit,
        tuple(known.telling(count, fit)),
    )
