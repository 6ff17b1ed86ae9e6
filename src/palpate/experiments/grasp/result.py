"""The result of a grasp."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from palpate.controllers.grip.grasp import GraspStage
from palpate.controllers.grip.slip_alarm import SlipAlarm
from palpate.errors import FloatArray
from palpate.experiments.grasp.creep import CREEPS, TURNS, creep_rate
from palpate.experiments.grasp.least import least_grip
from palpate.experiments.grasp.nudged import NotedNudge, NudgeFinding
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.grasp.truth import STAGES, GraspTruth
from palpate.experiments.kit.experiment import ShownResult
from palpate.experiments.kit.recorded_run import Recorded
from palpate.runtime import RunResult
from palpate.sim.fidelity import GRAVITY

BoolArray = npt.NDArray[np.bool_]

DROPPED = 0.01
"""[m] Of slip: that is a drop, even if the table or a fingertip caught it."""

SLIPPED, SPUN = 2e-5, math.radians(0.2)
"""[m], [rad] Least motion that counts as slip: below are elastic deflection and creep."""

EVERY, SELDOM = 5, 25
"""Periods from one to the next for which the least grip is worked out, while it is pulled and else."""

MEAN = 0.02
"""[s] Over which the acceleration of lifting and lowering is taken: what contacts ring with is no load."""

NEAR = 2e-5
"""[m] Above the table: closer, the table may still bear part of the weight."""


@dataclass(frozen=True, slots=True)
class Onset:
    """When a finger's contact began to slip by the truth, and when that was detected.

    Attributes:
        finger: Where.
        time: By the truth [s].
        alarm_time: Of the first alarm there since the lift began [s]; NaN if there was none.
    """

    finger: int
    time: float
    alarm_time: float

    @property
    def latency(self) -> float:
        """From slip to alarm [s]; below 0 if the alarm came first."""
        return self.alarm_time - self.time


@dataclass(frozen=True, eq=False)
class GraspResult(ShownResult):
    """The result of a grasp.

    Attributes:
        planned: What was planned.
        run: How it went.
        truth: What really happened; on a real robot what was felt, and NaN.
        alarms: Slips that were detected.
        regrips: How often the grip was raised for one.
        comparison: The same with a control that ignores spin, if that was asked for.
        met_early: Whether it met something while it was lowered that it did not stand on.
        nudged: What a nudge before the lift found, per finger; empty without.
    """

    experiment = "grasp"

    planned: GraspPlan
    run: RunResult
    truth: GraspTruth
    alarms: tuple[SlipAlarm, ...]
    regrips: int
    comparison: "GraspResult | None" = field(default=None)
    met_early: bool = False
    nudged: tuple[NudgeFinding, ...] = ()

    @property
    def truth_known(self) -> bool:
        """Whether it is known what really happened."""
        return not self.planned.hand.real

    @cached_property
    def counted(self) -> BoolArray:
        """Which periods count: from when something pulls until all of it was held, shape (n,)."""
        times, time = self.planned.times, self.truth.time
        holding = self.truth.stage == STAGES.index(GraspStage.HOLD)
        return np.asarray((time >= times.begin) & (time < times.end) & holding)

    @cached_property
    def aloft(self) -> BoolArray:
        """In which periods the hand has it: from the lift until it meets the table again, shape (n,)."""
        stage = self.truth.stage
        down = stage == STAGES.index(GraspStage.SET_DOWN)
        before = np.logical_or.accumulate(down & (self.truth.clearance <= 0.0))
        lifted = (stage == STAGES.index(GraspStage.LIFT)) | (stage == STAGES.index(GraspStage.HOLD)) | down
        return np.asarray(lifted & ~before)

    @cached_property
    def carried(self) -> BoolArray:
        """In which of them fingers alone bear it, shape (n,)."""
        return np.asarray(self.aloft & (self.truth.clearance > NEAR))

    @property
    def slip_aloft(self) -> float:
        """Largest over any fingertip since the lift began, in the whole time in the air [m]."""
        return float(self.truth.slid[self.aloft].max(initial=0.0))

    @property
    def spin_aloft(self) -> float:
        """Likewise, about its normal [rad]."""
        return float(self.truth.turned[self.aloft].max(initial=0.0))

    @property
    def gave_way(self) -> tuple[str, ...]:
        """Significant motion in the air, so far or still going on: "slipped", "spun", both or neither."""
        slipped = max(self.slip, self.slip_aloft) > SLIPPED or self.slip_rate > CREEPS
        spun = max(self.spin, self.spin_aloft) > SPUN or self.spin_rate > TURNS
        return tuple(word for word, beyond in (("slipped", slipped), ("spun", spun)) if beyond)

    @cached_property
    def slip_rate(self) -> float:
        """With which it creeps over any fingertip while it is pulled [m/s]."""
        return creep_rate(self.truth.time[self.counted], self.truth.slip[self.counted])

    @cached_property
    def spin_rate(self) -> float:
        """Likewise, about its normal [rad/s]."""
        return creep_rate(self.truth.time[self.counted], self.truth.spin[self.counted])

    @property
    def slip(self) -> float:
        """Largest over any fingertip since the pull began, while it was pulled [m]."""
        return float(self.truth.slip[self.counted].max(initial=0.0))

    @property
    def spin(self) -> float:
        """Likewise, about its normal [rad]."""
        return float(self.truth.spin[self.counted].max(initial=0.0))

    @property
    def dropped(self) -> bool:
        """Whether the object was lost, slid too far, or was never lifted."""
        lost = self.truth.touching[self.counted].sum(axis=1).min(initial=self.truth.fingers) < 2
        far = max(self.slip, self.slip_aloft) > DROPPED
        return bool(lost) or far or not self.counted.any() or self.left_behind

    @property
    def left_behind(self) -> bool:
        """Whether it still stood on the table, or lay there, when something began to pull."""
        if not self.counted.any():
            return False
        return bool(self.truth.clearance[int(self.counted.argmax())] <= NEAR)

    @property
    def higher(self) -> float:
        """How much higher than before the lift the fingers touch it in the end, mean over them [m]."""
        lifts = np.flatnonzero(self.aloft)
        at = self.truth.height + self.truth.contact[:, :, 2].mean(axis=1)
        return float(at[-1] - at[lifts[0]]) if len(lifts) else 0.0

    @cached_property
    def least(self) -> FloatArray:
        """Least grip of the true load, shape (n,) [N]; NaN where the fingers do not bear it alone."""
        truth, planned = self.truth, self.planned
        least = np.full(len(truth), np.nan)
        at = np.flatnonzero(self.carried & truth.touching.all(axis=1))
        if not len(at):
            return least
        often, seldom = at[self.counted[at]], at[~self.counted[at]]
        chosen = np.unique(np.concatenate([often[::EVERY], often[-1:], seldom[::SELDOM], at[-1:]]))
        mass, weight = planned.config.mass, np.zeros(6)
        values = []
        for i in chosen:
            contacts = [(x, y, z) for x, y, z in truth.contact[i].tolist()]
            normals = [(x, y, z) for x, y, z in truth.normal[i].tolist()]
            weight[2] = -mass * (GRAVITY + self.acceleration[i])
            a, b, c, d, e, f = (truth.pull[i] + weight).tolist()
            values.append(least_grip(planned.true, (a, b, c, d, e, f), contacts, normals))
        least[at] = np.interp(truth.time[at], truth.time[chosen], values)
        return least

    @cached_property
    def acceleration(self) -> FloatArray:
        """Of the object upwards while it is lifted and lowered, mean over `MEAN`, shape (n,) [m/s^2]; else 0."""
        truth, n = self.truth, round(MEAN / self.planned.period)
        moved = self.aloft & (truth.stage != STAGES.index(GraspStage.HOLD))
        if not moved.any() or len(truth) <= n:
            return np.zeros(len(truth))
        speed = np.gradient(truth.height, truth.time)
        mean = np.convolve(np.gradient(speed, truth.time), np.full(n, 1.0 / n), mode="same")
        return np.where(moved, mean, 0.0)

    @cached_property
    def felt(self) -> FloatArray:
        """Normal force, mean over the fingers, shape (n,) [N]: the true one, or as a real robot felt it."""
        return np.asarray(self.truth.loads[:, :, 0].mean(axis=1))

    @property
    def largest_grip(self) -> float:
        """Largest of that while it was pulled [N]; NaN if it never was held then."""
        known = self.counted & np.isfinite(self.least) if self.truth_known else self.counted
        return float(self.felt[known].max()) if known.any() else math.nan

    @property
    def growth(self) -> float:
        """Mean grip of the last half second that counts over that of the first; NaN if both are more than all."""
        felt, half = self.felt[self.counted], round(0.5 / self.planned.period)
        return float(felt[-half:].mean() / felt[:half].mean()) if len(felt) > 2 * half else math.nan

    @property
    def grip_ratio(self) -> float:
        """Mean of the true grip over the mean of the least, while it was pulled; NaN if it was never held."""
        known = self.counted & np.isfinite(self.least)
        return float(self.felt[known].sum() / self.least[known].sum()) if known.any() else math.nan

    @property
    def tightest(self) -> float:
        """Smallest of that ratio at any instant in the air; NaN if it was never lifted."""
        known = self.carried & np.isfinite(self.least) & (self.least > 0.0)
        return float((self.felt[known] / self.least[known]).min()) if known.any() else math.nan

    @cached_property
    def slipping(self) -> BoolArray:
        """Whether a contact slips, shape (n, k): beyond `SLIPPED` or `SPUN`, and going on."""
        truth = self.truth
        beyond = (truth.slip > SLIPPED) | (truth.spin > SPUN)
        moved = np.maximum(truth.slip / SLIPPED, truth.spin / SPUN)
        grown = np.zeros_like(beyond)
        # within 10 ms, a tenth of what counts
        grown[10:] = np.abs(moved[10:] - moved[:-10]) > 0.1
        return beyond & grown & self.counted[:, None]

    @cached_property
    def onsets(self) -> tuple[Onset, ...]:
        """Where and when it began to slip, at most one per finger."""
        found = []
        for k in range(self.truth.fingers):
            beyond = ((self.truth.slid[:, k] > SLIPPED) | (self.truth.turned[:, k] > SPUN)) & self.aloft
            if beyond.any():
                times = [a.time for a in self.alarms_aloft if a.finger == k]
                found.append(Onset(k, float(self.truth.time[int(beyond.argmax())]), min(times, default=math.nan)))
        return tuple(found)

    @property
    def pulled_alarms(self) -> tuple[SlipAlarm, ...]:
        """Alarms while it was pulled."""
        times = self.planned.times
        return tuple(alarm for alarm in self.alarms if times.begin <= alarm.time < times.end)

    @property
    def alarms_aloft(self) -> tuple[SlipAlarm, ...]:
        """Alarms since the lift began, while it was in the air."""
        return tuple(alarm for alarm in self.alarms if self.aloft[self._row(alarm.time)])

    def alarms_at(self) -> dict[GraspStage, int]:
        """Return how many alarms there were at each stage, where there were some, but for those while pulled."""
        stages = [STAGES[self.truth.stage[self._row(a.time)]] for a in self.alarms if a not in self.pulled_alarms]
        return {stage: stages.count(stage) for stage in STAGES if stage in stages}

    def raised_at(self) -> dict[GraspStage, int]:
        """Return how often the grip was raised at each stage, where it was."""
        raised = np.diff(self.truth.regrips, prepend=0)
        counts = {stage: int(raised[self.truth.stage == i].sum()) for i, stage in enumerate(STAGES)}
        return {stage: count for stage, count in counts.items() if count > 0}

    def _row(self, time: float) -> int:
        """The row of a time [s], or the next one."""
        return min(int(np.searchsorted(self.truth.time, time - 0.5 * self.planned.period)), len(self.truth) - 1)


def grasp_of(planned: GraspPlan, recorded: Recorded) -> GraspResult:
    """Return the result of a run, with that of its companion if there was one."""
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
        OSError: The file cannot be written.
    """
    truth = grasp.truth
    columns = {"time_s": truth.time, "wanted_grip_N": truth.target}
    if grasp.truth_known:
        slid, turned = truth.slid.max(axis=1), truth.turned.max(axis=1)
        columns |= {"true_grip_N": grasp.felt, "least_grip_N": grasp.least, "slip_m": slid, "spin_rad": turned}
    else:
        columns["felt_grip_N"] = grasp.felt
    np.savetxt(path, np.column_stack(list(columns.values())), "%.9g", ",", header=",".join(columns), comments="")
