"""From wrenches to contacts: the public face of contact sensing.

`Contact.condition` is by how much a relative error of force and moment is amplified in the centroid c, each of
the three relative to its own size, with moments and places about the tip's centre. It is about the Frobenius
norm of dc/d(f, m), in units of |f| and |m|, over |c|, and within a factor of 2 of the largest amplification
(`python benchmarks/contact_solutions.py --only condition`: 0.7 to 1.4 times it); below 1 at the end of a slender
tip. The size of an open quadric is added to |c|, which vanishes at its apex. It tells what errors of the
*sensor* do: the solver itself adds a few units in the last place, whatever the condition.

Wrenches are solved as long as the part of the force that the surface can take up is more than about 1e-150 of the
wrench; beyond, squares may leave float64, and the status then is INVALID. Grazing is resolved to condition numbers
of about 1e15.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Self

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.contact import Contact, ContactModel, Contacts, contact_of
from palpate.sensing.solve import solve_on
from palpate.surfaces.compliant import CompliantTip
from palpate.surfaces.composite import Composite
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.open_quadric import OpenQuadric
from palpate.surfaces.quadric import CenteredQuadric

_IS_HARD = {"soft": False, "hard": True}
_FLOAT64 = np.dtype(np.float64)
_empty, _contiguous = np.empty, np.ascontiguousarray  # to look them up takes as long as they do
_ONE, _NEXT = (6,), (8,)
"""Shape and strides of a wrench."""
_KEPT = 64
"""Surfaces whose solvers are kept for `contact_from_wrench`; a new one takes some 10 us."""


Surface = CenteredQuadric | OpenQuadric | Composite | Implicit | CompliantTip
"""Every kind of fingertip; controllers cannot tell them apart."""


class Solver:
    """The contacts of one fingertip, for loops: what can be prepared is, and compiled.

    Attributes:
        surface: The fingertip, in the sensor frame.
        model: "soft" or "hard", see `contact_from_wrench`.
    """

    __slots__ = ("_hard", "_solve", "_status", "model", "surface")

    def __init__(self, surface: Surface, model: ContactModel = "soft") -> None:
        """Take the fingertip and how it touches.

        Raises:
            InvalidValueError: No such model, or no solver for this kind of surface.
        """
        self.surface, self.model = surface, model
        self._hard = _hard(model)
        self._solve = solve_on(surface)
        self._status = np.empty(1, np.int8)  # written, and not read: threads may share a solver

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
        """What is compiled cannot be pickled; it is found again."""
        return type(self), (self.surface, self.model)

    def __call__(self, wrench: npt.ArrayLike) -> Contact:
        """Return the contact that explains a wrench, see `contact_from_wrench`.

        Raises:
            InvalidValueError: The wrench is not six numbers.
        """
        if type(wrench) is not np.ndarray or wrench.dtype is not _FLOAT64 or wrench.shape != _ONE:
            wrench = _six(wrench)
        if wrench.strides != _NEXT:
            wrench = _contiguous(wrench)
        result = _empty(15)
        found = self._solve(wrench, self._hard, result, self._status)
        return contact_of(result, *found)

    def reading(self, wrench: FloatArray) -> Callable[[], Contact]:
        """Return what solves whatever stands in an array at each call: for loops that write it anew every period.

        Args:
            wrench: See `contact_from_wrench`; contiguous, float64, shape (6,).

        Raises:
            InvalidValueError: It is not.
        """
        if type(wrench) is not np.ndarray or (wrench.dtype, wrench.shape, wrench.strides) != (
            _FLOAT64,
            _ONE,
            _NEXT,
        ):
            raise InvalidValueError("wrench must be a contiguous array of float64, shape (6,)")
        solve, hard, status = self._solve, self._hard, self._status

        def contact() -> Contact:
            result = _empty(15)
            return contact_of(result, *solve(wrench, hard, result, status))

        return contact

    def batch(self, wrenches: npt.ArrayLike) -> Contacts:
        """Return the contacts that explain many wrenches, see `contacts_from_wrenches`.

        Raises:
            InvalidValueError: The wrenches are not n rows of six numbers.
        """
        rows = np.ascontiguousarray(_numbers(wrenches, "wrenches"))
        if rows.ndim != 2 or rows.shape[1] != 6:
            raise InvalidValueError(f"wrenches has shape {rows.shape}: must be (n, 6), force then moment in a row")
        n = len(rows)
        stride = -(-n // 8) * 8  # every field begins on a cache line, as the kernels' widest stores want it
        result = _on_cache_line(15 * stride)
        status = np.empty(n, np.int8)
        self._solve(rows.reshape(-1), self._hard, result, status)

        def vectors(field: int) -> FloatArray:
            return result[3 * field * stride :][: 3 * n].reshape(n, 3)

        def scalars(field: int) -> FloatArray:
            return result[(12 + field) * stride :][:n]

        return Contacts(
            centroid=vectors(0),
            normal=vectors(1),
            force=vectors(2),
            tangential_force=vectors(3),
            normal_force=scalars(0),
            spin_torque=scalars(1),
            condition=scalars(2),
            status=status,
        )


def contact_from_wrench(surface: Surface, wrench: npt.ArrayLike, model: ContactModel = "soft") -> Contact:
    """Return the contact that explains a wrench (Bicchi 1990, sections 4 and 5).

    Args:
        surface: The fingertip, in the sensor frame.
        wrench: (f, m), what the object exerts on the finger: force [N], then moment [N m] about the sensor
            frame's origin, shape (6,).
        model: "soft" solves for the contact centroid and spin torque, exactly; "hard" is the wrench-axis
            method, which neglects spin, and reports as spin torque the normal part of the moment along the
            wrench axis (eq. 8).

    Returns:
        The contact in the sensor frame. Where there is none, its status says why.

    Raises:
        InvalidValueError: The wrench is not six numbers, or there is no such model.
    """
    return _solver(surface, model)(wrench)


def contacts_from_wrenches(surface: Surface, wrenches: npt.ArrayLike, model: ContactModel = "soft") -> Contacts:
    """Return the contacts that explain many wrenches; each is bit for bit that of `contact_from_wrench`.

    Args:
        surface: The fingertip, in the sensor frame.
        wrenches: As in `contact_from_wrench`, shape (n, 6).
        model: As in `contact_from_wrench`.

    Returns:
        n contacts as a structure of arrays.

    Raises:
        InvalidValueError: The wrenches are not n rows of six numbers, or there is no such model.
    """
    return _solver(surface, model).batch(wrenches)


_cached = lru_cache(maxsize=_KEPT)(Solver)


def _solver(surface: Surface, model: ContactModel) -> Solver:
    try:
        return _cached(surface, model)
    except TypeError:  # what cannot be looked up is no surface or no model
        return Solver(surface, model)


def _on_cache_line(size: int) -> FloatArray:
    """Return an uninitialised array that begins on a 64-byte boundary."""
    raw = np.empty(size + 7)
    first = -(raw.ctypes.data // 8) % 8
    return raw[first : first + size]


def _hard(model: ContactModel) -> bool:
    try:
        return _IS_HARD[model]
    except (KeyError, TypeError):
        raise InvalidValueError(f'model = {model!r}: must be "soft" or "hard"') from None


def _six(wrench: npt.ArrayLike) -> FloatArray:
    row = _numbers(wrench, "wrench")
    if row.shape != _ONE:
        raise InvalidValueError(f"wrench has shape {row.shape}: must be (6,), force then moment")
    return row


def _numbers(value: npt.ArrayLike, name: str) -> FloatArray:
    if type(value) is np.ndarray and value.dtype == np.float64:
        return value
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu" and array.size:
            raise TypeError
        return array.astype(np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name} = {value!r}: must be real numbers in a regular array") from None
