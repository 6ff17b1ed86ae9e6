"""Checks of the arrays that calibration routines take."""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError

AXES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
"""Names of a wrench's entries, for messages."""

OTHER_MOMENT_UNIT = "name the unit in the header, mx_mNm if moments are in mN m"
"""What to do where moments cannot be in N m."""


def finite_rows(name: str, value: npt.ArrayLike, columns: int | None, unit: str) -> FloatArray:
    """Return `value` as a float64 array of shape (n, columns), all finite.

    Args:
        name: What the caller calls it, for the message.
        value: Anything array-like.
        columns: Wanted length of a row; None: any.
        unit: For the message.

    Raises:
        InvalidValueError: Another shape, not numbers, or not finite (the first bad entry is named).
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError(
            f"{name}: must be numbers in a regular array (n, {columns or 'k'}) [{unit}]"
        ) from None
    if array.ndim != 2 or array.shape[1] != (columns or array.shape[1]):
        raise InvalidValueError(f"{name} has shape {array.shape}: must be (n, {columns or 'k'}) [{unit}]")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        i, j = (int(x) for x in bad[0])
        raise InvalidValueError(
            f"{name}[{i}, {j}] = {array[i, j]}: every entry must be finite [{unit}]; {len(bad)} of "
            f"{array.size} are not: drop those rows"
        )
    return array


def same_length(first_name: str, first: FloatArray, second_name: str, second: FloatArray) -> None:
    """Check that two arrays have equally many rows.

    Raises:
        InvalidValueError: They do not.
    """
    if len(first) != len(second):
        raise InvalidValueError(
            f"{first_name} has {len(first)} rows and {second_name} has {len(second)}: each row must have its "
            "partner"
        )


def positive_entries(name: str, value: npt.ArrayLike, length: int, unit: str) -> FloatArray:
    """Return `value` as a float64 array of shape (length,), all finite and above zero; a scalar is repeated.

    Raises:
        InvalidValueError: Otherwise.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name} = {value!r}: must be {length} numbers [{unit}]") from None
    if array.ndim == 0:
        array = np.full(length, float(array))
    if array.shape != (length,) or not (np.isfinite(array).all() and (array > 0.0).all()):
        raise InvalidValueError(f"{name} = {array.tolist()}: must be {length} finite numbers above 0 [{unit}]")
    return array


def named_axes(turn: FloatArray) -> str:
    """Return which axis each row of a matrix (3, 3) is nearest to, as (y, x, -z)."""
    near = [int(i) for i in np.argmax(np.abs(turn), axis=1)]
    return "(" + ", ".join(f"{'-' if turn[i, j] < 0.0 else ''}{'xyz'[j]}" for i, j in enumerate(near)) + ")"
