"""Linear limits and cones that tie several contacts together, in newtons and newton metres."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, numbers

__all__ = ["CoupledLimits", "actuator_limits", "checked_shared_actuators", "shared_limits"]


@dataclass(frozen=True, slots=True, eq=False)
class CoupledLimits:
    """A w = b, and h - G w in blocks of cones, of all forces w = (w_1, ..., w_n), shape (4 n,).

    Attributes:
        A: Shape (e, 4 n).
        b: Shape (e,).
        G: Shape (m, 4 n).
        h: Shape (m,).
        sizes: Rows of each block: 1 for a number >= 0, more for (s0, s1..) with s0 >= |(s1..)|.
        names: What a message calls each equation, then each block.
    """

    A: FloatArray
    b: FloatArray
    G: FloatArray
    h: FloatArray
    sizes: tuple[int, ...]
    names: tuple[str, ...]

    @classmethod
    def none(cls, contacts: int) -> CoupledLimits:
        """Return no limits."""
        return cls.of(contacts, [], [])

    @classmethod
    def of(
        cls,
        contacts: int,
        equations: Sequence[tuple[FloatArray, float, str]],
        blocks: Sequence[tuple[FloatArray, FloatArray, str]],
    ) -> CoupledLimits:
        """Put together equations (a, b, name) and blocks (G, h, name)."""
        n = 4 * contacts
        return cls(
            np.array([a for a, _, _ in equations]).reshape(-1, n),
            np.array([b for _, b, _ in equations]),
            np.concatenate([np.zeros((0, n)), *(G for G, _, _ in blocks)]),
            np.concatenate([np.zeros(0), *(h for _, h, _ in blocks)]),
            tuple(len(h) for _, h, _ in blocks),
            tuple(name for _, _, name in [*equations, *blocks]),
        )

    def and_also(self, other: CoupledLimits) -> CoupledLimits:
        """Return both."""
        e, o = len(self.b), len(other.b)
        return CoupledLimits(
            np.concatenate([self.A, other.A]),
            np.concatenate([self.b, other.b]),
            np.concatenate([self.G, other.G]),
            np.concatenate([self.h, other.h]),
            self.sizes + other.sizes,
            self.names[:e] + other.names[:o] + self.names[e:] + other.names[o:],
        )

    def chosen(self, which: Collection[int]) -> CoupledLimits:
        """Return some of them, as `names` counts."""
        e = len(self.b)
        equations = [k for k in range(e) if k in which]
        blocks = [k for k in range(len(self.sizes)) if e + k in which]
        ends = np.cumsum([0, *self.sizes])
        rows = [i for k in blocks for i in range(ends[k], ends[k + 1])]
        names = tuple(self.names[k] for k in [*equations, *(e + k for k in blocks)])
        sizes = tuple(self.sizes[k] for k in blocks)
        return CoupledLimits(self.A[equations], self.b[equations], self.G[rows], self.h[rows], sizes, names)

    def implied(self, y: FloatArray, z: FloatArray) -> tuple[list[Fraction], Fraction]:
        """Return a and b with a . w <= b for all w within the limits, exactly.

        Args:
            y: Multipliers of the equations, shape (e,).
            z: Multipliers of the rows of G, shape (m,); what is not in the dual cones is moved there.
        """
        weights, first = [Fraction(each) for each in z.tolist()], 0
        for size in self.sizes:
            # rounded up: the length itself is no fraction
            rest = float(np.linalg.norm(z[first + 1 : first + size])) * (1.0 + 1e-14)
            weights[first] = max(weights[first], Fraction(rest))
            first += size
        rows = [*zip(map(Fraction, y.tolist()), self.A.tolist(), self.b.tolist(), strict=True)]
        rows += zip(weights, self.G.tolist(), self.h.tolist(), strict=True)
        a, b = [Fraction(0)] * self.G.shape[1], Fraction(0)
        for weight, row, limit in rows:
            if weight:
                a = [
                    each + weight * Fraction(entry) if entry else each for each, entry in zip(a, row, strict=True)
                ]
                b += weight * Fraction(limit)
        return a, b


def checked_shared_actuators(given: Any) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return (A, lower, upper) as arrays (k, 4 n), (k,) and (k,).

    Raises:
        InvalidValueError: Not three arrays that fit, or limits that exclude each other.
    """
    if given is None:
        return None
    try:
        maps, low, high = given
    except (TypeError, ValueError):
        raise InvalidValueError(
            "shared_actuators: must be (A, lower, upper), for lower <= A w <= upper with w = (w_1, ..., w_n)"
        ) from None
    rows = numbers("shared_actuators: A", maps)
    if rows.ndim != 2 or not rows.shape[0] or rows.shape[1] % 4:
        raise InvalidValueError(
            f"shared_actuators: A has shape {rows.shape}: must be (k, 4 n), a row per actuator, "
            "(f_n, f_t1, f_t2, tau_n) of each contact in turn"
        )
    if not np.isfinite(rows).all():
        raise InvalidValueError("shared_actuators: every entry of A must be finite")
    limits = []
    for name, value in (("lower", low), ("upper", high)):
        array = numbers(f"shared_actuators: {name}", value)
        if array.shape not in ((), (len(rows),)):
            raise InvalidValueError(
                f"shared_actuators: {name} has shape {array.shape}: must be a number or ({len(rows)},)"
            )
        limits.append(np.broadcast_to(array, (len(rows),)).copy())
    lower, upper = limits
    wrong = ~((lower <= upper) & (lower < np.inf) & (upper > -np.inf))
    if wrong.any():
        k = int(np.flatnonzero(wrong)[0])
        raise InvalidValueError(
            f"shared_actuators: actuator {k} has lower = {lower[k]:g} and upper = {upper[k]:g}: lower must not be "
            "above upper; infinity for none"
        )
    return rows, lower, upper


