"""Put a wrench through the library and through the reference, and say how far apart they are."""

import functools
import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpmath import mp, mpf

import palpate
from reference import quadric

INF = math.inf
UNDERFLOW = 2.0**-1022
FIELDS = ("centroid", "normal", "normal_force", "tangential_force", "spin_torque")
MEASURED = (*FIELDS, "spin_torque of moment")  # the last relative to |q| + |f| times the length around


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
        """The surface, as the library knows it."""
        return _surface(self.kind, self.size, self.center, self.rotation)

    def got(self) -> Any:
        """What the library says."""
        return palpate.contact_from_wrench(self.surface(), np.array(self.wrench), model=self.model)

    def wanted(self) -> quadric.Solution:
        """What is true."""
        return quadric.solve(
            self.semi_axes, self.wrench, center=self.center, rotation=self.rotation, model=self.model
        )


@functools.lru_cache(maxsize=1024)
def _surface(kind: str, size: Any, center: Any, rotation: Any) -> Any:
    return getattr(palpate, kind)(size, center=center, rotation=rotation)


@dataclass(frozen=True)
class Measured:
    """Errors of one case by field, infinite where the status is wrong; kappa and the reported condition."""

    case: Case
    status: str
    wanted_status: str
    errors: dict[str, float]
    kappa: float
    condition: float


def measure(case: Case, wanted: quadric.Solution | None = None) -> Measured:
    """Errors of the library on one case.

    The centroid's is relative to its own length for a surface in the sensor frame, and to the largest of |c|,
    |center| and the smallest semi-axis for one that was moved.
    """
    got = case.got()
    wanted = wanted or case.wanted()
    status = palpate.ContactStatus(got.status).name
    kappa = INF if wanted.kappa is None else float(wanted.kappa)
    if status != wanted.status or status != quadric.OK:
        worst = 0.0 if status == wanted.status else INF
        return Measured(case, status, wanted.status, dict.fromkeys(MEASURED, worst), kappa, float(got.condition))
    with mp.workprec(quadric.PRECISION):
        reach = quadric.norm(list(wanted.centroid))
        if case.center != quadric.ORIGIN or case.rotation != quadric.IDENTITY:
            reach = max(reach, quadric.norm([mpf(x) for x in case.center]), mpf(min(case.semi_axes)))
        force = quadric.norm([mpf(x) for x in case.wrench[:3]])
        errors = {
            "centroid": _ratio(got.centroid, wanted.centroid, reach),
            "normal": _ratio(got.normal, wanted.normal, mpf(1)),
            "normal_force": _scalar(got.normal_force, wanted.normal_force),
            "tangential_force": _ratio(got.tangential_force, wanted.tangential_force, force),
            "spin_torque": _scalar(got.spin_torque, wanted.spin_torque),
        }
        moment = abs(wanted.spin_torque) + force * reach
        off = abs(mpf(got.spin_torque) - wanted.spin_torque) / moment
        errors["spin_torque of moment"] = float(off) if math.isfinite(got.spin_torque) else INF
    return Measured(case, status, wanted.status, errors, kappa, float(got.condition))


def _ratio(got: Any, wanted: quadric.Vector, scale: mpf) -> float:
    if not np.isfinite(got).all():
        return INF
    return float(quadric.distance(got, wanted) / scale)


def _scalar(got: float, wanted: mpf) -> float:
    if not math.isfinite(got):
        return INF
    error = abs(mpf(float(got)) - wanted)
    if abs(wanted) < UNDERFLOW:  # below: only a fixed number of bits is left, allow four of the last one
        return 0.0 if error <= 4 * mpf(5e-324) else INF
    return float(error / abs(wanted))


def sample(name: str, make: Callable[[np.random.Generator], Case], count: int) -> list[Case]:
    """The cases of a category: the seed is its name."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    return [make(rng) for _ in range(count)]
