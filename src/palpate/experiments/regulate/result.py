"""How a force was regulated: worked out from what was recorded."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.controllers.force_program import StepForce, Tones
from palpate.controllers.guarded_approach import Loss
from palpate.errors import FloatArray
from palpate.experiments.kit.change_outcome import ChangeOutcome
from palpate.experiments.kit.contact_truth import ContactTruth
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.response import (
    FrequencyResponse,
    StepResponse,
    frequency_response,
    step_response,
)
from palpate.robots.known_truth import cost_of
from palpate.runtime import Phase, Record, RunResult
from palpate.sim.scene_cost import SceneCost

SETTLED_AFTER = 0.5
"""How long after the profile's beginning its error is counted [s]: what landing has left is over then."""

BoolArray = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Regulation:
    """How a force was regulated.

    Attributes:
        planned: What was to be done.
        run: How the run ended, and its timing.
        record: Every period.
        truth: What really happened, every period.
        moved: By how much the profile was moved while it ran [N], shape (n,): live parameter `force`.
        held_since: When the profile began [s]; None if it never did.
        loss: Whether contact was lost, and how.
        bounces: How often it was lost again before it had settled.
        guard_trips: How often gain and forward feed were halved because the loop swung.
        changes: Which of the requested changes of live parameters took effect, and when.
    """

    planned: RegulationPlan
    run: RunResult
    record: Record
    truth: ContactTruth
    moved: FloatArray
    held_since: float | None
    loss: Loss
    bounces: int
    guard_trips: int
    changes: tuple[ChangeOutcome, ...] = ()

    @property
    def holding(self) -> BoolArray:
        """Which periods hold the profile, shape (n,)."""
        return np.asarray(self.record.phase == Phase.HOLD.value)

    @property
    def counted(self) -> BoolArray:
        """Which of them count for errors, shape (n,): the first moments do not."""
        if self.held_since is None:
            return np.zeros(len(self.record), dtype=np.bool_)
        return self.holding & (self.record.time >= self.held_since + SETTLED_AFTER)

    @property
    def since(self) -> FloatArray:
        """Time since the profile began, shape (n,) [s]; NaN if it never did."""
        return self.record.time - (math.nan if self.held_since is None else self.held_since)

    @property
    def set_force(self) -> FloatArray:
        """Asked for, shape (n,) [N]; NaN where the profile is not held."""
        profile = self.planned.profile
        wanted = np.full(len(self.record), np.nan)
        since, held = self.since, np.flatnonzero(self.holding)
        wanted[held] = [profile.at(time)[0] for time in since[held].tolist()]
        return wanted + self.moved

    @property
    def sensed_force(self) -> FloatArray:
        """Along the direction in which it is regulated, shape (n,) [N]; NaN where nothing is felt."""
        record, axis = self.record, self.planned.parameters.axis
        if axis is None:
            felt = record.normal_force
        else:
            force = record.tangential_force - record.normal_force[:, None] * record.normal
            felt = -force @ np.array(axis)
        return np.where(record.touching, felt, np.nan)

    @property
    def true_force(self) -> FloatArray:
        """The simulation's own in that direction, shape (n,) [N]; 0 without contact; NaN on a robot."""
        if not self.truth.known:
            return np.full(len(self.record), np.nan)
        axis, force = self.planned.parameters.axis, self.truth.force
        normal = self.record.normal if axis is None else np.broadcast_to(np.array(axis), force.shape)
        along = -np.sum(force * normal, axis=1)
        # before a touch is noticed there is no normal: all of the force counts
        along = np.where(np.isfinite(along), along, np.linalg.norm(force, axis=1))
        return np.where(self.truth.touching, along, 0.0)

    @property
    def judged_force(self) -> FloatArray:
        """The force that is judged, shape (n,) [N]: the true one; on a robot the sensed one, 0 without contact."""
        return self.true_force if self.truth.known else np.nan_to_num(self.sensed_force, nan=0.0)

    @property
    def true_rms(self) -> float:
        """RMS error of the true force while the profile is held [N]."""
        return _rms((self.true_force - self.set_force)[self.counted])

    @property
    def sensed_rms(self) -> float:
        """Likewise of the sensed force [N]."""
        return _rms((self.sensed_force - self.set_force)[self.counted])

    @property
    def landing_peak(self) -> float:
        """Largest true force from the first touch until the profile begins [N]; NaN if nothing was touched."""
        before = self.truth.touching.copy()
        if self.held_since is not None:
            before &= self.record.time < self.held_since
        force = np.linalg.norm(self.truth.force, axis=1)[before]
        return float(force.max()) if force.size else math.nan

    @property
    def peak(self) -> float:
        """Largest true force of the whole run, tangential part included [N]; on a robot the largest sensed one."""
        if not self.truth.known:
            return float(np.nanmax(np.linalg.norm(self.record.wrench[:, :3], axis=1), initial=0.0))
        return float(np.nanmax(np.linalg.norm(self.truth.force, axis=1), initial=0.0))

    @property
    def sensor_error(self) -> float:
        """Sensed less true force, mean over the last second of holding [N]: what drift has done; NaN without."""
        error = (self.sensed_force - self.true_force)[self.counted]
        last = error[-max(1, round(1.0 / self.planned.period)) :]
        return float(np.nanmean(last)) if np.isfinite(last).any() else math.nan

    @property
    def cost(self) -> SceneCost | None:
        """Of the simulated scene; None on a robot."""
        return cost_of(self.planned.ready.backend)

    @property
    def judged_steps(self) -> StepResponse | None:
        """Response of the judged force to the profile's steps; None if it has none."""
        return self.steps(self.judged_force)

    @property
    def judged_tones(self) -> FrequencyResponse | None:
        """Likewise to the profile's sines."""
        return self.tones(self.judged_force)

    @property
    def felt_steps(self) -> StepResponse | None:
        """Likewise of the sensed force, 0 where nothing is felt, to steps."""
        return self.steps(np.nan_to_num(self.sensed_force, nan=0.0))

    @property
    def felt_tones(self) -> FrequencyResponse | None:
        """Likewise to sines."""
        return self.tones(np.nan_to_num(self.sensed_force, nan=0.0))

    def steps(self, force: FloatArray) -> StepResponse | None:
        """Return the response of a force, shape (n,) [N], to the profile's steps; None if it has none."""
        profile, held = self.planned.profile, self.holding
        if not isinstance(profile, StepForce):
            return None
        times = profile.steps(self.planned.parameters.duration)
        half = 0.5 * profile.hold
        steps = [(time, profile.at(time - half)[0], profile.at(time + half)[0]) for time in times]
        # a period less: by rounding, the next step may be taken a period early
        return step_response(self.since[held], force[held], steps, profile.hold - 2.0 * self.planned.period)

    def tones(self, force: FloatArray) -> FrequencyResponse | None:
        """Return the response of a force, shape (n,) [N], to the profile's sines; None if it has none."""
        profile, held = self.planned.profile, self.holding
        if not isinstance(profile, Tones):
            return None
        return frequency_response(
            self.since[held], self.set_force[held], force[held], profile.begins, profile.frequencies
        )


def regulation_in(planned: RegulationPlan, recorded: Recorded) -> Regulation:
    """Return the result of a run, however it ended."""
    force = recorded.live_values("force", planned.controller().live)
    controller = recorded.controller
    return Regulation(
        planned,
        recorded.run,
        recorded.record(),
        recorded.contact_truth,
        np.array(force) - planned.parameters.force,
        controller.held_since,
        controller.contact.loss,
        controller.contact.bounces,
        controller.guard.trips,
        recorded.change_outcomes(planned.changes(), Phase.HOLD),
    )


def write_forces(regulation: Regulation, path: Path) -> None:
    """Write the forces over time as CSV.

    Raises:
        OSError: It cannot be written.
    """
    columns = (regulation.record.time, regulation.set_force, regulation.sensed_force, regulation.true_force)
    heading = "time_s,set_force_N,sensed_force_N,true_force_N"
    np.savetxt(path, np.column_stack(columns), fmt="%.9g", delimiter=",", header=heading, comments="")


def _rms(error: FloatArray) -> float:
    error = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(np.square(error)))) if error.size else math.nan
