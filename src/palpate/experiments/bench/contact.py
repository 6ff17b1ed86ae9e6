"""A contact on an ellipsoid from a wrench: palpate, plain formulas, a solver, against contacts that are known.

Bicchi 1990, "Intrinsic contact sensing for soft fingers": equations 5 and 6 (wrench axis, no spin), 16 and 18.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import root

from palpate.errors import FloatArray
from palpate.experiments.bench.study import Row, Study, Tell
from palpate.experiments.bench.turns import timed_in_turns
from palpate.sensing.solver import contact_from_wrench, contacts_from_wrenches
from palpate.surfaces import Ellipsoid

Solve = Callable[[FloatArray], FloatArray]
"""Wrenches (n, 6) [N, N m] to centroids (n, 3) [m]."""

SPUN = 0.75
"""Share of the contacts that bear spin torque."""

ABOUT = (
    "Fingertips with semi-axes from 4 to 40 mm, contacts all over them, a quarter of them without spin torque, "
    "the others with what a soft finger bears. Each wrench is made from a contact, which is therefore known, "
    "but for the rounding of the wrench: errors near 1e-16 are that. The error is that of the centroid over "
    "its distance from the middle. A cost between wrenches that come together is per contact of 1000. Against "
    "180 digits, and for the hard cases (grazing, slender, extreme scale): python benchmarks/contact, in a "
    "checkout."
)


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A fingertip with contacts that are known.

    Attributes:
        semi_axes: Shape (3,) [m].
        centroids: Shape (n, 3) [m].
        wrenches: That the object exerts on the finger, shape (n, 6) [N, N m].
    """

    semi_axes: FloatArray
    centroids: FloatArray
    wrenches: FloatArray


def built(count: int, rng: np.random.Generator) -> Case:
    """Return contacts on one fingertip, made from where they are."""
    semi_axes = 0.004 * 10.0 ** rng.uniform(0.0, 1.0, 3)
    on_ball = rng.normal(size=(count, 3))
    on_ball /= np.linalg.norm(on_ball, axis=1, keepdims=True)
    c = on_ball * semi_axes
    n = c / semi_axes**2
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    pull = rng.normal(size=(count, 3))
    pull -= np.sum(pull * n, axis=1, keepdims=True) * n
    force = rng.uniform(0.3, 5.0, (count, 1))
    f = force * (-n + rng.uniform(0.0, 0.8, (count, 1)) * pull / np.linalg.norm(pull, axis=1, keepdims=True))
    spin = force * rng.uniform(-0.004, 0.004, (count, 1)) * (rng.uniform(size=(count, 1)) < SPUN)
    return Case(semi_axes, c, np.hstack([f, np.cross(c, f) + spin * n]))


def wrench_axis(semi_axes: FloatArray) -> Solve:
    """Return equations 5 and 6: where the wrench axis enters; NaN where it misses, wrong where there is spin."""
    A = 1.0 / semi_axes

    def solve(wrenches: FloatArray) -> FloatArray:
        f, m = wrenches[:, :3], wrenches[:, 3:]
        r0 = np.cross(f, m) / _dot(f, f)
        Af, Ar = A * f, A * r0
        ff, fr = _dot(Af, Af), _dot(Af, Ar)
        return np.asarray(r0 - f * (fr + np.sqrt(fr**2 - ff * (_dot(Ar, Ar) - 1.0))) / ff)

    return solve


def paper(semi_axes: FloatArray) -> Solve:
    """Return equations 16 and 18, and 5 where f.m is exactly zero, as the paper says."""
    R = semi_axes.min()
    A = R / semi_axes
    D = A.prod()
    no_spin = wrench_axis(semi_axes)

    def solve(wrenches: FloatArray) -> FloatArray:
        f, m = wrenches[:, :3], wrenches[:, 3:]
        s, Af, Am = _dot(f, m), A * f, m / A
        ff = _dot(Af, Af)
        sigma = D**2 * _dot(Am, Am) - R**2 * ff
        root_ = np.sqrt(sigma + np.sqrt(sigma**2 + 4.0 * D**2 * R**2 * s**2))
        K = -np.sign(s) / (np.sqrt(2.0) * R * D) * root_
        c = (K**2 * D**2 * m / A**2 + K * np.cross(A**2 * f, m) + s * f) / (K * (K**2 * D**2 + ff))
        zero = s[:, 0] == 0.0
        if zero.any():
            c[zero] = no_spin(wrenches[zero])
        return np.asarray(c)

    return solve


