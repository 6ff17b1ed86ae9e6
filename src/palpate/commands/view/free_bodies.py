"""Where an object is that moves freely or yields: in a simulation that runs, or as a log knows it."""

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray
from palpate.robots.known_truth import scene_of
from palpate.runtime import Backend
from palpate.runtime.log import Log
from palpate.runtime.truth import TruthSource, truth_source
from palpate.sim import Mount, contact_truth
from palpate.sim.hand.truth_numbers import OBJECT_POSITION, OBJECT_QUATERNION
from palpate.viewing import FreePoses

COLUMNS = (*OBJECT_POSITION, *OBJECT_QUATERNION)
"""Position [m] and quaternion (w, x, y, z), base frame, as views take them."""

TURNED = (*contact_truth.OBJECT_POSITION, *contact_truth.OBJECT_ROTATION)
"""Position [m] and rotation, row by row, as the truth at a single fingertip has them."""

YIELDING = (Mount.SPRUNG, Mount.JOINTED)
"""Objects that a single fingertip moves."""


def free_poses_of(backend: Backend) -> FreePoses | None:
    """Return what knows where the object of a back end is; None if nobody knows, or it does not move freely."""
    source = truth_source(backend)
    if source is None:
        return None
    names = TURNED if _yields(backend, source) else COLUMNS
    if not set(names) <= set(source.truth_columns):
        return None
    places = [source.truth_columns.index(name) for name in names]

    def poses() -> tuple[float, ...]:
        row = source.truth_row()
        return tuple(row[place] for place in places)

    return poses if names is COLUMNS else lambda: tuple(_with_quaternions(np.array([poses()]))[0].tolist())


def free_poses_in(log: Log) -> FloatArray | None:
    """Return where the object was in every period of a log, shape (n, 7); None if the log does not know.

    While it is not known, as before emulated devices have reported it, it is where it was known next.
    """
    truth = log.truth
    if set(COLUMNS) <= set(truth.columns):
        poses = truth.column(*COLUMNS).copy()
    elif set(TURNED) <= set(truth.columns):
        turned = truth.column(*TURNED)
        if (turned == turned[:1]).all():  # it stands still, or nothing has touched it
            return None
        poses = _with_quaternions(turned)
    else:
        return None
    known = np.flatnonzero(np.isfinite(poses).all(axis=1))
    if not len(known):
        return None
    nearest = known[np.minimum(np.searchsorted(known, np.arange(len(poses))), len(known) - 1)]
    return np.asarray(poses[nearest])


def _yields(backend: Backend, source: TruthSource) -> bool:
    """Whether it simulates a single fingertip on what gives way to it."""
    scene = scene_of(backend) if set(TURNED) <= set(source.truth_columns) else None
    return scene is not None and scene.target.mount in YIELDING


def _with_quaternions(rows: FloatArray) -> FloatArray:
    """Rows of `TURNED` as rows of `COLUMNS`."""
    known = np.isfinite(rows).all(axis=1, keepdims=True)
    rotations = np.where(known, rows[:, 3:], np.eye(3).ravel()).reshape(-1, 3, 3)
    quaternions = np.roll(Rotation.from_matrix(rotations).as_quat(), 1, axis=1)  # scipy has w last
    return np.where(known, np.hstack([rows[:, :3], quaternions]), np.nan)
