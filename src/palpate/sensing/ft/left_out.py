"""Which loads of a calibration are left out together, and what least squares says of those that are."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError

SAME_LOAD = 1e-9
"""Of the largest load: closer together, two are the same one, written out twice."""

ALONE = 1e-9
"""Share of its own row that a group leaves to others: below, nothing else tells what it does."""

Groups = Sequence[npt.NDArray[np.intp]]
"""Rows of each group."""


def equal_loads(loads: FloatArray) -> npt.NDArray[np.intp]:
    """Return a number for each row of (n, 6) that is the same for equal loads, shape (n,).

    A load that was put on twice is no load that the calibration has not seen: both are to be left out at once.
    """
    largest = np.abs(loads).max(axis=0)
    steps = np.round(loads / np.where(largest > 0.0, SAME_LOAD * largest, 1.0))
    return np.asarray(np.unique(steps, axis=0, return_inverse=True)[1].reshape(-1))


def grouped(numbers: npt.NDArray[np.intp]) -> Groups:
    """Return the rows of each group, in the order in which groups are first seen."""
    order = np.argsort(numbers, kind="stable")
    ends = np.flatnonzero(np.diff(numbers[order])) + 1
    return sorted(np.split(order, ends), key=lambda rows: int(rows[0]))


def solved_left_out(kept: FloatArray, residual: FloatArray) -> FloatArray:
    """Return what a group's residuals would be by a fit that never saw it, shape (g, q).

    Args:
        kept: I - H of the group, H the hat matrix, shape (g, g).
        residual: Of the fit to all, shape (g, q).

    Raises:
        InvalidValueError: Without the group something is not determined.
    """
    if float(np.linalg.eigvalsh(kept)[0]) < ALONE:
        raise InvalidValueError(
            f"{len(kept)} rows are of one load, and without it the others do not determine the calibration: load "
            "more directions"
        )
    return np.asarray(np.linalg.solve(kept, residual))


def left_out_residuals(basis: FloatArray, residual: FloatArray, groups: Groups) -> FloatArray:
    """Return residuals of every row by a fit that never saw its group, shape (n, q); NaN where there is none.

    Args:
        basis: Orthonormal columns of the design, shape (n, p).
        residual: Of the fit to all, shape (n, q).
        groups: Rows that are left out together.
    """
    free = 1.0 - (basis**2).sum(axis=1)
    free[free < ALONE] = np.nan
    out = residual / free[:, None]
    for group in groups:
        if len(group) > 1:
            kept = np.eye(len(group)) - basis[group] @ basis[group].T
            alone = float(np.linalg.eigvalsh(kept)[0]) < ALONE
            out[group] = np.nan if alone else np.linalg.solve(kept, residual[group])
    return np.asarray(out)
