"""Explore a simulated object by touch: configuration in, map, files and report out."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.controllers import ForceGain
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.explore_plan import ExplorationPlan, plan
from palpate.experiments.explored_map import ExploredMap, Tell, explored_map
from palpate.experiments.map_budget import map_budget
from palpate.experiments.truth_recorder import TruthRecord, TruthRecorder
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
from palpate.runtime import Observer, Phase, RunResult, Supervisor, Touch, run
from palpate.runtime.live import ScheduledChanges
from palpate.runtime.log import MemoryLog, Record, Recorder, Sink
from palpate.sim import SceneObject
from palpate.sim.scene_cost import SceneCost, scene_cost


@dataclass(frozen=True, slots=True, eq=False)
class Exploration:
    """What an exploration found, and how it went.

    Attributes:
        config: What was asked for.
        target: What was touched.
        gain: The force gain with its margins.
        run: How the run ended, and its timing.
        record: Every period.
        set_force: Normal force asked for in every period, shape (n,) [N].
        truth: What really happened, every period.
        cloud: Points on the object's surface, from the scan.
        map: The touched surface with its uncertainty, its mesh, and which shape it is; None if nothing was
            touched.
        height_map: The same as heights on a grid, which can be explored again; None if nothing was touched from
            above.
        sphere: The sphere through the points alone; None where they do not determine one. `map.shape` says whether
            it is a sphere at all.
        point_error: Distance of each point of the cloud to the true surface, positive outside, shape (n,) [m].
        cost: Of the simulated scene.
    """

    config: ExploreConfig
    target: SceneObject
    gain: ForceGain
    run: RunResult
    record: Record
    set_force: FloatArray
    truth: TruthRecord
    cloud: TouchCloud
    map: ExploredMap | None
    height_map: HeightMap | None
    sphere: SphereFit | None
    point_error: FloatArray
    cost: SceneCost

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
        return float(np.sqrt(np.nanmean(np.square(error)))) if error.size else float("nan")

    @property
    def point_rms(self) -> float:
        """RMS distance of the points to the true surface [m]."""
        return float(np.sqrt(np.mean(np.square(self.point_error)))) if self.point_error.size else float("nan")


def explore(config: ExploreConfig, observers: tuple[Observer, ...] = ()) -> Exploration:
    """Plan an exploration and carry it out: see `palpate.experiments.explore_plan.plan` and `carry_out`."""
    return carry_out(plan(config), observers)


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
        self._memory = MemoryLog()
        self._truth = TruthRecorder(planned.backend)

    def run(self, observers: tuple[Observer, ...] = (), sinks: tuple[Sink, ...] = ()) -> RunResult:
        """Move the robot; see `carry_out`."""
        planned = self._planned
        return run(
            planned.backend,
            Touch(planned.finger),
            self.controller,
            Supervisor(planned.limits),
            duration=3.0 * planned.expected_duration + 10.0,
            recorder=Recorder(self._memory, *sinks),
            live=ScheduledChanges(self.controller.live, planned.changes()),
            observers=(self._truth, *observers),
        )

    def found(self, result: RunResult, tell: Tell = lambda step: None) -> Exploration:
        """Return what was found in a run that went like `result`; `tell` is told what is being worked out."""
        planned, record = self._planned, self._memory.record()
        config = planned.config
        cloud = touch_cloud(record, planned.half_compliance, config.force)
        set_force = self._set_force(record)
        return Exploration(
            config,
            planned.target,
            planned.parameters.gain,
            result,
            record,
            set_force,
            self._truth.record(),
            cloud,
            self._map(record, cloud, set_force, tell),
            _height_map(cloud, config.map_spacing),
            _sphere(cloud, config),
            planned.target.signed_distance(cloud.position),
            scene_cost(planned.backend.scene.model),
        )

    def _map(self, record: Record, cloud: TouchCloud, set_force: FloatArray, tell: Tell) -> ExploredMap | None:
        if not len(cloud):
            return None
        planned, config = self._planned, self._planned.config
        kept = felt_in_scan(record)
        budget = map_budget(
            record,
            planned.finger,
            kept=kept,
            set_force=set_force,
            half_compliance=planned.half_compliance,
            force_noise=config.force_noise,
            moment_noise=config.moment_noise,
        )
        speed = np.linalg.norm(record.velocity[kept], axis=1)
        return explored_map(cloud, speed, planned.target, config, budget, tell)

    def _set_force(self, record: Record) -> FloatArray:
        """The force asked for in every period [N]: the live parameters ramp as they did in the run."""
        live = self._planned.controller().live
        asked = [replace(change, time=change.time - record.time[0]) for change in self._memory.changes]
        again = ScheduledChanges(live, asked)
        wanted = []
        for time in record.time.tolist():
            again.step(time)
            wanted.append(live.value("force"))
        return np.array(wanted)


def _height_map(cloud: TouchCloud, spacing: float) -> HeightMap | None:
    """The map, or none where every contact was on a wall: what was felt is worth its files all the same."""
    try:
        return HeightMap.from_cloud(cloud, spacing)
    except InvalidValueError:
        return None


def _sphere(cloud: TouchCloud, config: ExploreConfig) -> SphereFit | None:
    """The sphere through the points, or none where they are too few or in one plane."""
    thin = cloud.thinned(config.map_spacing)
    try:
        # the stretches of a row share one error: each row counts as one observation
        return fit_sphere(thin.position, correlation_points=max(1.0, config.width / config.map_spacing))
    except InvalidValueError:
        return None


def felt_in_scan(record: Record) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return which periods give a point of the map, shape (n,)."""
    return np.asarray((record.phase == Phase.SCAN.value) & record.touching & (record.status == 0))


