"""Uncertainty of a grasp and its load."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from palpate.errors import FloatArray, InvalidValueError, numbers

__all__ = ["GraspUncertainty"]

NEGATIVE = -1e-9
"""Smallest eigenvalue of a covariance, over its largest: rounding passes."""


@dataclass(frozen=True, slots=True, eq=False, init=False)
class GraspUncertainty:
    """Covariances of a grasp of n contacts; errors of different kinds, and of different places, are independent.

    Attributes:
        friction: Standard deviations of mu, shape (n,), if contacts err independently; else covariance, shape (n,
            n).
        spin_length: Of e, the same [m], [m^2].
        position: Covariances of the places, object frame, shape (n, 3, 3) [m^2].
        normal: Covariances of the normals' parts along t1 and t2, shape (n, 2, 2).
        load: Covariance of the load about the object's origin, shape (6, 6) [N^2, N^2 m, N^2 m^2].
    """

    friction: FloatArray
    spin_length: FloatArray
    position: FloatArray
    normal: FloatArray
    load: FloatArray

    def __init__(
        self,
        friction: ArrayLike,
        spin_length: ArrayLike,
        position: ArrayLike | None = None,
        normal: ArrayLike | None = None,
        load: ArrayLike | None = None,
    ) -> None:
        """Check and keep; None for what is known.

        Raises:
            InvalidValueError: Shapes that do not fit, negative deviations, or matrices that are no covariances.
        """
        n = len(np.atleast_1d(numbers("friction", friction)))
        for name, given, shape in (
            ("friction", friction, (n, n)),
            ("spin_length", spin_length, (n, n)),
            ("position", position, (n, 3, 3)),
            ("normal", normal, (n, 2, 2)),
            ("load", load, (6, 6)),
        ):
            value = np.zeros(shape) if given is None else numbers(name, given)
            if shape == (n, n) and value.shape == (n,):
                if not (value >= 0.0).all():
                    raise InvalidValueError(f"{name} = {value.tolist()}: standard deviations must be at least 0")
                value = np.diag(value**2)
            if value.shape != shape:
                raise InvalidValueError(f"{name} has shape {value.shape}: must be {shape}")
            _check_covariance(name, value)
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        """Number of contacts."""
        return len(self.friction)


def _check_covariance(name: str, value: FloatArray) -> None:
    if not np.isfinite(value).all():
        raise InvalidValueError(f"{name}: every entry must be finite")
    matrices = value.reshape(-1, *value.shape[-2:])
    for i, each in enumerate(matrices):
        which = name if len(matrices) == 1 else f"{name} of contact {i}"
        largest = float(np.abs(each).max(initial=0.0))
        if float(np.abs(each - each.T).max(initial=0.0)) > -NEGATIVE * largest:
            raise InvalidValueError(f"{which} is not symmetric: give a covariance matrix")
        if largest > 0.0 and float(np.linalg.eigvalsh(each)[0]) < NEGATIVE * largest:
            raise InvalidValueError(f"{which} has a negative eigenvalue: give a covariance matrix")
