"""Explore a simulated object by touch: configuration in, map, files and report out."""

import errno
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    ForceGain,
    Raster,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.errors import FloatArray, InvalidValueError, PalpateError
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.truth_recorder import TruthRecord, TruthRecorder
from palpate.mapping import (
    HeightMap,
    SphereFit,
    TouchCloud,
    fit_sphere,
    write_cloud_csv,
    write_cloud_ply,
    write_height_map_csv,
    write_height_map_ply,
)
from palpate.runtime import Finger, Observer, Phase, Record, Recorder, RunResult, Supervisor, Touch, run
from palpate.sensing.compensation import Payload
from palpate.sim import (
    Box,
    ContactLaw,
    CylinderObject,
    EllipsoidObject,
    MujocoBackend,
    SceneObject,
    SphereObject,
    Stage,
    Tip,
    WrenchNoise,
    build_stage_scene,
)
from palpate.surfaces import Ellipsoid, Sphere

CLEARANCE = 0.003
"""How far above the object's top the tip starts [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Exploration:
    """What an exploration found, and how it went.

    Attributes:
        config: What was asked for.
        target: What was touched.
        gain: The force gain with its margins.
        run: How the run ended, and its timing.
        record: Every period.
        truth: What really happened, every period.
        cloud: Points on the object's surface, from the scan.
        height_map: The touched surface; None if nothing was touched.
        sphere: The sphere through the points; None where they do not determine one.
        point_error: Distance of each point of the cloud to the true surface, positive outside, shape (n,) [m].
    """

    config: ExploreConfig
    target: SceneObject
    gain: ForceGain
    run: RunResult
    record: Record
    truth: TruthRecord
    cloud: TouchCloud
    height_map: HeightMap | None
    sphere: SphereFit | None
    point_error: FloatArray

    @property
    def scanning(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Which periods belong to the scan, shape (n,)."""
        return np.asarray(self.record.phase == Phase.SCAN.value)

    @property
    def true_normal_force(self) -> FloatArray:
        """The simulation's contact force along the sensed normal, shape (n,) [N]; NaN without contact."""
        return np.asarray(-np.sum(self.truth.force * self.record.normal, axis=1))

    @property
    def true_spin_torque(self) -> FloatArray:
        """The simulation's contact torque along the sensed normal, shape (n,) [N m]; NaN without contact."""
        return np.asarray(np.sum(self.truth.torque * self.record.normal, axis=1))

    @property
    def force_rms(self) -> float:
        """RMS error of the true normal force while scanning [N]."""
        error = self.true_normal_force[self.scanning] - self.config.force
        return float(np.sqrt(np.nanmean(np.square(error)))) if error.size else float("nan")

    @property
    def point_rms(self) -> float:
        """RMS distance of the points to the true surface [m]."""
        return float(np.sqrt(np.mean(np.square(self.point_error)))) if self.point_error.size else float("nan")


def scene_object(config: ExploreConfig) -> SceneObject:
    """Return the object that a configuration asks for."""
    size = config.size
    if config.object == "sphere":
        return SphereObject(size[0])
    if config.object == "ellipsoid":
        return EllipsoidObject((size[0], size[1], size[2]))
    if config.object == "box":
        return Box((size[0], size[1], size[2]))
    return CylinderObject(size[0], size[1])


def tip_surface(config: ExploreConfig, shrunk: float = 0.0) -> Sphere | Ellipsoid:
    """Return the fingertip's surface, moved inwards by `shrunk` [m]."""
    lengths = [length - shrunk for length in config.tip]
    if min(lengths) <= 0.0:
        raise InvalidValueError(
            f"tip = {min(config.tip):g} m: must be larger than its compression at {config.force:g} N and "
            f"{config.stiffness:g} N/m, {shrunk:.2g} m"
        )
    return Sphere(lengths[0]) if len(lengths) == 1 else Ellipsoid((lengths[0], lengths[1], lengths[2]))


def raster_over(target: SceneObject, config: ExploreConfig) -> Raster:
    """Return the raster over an object.

    Raises:
        InvalidValueError: It leaves the part of the object that can be touched from above.
    """
    raster = Raster(config.width, config.depth, config.spacing)

    def fits(factor: float) -> bool:
        return all(target.reachable(factor * x, factor * y, min(config.tip)) for x, y in raster.corners())

    if not fits(1.0):
        best = max((factor for factor in np.linspace(0.01, 0.99, 99).tolist() if fits(factor)), default=0.0)
        raise InvalidValueError(
            f"a raster of {config.width:g} x {config.depth:g} m leaves the part of the {config.object} that can "
            f"be touched from above; at most {best * config.width:.3g} x {best * config.depth:.3g} m in these "
            "proportions (--width, --depth), or take a larger object (--size)"
        )
    return raster