def touch_cloud(record: Record, half_compliance: float, sensed_force: float) -> TouchCloud:
    """Return the points of the object that a scan touched.

    The centroid lies half-way into the overlap of the undeformed tip and object. The object's own half of the
    compression, `half_compliance` [m/N] times the normal force, is taken off along the normal; so is what the tip
    is compressed beyond what its sensed surface allows for, which is that of `sensed_force` [N].
    """
    kept = felt_in_scan(record)
    normal = -record.normal[kept]
    offset = half_compliance * (2.0 * record.normal_force[kept] - sensed_force)
    return TouchCloud(
        time=record.time[kept],
        position=record.centroid[kept] + offset[:, None] * normal,
        normal=normal,
        normal_force=record.normal_force[kept],
        tangential_force=record.tangential_force[kept],
        spin_torque=record.spin_torque[kept],
    )


def make_folder(folder: Path) -> None:
    """Make a folder before a run, so that nothing is lost after it.

    Raises:
        InvalidValueError: It cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".writable").touch()
        (folder / ".writable").unlink()
    except OSError as error:
        raise InvalidValueError(f"out = {folder}: {error.strerror}; choose another folder (--out)") from None


def write_exploration(exploration: Exploration, folder: Path) -> tuple[Path, ...]:
    """Write points, map and report into a folder, which is made if need be.

    Returns:
        The files, the report first.

    Raises:
        InvalidValueError: The folder cannot be made.
        OSError: A file cannot be written.
    """
    from palpate.experiments.explore_report import exploration_report
    from palpate.reporting import write_report

    make_folder(folder)
    report = folder / "report.html"
    files = [report, folder / "contacts.ply", folder / "contacts.csv"]
    write_report(exploration_report(exploration), report)
    write_cloud_ply(exploration.cloud, files[1])
    write_cloud_csv(exploration.cloud, files[2])
    found = exploration.map
    if found is not None and len(found.mesh.triangles):
        files += [folder / "map.ply", folder / "map.stl"]
        write_layered_mesh(found.mesh, (found.friction,), files[-2])
        write_mesh(found.mesh, files[-1])
    if exploration.height_map is not None:
        files.append(folder / "height_map.csv")
        write_height_map_csv(exploration.height_map, files[-1])
    return tuple(files)
