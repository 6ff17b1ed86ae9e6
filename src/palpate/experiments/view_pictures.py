"""Stills and videos of a recorded exploration, drawn by the simulator without a screen."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from palpate.errors import InvalidValueError
from palpate.experiments.explore_plan import ExplorationPlan
from palpate.sim.render.files import write_gif, write_png
from palpate.sim.render.renderer import ContactForce, Picture, SceneRenderer
from palpate.spatial import Vector
from palpate.viewing import Frames

INTERVAL = 0.05
"""Between two pictures of a video [s]: smooth enough, and half the bytes of 40 a second."""

MOST_PICTURES = 3000
"""Of one video: two and a half minutes; GIFs of more choke browsers."""


def write_still(planned: ExplorationPlan, frames: Frames, path: Path) -> None:
    """Write a picture of a scan's last contact, or of the run's end if there was none.

    Args:
        planned: As the run was.
        frames: The run, at least one period.
        path: The file (PNG).

    Raises:
        NoRendererError: This machine cannot draw off screen.
        InvalidValueError: There are no periods.
        OSError: The file cannot be written.
    """
    _check_any(frames)
    # of the scan: while the tip lifts off, the force dwindles
    scanning = np.flatnonzero(frames.scanning)
    index = int(scanning[-1]) if len(scanning) else len(frames) - 1
    with SceneRenderer(planned.backend.scene.model) as renderer:
        picture = _picture(renderer, frames, index)
    write_png(picture, path)


def write_video(planned: ExplorationPlan, frames: Frames, path: Path, speed: float) -> int:
    """Write a video of a run; returns of how many pictures.

    Args:
        planned: As the run was.
        frames: The run, at least one period.
        path: The file (GIF).
        speed: Times as fast as in reality.

    Raises:
        NoRendererError: This machine cannot draw off screen.
        InvalidValueError: There are no periods, or it would become too long.
        OSError: The file cannot be written.
    """
    _check_any(frames)
    times = np.arange(frames.time[0], frames.time[-1], INTERVAL * speed)
    if len(times) > MOST_PICTURES:
        least = speed * len(times) / MOST_PICTURES
        raise InvalidValueError(
            f"speed = {speed:g}: makes a video of {len(times)} pictures, the limit is {MOST_PICTURES}; take at "
            f"least {least:.2g} times real time"
        )
    chosen = np.searchsorted(frames.time, times) if len(times) else np.array([0])

    def pictures(renderer: SceneRenderer) -> Iterator[Picture]:
        for index in chosen.tolist():
            yield _picture(renderer, frames, index)

    with SceneRenderer(planned.backend.scene.model) as renderer:
        return write_gif(pictures(renderer), path, INTERVAL)


def _check_any(frames: Frames) -> None:
    if not len(frames):
        raise InvalidValueError("there are no periods to show: the log is empty")


def _picture(renderer: SceneRenderer, frames: Frames, index: int) -> Picture:
    one = frames[index : index + 1]
    force = None
    if one.touching[0]:
        force = ContactForce(_vector(one.centroid[0]), _vector(one.force[0]))
    return renderer.picture(_vector(one.position[0]), tuple(one.joint_position[0].tolist()), force)


def _vector(array: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Vector:
    x, y, z = array.tolist()
    return (x, y, z)
