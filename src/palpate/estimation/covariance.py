"""Covariances as people give them: checked, and symmetric to the last bit."""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, numbers

SYMMETRY_TOLERANCE = 1e-9
"""Largest asymmetry and negative eigenvalue of a covariance, relative to its largest entry: rounding and printing
with ten digits pass, a wrong entry does not."""


def covariance_matrix(name: str, value: npt.ArrayLike, size: int, *, remedy: str) -> FloatArray:
    """Return a covariance, or a stack of them, as a read-only symmetric float64 copy.

    It is judged as correlations: its entries may have different units.

    Args:
        name: What the caller calls it, for the message.
        value: Shape (..., size, size).
        size: Of the matrix.
        remedy: What is one, for the message.

    Raises:
        InvalidValueError: Another shape, not finite, not symmetric, or a negative eigenvalue.
    """
    E = numbers(name, value)
    if E.ndim < 2 or E.shape[-2:] != (size, size):
        raise InvalidValueError(
            f"{name} has shape {E.shape}: must be ({size}, {size}); for standard deviations s give np.diag(s**2)"
        )
    if not np.isfinite(E).all():
        raise InvalidValueError(f"{name} = {E.tolist()}: every entry must be finite")
    sd = np.sqrt(np.abs(np.diagonal(E, axis1=-2, axis2=-1)))
    scale = np.where(sd > 0.0, sd, 1.0)
    R = E / (scale[..., :, None] * scale[..., None, :])
    mirrored = np.swapaxes(R, -1, -2)
    asymmetry = np.abs(R - mirrored).max(initial=0.0)
    lowest = np.linalg.eigvalsh(0.5 * (R + mirrored))[..., 0].min(initial=0.0)
    if asymmetry > SYMMETRY_TOLERANCE or lowest < -SYMMETRY_TOLERANCE:
        raise InvalidValueError(f"{name} = {E.tolist()}: must be symmetric without negative eigenvalues; {remedy}")
    E = np.asarray(0.5 * (E + np.swapaxes(E, -1, -2)))
    E.setflags(write=False)
    return E
