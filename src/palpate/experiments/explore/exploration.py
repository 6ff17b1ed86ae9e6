"""What an exploration found, and how it went."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from palpate.controllers.paths import Active, Mark, StopReason
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import BrokenAssumption
from palpate.experiments.explore.assumption_check import AssumptionCheck, assumption_check
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.explored_contacts import ScanContacts, felt_in_scan
from palpate.experiments.explore.explored_map import ExploredMap, explored_map, points_per_row
from palpate.experiments.explore.map_budget import map_budget
from palpate.experiments.explore.map_growth import MapGrowth, map_growth
from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.kit.comparable import ErrorSample
from palpate.experiments.kit.experiment import ShownResult
from palpate.experiments.kit.recorded_periods import ContactTruth
from palpate.experiments.kit.recorded_run import ChangeOutcome, ProgressCallback, Recorded
from palpate.mapping import HeightMap, TouchCloud
from palpate.mapping.point_normals import point_normals
from palpate.mapping.primitives import PrimitiveKind, SphereShape, fit_primitive
from palpate.runtime import FingerDescription, Phase, Record, RunResult
from palpate.runtime.shown_plan import PlanChange
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sensing.tip_agreement import TipAgreement, tip_agreement
from palpate.sensing.tip_uncertainty import TipUncertainty
from palpate.sim import SceneObject

AROUND = 2.5e-3
"""[m] Around a contact, for the normal of the places there: a paraboloid is good over a third of a tip."""

SPACING = 2e-4
"""[m] between the places that are kept for that."""

ASKED = 600
"""Contacts that are asked, evenly over the scan."""

LEAST_FRICTION = 1e-3
"""Of the force: below, friction does not tell how the sensor is turned about the normal."""


@dataclass(frozen=True, slots=True, eq=False)
class TipCheck:
    """What contacts say of the tip, and what was said of it.

    Attributes:
        agreement: By how much the contacts say that it is other.
        tip: How well it is said to be known.
        place_sd: How far off the sensor's calibration may leave contacts, sideways [m].
    """

    agreement: TipAgreement
    tip: TipUncertainty
    place_sd: float

    def broken(self) -> Iterator[BrokenAssumption]:
        """Return what does not agree; see `TipAgreement.broken`."""
        return self.agreement.broken(self.tip, self.place_sd)


def tip_check(
    record: Record,
    finger: FingerDescription,
    kept: npt.NDArray[np.bool_],
    tip: TipUncertainty,
    place_sd: float,
) -> TipCheck | None:
    """Return what a scan says of the tip; None where it says nothing, as along a single line.

    Args:
        record: Of the run.
        finger: That felt it.
        kept: Which periods gave a point of the map, shape (n,).
        tip: How well its fingertip is said to be known.
        place_sd: How far off the sensor's calibration may leave contacts, sideways [m].
    """
    felt = np.flatnonzero(kept)
    if not len(felt):
        return None
    found = point_normals(record.centroid[felt], record.normal[felt], radius=AROUND, spacing=SPACING, count=ASKED)
    rows = felt[found.rows]
    rubbing = np.linalg.norm(record.tangential_force[rows], axis=1) > LEAST_FRICTION * record.normal_force[rows]
    rows, normal, bend = rows[rubbing], found.normal[rubbing], found.bend[rubbing]
    if not len(rows):
        return None
    contacts = contacts_from_wrenches(finger.surface, record.wrench[rows])
    base = _axes(record.normal[rows], record.tangential_force[rows])
    sensor = _axes(contacts.normal, contacts.tangential_force)
    turn = sensor @ base.transpose(0, 2, 1)
    normal = np.einsum("nij,nj->ni", turn, normal)
    agreement = tip_agreement(finger.surface, contacts, normal, turn @ bend @ turn.transpose(0, 2, 1))
    return None if agreement is None else TipCheck(agreement, tip, place_sd)


def _axes(normal: FloatArray, friction: FloatArray) -> FloatArray:
    """Axes along normal, friction, and across both, as columns, shape (n, 3, 3)."""
    along = friction / np.linalg.norm(friction, axis=1, keepdims=True)
    return np.asarray(np.stack([normal, along, np.cross(normal, along)], axis=2), dtype=float)


ERRORS = (
    "Errors of the surface",
    "Signed distances of the touched points from the true surface, positive outside, as shares of each run's "
    "points. Narrow and about zero is good; outliers are counted in the outermost bins.",
    "error of the points",
    "µm",
)
"""Title, caption, quantity and unit of their figure."""


@dataclass(frozen=True, eq=False)
class ExplorationResult(ShownResult):
    """What an exploration found, and how it went.

    What no metric of merit needs is computed when it is first asked for: a sweep never does.

    Attributes:
        plan: That was carried out.
        run: How the run ended, and its timing.
        record: Every period.
        set_force: Normal force asked for in every period, shape (n,) [N].
        truth: What really happened, every period.
        cloud: Points on the object's surface, from the scan.
        marks: Edges that were met and places that could not be felt, in order.
        map: The touched surface with its uncertainty, its mesh, and which shape it is; None if nothing was
            touched.
        point_error: Distance of each point of the cloud to the true surface, positive outside, shape (n,) [m]; NaN
            on a robot.
        assumptions: Sensor zero and contact stiffness as the run showed them.
        tip: What the contacts say of the fingertip; None where they say nothing.
        changes: Which of the requested changes of live parameters took effect, and when.
        stop_reason: Why an active exploration ended; None of others, and if it did not get so far.
        shown_plans: Where the tip was going, as that changed.
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
    tip: TipCheck | None = None
    changes: tuple[ChangeOutcome, ...] = ()
    stop_reason: StopReason | None = None
    shown_plans: Sequence[PlanChange] = ()

    @property
    def config(self) -> ExploreConfig:
        """What was asked for, completed from the robot file."""
        return self.plan.config

    @property
    def claimed_map(self) -> ExploredMap | None:
        """The map, if it claims anything."""
        return self.map if self.map is not None and self.map.claimed.any() else None

    @cached_property
    def height_map(self) -> HeightMap | None:
        """The map as heights on a grid, which can be explored again; None if nothing was touched from above."""
        try:
            return HeightMap.from_cloud(self.cloud, self.config.map_spacing)
        except InvalidValueError:  # every contact was on a wall: the other files are written all the same
            return None

    @cached_property
    def sphere(self) -> SphereShape | None:
        """The sphere nearest to points and normals; None where they do not determine one.

        See `map.shape` for whether it is a sphere at all.
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
    def growth(self) -> MapGrowth | None:
        """How the map grew; None if there is none."""
        found = self.map
        if found is None:
            return None
        worst, finest = found.worst, found.mesh.voxel
        return map_growth(self.cloud, self.record, found.surface, self.shown_plans, worst=worst, finest=finest)

    @property
    def coverage(self) -> float:
        """Share of what could be felt along its path that is observed; NaN where nobody knows the surface."""
        if not self.truth.known:
            return float("nan")
        return 0.0 if self.map is None else self.map.observed_share

    @property
    def scanning(self) -> npt.NDArray[np.bool_]:
        """Which periods belong to the scan, shape (n,)."""
        return np.asarray(self.record.phase == Phase.SCAN.value)

    @property
    def true_normal_force(self) -> FloatArray:
        """The simulation's contact force along the sensed normal, shape (n,) [N]; NaN where none was sensed."""
        return np.asarray(-np.sum(self.truth.force * self.record.normal, axis=1))

    @property
    def true_spin_torque(self) -> FloatArray:
        """The simulation's contact torque along the sensed normal, shape (n,) [N m]; NaN likewise."""
        return np.asarray(np.sum(self.truth.torque * self.record.normal, axis=1))

    @property
    def force_rms(self) -> float:
        """RMS error of the true normal force while scanning [N]."""
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
        """How far what fingers hold moved in them, at most [m]; None if they hold nothing, NaN on a robot."""
        moved = self.truth.held_position
        if not self.plan.fingers[1:]:
            return None
        return float(np.max(np.linalg.norm(moved - moved[:1], axis=1))) if len(moved) else float("nan")

    def error_samples(self) -> tuple[ErrorSample, ...]:
        """Return how far the points are off, for comparisons; none on a robot."""
        return (ErrorSample(*ERRORS, 1e6 * self.point_error),) if self.truth.known else ()


