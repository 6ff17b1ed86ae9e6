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

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.contact import Contact, ContactModel, Contacts, ContactStatus
from palpate.sensing.solve import solve
from palpate.surfaces.compliant import CompliantTip
from palpate.surfaces.composite import Composite
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.open_quadric import OpenQuadric
from palpate.surfaces.quadric import CenteredQuadric

_IS_HARD = {"soft": False, "hard": True}
_STATUS = tuple(ContactStatus)


Surface = CenteredQuadric | OpenQuadric | Composite | Implicit | CompliantTip
"""Every kind of fingertip; controllers cannot tell them apart."""


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
    row = _writeable(_numbers(wrench, "wrench"))
    if row.shape != (6,):
        raise InvalidValueError(f"wrench has shape {row.shape}: must be (6,), force then moment")
    result = np.empty(15)
    status = np.empty(1, np.int8)
    solve(surface, row.reshape(1, 6), _hard(model), result, status)
    result.setflags(write=False)
    normal_force, spin_torque, condition = result[12:].tolist()
    return Contact(
        result[0:3],
        result[3:6],
        result[6:9],
        normal_force,
        result[9:12],
        spin_torque,
        condition,
        _STATUS[status.item()],
    )


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
    rows = _writeable(_numbers(wrenches, "wrenches"))
    if rows.ndim != 2 or rows.shape[1] != 6:
        raise InvalidValueError(f"wrenches has shape {rows.shape}: must be (n, 6), force then moment in each row")
    n = len(rows)
    stride = -(-n // 8) * 8  # every field begins on a cache line, as the kernels' widest stores want it
    result = _on_cache_line(15 * stride)
    status = np.empty(n, np.int8)
    solve(surface, rows, _hard(model), result, status)

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


def _writeable(array: FloatArray) -> FloatArray:
    """Return it contiguous, a copy if it is read-only: a compiled solver would be compiled anew for that."""
    array = np.ascontiguousarray(array)
    return array if array.flags.writeable else array.copy()


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
