"""What a finger felt along its path: points on the surface with their normals and forces."""

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.mapping.arc_bins import stretch_means, stretch_starts

UNIT_TOLERANCE = 1e-6
"""How far the length of a normal may be from 1: far above rounding, far below any error of a sensor."""

PAUSE_PERIODS = 5.0
"""A pause of more than this many median sample periods is a lift-off: the finger may have come back
elsewhere."""

_SCALARS = ("time", "normal_force", "spin_torque")
_VECTORS = ("position", "normal", "tangential_force")
_DEVIATIONS = ("noise", "tilt")


@dataclass(frozen=True, slots=True, eq=False)
class TouchCloud:
    """n contacts in the order they were felt, in the robot's base frame. Arrays are read-only copies.

    The normal is the object's, so it points out of the object: minus the fingertip's normal of
    `palpate.sensing.Contact`. Forces are what the object exerts on the finger.

    Attributes:
        time: When each contact was felt, not decreasing, shape (n,) [s].
        position: Points on the object's surface, shape (n, 3) [m].
        normal: The object's outward unit normals there, shape (n, 3).
        normal_force: Shape (n,) [N], positive when pushing.
        tangential_force: Shape (n, 3) [N].
        spin_torque: Torque about the fingertip's normal, shape (n,) [N m].
        noise: Standard deviation of each position along its normal, shape (n,) [m], where it is known from the
            sensor's noise (`standard_deviations`); None where all contacts are alike.
        tilt: Standard deviation of each normal about a tangent, shape (n,) [rad], or None.

    Raises:
        InvalidValueError: Shapes do not fit together, an entry is not finite, a normal is not of unit length,
            time runs backwards, or a standard deviation is not positive.
    """

    time: FloatArray
    position: FloatArray
    normal: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    spin_torque: FloatArray
    noise: FloatArray | None = None
    tilt: FloatArray | None = None

    def __post_init__(self) -> None:
        count = len(np.atleast_1d(np.asarray(self.time)))
        for name in _SCALARS:
            object.__setattr__(self, name, _checked(name, getattr(self, name), (count,)))
        for name in _VECTORS:
            object.__setattr__(self, name, _checked(name, getattr(self, name), (count, 3)))
        for name in self._deviations:
            array = _checked(name, getattr(self, name), (count,))
            if count and array.min() <= 0.0:
                at = int(array.argmin())
                raise InvalidValueError(
                    f"{name} of contact {at} is {array[at]}: a standard deviation must be above 0; "
                    "leave it out where nothing is known"
                )
            object.__setattr__(self, name, array)
        steps = np.diff(self.time)
        if count and steps.size and steps.min() < 0.0:
            at = int(steps.argmin())
            raise InvalidValueError(
                f"time runs backwards from {self.time[at]} s to {self.time[at + 1]} s at contact {at + 1}: "
                "give contacts in the order they were felt"
            )
        defect = np.abs(np.linalg.norm(self.normal, axis=1) - 1.0)
        if count and defect.max() > UNIT_TOLERANCE:
            at = int(defect.argmax())
            raise InvalidValueError(
                f"normal of contact {at} is {self.normal[at].tolist()}: its length must be 1 "
                f"within {UNIT_TOLERANCE:.0e}"
            )

    def __len__(self) -> int:
        """Number of contacts."""
        return len(self.time)

    @property
    def _deviations(self) -> tuple[str, ...]:
        """The optional fields that are given."""
        return tuple(name for name in _DEVIATIONS if getattr(self, name) is not None)

    def select(self, mask: npt.NDArray[np.bool_]) -> Self:
        """Return the contacts where `mask` (n,) is true.

        Raises:
            InvalidValueError: Not a boolean array of shape (n,).
        """
        mask = np.asarray(mask)
        if mask.dtype != np.bool_ or mask.shape != (len(self),):
            raise InvalidValueError(
                f"mask has shape {mask.shape} and type {mask.dtype}: must be ({len(self)},) and bool"
            )
        names = _SCALARS + _VECTORS + self._deviations
        return dataclasses.replace(self, **{name: getattr(self, name)[mask] for name in names})

    def thinned(self, spacing: float, longest_pause: float | None = None) -> Self:
        """Return means over stretches of `spacing` along the path; gaps and edges are not bridged.

        The mean of points along an arc of length b on a surface of radius R lies b^2 / (24 R) inside it. To
        second order p = p0 + u - n0 (u' H u) / 2 and n = n0 + H u, so the mean is low by tr(H cov(u)) / 2,
        which is tr(cov(p, n)) / 2: measurable within the stretch, for any shape and any distribution of the
        contacts.

        Args:
            spacing: Length of a stretch [m].
            longest_pause: Longest time between neighbours of one stretch [s]; by default `PAUSE_PERIODS`
                median sample periods.

        Raises:
            InvalidValueError: `spacing` or `longest_pause` is not positive.
        """
        spacing = positive("spacing", spacing, "m")
        if len(self) < 2:
            return self
        if longest_pause is None:
            longest_pause = PAUSE_PERIODS * float(np.median(np.diff(self.time)))
            if longest_pause <= 0.0:  # most contacts share one time: pauses mean nothing
                longest_pause = float("inf")
        longest_pause = positive("longest_pause", longest_pause, "s", infinite_allowed=True)
        starts = stretch_starts(self.time, self.position, self.normal, spacing, longest_pause)
        # Noise keeps along a stretch, so a mean errs as its contacts do.
        names = _SCALARS + _VECTORS + self._deviations
        mean = {name: stretch_means(getattr(self, name), starts) for name in names}
        # Covariance from deviations, not from E[pn] - E[p]E[n], which cancels far from the base's origin.
        counts = np.diff(np.append(starts, len(self)))
        deviation = self.position - np.repeat(mean["position"], counts, axis=0)
        covariance = stretch_means((deviation * self.normal).sum(axis=1), starts)
        mean["normal"] = mean["normal"] / np.linalg.norm(mean["normal"], axis=1, keepdims=True)
        mean["position"] = mean["position"] + 0.5 * covariance[:, np.newaxis] * mean["normal"]
        return dataclasses.replace(self, **mean)