def one_formula(semi_axes: FloatArray) -> Solve:
    """Return the formula that palpate compensates, here plain: nothing in it is singular without spin."""
    A = 1.0 / semi_axes
    D = A.prod()
    C = D / A

    def solve(wrenches: FloatArray) -> FloatArray:
        f, m = wrenches[:, :3], wrenches[:, 3:]
        a, b = C * m, A * f
        bb = _dot(b, b)
        z = -np.sqrt(bb - _dot(a, a) + 2j * D * _dot(f, m))
        g, k = z.real, z.imag
        return np.asarray((k / D * C**2 * m + np.cross(A**2 * f, m) + g * f) / (k**2 + bb))

    return solve


def scipy_root(semi_axes: FloatArray) -> Solve:
    """Return scipy's `root` on equations 13 and 11, from where the force pushes squarely, one wrench at a time."""
    R = semi_axes.min()
    A2 = (R / semi_axes) ** 2

    def solve(wrenches: FloatArray) -> FloatArray:
        found = np.full((len(wrenches), 3), np.nan)
        for i, wrench in enumerate(wrenches):
            size = np.abs(wrench[:3]).max()
            f, m = wrench[:3] / size, wrench[3:] / size / R

            def left(x: FloatArray, f: FloatArray = f, m: FloatArray = m) -> FloatArray:
                c, K = x[:3], x[3]
                return np.append(K * A2 * c + np.cross(c, f) - m, 0.5 * (c @ (A2 * c) - 1.0))

            square = f / A2
            start = np.append(-square / np.sqrt(f @ square), 0.0)
            answer = root(left, start, tol=1e-15)
            found[i] = R * answer.x[:3]
        return found

    return solve


def measure(quick: bool, seed: int, tell: Tell) -> Study:
    """Measure contact sensing."""
    rng = np.random.default_rng(seed)
    cases = [built(50 if quick else 400, rng) for _ in range(8 if quick else 25)]
    timed = built(1000, rng)
    tip = _tip(timed.semi_axes)
    first = timed.wrenches[0]
    makers: dict[str, Callable[[FloatArray], Solve]] = {
        "palpate, many at once": _at_once,
        "palpate, one by one": _one_by_one,
        "one formula, numpy": one_formula,
        "paper, eq. 16 to 18, numpy": paper,
        "wrench axis, numpy": wrench_axis,
        "scipy root": scipy_root,
    }
    few = timed.wrenches[:20]
    tell("contact: time")
    runs = {name: maker(timed.semi_axes) for name, maker in makers.items()}
    calls: dict[str, tuple[Callable[[], object], int]] = {
        name: (partial(solve, timed.wrenches), len(timed.wrenches)) for name, solve in runs.items()
    }
    calls["palpate, many at once"] = (lambda: contacts_from_wrenches(tip, timed.wrenches), len(timed.wrenches))
    calls["palpate, one by one"] = (lambda: contact_from_wrench(tip, first), 1)
    calls["scipy root"] = (lambda: runs["scipy root"](few), len(few))
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that the simpler methods overflow or stall is the point
        taken = timed_in_turns({name: call for name, (call, _) in calls.items()}, 5 if quick else 15)
        rows = []
        for name, maker in makers.items():
            tell(f"contact: error of {name}")
            errors = np.concatenate([_errors(maker, case) for case in cases])
            rows.append(_row(name, taken[name] / calls[name][1], errors))
    return Study(
        "contact",
        "A contact from a wrench",
        ABOUT,
        "time per contact",
        "s",
        "of the centroid, relative",
        "",
        tuple(rows),
    )


def _row(name: str, cost: float, errors: FloatArray) -> Row:
    number = np.isfinite(errors)
    none = int(np.count_nonzero(~number))
    note = f"no answer to {none} of {len(errors)}" if none else ""
    typical = float(np.median(np.where(number, errors, np.inf)))
    return Row(name, name, cost, typical, float(errors[number].max(initial=0.0)), note)


def _errors(maker: Callable[[FloatArray], Solve], case: Case) -> FloatArray:
    found = maker(case.semi_axes)(case.wrenches)
    away = np.linalg.norm(found - case.centroids, axis=1)
    return np.asarray(away / np.linalg.norm(case.centroids, axis=1))


def _tip(semi_axes: FloatArray) -> Ellipsoid:
    a, b, c = semi_axes.tolist()
    return Ellipsoid((a, b, c))


def _at_once(semi_axes: FloatArray) -> Solve:
    tip = _tip(semi_axes)
    return lambda wrenches: contacts_from_wrenches(tip, wrenches).centroid


def _one_by_one(semi_axes: FloatArray) -> Solve:
    tip = _tip(semi_axes)
    return lambda wrenches: np.array([contact_from_wrench(tip, wrench).centroid for wrench in wrenches])


def _dot(u: FloatArray, v: FloatArray) -> FloatArray:
    """Return the scalar products of rows, shape (n, 1)."""
    return np.asarray(np.einsum("ij,ij->i", u, v)[:, None])
