"""The force over time in some periods of a regulation: set, felt, true."""

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.kit.recorded_periods import ContactTruth
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.runtime import Phase, Record

SETTLED_AFTER = 0.5
"""How long after the profile's beginning its error is counted [s]: what landing has left is over then."""

BoolArray = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """The force in some periods of a run.

    Attributes:
        planned: What was to be done.
        record: These periods.
        truth: What really happened in them.
        moved: By how much the profile was moved while it ran [N], shape (n,): live parameter `force`.
        held_since: When the profile began [s]; None if it never did.
    """

    planned: RegulationPlan
    record: Record
    truth: ContactTruth
    moved: FloatArray
    held_since: float | None

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
