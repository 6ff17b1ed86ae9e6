"""The result of a grasp: how far the object slipped and spun, and the grip against the minimum."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from palpate.controllers.grip.grasp import GraspStage
from palpate.controllers.grip.slip_alarm import SlipAlarm
from palpate.errors import FloatArray
from palpate.experiments.grasp.friction_belief import NotedNudge, NudgeFinding
from palpate.experiments.grasp.metrics import (
    CREEP_RATE_LIMIT,
    SLIP_LIMIT,
    SPIN_LIMIT,
    SPIN_RATE_LIMIT,
)
from palpate.experiments.grasp.minimum_grip import least_grip
from palpate.experiments.grasp.truth import STAGES, GraspTruth
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.kit.registry import ShownResult
from palpate.runtime import RunResult
from palpate.sim.fidelity import GRAVITY

if TYPE_CHECKING:  # plans make the recorders whose truth is evaluated here
    from palpate.experiments.grasp.plan import GraspPlan

BoolArray = npt.NDArray[np.bool_]

_DROP_SLIP = 0.01
"""Slip that counts as a drop, even if the table or a fingertip caught the object [m]."""

_MIN_RATE_TIME = 1.0
"""Shortest time over which a rate of slip is given [s]: shaking at 2 Hz has come back twice."""

_DENSE_STEP, _SPARSE_STEP = 5, 25
"""Periods between two evaluations of the minimum grip, while something pulls and otherwise."""

_ACCELERATION_WINDOW = 0.02
"""Time over which the acceleration of lifting and lowering is averaged [s]; contacts that ring are no load."""

_TABLE_GAP = 2e-5
"""Height above the table below which the table may still carry part of the weight [m]."""


def creep_rate(time: FloatArray, way: FloatArray) -> float:
    """Return the slope of the line through a way, the largest of all fingers; 0 below `_MIN_RATE_TIME`.

    Args:
        time: Time of each row, shape (n,) [s].
        way: Way of each finger, shape (n, k) [m] or [rad].
    """
    if len(time) < 2 or time[-1] - time[0] < _MIN_RATE_TIME:
        return 0.0
    from_middle = time - time.mean()
    slopes = from_middle @ way / (from_middle @ from_middle)
    return float(np.abs(slopes).max())


@dataclass(frozen=True, slots=True)
class Onset:
    """The onset of slip of one finger's contact by the truth, and its detection.

    Attributes:
        finger: Index of the finger.
        time: Onset by the truth [s].
        alarm_time: First alarm of that finger since the lift began [s]; NaN without an alarm.
    """

    finger: int
    time: float
    alarm_time: float

    @property
    def latency(self) -> float:
        """Time from slip to alarm [s]; below 0 if the alarm came first."""
        return self.alarm_time - self.time


@dataclass(frozen=True, eq=False)
class GraspResult(ShownResult):
    """The result of a grasp.

    Attributes:
        planned: Plan of the run.
        run: Ending and timing of the run.
        truth: True motion and loads; on a real robot the felt ones, and NaN.
        alarms: Detected slips.
        regrips: Number of times that an alarm raised the grip.
        comparison: Result of a control that ignores spin; None without it.
        met_early: Whether the object met something on the way down on which it did not stand.
        nudged: Findings of a nudge before the lift, per finger; empty without a nudge.
    """

    experiment = "grasp"

    planned: "GraspPlan"
    run: RunResult
    truth: GraspTruth
    alarms: tuple[SlipAlarm, ...]
    regrips: int
    comparison: "GraspResult | None" = field(default=None)
    met_early: bool = False
    nudged: tuple[NudgeFinding, ...] = ()

    @property
    def truth_known(self) -> bool:
        """Whether a simulation knows the true motion."""
        return not self.planned.hand.real

    def _at(self, *stages: GraspStage) -> BoolArray:
        """Return the periods at these stages, shape (n,)."""
        return np.isin(self.truth.stage, [STAGES.index(stage) for stage in stages])

    @cached_property
    def counted(self) -> BoolArray:
        """Periods of the pull, from its beginning until the whole pull was held, shape (n,)."""
        times, time = self.planned.times, self.truth.time
        return np.asarray((time >= times.begin) & (time < times.end) & self._at(GraspStage.HOLD))

    @cached_property
    def aloft(self) -> BoolArray:
        """Periods from the lift until the object meets the table again, shape (n,)."""
        down = self._at(GraspStage.SET_DOWN)
        landed = np.logical_or.accumulate(down & (self.truth.clearance <= 0.0))
        return np.asarray((self._at(GraspStage.LIFT, GraspStage.HOLD) | down) & ~landed)

    @cached_property
    def carried(self) -> BoolArray:
        """Periods in which the fingers alone carry the object, shape (n,)."""
        return np.asarray(self.aloft & (self.truth.clearance > _TABLE_GAP))

    @property
    def slip_aloft(self) -> float:
        """Largest slip over any fingertip since the lift began, while in the air [m]."""
        return float(self.truth.slid[self.aloft].max(initial=0.0))

    @property
    def spin_aloft(self) -> float:
        """Largest spin about any contact normal since the lift began, while in the air [rad]."""
        return float(self.truth.turned[self.aloft].max(initial=0.0))

    @property
    def slip(self) -> float:
        """Largest slip over any fingertip during the pull [m]."""
        return float(self.truth.slip[self.counted].max(initial=0.0))

    @property
    def spin(self) -> float:
        """Largest spin about any contact normal during the pull [rad]."""
        return float(self.truth.spin[self.counted].max(initial=0.0))

    @cached_property
    def slip_rate(self) -> float:
        """Largest creep rate over any fingertip during the pull [m/s]."""
        return creep_rate(self.truth.time[self.counted], self.truth.slip[self.counted])

    @cached_property
    def spin_rate(self) -> float:
        """Largest rate of spin about any contact normal during the pull [rad/s]."""
        return creep_rate(self.truth.time[self.counted], self.truth.spin[self.counted])

    @property
    def gave_way(self) -> tuple[str, ...]:
        """Significant motion in the air, so far or still going on: "slipped", "spun", both or neither."""
        slipped = max(self.slip, self.slip_aloft) > SLIP_LIMIT or self.slip_rate > CREEP_RATE_LIMIT
        spun = max(self.spin, self.spin_aloft) > SPIN_LIMIT or self.spin_rate > SPIN_RATE_LIMIT
        return tuple(word for word, beyond in (("slipped", slipped), ("spun", spun)) if beyond)

    @property
    def dropped(self) -> bool:
        """Whether the object was lost, slid too far, or was never lifted."""
        lost = self.truth.touching[self.counted].sum(axis=1).min(initial=self.truth.fingers) < 2
        far = max(self.slip, self.slip_aloft) > _DROP_SLIP
        return bool(lost) or far or not self.counted.any() or self.left_behind

    @property
    def left_behind(self) -> bool:
        """Whether the object still stood or lay on the table when the pull began."""
        pulled = np.flatnonzero(self.counted)
        return bool(len(pulled) and self.truth.clearance[pulled[0]] <= _TABLE_GAP)

    @property
    def higher(self) -> float:
        """Height gained by the contacts from before the lift to the end, mean over the fingers [m]."""
        lifts = np.flatnonzero(self.aloft)
        at = self.truth.height + self.truth.contact[:, :, 2].mean(axis=1)
        return float(at[-1] - at[lifts[0]]) if len(lifts) else 0.0

    @cached_property
    def least(self) -> FloatArray:
        """Minimum grip of the true load, shape (n,) [N]; NaN where the fingers do not carry it alone."""
        truth, planned = self.truth, self.planned
        least = np.full(len(truth), np.nan)
        at = np.flatnonzero(self.carried & truth.touching.all(axis=1))
        if not len(at):
            return least
        dense, sparse = at[self.counted[at]], at[~self.counted[at]]
        chosen = np.unique(np.concatenate([dense[::_DENSE_STEP], dense[-1:], sparse[::_SPARSE_STEP], at[-1:]]))
        load = truth.pull.copy()
        load[:, 2] += -planned.config.mass * (GRAVITY + self._acceleration())
        values = [
            least_grip(planned.true, tuple(load[i].tolist()), truth.contact[i].tolist(), truth.normal[i].tolist())
            for i in chosen
        ]
        least[at] = np.interp(truth.time[at], truth.time[chosen], values)
        return least

    def _acceleration(self) -> FloatArray:
        """Return the object's acceleration upwards while it is lifted and lowered, shape (n,) [m/s^2]; else 0."""
        truth, n = self.truth, round(_ACCELERATION_WINDOW / self.planned.period)
        moved = self.aloft & ~self._at(GraspStage.HOLD)
        if not moved.any() or len(truth) <= n:
            return np.zeros(len(truth))
        speed = np.gradient(truth.height, truth.time)
        mean = np.convolve(np.gradient(speed, truth.time), np.full(n, 1.0 / n), mode="same")
        return np.where(moved, mean, 0.0)

    @cached_property
    def felt(self) -> FloatArray:
        """Normal force, mean over the fingers, shape (n,) [N]: the true one, on a real robot the felt one."""
        return np.asarray(self.truth.loads[:, :, 0].mean(axis=1))

    @property
    def largest_grip(self) -> float:
        """Largest normal force during the pull, mean over the fingers [N]; NaN if nothing was held then."""
        known = self.counted & np.isfinite(self.least) if self.truth_known else self.counted
        return float(self.felt[known].max()) if known.any() else math.nan

    @property
    def growth(self) -> float:
        """Mean grip of the last half second of the hold over that of the first; NaN for a hold of a second."""
        felt, half = self.felt[self.counted], round(0.5 / self.planned.period)
        return float(felt[-half:].mean() / felt[:half].mean()) if len(felt) > 2 * half else math.nan

    @property
    def grip_ratio(self) -> float:
        """Mean of the true grip over the mean of the minimum during the pull; NaN if nothing was held then."""
        known = self.counted & np.isfinite(self.least)
        return float(self.felt[known].sum() / self.least[known].sum()) if known.any() else math.nan

    @property
    def tightest(self) -> float:
        """Smallest ratio of grip and minimum at any instant in the air; NaN if nothing was lifted."""
        known = self.carried & np.isfinite(self.least) & (self.least > 0.0)
        return float((self.felt[known] / self.least[known]).min()) if known.any() else math.nan

    @cached_property
    def onsets(self) -> tuple[Onset, ...]:
        """Onsets of slip in the air, at most one per finger."""
        truth, found = self.truth, []
        for k in range(truth.fingers):
            beyond = ((truth.slid[:, k] > SLIP_LIMIT) | (truth.turned[:, k] > SPIN_LIMIT)) & self.aloft
            if beyond.any():
                times = [alarm.time for alarm in self.alarms_aloft if alarm.finger == k]
                found.append(Onset(k, float(truth.time[int(beyond.argmax())]), min(times, default=math.nan)))
        return tuple(found)

    @property
    def pulled_alarms(self) -> tuple[SlipAlarm, ...]:
        """Alarms during the pull."""
        times = self.planned.times
        return tuple(alarm for alarm in self.alarms if times.begin <= alarm.time < times.end)

    @property
    def alarms_aloft(self) -> tuple[SlipAlarm, ...]:
        """Alarms since the lift began, while in the air."""
        return tuple(alarm for alarm in self.alarms if self.aloft[self._row(alarm.time)])

    def alarms_at(self) -> dict[GraspStage, int]:
        """Return the number of alarms at each stage that had some, without those during the pull."""
        others = (alarm for alarm in self.alarms if alarm not in self.pulled_alarms)
        stages = [STAGES[self.truth.stage[self._row(alarm.time)]] for alarm in others]
        return {stage: stages.count(stage) for stage in STAGES if stage in stages}

    def raised_at(self) -> dict[GraspStage, int]:
        """Return how often the grip was raised at each stage, where it was."""
        raised = np.diff(self.truth.regrips, prepend=0)
        counts = {stage: int(raised[self.truth.stage == i].sum()) for i, stage in enumerate(STAGES)}
        return {stage: count for stage, count in counts.items() if count > 0}

    def _row(self, time: float) -> int:
        """Return the row of a time [s], or the next one."""
        return min(int(np.searchsorted(self.truth.time, time - 0.5 * self.planned.period)), len(self.truth) - 1)


