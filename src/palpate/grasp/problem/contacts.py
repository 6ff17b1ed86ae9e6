"""A grasp: where soft fingers touch an object, and what each contact bears."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate.compiling import njit
from palpate.errors import ORTHONORMAL_TOLERANCE, FloatArray, InvalidValueError, numbers
from palpate.friction import LimitSurface
from palpate.friction.limit_surface import LARGEST_LOAD_EXPONENT

__all__ = ["GraspContacts", "has_fault"]

FRICTION, SPIN_LENGTH, LEAST, MOST, LOAD_EXPONENT, NORM_EXPONENT, NUMBERS = range(7)
"""Rows of what each contact has as one number; how many there are."""

FINITE = 1.7976931348623157e308
"""The largest float: what is above is infinite, and nothing that is not a number is below."""


@njit(cache=True, error_model="numpy")
def has_fault(positions: Any, frames: Any, each: Any) -> bool:
    """Return whether contacts need to be looked at more closely: any of them cannot be.

    Args:
        positions: Shape (n, 3).
        frames: Shape (n, 3, 3).
        each: mu, c, f_min, f_max, gamma and p of each contact, shape (6, n).
    """
    for i in range(positions.shape[0]):
        for k in range(3):
            if not abs(positions[i, k]) <= FINITE:
                return True
        r = frames[i]
        for a in range(3):
            for b in range(a, 3):
                product = r[0, a] * r[0, b] + r[1, a] * r[1, b] + r[2, a] * r[2, b]
                if not abs(product - (1.0 if a == b else 0.0)) <= ORTHONORMAL_TOLERANCE:
                    return True
        x = r[1, 0] * r[2, 1] - r[2, 0] * r[1, 1]
        y = r[2, 0] * r[0, 1] - r[0, 0] * r[2, 1]
        z = r[0, 0] * r[1, 1] - r[1, 0] * r[0, 1]
        if not x * r[0, 2] + y * r[1, 2] + z * r[2, 2] > 0.0:
            return True
        if not (0.0 < each[FRICTION, i] <= FINITE and 0.0 < each[SPIN_LENGTH, i] <= FINITE):
            return True
        if not (0.0 <= each[LEAST, i] <= FINITE and each[LEAST, i] <= each[MOST, i]):
            return True
        if not (0.0 <= each[LOAD_EXPONENT, i] <= LARGEST_LOAD_EXPONENT and 1.0 <= each[NORM_EXPONENT, i] <= 2.0):
            return True
    return False


@dataclass(frozen=True, slots=True, eq=False, init=False)
class GraspContacts:
    """n soft contacts on one object, in the object's frame.

    Contact i exerts w = (f_n, f_t1, f_t2, tau_n) on the object, along n, t1, t2 and about n, at its place. Scalars
    given for an entry per contact hold for all.

    Attributes:
        positions: Where they are, shape (n, 3) [m].
        frames: [n t1 t2] as columns, n into the object, shape (n, 3, 3).
        friction: mu, shape (n,).
        spin_length: c [m], which is e at a normal force of 1 N, shape (n,).
        force_min: Least normal force [N], shape (n,).
        force_max: Largest normal force [N], shape (n,); infinity for none.
        actuator_map: Rows J by which w loads the actuators behind the contact, shape (n, k, 4); None for none.
        actuator_limit: Largest |J w|, shape (n, k).
        load_exponent: gamma, how e grows with the normal force, shape (n,).
        norm_exponent: p, how force and torque share, shape (n,).
    """

    positions: FloatArray
    frames: FloatArray
    friction: FloatArray
    spin_length: FloatArray
    force_min: FloatArray
    force_max: FloatArray
    actuator_map: FloatArray | None
    actuator_limit: FloatArray | None
    load_exponent: FloatArray
    norm_exponent: FloatArray

    def __init__(
        self,
        positions: ArrayLike,
        frames: ArrayLike,
        friction: ArrayLike,
        spin_length: ArrayLike,
        force_min: ArrayLike = 0.0,
        force_max: ArrayLike = np.inf,
        actuator_map: ArrayLike | None = None,
        actuator_limit: ArrayLike | None = None,
        load_exponent: ArrayLike = 0.0,
        norm_exponent: ArrayLike = 2.0,
    ) -> None:
        """Check and keep.

        Raises:
            InvalidValueError: Whatever no contact can be: none at all, mu or e not above 0, frames that are no
                rotations, force_min above force_max, shapes that do not fit, numbers that are not finite.
        """
        places = _array("positions", positions)
        if places.ndim != 2 or places.shape[1:] != (3,) or not len(places):
            raise InvalidValueError(
                f"positions has shape {places.shape}: must be (n, 3) with at least one contact"
            )
        n = len(places)
        axes = _array("frames", frames)
        if axes.shape != (n, 3, 3):
            raise InvalidValueError(f"frames has shape {axes.shape}: must be ({n}, 3, 3), [n t1 t2] as columns")
        each = np.empty((NUMBERS, n))
        given = (friction, spin_length, force_min, force_max, load_exponent, norm_exponent)
        for row, name, value in zip(each, _EACH, given, strict=True):
            row[:] = value if type(value) is float else _per_contact(name, value, n)
        if has_fault(places, axes, each):
            _refuse(places, axes, dict(zip(_EACH, each, strict=True)))
        maps, limits = _actuators(actuator_map, actuator_limit, n)
        for array in (places, axes, each, maps, limits):
            if array is not None:
                array.setflags(write=False)
        keep = object.__setattr__
        keep(self, "positions", places)
        keep(self, "frames", axes)
        for name, row in zip(_EACH, each, strict=True):
            keep(self, name, row)
        keep(self, "actuator_map", maps)
        keep(self, "actuator_limit", limits)

    def __len__(self) -> int:
        """Number of contacts."""
        return len(self.positions)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle through the checks, which also make the arrays read-only."""
        return type(self), tuple(getattr(self, each.name) for each in fields(self))

    @property
    def is_convex(self) -> bool:
        """Whether all limits are second-order cones: e does not depend on the load, and p = 2."""
        return bool((self.load_exponent == 0.0).all() and (self.norm_exponent == 2.0).all())

    @property
    def surfaces(self) -> tuple[LimitSurface, ...]:
        """What each contact bears."""
        columns = [getattr(self, name).tolist() for name in _SURFACE]
        return tuple(LimitSurface(*values) for values in zip(*columns, strict=True))

    @property
    def grasp_map(self) -> FloatArray:
        """G, shape (6, 4 n): wrench about the object's origin = G (w_1, ..., w_n)."""
        n = len(self)
        out = np.zeros((6, n, 4))
        out[:3, :, :3] = self.frames.transpose(1, 0, 2)
        out[3:, :, :3] = np.cross(self.positions[:, :, None], self.frames, axis=1).transpose(1, 0, 2)
        out[3:, :, 3] = self.frames[:, :, 0].T
        return out.reshape(6, 4 * n)

    def chosen(self, which: Sequence[int]) -> GraspContacts:
        """Return the grasp by some of its contacts."""
        index = list(which)
        kept = {each.name: getattr(self, each.name) for each in fields(self)}
        part: Any = {name: None if value is None else value[index] for name, value in kept.items()}
        return GraspContacts(**part)

    def margins(self, forces: FloatArray) -> FloatArray:
        """Return mu f_n - |(f_t, tau / e)|_p of each contact, shape (n,) [N]: below 0 it slips or spins.

        Args:
            forces: Shape (n, 4) [N, N, N, N m].
        """
        normal, p = forces[:, 0], self.norm_exponent
        force, length = np.hypot(forces[:, 1], forces[:, 2]), self.spin_length
        if (self.load_exponent > 0.0).any():
            grown = np.maximum(normal, 0.0) ** self.load_exponent
            length = length * np.where(self.load_exponent > 0.0, grown, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):  # a contact that does not press has no size
            torque = np.where(forces[:, 3] == 0.0, 0.0, np.abs(forces[:, 3]) / length)
        if (p == 2.0).all():
            return np.asarray(self.friction * normal - np.hypot(force, torque))
        largest = np.maximum(np.maximum(force, torque), _LEAST)
        return np.asarray(
            self.friction * normal - largest * ((force / largest) ** p + (torque / largest) ** p) ** (1.0 / p)
        )