def standard_deviations(
    normal: FloatArray, position_covariance: FloatArray, normal_covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return `noise` and `tilt` of a `TouchCloud` from covariances such as `contacts_uncertainties` gives.

    A surface feels of a position's error only what lies along the normal, and of a normal's error what lies in the
    tangent plane, here as the root mean square of its two directions. Covariances may be in any frame as long as
    the normals are in the same. The centroid of a rigid tip cannot err across the tip's surface (that `noise` is
    0): add the variance that calibration and compliance leave along the normal before, or keep `noise` out.

    Args:
        normal: Unit normals, shape (n, 3).
        position_covariance: Shape (n, 3, 3) [m^2].
        normal_covariance: Shape (n, 3, 3).

    Returns:
        Standard deviations, shapes (n,) [m] and (n,) [rad].
    """
    along = np.einsum("ni,nij,nj->n", normal, position_covariance, normal)
    across = np.trace(normal_covariance, axis1=1, axis2=2) - np.einsum(
        "ni,nij,nj->n", normal, normal_covariance, normal
    )
    return np.sqrt(np.maximum(along, 0.0)), np.sqrt(np.maximum(0.5 * across, 0.0))


def _checked(name: str, value: object, shape: tuple[int, ...]) -> FloatArray:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name}: must be numbers in a regular array of shape {shape}") from None
    if array.shape != shape:
        raise InvalidValueError(f"{name} has shape {array.shape}: must be {shape}, one row per entry of time")
    if not np.isfinite(array).all():
        at = int(np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(axis=1))[0])
        raise InvalidValueError(
            f"{name} of contact {at} is {array[at].tolist()}: must be finite; "
            "keep only contacts whose status is OK"
        )
    array.setflags(write=False)
    return array
