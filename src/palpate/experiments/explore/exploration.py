"""The result of an exploration, evaluated from its record."""

import csv
import io
import math
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from palpate.atomic_file import replacing
from palpate.controllers.paths import Active, Mark, PathEvent, StopReason
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import BrokenAssumption
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.error_budget import (
    AssumptionCheck,
    assumption_check,
    map_budget,
    tip_findings,
)
from palpate.experiments.explore.explored_map import (
    ExploredMap,
    explored_map,
    felt_in_scan,
    points_per_row,
    touch_cloud,
)
from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.kit.comparable import ErrorSample
from palpate.experiments.kit.recorded_periods import ContactTruth
from palpate.experiments.kit.recorded_run import ChangeOutcome, Recorded
from palpate.experiments.kit.registry import ShownResult
from palpate.mapping import HeightMap, TouchCloud
from palpate.mapping.primitives import PrimitiveKind, SphereShape, fit_primitive
from palpate.runtime import Phase, Record, RunResult
from palpate.runtime.shown_plan import PlanChange

if TYPE_CHECKING:  # draws
    from palpate.experiments.explore.map_growth import MapGrowth

_MISSED_EVENTS = frozenset(
    {PathEvent.STEEP, PathEvent.LOST, PathEvent.UNREACHABLE, PathEvent.BLOCKED, PathEvent.OPEN}
)
"""Events of places that were planned and not felt; the other events belong to places that were felt."""


def marks_text(marks: Sequence[Mark]) -> str:
    """Return the number of marks of each event, for example "2 steep, 1 lost"; "none" without marks."""
    counted = Counter(mark.event for mark in marks)
    return ", ".join(f"{count} {event.value}" for event, count in counted.items()) or "none"


def missed_marks(marks: Sequence[Mark]) -> tuple[Mark, ...]:
    """Return the marks of places that were planned and not felt."""
    return tuple(mark for mark in marks if mark.event in _MISSED_EVENTS)


