"""A wrench through the library, the true contact in two floats per number, and how far apart they are."""

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

import palpate
from reference import quadric

INF = math.inf
UNDERFLOW = 2.0**-1022
LARGEST = 1e307
BEYOND = "BEYOND"  # a contact that float64 cannot hold
FIELDS = ("centroid", "normal", "normal_force", "tangential_force", "spin_torque")
MEASURED = (*FIELDS, "spin_torque of moment")  # the last relative to |q| + |f| times the length around
NUMBERS = 12  # centroid, normal, normal force, tangential force, spin torque; kappa


@dataclass(frozen=True)
class Case:
    """One wrench on one surface, replayable from its repr."""

    kind: str  # "Sphere", "Ellipsoid", "Cylinder", "Plane"
    size: Any  # radius, three semi-axes, radius, distance
    wrench: tuple[float, ...]
    center: tuple[float, ...] = (0.0, 0.0, 0.0)
    rotation: tuple[tuple[float, ...], ...] = quadric.IDENTITY
    model: str = "soft"

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """The three semi-axes, infinite where the surface is."""
        if self.kind == "Ellipsoid":
            a, b, c = self.size
            return float(a), float(b), float(c)
        r = float(self.size)
        return {"Sphere": (r, r, r), "Cylinder": (r, r, INF), "Plane": (INF, INF, r)}[self.kind]

    def surface(self) -> Any:
        """Return the surface, as the library has it."""
        return _surface(self.kind, self.size, self.center, self.rotation)

    def got(self) -> Any:
        """Return the library's contact."""
        return palpate.contact_from_wrench(self.surface(), np.array(self.wrench), model=self.model)

    def wanted(self) -> quadric.Solution:
        """Return the true contact."""
        return quadric.solve(
            self.semi_axes, self.wrench, center=self.center, rotation=self.rotation, model=self.model
        )


@functools.lru_cache(maxsize=1024)
def _surface(kind: str, size: Any, center: Any, rotation: Any) -> Any:
    return getattr(palpate, kind)(size, center=center, rotation=rotation)


@dataclass(frozen=True)
class Answer:
    """A true contact: its status, and numbers (12,) as floats and the small shares of them that are missing."""

    status: str
    numbers: np.ndarray
    rest: np.ndarray

    @classmethod
    def rounded(cls, found: quadric.Solution) -> "Answer":
        """Return a solution of many digits in 77 bits."""
        if found.status != quadric.OK:
            return cls(found.status, np.full(NUMBERS, np.nan), np.zeros(NUMBERS, np.float32))
        exact = (
            *found.centroid, *found.normal, found.normal_force, *found.tangential_force, found.spin_torque,
            INF if found.kappa is None else found.kappa,
        )  # fmt: skip
        numbers = np.array([float(x) for x in exact])
        if not (np.abs(numbers[[0, 1, 2, 6, 7, 8, 9, 10]]) < LARGEST).all():
            return cls(BEYOND, numbers, np.zeros(NUMBERS, np.float32))
        known = np.isfinite(numbers) & (numbers != 0.0)
        rest = [float((x - y) / y) if ok else 0.0 for x, y, ok in zip(exact, numbers.tolist(), known, strict=True)]
        return cls(found.status, numbers, np.array(rest, np.float32))

    @property
    def kappa(self) -> float:
        """Condition number where the ellipsoid is a sphere; infinite without one."""
        return float(self.numbers[-1]) if self.status == quadric.OK else INF


@dataclass(frozen=True)
class Measured:
    """Errors of one case by field, infinite where the status is wrong; kappa and the reported condition."""

    case: Case
    status: str
    wanted_status: str
    errors: dict[str, float]
    kappa: float
    condition: float


def measure(case: Case, wanted: Answer) -> Measured:
    """Return the errors of the library on one case.

    The centroid's is relative to its own length for a surface in the sensor frame, and to the largest of |c|,
    |center| and the smallest semi-axis for one that was moved.
    """
    got = case.got()
    status = palpate.ContactStatus(got.status).name
    errors = dict.fromkeys(MEASURED, 0.0 if status == wanted.status else INF)
    if status == wanted.status == quadric.OK:
        found = np.hstack([getattr(got, name) for name in FIELDS])
        off = (found - wanted.numbers[:-1]) - wanted.numbers[:-1] * wanted.rest[:-1].astype(float)
        off = np.where(np.isfinite(found), np.abs(off), INF)
        reach, force = math.hypot(*wanted.numbers[:3]), math.hypot(*case.wrench[:3])
        if case.center != quadric.ORIGIN or case.rotation != quadric.IDENTITY:
            reach = max(reach, math.hypot(*case.center), min(case.semi_axes))
        press, spin = abs(wanted.numbers[6]), abs(wanted.numbers[10])
        errors = {
            "centroid": math.hypot(*off[:3]) / reach,
            "normal": math.hypot(*off[3:6]),
            "normal_force": _relative(off[6], press),
            "tangential_force": math.hypot(*off[7:10]) / force,
            "spin_torque": _relative(off[10], spin),
            "spin_torque of moment": off[10] / (spin + force * reach),
        }
    return Measured(case, status, wanted.status, errors, wanted.kappa, float(got.condition))


def _relative(off: float, size: float) -> float:
    if size < UNDERFLOW:  # below: only a fixed number of bits is left, allow four of the last one
        return 0.0 if off <= 4 * 5e-324 else INF
    return off / size
