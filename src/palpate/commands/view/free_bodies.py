"""Where an object that moves freely is: in a simulation that runs, or as a log knows it."""

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime import Backend
from palpate.runtime.log import Log
from palpate.runtime.truth import truth_source
from palpate.sim.hand.truth_numbers import OBJECT_POSITION, OBJECT_QUATERNION
from palpate.viewing import FreePoses

COLUMNS = (*OBJECT_POSITION, *OBJECT_QUATERNION)
"""Position [m] and quaternion (w, x, y, z), base frame, as views take them."""


def free_poses_of(backend: Backend) -> FreePoses | None:
    """Return what knows where the object of a back end is; None if nobody knows, or it does not move freely."""
    source = truth_source(backend)
    if source is None or not set(COLUMNS) <= set(source.truth_columns):
        return None
    places = [source.truth_columns.index(name) for name in COLUMNS]

    def poses() -> tuple[float, ...]:
        row = source.truth_row()
        return tuple(row[place] for place in places)

    return poses


def free_poses_in(log: Log) -> FloatArray | None:
    """Return where the object was in every period of a log, shape (n, 7); None if the log does not know.

    While it is not known, as before emulated devices have reported it, it is where it was known next.
    """
    truth = log.truth
    if not set(COLUMNS) <= set(truth.columns):
        return None
    poses = truth.column(*COLUMNS).copy()
    known = np.flatnonzero(np.isfinite(poses).all(axis=1))
    if not len(known):
        return None
    nearest = known[np.minimum(np.searchsorted(known, np.arange(len(poses))), len(known) - 1)]
    return np.asarray(poses[nearest])
