"""Scene, object pose and planned path of a run for a view; and images of them with the contact forces."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.options import lasting
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.kinematics.posture import Posture
from palpate.robots.known_truth import scene_of
from palpate.runtime import Backend
from palpate.runtime.live import live_parameters_of
from palpate.runtime.log import Log
from palpate.runtime.replay import RecordedChanges
from palpate.runtime.shown_plan import PlanChange, PlanDiary
from palpate.runtime.truth import truth_source
from palpate.sim import Mount, contact_truth
from palpate.sim.hand.truth_numbers import OBJECT_POSITION, OBJECT_QUATERNION
from palpate.sim.render.files import write_gif, write_png
from palpate.sim.render.held import HeldPlacement
from palpate.sim.render.place import ScenePlacement
from palpate.sim.render.renderer import ContactForce, Figure, SceneRenderer, camera_on
from palpate.sim.render.tool import ToolPlacement
from palpate.spatial import add, as_vector, rotate
from palpate.viewing import Frames, FreePoses, ViewScene

_IMAGE_INTERVAL = 0.05
"""Time between two images of a video [s]: smooth enough, and half the bytes of 40 a second."""

_POSTURES_IN_VIEW = 25
"""Number of postures of the run that a video's camera has in view."""

_MAX_IMAGES = 3000
"""Largest number of images of one video: two and a half minutes; larger GIFs choke browsers."""

_QUATERNION_COLUMNS = (*OBJECT_POSITION, *OBJECT_QUATERNION)
"""Position [m] and quaternion (w, x, y, z) of the object, base frame, as views take them."""

_MATRIX_COLUMNS = (*contact_truth.OBJECT_POSITION, *contact_truth.OBJECT_ROTATION)
"""Position [m] and rotation, row by row, as a single fingertip's back end records them."""

_YIELDING_MOUNTS = (Mount.SPRUNG, Mount.JOINTED)
"""Mounts of objects that a single fingertip moves."""


def shown_scene(experiment: Experiment, plan: Plan) -> ViewScene:
    """Return the scene of a run; for a robot that cannot be shown, the scene of its stand-in.

    The object is the object of the run's configuration: the true object of a real robot is unknown.

    Raises:
        InvalidValueError: If the scene cannot be simulated.
    """
    robot = plan.robot
    shown = None if robot is None else robot.file.backend.shown(robot)
    if shown is robot:
        return plan.view()
    return experiment.plan(lasting(plan.config), shown, plan.attachments()).view()


def plans_of_log(logged: LoggedRun) -> tuple[PlanChange, ...]:
    """Return each plan of a recorded run, with the time from which it was followed.

    Raises:
        InvalidValueError: If the log cannot be replayed.
    """
    plan = logged.plan()
    run = RecordedRun(plan, logged.backend())
    source = plan.shown_plan(run.controller)
    if source is None:
        return ()
    diary = PlanDiary(source)
    run.run((diary,), live=RecordedChanges(live_parameters_of(run.controller), logged.log.changes))
    return diary.changes


# --- the pose of an object that moves freely or yields ---


def free_poses_of(backend: Backend) -> FreePoses | None:
    """Return a function that reads an object's pose from a simulation; None if it stands or is unknown."""
    source = truth_source(backend)
    if source is None:
        return None
    columns = source.truth_columns
    names: tuple[str, ...] = _QUATERNION_COLUMNS
    if set(_MATRIX_COLUMNS) <= set(columns):
        scene = scene_of(backend)
        if scene is not None and scene.target.mount in _YIELDING_MOUNTS:
            names = _MATRIX_COLUMNS
    if not set(names) <= set(columns):
        return None
    places = [columns.index(name) for name in names]

    def pose() -> tuple[float, ...]:
        row = source.truth_row()
        values = tuple(row[place] for place in places)
        return values if names is _QUATERNION_COLUMNS else tuple(_with_quaternions(np.array([values]))[0].tolist())

    return pose


def free_poses_in(log: Log) -> FloatArray | None:
    """Return the object's pose in every period of a log, shape (n, 7); None if the log does not record it.

    In periods without a pose, as before emulated devices have reported one, it is the next recorded pose.
    """
    truth = log.truth
    if set(_QUATERNION_COLUMNS) <= set(truth.columns):
        poses = truth.column(*_QUATERNION_COLUMNS).copy()
    elif set(_MATRIX_COLUMNS) <= set(truth.columns):
        matrices = truth.column(*_MATRIX_COLUMNS)
        if (matrices == matrices[:1]).all():  # the object stands still, or nothing has touched it
            return None
        poses = _with_quaternions(matrices)
    else:
        return None
    known = np.flatnonzero(np.isfinite(poses).all(axis=1))
    if not len(known):
        return None
    nearest = known[np.minimum(np.searchsorted(known, np.arange(len(poses))), len(known) - 1)]
    return np.asarray(poses[nearest])


