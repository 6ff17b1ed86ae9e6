"""Explore a simulated object by touch: configuration in, map, files and report out."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.commands.output_folder import make_folder
from palpate.controllers import ForceGain
from palpate.controllers.paths import Active, Enough, Mark
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.explored_contacts import ScanContacts, felt_in_scan
from palpate.experiments.explore.explored_map import GROWTH_STEP, ExploredMap, Tell, explored_map, points_per_row
from palpate.experiments.explore.explored_marks import write_marks_csv
from palpate.experiments.explore.growth_data import GrowthReport
from palpate.experiments.explore.identified import IdentifiedForce
from palpate.experiments.explore.map_budget import map_budget
from palpate.experiments.explore.map_growth import map_growth
from palpate.experiments.explore.plan import ExplorationPlan, plan
from palpate.experiments.explore.plan_watch import PlanDiary
from palpate.experiments.explore.pressing import prepared
from palpate.experiments.explore.run_account import RunAccount, run_account
from palpate.experiments.explore.scans import Scan
from palpate.experiments.explore.wall_bound import WallBound
from palpate.experiments.kit.change_account import ChangeAccount
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.truth_recorder import TruthRecord
from palpate.mapping import (
    HeightMap,
    SphereFit,
    TouchCloud,
    fit_sphere,
    write_cloud_csv,
    write_cloud_ply,
    write_height_map_csv,
    write_mesh,
)
from palpate.mapping.layers import write_layered_mesh
from palpate.robots.known_truth import cost_of
from palpate.runtime import Observer, Phase, Record, RunResult
from palpate.runtime.live import Change
from palpate.runtime.log import Sink
from palpate.sim import SceneObject
from palpate.sim.scene_cost import SceneCost


@dataclass(frozen=True, slots=True, eq=False)
class Exploration:
    """What an exploration found, and how it went.

    Attributes:
        asked: What was asked for.
        config: The same, with what the robot file says where it left something out.
        target: What was touched.
        scan: Where it went.
        gain: The force gain with its margins.
        identified: What pressing has found before, if it was asked for.
        run: How the run ended, and its timing.
        record: Every period.
        set_force: Normal force asked for in every period, shape (n,) [N].
        truth: What really happened, every period.
        cloud: Points on the object's surface, from the scan.
        marks: What there is to say besides: edges that were met, places that could not be felt, in order.
        map: The touched surface with its uncertainty, its mesh, and which shape it is; None if nothing was
            touched.
        height_map: The same as heights on a grid, which can be explored again; None if nothing was touched from
            above.
        sphere: The sphere through the points alone; None where they do not determine one. `map.shape` says whether
            it is a sphere at all.
        point_error: Distance of each point of the cloud to the true surface, positive outside, shape (n,) [m]; NaN
            on a robot.
        cost: Of the simulated scene; None on a robot.
        account: What the run showed of its own assumptions.
        wall: What a wall in the way of the sweep would have done.
        growth: How the map grew; None if there is none.
        changes: What became of the changes of live parameters that were asked for beforehand.
        enough: Why an active exploration ended; None of others, and if it did not get so far.
    """

    asked: ExploreConfig
    config: ExploreConfig
    target: SceneObject
    scan: Scan
    gain: ForceGain
    identified: IdentifiedForce | None
    run: RunResult
    record: Record
    set_force: FloatArray
    truth: TruthRecord
    cloud: TouchCloud
    marks: tuple[Mark, ...]
    map: ExploredMap | None
    height_map: HeightMap | None
    sphere: SphereFit | None
    point_error: FloatArray
    cost: SceneCost | None
    account: RunAccount
    wall: WallBound
    growth: GrowthReport | None = None
    changes: tuple[ChangeAccount, ...] = ()
    enough: Enough | None = None

    @property
    def scanning(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
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

    def _repr_html_(self) -> str:
        """What a notebook shows: how it went, the key figures, and what was felt."""
        from palpate.experiments.explore.notebook import exploration_html
        from palpate.experiments.explore.report import exploration_report

        return exploration_html(exploration_report(self))


def explore(config: ExploreConfig, observers: tuple[Observer, ...] = ()) -> Exploration:
    """Plan an exploration, press first if that is asked for, and carry it out.

    See `palpate.experiments.explore.plan.plan`, `palpate.experiments.explore.pressing.prepared` and `carry_out`.
    """
    return carry_out(prepared(plan(config)), observers)


def carry_out(
    planned: ExplorationPlan, observers: tuple[Observer, ...] = (), sinks: tuple[Sink, ...] = ()
) -> Exploration:
    """Run an exploration.

    Args:
        planned: What to do.
        observers: Called every period, for example to show progress.
        sinks: Where to record it, beside memory.

    Raises:
        KeyboardInterrupt: The robot was stopped. An `Attempt` still knows what was found until then.
    """
    attempt = Attempt(planned)
    return attempt.found(attempt.run(observers, sinks))


class Attempt:
    """One try at an exploration: it is run once, and what was found is made of it, however the run ended.

    Attributes:
        controller: What moves the robot; its `live` takes requests while it runs.
    """

    def __init__(self, planned: ExplorationPlan) -> None:
        """Take what to do."""
        self._planned = planned
        self.controller = planned.controller()
        self._recorded = RecordedRun(planned, self.controller)
        self._plans = PlanDiary(self.controller)

    def run(self, observers: tuple[Observer, ...] = (), sinks: tuple[Sink, ...] = ()) -> RunResult:
        """Move the robot; see `carry_out`."""
        return self._recorded.run(self._planned.longest_duration, (self._plans.observe, *observers), sinks)

    @property
    def changes(self) -> tuple[Change, ...]:
        """Live parameters that were changed, as they took effect."""
        return self._recorded.changes

    def found(self, result: RunResult, tell: Tell = lambda step: None) -> Exploration:
        """Return what was found in a run that went like `result`; `tell` is told what is being worked out."""
        planned, record, strategy = self._planned, self._recorded.record(), self.controller.strategy
        config = planned.config
        felt = ScanContacts.of(
            record,
            planned.finger,
            half_compliance=planned.half_compliance,
            sensed_force=config.force,
            force_noise=config.noise[0],
        )
        cloud = felt.cloud
        set_force = self._set_force(record)
        account = run_account(record, planned.finger, stiffness=config.stiffness, kept=felt_in_scan(record))
        mapped = self._map(record, felt, set_force, account, tell)
        return Exploration(
            planned.asked,
            config,
            planned.target,
            planned.scan,
            planned.parameters.gain,
            planned.identified,
            result,
            record,
            set_force,
            self._recorded.truth(),
            cloud,
            strategy.marks,
            mapped,
            _height_map(cloud, config.map_spacing),
            _sphere(cloud, planned.scan, config.map_spacing),
            planned.target.signed_distance(cloud.position) if planned.truth_known else np.full(len(cloud), np.nan),
            cost_of(planned.backend),
            account,
            planned.wall,
            self._growth(record, cloud, mapped, tell),
            self._recorded.account_of_changes(Phase.SCAN),
            strategy.enough if isinstance(strategy, Active) else None,
        )

    def _growth(
        self, record: Record, cloud: TouchCloud, found: ExploredMap | None, tell: Tell
    ) -> GrowthReport | None:
        if found is None:
            return None
        tell(GROWTH_STEP)
        plans, finest = self._plans.changes, found.mesh.voxel
        return map_growth(cloud, record, found.surface, plans, worst=found.worst, finest=finest)

    def _map(
        self, record: Record, felt: ScanContacts, set_force: FloatArray, account: RunAccount, tell: Tell
    ) -> ExploredMap | None:
        if not len(felt.cloud):
            return None
        planned, config = self._planned, self._planned.config
        budget = map_budget(
            record,
            planned.finger,
            kept=felt_in_scan(record),
            set_force=set_force,
            half_compliance=planned.half_compliance,
            force_noise=config.noise[0],
            moment_noise=config.noise[1],
        )
        budget = replace(budget, shown=account.offset)
        target = planned.target if planned.truth_known else None
        return explored_map(felt, target, planned.scan, config, budget, tell)

    def _set_force(self, record: Record) -> FloatArray:
        """The force asked for in every period [N], live or by a profile, as it was in the run."""
        planned, profile = self._planned, self._planned.profile
        if profile is None:
            return np.array(self._recorded.live_values("force", planned.controller().live))
        swept = np.flatnonzero(record.phase == Phase.SCAN.value)  # from the first sweep on
        begin = record.time[swept[0]] if len(swept) else np.inf
        return np.array([profile.at(since)[0] for since in np.maximum(record.time - begin, 0.0).tolist()])


def _height_map(cloud: TouchCloud, spacing: float) -> HeightMap | None:
    """The map, or none where every contact was on a wall: what was felt is worth its files all the same."""
    try:
        return HeightMap.from_cloud(cloud, spacing)
    except InvalidValueError:
        return None


def _sphere(cloud: TouchCloud, scan: Scan, spacing: float) -> SphereFit | None:
    """The sphere through the points, or none where they are too few or in one plane."""
    thin = cloud.thinned(spacing)
    try:
        # the stretches of a row share one error: each row counts as one observation
        return fit_sphere(thin.position, correlation_points=points_per_row(thin, scan.row, spacing))
    except InvalidValueError:
        return None


def write_exploration(exploration: Exploration, folder: str | Path) -> tuple[Path, ...]:
    """Write points, map and report into a folder, which is made if need be.

    Returns:
        The files, the report first.

    Raises:
        InvalidValueError: The folder cannot be made.
        OSError: A file cannot be written.
    """
    from palpate.experiments.explore.report import exploration_report
    from palpate.experiments.explore.report_page import write_report

    folder = Path(folder)
    make_folder(folder)
    report = folder / "report.html"
    files = [report, folder / "contacts.ply", folder / "contacts.csv"]
    write_report(exploration_report(exploration), report)
    write_cloud_ply(exploration.cloud, files[1])
    write_cloud_csv(exploration.cloud, files[2])
    files.append(folder / "marks.csv")
    write_marks_csv(exploration.marks, files[-1])
    found = exploration.map
    if found is not None and len(found.mesh.triangles):
        files += [folder / "map.ply", folder / "map.stl"]
        write_layered_mesh(found.mesh, found.layers, files[-2])
        write_mesh(found.mesh, files[-1])
    if exploration.height_map is not None:
        files.append(folder / "height_map.csv")
        write_height_map_csv(exploration.height_map, files[-1])
    return tuple(files)
