"""Which stretches start a patch: those with none near enough, also of those that stretches before them started."""

import numpy as np

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.mapping.surface_map.blend import IndexArray


def seeds(
    position: FloatArray,
    normal: FloatArray,
    centers: FloatArray,
    axes: FloatArray,
    spacing: float,
    least_cos: float,
) -> IndexArray:
    """Return the stretches that start a patch, increasing, shape (k,).

    Args:
        position: Of new stretches, in path order, shape (n, 3) [m].
        normal: Theirs, shape (n, 3).
        centers: Of the patches there are, shape (p, 3) [m].
        axes: Theirs, shape (p, 3).
        spacing: A patch is near whose centre is not farther [m].
        least_cos: And whose axis is turned from the normal by an angle of a larger cosine.
    """
    return _seeds(np.hstack([position, normal]), np.hstack([centers, axes]), spacing, least_cos)


@njit(cache=True)
def _seeds(new: FloatArray, patches: FloatArray, spacing: float, least_cos: float) -> IndexArray:
    """Rows are places and directions."""
    before = len(patches)
    started = np.empty(len(new), np.intp)
    count = 0
    for i in range(len(new)):
        alone = True
        for j in range(before + count):
            other = patches[j] if j < before else new[started[j - before]]
            square = cos = 0.0
            for k in range(3):
                step = new[i, k] - other[k]
                square += step * step
                cos += new[i, 3 + k] * other[3 + k]
            if square <= spacing * spacing and cos > least_cos:
                alone = False
                break
        if alone:
            started[count] = i
            count += 1
    return started[:count]