def _with_quaternions(rows: FloatArray) -> FloatArray:
    """Return rows of `_MATRIX_COLUMNS` as rows of `_QUATERNION_COLUMNS`."""
    known = np.isfinite(rows).all(axis=1, keepdims=True)
    rotations = np.where(known, rows[:, 3:], np.eye(3).ravel()).reshape(-1, 3, 3)
    quaternions = np.roll(Rotation.from_matrix(rotations).as_quat(), 1, axis=1)  # scipy has w last
    return np.where(known, np.hstack([rows[:, :3], quaternions]), np.nan)


# --- stills and videos, drawn by the simulator without a screen ---


def write_still(scene: ViewScene, frames: Frames, path: Path) -> None:
    """Write an image of a run's last contact: of the last contact of its scan, if it has one.

    A run without contact is shown at its end. A hand is shown at its hardest grip: at its last contact it lets go.

    Args:
        scene: Scene of the run, as `palpate.experiments.kit.scene` makes it.
        frames: Frames of the run, at least one period.
        path: Name of the file (PNG).

    Raises:
        NoRendererError: If this machine cannot draw off screen.
        InvalidValueError: If there are no periods.
        OSError: If the file cannot be written.
    """
    _check_not_empty(frames)
    contacts = [frames.finger(i) for i in range(frames.layout.fingers)]
    period = len(frames) - 1
    if len(contacts) > 1:
        forces = [np.where(contact.touching, contact.normal_force, 0.0) for contact in contacts]
        period = int(np.argmax(np.min(forces, axis=0)))
    else:
        # the scan first: while the tip lifts off, the force dwindles
        for chosen in (frames.scanning, contacts[0].touching):
            if chosen.any():
                period = int(np.flatnonzero(chosen)[-1])
                break
    (image,) = _images(scene, frames, [period], (frames.posture(period),))
    write_png(image, path)


def write_video(scene: ViewScene, frames: Frames, path: Path, time_scale: float) -> int:
    """Write a video of a run; returns its number of images.

    Args:
        scene: Scene of the run, as for `write_still`.
        frames: Frames of the run, at least one period.
        path: Name of the file (GIF).
        time_scale: Seconds of the run per second of the video.

    Raises:
        NoRendererError: If this machine cannot draw off screen.
        InvalidValueError: If there are no periods, or the video would become too long.
        OSError: If the file cannot be written.
    """
    _check_not_empty(frames)
    times = np.arange(frames.time[0], frames.time[-1], _IMAGE_INTERVAL * time_scale)
    if len(times) > _MAX_IMAGES:
        least = time_scale * len(times) / _MAX_IMAGES
        raise InvalidValueError(
            f"time_scale = {time_scale:g}: makes a video of {len(times)} images, the limit is {_MAX_IMAGES}; "
            f"take at least {least:.2g}"
        )
    periods = np.searchsorted(frames.time, times).tolist() if len(times) else [0]
    images = _images(scene, frames, periods, frames.postures(_POSTURES_IN_VIEW))
    return write_gif(images, path, _IMAGE_INTERVAL)


def _check_not_empty(frames: Frames) -> None:
    if not len(frames):
        raise InvalidValueError("there are no periods to show: the log is empty")


def _images(
    view: ViewScene, frames: Frames, periods: Sequence[int], in_view: Sequence[Posture]
) -> Iterator[Figure]:
    """Yield an image of each of some periods; the camera has all postures of `in_view` in view."""
    placement = view.placement
    if not isinstance(placement, ScenePlacement | HeldPlacement | ToolPlacement):
        raise TypeError(f"a {type(placement).__name__} belongs to no simulated scene")
    scene = placement.scene
    camera = camera_on(scene.model, scene, [placement.in_scene(posture) for posture in in_view])
    with SceneRenderer(scene.model, camera=camera, placement=scene) as renderer:
        for period in periods:
            posture = placement.in_scene(frames.posture(period))
            poses, forces = scene.poses(posture), []
            for i, body in enumerate(view.fingers):
                contact, pose = frames.finger(i), poses[body]
                if contact.touching[period]:
                    point = add(pose.position, rotate(pose.rotation, as_vector(contact.centroid[period])))
                    force = rotate(pose.rotation, as_vector(contact.force[period]))
                    forces.append(ContactForce(point, force))
            yield renderer.picture(posture, forces)