def shared_limits(given: tuple[FloatArray, FloatArray, FloatArray] | None, contacts: int) -> CoupledLimits:
    """Return lower <= A w <= upper as limits.

    Raises:
        InvalidValueError: A is for another number of contacts.
    """
    if given is None:
        return CoupledLimits.none(contacts)
    rows, lower, upper = given
    if rows.shape[1] != 4 * contacts:
        raise InvalidValueError(
            f"shared_actuators: A has shape {rows.shape}: the grasp has {contacts} contacts, so it must be "
            f"({len(rows)}, {4 * contacts})"
        )
    return _between(rows, lower, upper, [f"shared_actuators[{k}]" for k in range(len(rows))], contacts)


def actuator_limits(maps: FloatArray | None, limits: FloatArray | None, contacts: int) -> CoupledLimits:
    """Return the limits |J_i w_i| <= tau_max of actuators behind each contact, shapes (n, k, 4) and (n, k)."""
    if maps is None or limits is None:
        return CoupledLimits.none(contacts)
    n, k = limits.shape
    rows = np.zeros((n, k, n, 4))
    rows[np.arange(n), :, np.arange(n)] = maps
    names = [f"actuator {j} of contact {i}" for i in range(n) for j in range(k)]
    return _between(rows.reshape(n * k, 4 * n), -limits.ravel(), limits.ravel(), names, contacts)


def _between(
    rows: FloatArray, lower: FloatArray, upper: FloatArray, names: Sequence[str], contacts: int
) -> CoupledLimits:
    equations, blocks = [], []
    for row, low, high, name in zip(rows, lower.tolist(), upper.tolist(), names, strict=True):
        if low == high:
            equations.append((row, low, name))
            continue
        if high < np.inf:
            blocks.append((row[None], np.array([high]), f"{name}, upper"))
        if low > -np.inf:
            blocks.append((-row[None], np.array([-low]), f"{name}, lower"))
    return CoupledLimits.of(contacts, equations, blocks)