def write_marks_csv(marks: Sequence[Mark], path: str | os.PathLike[str]) -> None:
    """Write marks as CSV, in order: x_m, y_m, z_m in the base frame, event, radius_m, reason.

    The radius is that of the surface, positive where it is convex; empty where none was felt.

    Raises:
        OSError: If the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("x_m", "y_m", "z_m", "event", "radius_m", "reason"))
    for mark in marks:
        radius = f"{mark.radius:z.6f}" if math.isfinite(mark.radius) else ""
        writer.writerow((*(f"{value:.6f}" for value in mark.position), mark.event.value, radius, mark.reason))
    with replacing(path) as file:
        file.write(text.getvalue().encode())


@dataclass(frozen=True, eq=False)
class ExplorationResult(ShownResult):
    """Result of an exploration.

    Properties that no metric needs are computed at their first use: a sweep never computes them.

    Attributes:
        plan: Plan of the run.
        run: Ending and timing of the run.
        record: Every period.
        set_force: Target of the normal force in every period, shape (n,) [N].
        truth: True contact in every period.
        cloud: Points on the object's surface, from the scan.
        marks: Edges, and places that could not be felt, in order.
        map: Touched surface with its uncertainty, mesh and shape; None without contacts.
        point_error: Distance of each point of the cloud to the true surface, positive outside, shape (n,) [m]; NaN
            on a robot.
        assumptions: Sensor zero and contact stiffness as the run showed them.
        tip: Assumptions about the fingertip that the contacts contradict; None if they cannot judge.
        changes: Requested changes of live parameters, with the times at which they took effect.
        stop_reason: Reason for the end of an active exploration; None of others, or before it ended.
        shown_plans: Plans of the tip's path, each from its time on.
    """

    experiment = "explore"

    plan: ExplorationPlan
    run: RunResult
    record: Record
    set_force: FloatArray
    truth: ContactTruth
    cloud: TouchCloud
    marks: tuple[Mark, ...]
    map: ExploredMap | None
    point_error: FloatArray
    assumptions: AssumptionCheck
    tip: tuple[BrokenAssumption, ...] | None = None
    changes: tuple[ChangeOutcome, ...] = ()
    stop_reason: StopReason | None = None
    shown_plans: Sequence[PlanChange] = ()

    @property
    def config(self) -> ExploreConfig:
        """Request, completed from the robot file."""
        return self.plan.config

    @property
    def claimed_map(self) -> ExploredMap | None:
        """The map; None if it claims no surface."""
        return self.map if self.map is not None and self.map.claimed.any() else None

    @cached_property
    def height_map(self) -> HeightMap | None:
        """The map as heights on a grid, which can be explored again; None if no contact was from above."""
        try:
            return HeightMap.from_cloud(self.cloud, self.config.map_spacing)
        except InvalidValueError:  # every contact was on a wall: the other files are written all the same
            return None

    @cached_property
    def sphere(self) -> SphereShape | None:
        """The sphere nearest to points and normals; None where they do not determine one.

        `map.shape` says whether the object is a sphere at all.
        """
        spacing = self.config.map_spacing
        thin = self.cloud.thinned(spacing)
        try:
            # the stretches of a row share one error: each row counts as one observation
            correlated = points_per_row(thin, self.plan.scan.row, spacing)
            found = fit_primitive(thin, PrimitiveKind.SPHERE, correlation_points=correlated)
        except InvalidValueError:  # too few, or in one place
            return None
        return found.shape if found.exists else None

    @cached_property
    def growth(self) -> "MapGrowth | None":
        """Growth of the map; None without a map."""
        from palpate.experiments.explore.map_growth import map_growth

        found = self.map
        if found is None:
            return None
        finest = found.mesh.voxel
        return map_growth(
            self.cloud, self.record, found.surface, self.shown_plans, line=found.is_line, finest=finest
        )

    @property
    def coverage(self) -> float:
        """Observed share of the surface that could be felt along the path; NaN if the true surface is unknown."""
        if not self.truth.known:
            return float("nan")
        return 0.0 if self.map is None else self.map.observed_share

    @property
    def scanning(self) -> npt.NDArray[np.bool_]:
        """Mask of the periods of the scan, shape (n,)."""
        return np.asarray(self.record.phase == Phase.SCAN.value)

    @property
    def true_normal_force(self) -> FloatArray:
        """True contact force along the sensed normal, shape (n,) [N]; NaN without a sensed contact."""
        return np.asarray(-np.sum(self.truth.force * self.record.normal, axis=1))

    @property
    def true_spin_torque(self) -> FloatArray:
        """True contact torque along the sensed normal, shape (n,) [N m]; NaN without a sensed contact."""
        return np.asarray(np.sum(self.truth.torque * self.record.normal, axis=1))

    @property
    def force_rms(self) -> float:
        """RMS error of the true normal force while scanning [N]; NaN if unknown."""
        error = (self.true_normal_force - self.set_force)[self.scanning]
        return float(np.sqrt(np.nanmean(np.square(error)))) if error.size and self.truth.known else float("nan")

    @property
    def point_rms(self) -> float:
        """RMS distance of the points to the true surface [m]."""
        return float(np.sqrt(np.mean(np.square(self.point_error)))) if self.point_error.size else float("nan")

    @property
    def point_p99(self) -> float:
        """Distance to the true surface that 99 % of the points stay below [m]."""
        return float(np.percentile(np.abs(self.point_error), 99)) if self.point_error.size else float("nan")

    @property
    def held_motion(self) -> float | None:
        """Largest motion of a held object or tool in the fingers [m]; None if nothing is held, NaN on a robot."""
        moved = self.truth.held_position
        if not self.plan.fingers[1:]:
            return None
        return float(np.max(np.linalg.norm(moved - moved[:1], axis=1))) if len(moved) else float("nan")

    def error_samples(self) -> tuple[ErrorSample, ...]:
        """Return the errors of the points, for comparisons; none on a robot."""
        if not self.truth.known:
            return ()
        caption = (
            "Signed distances of the touched points from the true surface, positive outside, as shares of each "
            "run's points. Narrow and about zero is good; outliers are counted in the outermost bins."
        )
        return (
            ErrorSample("Errors of the surface", caption, "error of the points", "µm", 1e6 * self.point_error),
        )


def evaluate(plan: ExplorationPlan, recorded: Recorded) -> ExplorationResult:
    """Return the result of a run, however it ended."""
    config, record, strategy = plan.config, recorded.record(), recorded.controller.strategy
    kept, set_force, truth = felt_in_scan(record), _set_force(plan, recorded, record), recorded.contact_truth
    force_noise, moment_noise = config.noise
    cloud, target = touch_cloud(plan, record), plan.target if truth.known else None
    assumptions = assumption_check(record, plan.fingers[0], stiffness=config.stiffness, kept=kept)
    mapped = tip = None
    if len(cloud):
        budget = map_budget(
            record,
            plan.fingers[0],
            kept=kept,
            set_force=set_force,
            half_compliance=plan.half_compliance,
            force_noise=force_noise,
            moment_noise=moment_noise,
            tip=plan.tip_uncertainty,
            shown=assumptions.offset,
        )
        mapped = explored_map(plan, record, cloud, target, budget, recorded.progress)
        tip = tip_findings(record, plan.fingers[0], kept=kept, tip=plan.tip_uncertainty, place_sd=budget.aside)
    return ExplorationResult(
        plan,
        recorded.run,
        record,
        set_force,
        truth,
        cloud,
        strategy.marks,
        mapped,
        np.full(len(cloud), np.nan) if target is None else target.signed_distance(cloud.position),
        assumptions,
        tip,
        recorded.change_outcomes(plan.changes(), Phase.SCAN),
        strategy.stop_reason if isinstance(strategy, Active) else None,
        recorded.observer.changes,
    )


def _set_force(plan: ExplorationPlan, recorded: Recorded, record: Record) -> FloatArray:
    """Return the target of the force in every period [N], live or by a profile, as it was in the run."""
    profile = plan.profile
    if profile is None:
        return np.array(recorded.live_values("force", plan.controller().live))
    swept = np.flatnonzero(record.phase == Phase.SCAN.value)  # from the first sweep on
    begin = record.time[swept[0]] if len(swept) else np.inf
    return np.array([profile.at(since)[0] for since in np.maximum(record.time - begin, 0.0).tolist()])