def found_by(plan: ExplorationPlan, recorded: Recorded) -> ExplorationResult:
    """Return what was found, however the run ended."""
    config, record, strategy = plan.config, recorded.record(), recorded.controller.strategy
    felt = ScanContacts.of(
        record,
        plan.fingers[0],
        half_compliance=plan.half_compliance,
        sensed_force=config.force,
        force_noise=config.noise[0],
    )
    cloud, set_force, truth = felt.cloud, _set_force(plan, recorded, record), recorded.contact_truth
    assumptions = assumption_check(record, plan.fingers[0], stiffness=config.stiffness, kept=felt_in_scan(record))
    target = plan.target if truth.known else None
    mapped = _map(plan, target, record, felt, set_force, assumptions, recorded.progress)
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
        _tip(plan, record, mapped),
        recorded.change_outcomes(plan.changes(), Phase.SCAN),
        strategy.stop_reason if isinstance(strategy, Active) else None,
        recorded.observer.changes,
    )


def _tip(plan: ExplorationPlan, record: Record, found: ExploredMap | None) -> TipCheck | None:
    if found is None:
        return None
    return tip_check(record, plan.fingers[0], felt_in_scan(record), plan.tip_uncertainty, found.budget.aside)


def _map(
    plan: ExplorationPlan,
    target: SceneObject | None,
    record: Record,
    felt: ScanContacts,
    set_force: FloatArray,
    assumptions: AssumptionCheck,
    progress: ProgressCallback,
) -> ExploredMap | None:
    if not len(felt.cloud):
        return None
    config = plan.config
    budget = map_budget(
        record,
        plan.fingers[0],
        kept=felt_in_scan(record),
        set_force=set_force,
        half_compliance=plan.half_compliance,
        force_noise=config.noise[0],
        moment_noise=config.noise[1],
        tip=plan.tip_uncertainty,
    )
    budget = replace(budget, shown=assumptions.offset)
    return explored_map(felt, target, plan.scan, config, budget, plan.tip_uncertainty.size_sd, progress)


def _set_force(plan: ExplorationPlan, recorded: Recorded, record: Record) -> FloatArray:
    """The force asked for in every period [N], live or by a profile, as it was in the run."""
    profile = plan.profile
    if profile is None:
        return np.array(recorded.live_values("force", plan.controller().live))
    swept = np.flatnonzero(record.phase == Phase.SCAN.value)  # from the first sweep on
    begin = record.time[swept[0]] if len(swept) else np.inf
    return np.array([profile.at(since)[0] for since in np.maximum(record.time - begin, 0.0).tolist()])
