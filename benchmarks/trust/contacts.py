"""Contacts and their 95 % regions, as `contacts_uncertainties` gives them.

A wrench of a contact anywhere on a tip, with noise, of a tip that is not quite the assumed one: place, friction,
normal force and spin against their covariance, vectors in the tangent plane.
"""

import dataclasses
from collections.abc import Callable

import numpy as np
from contact_solutions import R, Rng, directions, irregular, wrenches_at
from trust.study import Case, Run, Study

from palpate import (
    Capsule,
    CompliantTip,
    ContactStatus,
    Ellipsoid,
    Sphere,
    Superellipsoid,
    contacts_from_wrenches,
)
from palpate.errors import FloatArray
from palpate.sensing.contact import Contacts
from palpate.sensing.solver import Surface
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty
from palpate.sensing.uncertainty import UncertaintyStatus, contacts_uncertainties, white_noise

SURE = {1: 3.841, 2: 5.991}
"""95 % of chi squared, by degrees of freedom."""

QUANTITIES = {"centroid": 2, "tangential_force": 2, "normal_force": 1, "spin_torque": 1}
"""Judged quantities and their degrees of freedom: vectors count in the tangent plane."""


@dataclasses.dataclass(frozen=True)
class Touch:
    """Wrenches of one tip, taken for those of another.

    Attributes:
        tip: Draws the assumed tip and the real one.
        noise: Noise of a force component relative to the normal force; times the radius, that of a moment.
        slope: Largest tangential over normal force.
        uncertain: Stated uncertainty of the tip.
    """

    tip: Callable[[Rng], tuple[Surface, Surface]]
    noise: float = 0.01
    slope: float = 1.0
    uncertain: TipUncertainty = EXACT


def same(kind: Callable[[Rng], Surface]) -> Callable[[Rng], tuple[Surface, Surface]]:
    """Return tips that are as assumed."""

    def drawn(rng: Rng) -> tuple[Surface, Surface]:
        tip = kind(rng)
        return tip, tip

    return drawn


def ball(rng: Rng) -> Surface:
    """Return a sphere beside the sensor."""
    return Sphere(R, center=R * rng.uniform(-1, 1, 3))


def egg(rng: Rng) -> Surface:
    """Return an ellipsoid beside the sensor."""
    return Ellipsoid(tuple(R * np.exp(rng.uniform(-0.35, 0.35, 3))), center=R * rng.uniform(-1, 1, 3))


def larger(rng: Rng) -> tuple[Surface, Surface]:
    """Return spheres of which the real one is 0.1 mm larger."""
    center = R * rng.uniform(-1, 1, 3)
    return Sphere(R, center=center), Sphere(R + 1e-4, center=center)


def moved(rng: Rng) -> tuple[Surface, Surface]:
    """Return ellipsoids of which the real one sits 0.5 mm aside: the sensor's origin is elsewhere."""
    tip = egg(rng)
    assert isinstance(tip, Ellipsoid)
    return tip, dataclasses.replace(tip, center=tip.center + 5e-4 * directions(rng, 1)[0])


def softer(rng: Rng) -> tuple[Surface, Surface]:
    """Return compliant spheres, the real one softer by a fifth."""
    tip = ball(rng)
    assert isinstance(tip, Sphere)
    return CompliantTip(tip, 2e3), CompliantTip(tip, 1.6e3)


COARSE = irregular(300, (0.008, 0.01, 0.012), 2.0, 5)