_LEAST = 1e-300
"""[N] Keeps quotients of zeros finite."""

_SURFACE = ("friction", "spin_length", "load_exponent", "norm_exponent")


_EACH = ("friction", "spin_length", "force_min", "force_max", "load_exponent", "norm_exponent")
"""As `contact_faults` numbers them."""

_UNITS = {"spin_length": "m", "force_min": "N", "force_max": "N"}


def _array(name: str, value: object) -> FloatArray:
    return np.ascontiguousarray(numbers(name, value))  # of one memory layout, so that nothing is compiled twice


def _finite(name: str, array: FloatArray, unit: str) -> None:
    if not np.isfinite(array).all():
        raise InvalidValueError(f"{name}: every entry must be finite" + (f" [{unit}]" if unit else ""))


def _per_contact(name: str, value: object, n: int) -> FloatArray:
    array = numbers(name, value)
    if array.shape not in ((), (n,)):
        raise InvalidValueError(f"{name} has shape {array.shape}: must be a number or ({n},), one per contact")
    return array


def _refuse(places: FloatArray, axes: FloatArray, each: dict[str, FloatArray]) -> None:
    """Say what is wrong with contacts that have a fault."""
    _finite("positions", places, "m")
    _finite("frames", axes, "")
    _check_rotations(axes)
    for name, values in each.items():
        if np.isnan(values).any():
            unit = f" [{_UNITS[name]}]" if name in _UNITS else ""
            raise InvalidValueError(f"{name} = {values.tolist()}: not a number" + unit)
    for i in range(len(places)):  # the limit surface knows what is allowed
        try:
            LimitSurface(*(float(each[name][i]) for name in _SURFACE))
        except InvalidValueError as error:
            raise InvalidValueError(f"contact {i}: {error}") from None
    _check_forces(each["force_min"], each["force_max"])