def grasp_of(planned: "GraspPlan", recorded: Recorded) -> GraspResult:
    """Return the result of a run, with the one of its companion if it has one."""
    control, other = recorded.controller, planned.companion()
    belief = control.grip.belief.believed
    comparison = None if other is None or recorded.companion is None else grasp_of(other, recorded.companion)
    return GraspResult(
        planned,
        recorded.run,
        recorded.observer.truth(),
        control.grip.alarms,
        control.grip.regrips,
        comparison,
        control.met_early,
        belief.found if isinstance(belief, NotedNudge) else (),
    )


def write_table(grasp: GraspResult, path: Path) -> None:
    """Write grip, slip and spin over time as CSV.

    Raises:
        OSError: If the file cannot be written.
    """
    truth = grasp.truth
    columns = {"time_s": truth.time, "wanted_grip_N": truth.target}
    if grasp.truth_known:
        slid, turned = truth.slid.max(axis=1), truth.turned.max(axis=1)
        columns |= {"true_grip_N": grasp.felt, "least_grip_N": grasp.least, "slip_m": slid, "spin_rad": turned}
    else:
        columns["felt_grip_N"] = grasp.felt
    np.savetxt(path, np.column_stack(list(columns.values())), "%.9g", ",", header=",".join(columns), comments="")