def inside(found: Contacts, true: Contacts, covariance: FloatArray, name: str) -> FloatArray:
    """Return squared distances of a quantity over its covariance, over the tangent plane for vectors."""
    off = getattr(found, name) - getattr(true, name)
    if off.ndim == 1:
        return np.asarray(off**2 / covariance)
    n = found.normal
    first = np.cross(n, np.where(np.abs(n[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    T = np.stack([first, np.cross(n, first)], axis=1)
    S, x = T @ covariance @ T.transpose(0, 2, 1), np.einsum("iak,ik->ia", T, off)
    return np.einsum("ia,ia->i", x, np.linalg.solve(S, x[:, :, None])[:, :, 0])


def middle(tip: Surface) -> FloatArray:
    """Return a point inside a tip."""
    return np.asarray(tip.centers[-1] if hasattr(tip, "centers") else tip.center)


def touched(case: Touch, seed: int) -> Run:
    """Take one noisy wrench."""
    rng = np.random.default_rng(seed)
    while True:  # some directions lead past the tip
        tip, real = case.tip(rng)
        toward = directions(rng, 1)
        toward[0, 2] = abs(toward[0, 2])
        at = contacts_from_wrenches(real, np.hstack([-toward, np.cross(middle(real), -toward)]))
        slope, spin = rng.uniform(0.0, case.slope, 1), R * rng.uniform(-0.3, 0.3, 1)
        if at.status[0] != ContactStatus.OK:
            continue
        wrench = wrenches_at(at.centroid, at.normal, np.ones(1), slope, spin, rng)
        true = contacts_from_wrenches(real, wrench)
        if true.status[0] == ContactStatus.OK:
            break
    noise = white_noise(case.noise, R * case.noise)
    found = contacts_from_wrenches(tip, wrench + rng.normal(size=(1, 6)) * np.sqrt(np.diag(noise)))
    known = contacts_uncertainties(tip, found, noise, case.uncertain)
    if found.status[0] != ContactStatus.OK or known.status[0] != UncertaintyStatus.VALID:
        return Run(ok=False, furthest=0.0, finding="no contact, or not VALID")
    squares = {name: float(inside(found, true, getattr(known, name), name)[0]) for name in QUANTITIES}
    names = "place", "friction", "push", "spin"
    held = (squares[name] <= SURE[degrees] for name, degrees in QUANTITIES.items())
    return Run(True, max(squares.values()) ** 0.5, dict(zip(names, map(float, held), strict=True)))


def case(name: str, *args: object, holds: bool = True, shown: bool = True, **changes: object) -> Case:
    """Return a kind of wrench."""
    touch = Touch(*args, **changes)  # type: ignore[arg-type]
    return Case(name, lambda seed: touched(touch, seed), holds, 5.0 if holds else 1.0, shown)


SIZE, PLACE, SOFT = (
    TipUncertainty.independent(size=1e-4),
    TipUncertainty.independent(position=3e-4),
    TipUncertainty.independent(stiffness=0.2),
)
STUDY = Study(
    "contact",
    (
        *(case(f"noise of {100 * level:g} %", same(egg), level) for level in (0.01, 0.03, 0.07, 0.1, 0.2)),
        case("noise of 40 %", same(egg), 0.4, holds=False),
        case("capsule", same(lambda _: Capsule(0.008, 0.02)), 0.02),
        case("superellipsoid", same(lambda _: Superellipsoid((0.009, 0.009, 0.008), 2.5)), 0.02),
        case("compliant", same(lambda rng: CompliantTip(Sphere(R), 2e3)), 0.02),
        case("mu of 3, noise of 5 %", same(egg), 0.05, 3.0),
        case("grazing, f_t/f_n up to 100", same(egg), 0.01, 100.0, holds=False),
        case("irregular mesh", same(lambda _: COARSE), 0.01),
        case("radius 0.1 mm larger, described", larger, 0.003, 1.0, SIZE, holds=False),
        case("origin 0.5 mm off, described", moved, 0.003, 1.0, PLACE, holds=False),
        case("stiffness 20 % off, described", softer, 0.003, 1.0, SOFT, holds=False),
        case("radius 0.1 mm larger, not described", larger, 0.003, holds=False, shown=False),
        case("origin 0.5 mm off, not described", moved, 0.003, holds=False, shown=False),
    ),
)