def _check_forces(least: FloatArray, most: FloatArray) -> None:
    for i in np.flatnonzero(~((least >= 0.0) & np.isfinite(least))):
        raise InvalidValueError(
            f"contact {i}: force_min = {least[i]:g} N: must be finite and at least 0: contacts only push"
        )
    for i in np.flatnonzero(~(least <= most)):
        raise InvalidValueError(
            f"contact {i}: force_min = {least[i]:g} N lies above force_max = {most[i]:g} N: no force is allowed"
        )


def _check_rotations(frames: FloatArray) -> None:
    defect = np.abs(frames.transpose(0, 2, 1) @ frames - np.eye(3)).max(axis=(1, 2))
    for i in np.flatnonzero(defect > ORTHONORMAL_TOLERANCE):
        raise InvalidValueError(
            f"contact {i}: its frame is not orthonormal: the largest entry of R'R - I is {defect[i]:.1e}, the "
            f"limit is {ORTHONORMAL_TOLERANCE:.0e}; give the columns n, t1, t2 in full precision"
        )
    for i in np.flatnonzero(np.linalg.det(frames) < 0.0):
        raise InvalidValueError(f"contact {i}: its frame is a reflection (determinant -1): t2 must be n x t1")


def _actuators(maps: object, limits: object, n: int) -> tuple[FloatArray | None, FloatArray | None]:
    if maps is None and limits is None:
        return None, None
    if maps is None or limits is None:
        raise InvalidValueError("actuator_map and actuator_limit belong together: give both or none")
    found, most = numbers("actuator_map", maps), numbers("actuator_limit", limits)
    _finite("actuator_map", found, "")
    if found.ndim != 3 or found.shape[0] != n or found.shape[2] != 4:
        raise InvalidValueError(f"actuator_map has shape {found.shape}: must be ({n}, k, 4)")
    if most.shape != found.shape[:2]:
        raise InvalidValueError(
            f"actuator_limit has shape {most.shape}: must be {found.shape[:2]}, as actuator_map"
        )
    if not (most > 0.0).all():
        raise InvalidValueError("actuator_limit: every entry must be above 0")
    return found, most
