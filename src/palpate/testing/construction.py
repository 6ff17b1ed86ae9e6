"""Whether a class refuses the bad values that its constructor may be given."""

import inspect
import math
from collections.abc import Iterator

import numpy as np

from palpate.errors import shown
from palpate.testing.nonconformity import Inspection

NO_ROTATIONS = (
    2.0 * np.eye(3),
    np.round([[0.6 * 2**0.5, -(0.28**0.5), 0.0], [0.28**0.5, 0.6 * 2**0.5, 0.0], [0.0, 0.0, 1.0]], 4),
    np.diag([1.0, 1.0, -1.0]),
    np.eye(2),
    np.eye(4),
)
"""Not orthonormal, typed with four decimals, a reflection, other shapes."""


def examine_construction(inspection: Inspection, piece: object) -> None:
    """Build a piece again, one argument at a time with bad numbers in it: each must be refused.

    Only a class whose arguments are kept under their names can be built again.
    """
    names = inspect.signature(type(piece)).parameters
    if not all(hasattr(piece, name) for name in names):
        return
    given = {name: getattr(piece, name) for name in names}
    for name, value in given.items():
        for bad in _bad(name, value):
            what = f"{type(piece).__name__}({name}={shown(bad)})"
            inspection.refuses(what, type(piece), names=name, **{**given, name: bad})


def _bad(name: str, value: object) -> Iterator[object]:
    """Yield what a value of this kind must not be."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        yield math.nan
    elif isinstance(value, tuple | np.ndarray):
        array = np.array(value, dtype=object)
        if array.size and all(isinstance(entry, float) for entry in array.ravel()):
            array.flat[0] = math.nan
            yield array.astype(float)
            if array.shape == (3,):
                yield from (np.ones(2), np.ones((3, 1)), np.full(3, math.nan), ("a", "b", "c"), None)
            if name == "rotation":
                yield from NO_ROTATIONS
