"""Exceptions and the checks that raise them.

Every exception inherits from `PalpateError` and from the built-in that a caller would expect. Every message
names the value, what would have been right, and where it was given.
"""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


class PalpateError(Exception):
    """Base of everything that palpate raises on purpose."""


class InvalidValueError(PalpateError, ValueError):
    """An invalid value; the message names the value, the limit and the remedy."""


class OverrunError(PalpateError, TimeoutError):
    """A control period was over before its work was done."""


class ConcurrentUseError(PalpateError, RuntimeError):
    """Two threads use at once what serves one at a time."""


class LatchedError(PalpateError, RuntimeError):
    """The supervisor has tripped earlier and nobody has reset it."""


class SimulationDivergedError(PalpateError, FloatingPointError):
    """A simulation left the range of anything physical."""


def positive(name: str, value: float, unit: str, *, infinite_allowed: bool = False) -> float:
    """Return `value` as a float if it is a number above zero.

    Args:
        name: What the caller calls it, for the message.
        value: The value to check.
        unit: Its unit, for the message ("m", "N", "" for a ratio).
        infinite_allowed: Whether infinity counts as positive.

    Raises:
        InvalidValueError: Not a number, not above zero, or infinite where that is not allowed.
    """
    number = _real(name, value, unit)
    if number > 0.0 and (infinite_allowed or math.isfinite(number)):
        return number
    wanted = "a number above 0 (infinity allowed)" if infinite_allowed else "a finite number above 0"
    raise InvalidValueError(f"{name} = {value!r} {unit}".rstrip() + f": must be {wanted}")


def not_negative(name: str, value: float, unit: str) -> float:
    """Return `value` as a float if it is finite and at least zero.

    Raises:
        InvalidValueError: Otherwise.
    """
    number = _real(name, value, unit)
    if number >= 0.0 and math.isfinite(number):
        return number
    raise InvalidValueError(f"{name} = {value!r} {unit}".rstrip() + ": must be a finite number, 0 or above")


def check_positive(owner: object, /, **units: str) -> None:
    """Check that the named attributes of `owner` are finite numbers above zero; `units` maps names to units.

    Raises:
        InvalidValueError: If one of the attributes is not.
    """
    for name, unit in units.items():
        positive(name, getattr(owner, name), unit)


def check_not_negative(owner: object, /, **units: str) -> None:
    """Check that the named attributes of `owner` are finite and at least zero; `units` maps names to units.

    Raises:
        InvalidValueError: If one of the attributes is not.
    """
    for name, unit in units.items():
        not_negative(name, getattr(owner, name), unit)


def vector(name: str, value: Sequence[float] | FloatArray, length: int, unit: str) -> FloatArray:
    """Return `value` as a read-only float64 copy of shape (length,), all finite.

    Raises:
        InvalidValueError: Another shape, not numbers, or not finite.
    """
    array = numbers(name, value)
    if array.shape != (length,):
        raise InvalidValueError(f"{name} has shape {array.shape}: must be ({length},) [{unit}]")
    if not np.isfinite(array).all():
        raise InvalidValueError(f"{name} = {array.tolist()}: every entry must be finite [{unit}]")
    array.setflags(write=False)
    return array


ORTHONORMAL_TOLERANCE = 1e-9
"""Largest entry of R'R - I accepted in a rotation: seven digits looser than rounding, far tighter than a
matrix typed by hand with four decimals, which would silently bend the fingertip."""


def rotation_matrix(name: str, value: Sequence[Sequence[float]] | FloatArray) -> FloatArray:
    """Return `value` as a read-only 3x3 rotation matrix.

    Raises:
        InvalidValueError: Another shape, not finite, not orthonormal within `ORTHONORMAL_TOLERANCE`, or a
            reflection.
    """
    matrix = numbers(name, value)
    if matrix.shape != (3, 3):
        raise InvalidValueError(f"{name} has shape {matrix.shape}: must be a rotation matrix (3, 3)")
    if not np.isfinite(matrix).all():
        raise InvalidValueError(f"{name} = {matrix.tolist()}: every entry must be finite")
    defect = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
    if defect > ORTHONORMAL_TOLERANCE:
        raise InvalidValueError(
            f"{name} is not orthonormal: the largest entry of R'R - I is {defect:.1e}, the limit is "
            f"{ORTHONORMAL_TOLERANCE:.0e}; give the columns in full precision"
        )
    if np.linalg.det(matrix) < 0.0:
        raise InvalidValueError(f"{name} is a reflection (determinant -1): flip one column to get a rotation")
    matrix.setflags(write=False)
    return matrix


def shown(value: object, longest: int = 60) -> str:
    """Return the representation of a value for messages, in at most `longest` characters, even if `repr` fails."""
    try:
        text = repr(value)
    except Exception:
        text = f"a {type(value).__name__}"
    return text if len(text) <= longest else text[: longest - 3] + "..."


def _real(name: str, value: float, unit: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(f"{name} = {shown(value)}: must be a number [{unit}]") from None


def numbers(name: str, value: object) -> FloatArray:
    """Return `value` as a float64 copy of whatever shape.

    Raises:
        InvalidValueError: Not numbers in a regular array.
    """
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name} = {value!r}: must be numbers in a regular array") from None