def expected_duration(config: ExploreConfig, raster: Raster, descent: float) -> float:
    """Return about how long an exploration takes [s], for progress bars and time limits."""
    stops = len(raster.corners()) * (config.speed / 0.5 + 0.05)
    return 1.25 * raster.length / config.speed + stops + descent / 0.005 + 1.0


def explore(config: ExploreConfig, observers: tuple[Observer, ...] = ()) -> Exploration:
    """Run an exploration.

    Args:
        config: What to do.
        observers: Called every period, for example to show progress.

    Raises:
        InvalidValueError: The configuration cannot be realised; the message says what to change.
    """
    target = scene_object(config)
    raster = raster_over(target, config)
    first_x, first_y = raster.corners()[0]
    half_compression = config.force / (2.0 * config.stiffness)
    shape, sensed = tip_surface(config), tip_surface(config, half_compression)

    tip, stage = Tip(shape), Stage()
    law = ContactLaw(stiffness=config.stiffness, friction=config.friction, spin_length=config.spin_length)
    top = target.top + max(config.tip) + CLEARANCE
    scene = build_stage_scene(tip, target, law, (first_x, first_y, top), stage)
    noise = WrenchNoise(config.force_noise, config.moment_noise, config.seed)
    backend = MujocoBackend(scene, config.period, noise)

    delay = tracking_delay(config.period, stage.lag)
    gain = force_gain(series_stiffness(config.stiffness, stage.stiffness(tip.mass)), delay)
    descent = 2.0 * target.top + max(config.tip) + CLEARANCE
    parameters = ExploreParameters(
        force=config.force, speed=config.speed, gain=gain, lead=delay, approach_distance=descent
    )
    payload = Payload(tip.mass, tip.center_of_mass)
    finger = Finger(sensed, payload, config.touch_force, config.touch_force / 2.0)
    recorder, truth_recorder = Recorder(), TruthRecorder(backend)
    result = run(
        backend,
        Touch(finger),
        ExploreController(parameters, raster, config.period),
        Supervisor(),
        duration=3.0 * expected_duration(config, raster, descent),
        observers=(recorder, truth_recorder, *observers),
    )
    record = recorder.record()
    cloud = touch_cloud(record, half_compression / config.force)
    height_map, sphere = None, None
    if len(cloud):
        height_map = HeightMap.from_cloud(cloud, config.spacing / 4.0)
        try:
            sphere = fit_sphere(cloud.thinned(config.spacing / 4.0).position)
        except PalpateError:
            sphere = None  # too few points, or all in one plane
    return Exploration(
        config,
        target,
        gain,
        result,
        record,
        truth_recorder.record(),
        cloud,
        height_map,
        sphere,
        target.signed_distance(cloud.position),
    )


def touch_cloud(record: Record, half_compliance: float) -> TouchCloud:
    """Return the points of the object that a scan touched.

    The centroid lies half-way into the overlap of the undeformed tip and object. The object's own half of the
    compression, `half_compliance` [m/N] times the normal force, is taken off along the normal.
    """
    kept = (record.phase == Phase.SCAN.value) & record.touching & (record.status == 0)
    normal = -record.normal[kept]
    offset = half_compliance * record.normal_force[kept]
    return TouchCloud(
        time=record.time[kept],
        position=record.centroid[kept] + offset[:, None] * normal,
        normal=normal,
        normal_force=record.normal_force[kept],
        tangential_force=record.tangential_force[kept],
        spin_torque=record.spin_torque[kept],
    )


def refuse_unwritable(folder: Path) -> None:
    """Find out before a run, not after it, whether its folder can be made and written; makes nothing.

    Raises:
        NotADirectoryError: A file is in the way.
        PermissionError: The folder may not be written.
    """
    existing = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    if not existing.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, "a file is in the way; choose another --out", str(existing))
    if not os.access(existing, os.W_OK):
        raise PermissionError(errno.EACCES, "no permission to write here; choose another --out", str(existing))


def write_exploration(exploration: Exploration, folder: Path) -> tuple[Path, ...]:
    """Write points, map and report into a folder, which is made if need be.

    Returns:
        The files, the report first.

    Raises:
        OSError: A file cannot be written.
    """
    from palpate.experiments.explore_report import exploration_report
    from palpate.reporting import write_report

    folder.mkdir(parents=True, exist_ok=True)
    report = folder / "report.html"
    files = [report, folder / "contacts.ply", folder / "contacts.csv"]
    write_report(exploration_report(exploration), report)
    write_cloud_ply(exploration.cloud, files[1])
    write_cloud_csv(exploration.cloud, files[2])
    if exploration.height_map is not None:
        files += [folder / "height_map.ply", folder / "height_map.csv"]
        write_height_map_ply(exploration.height_map, files[3])
        write_height_map_csv(exploration.height_map, files[4])
    return tuple(files)
