"""Stills and videos of a run in simulation, drawn by the simulator without a screen."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from palpate.errors import InvalidValueError
from palpate.kinematics.posture import Posture
from palpate.sim.render.files import write_gif, write_png
from palpate.sim.render.held import HeldPlacement
from palpate.sim.render.place import ScenePlacement
from palpate.sim.render.renderer import ContactForce, Figure, SceneRenderer, camera_on
from palpate.sim.render.tool import ToolPlacement
from palpate.spatial import add, as_vector, rotate
from palpate.viewing import Frames, ViewScene

INTERVAL = 0.05
"""Between two pictures of a video [s]: smooth enough, and half the bytes of 40 a second."""

IN_VIEW = 25
"""Postures of the run that a video's camera has in view."""

MOST_PICTURES = 3000
"""Of one video: two and a half minutes; GIFs of more choke browsers."""


def write_still(scene: ViewScene, frames: Frames, path: Path) -> None:
    """Write a picture of a run's last contact: of the scan's, if there was one; of the run's end without any.

    Of a hand it is that in which it grips hardest: at its last contact it lets go.

    Args:
        scene: What there is to see, as `palpate.experiments.kit.scene` makes it.
        frames: The run, at least one period.
        path: The file (PNG).

    Raises:
        NoRendererError: This machine cannot draw off screen.
        InvalidValueError: There are no periods.
        OSError: The file cannot be written.
    """
    _check_any(frames)
    index = _last_contact(frames) if frames.layout.fingers == 1 else _hardest_grip(frames)
    with _renderer(scene, (frames.posture(index),)) as renderer:
        picture = _picture(renderer, scene, frames, index)
    write_png(picture, path)


def write_video(scene: ViewScene, frames: Frames, path: Path, time_scale: float) -> int:
    """Write a video of a run; returns of how many pictures.

    Args:
        scene: As for `write_still`.
        frames: The run, at least one period.
        path: The file (GIF).
        time_scale: Seconds of the run per second of the video.

    Raises:
        NoRendererError: This machine cannot draw off screen.
        InvalidValueError: There are no periods, or it would become too long.
        OSError: The file cannot be written.
    """
    _check_any(frames)
    times = np.arange(frames.time[0], frames.time[-1], INTERVAL * time_scale)
    if len(times) > MOST_PICTURES:
        least = time_scale * len(times) / MOST_PICTURES
        raise InvalidValueError(
            f"time_scale = {time_scale:g}: makes a video of {len(times)} pictures, the limit is {MOST_PICTURES}; "
            f"take at least {least:.2g}"
        )
    chosen = np.searchsorted(frames.time, times) if len(times) else np.array([0])

    def pictures(renderer: SceneRenderer) -> Iterator[Figure]:
        for index in chosen.tolist():
            yield _picture(renderer, scene, frames, index)

    with _renderer(scene, frames.postures(IN_VIEW)) as renderer:
        return write_gif(pictures(renderer), path, INTERVAL)


def _check_any(frames: Frames) -> None:
    if not len(frames):
        raise InvalidValueError("there are no periods to show: the log is empty")


def _last_contact(frames: Frames) -> int:
    # of the scan before any other: while the tip lifts off, the force dwindles
    touching = np.any([frames.finger(i).touching for i in range(frames.layout.fingers)], axis=0)
    for chosen in (frames.scanning, touching):
        if chosen.any():
            return int(np.flatnonzero(chosen)[-1])
    return len(frames) - 1


def _hardest_grip(frames: Frames) -> int:
    contacts = [frames.finger(i) for i in range(frames.layout.fingers)]
    forces = [np.where(contact.touching, contact.normal_force, 0.0) for contact in contacts]
    return int(np.argmax(np.min(forces, axis=0)))


def _renderer(scene: ViewScene, postures: Sequence[Posture]) -> SceneRenderer:
    placement = scene.placement
    if not isinstance(placement, ScenePlacement | HeldPlacement | ToolPlacement):
        raise TypeError(f"a {type(placement).__name__} is of no simulated scene")
    inside, model = placement.scene, placement.scene.model
    postures = [placement.in_scene(posture) for posture in postures]
    return SceneRenderer(model, camera=camera_on(model, inside, postures), placement=inside)


def _picture(renderer: SceneRenderer, scene: ViewScene, frames: Frames, index: int) -> Figure:
    placement = scene.placement
    assert isinstance(placement, ScenePlacement | HeldPlacement | ToolPlacement)  # there is a renderer
    posture = placement.in_scene(frames.posture(index))
    poses, forces = placement.scene.poses(posture), []
    for i, body in enumerate(scene.fingers):
        contact, pose = frames.finger(i), poses[body]
        if contact.touching[index]:
            point = add(pose.position, rotate(pose.rotation, as_vector(contact.centroid[index])))
            forces.append(ContactForce(point, rotate(pose.rotation, as_vector(contact.force[index]))))
    return renderer.picture(posture, forces)
