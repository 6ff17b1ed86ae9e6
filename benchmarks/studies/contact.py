"""A contact on an ellipsoid from a wrench: palpate, plain formulas, a solver, against contacts that are known."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from contact.closed_forms import Solve, prepare_one_formula, prepare_paper, prepare_wrench_axis
from contact.iterations import prepare_root
from contact.methods import one_palpate, prepare_palpate

from palpate.errors import FloatArray
from studies.study import Row, Study, Tell
from studies.turns import timed_in_turns

SINGLE, FEW = ("palpate, one by one", "scipy root"), 20
"""Methods that take one wrench at a time, and how many wrenches are enough to time them."""

SPUN = 0.75
"""Share of the contacts that bear spin torque."""

ABOUT = (
    "Fingertips with semi-axes from 4 to 40 mm, contacts all over them, a quarter of them without spin torque, "
    "the others with what a soft finger bears. Each wrench is made from a contact, which is therefore known, "
    "but for the rounding of the wrench: errors near 1e-16 are that. The error is that of the centroid over "
    "its distance from the middle. A cost between wrenches that come together is per contact of 1000. Against "
    "180 digits, and for the hard cases (grazing, slender, extreme scale): python benchmarks/contact."
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


def _one_by_one(semi_axes: FloatArray) -> Solve:
    solve = one_palpate(semi_axes)
    return lambda wrenches: np.array([solve(wrench).centroid for wrench in wrenches])


METHODS: dict[str, Callable[[FloatArray], Solve]] = {
    "palpate, many at once": prepare_palpate,
    "palpate, one by one": _one_by_one,
    "one formula, numpy": prepare_one_formula,
    "paper, eq. 16 to 18, numpy": prepare_paper,
    "wrench axis, numpy": prepare_wrench_axis,
    "scipy root": prepare_root,
}


def measure(quick: bool, seed: int, tell: Tell) -> Study:
    """Measure contact sensing."""
    rng = np.random.default_rng(seed)
    cases = [built(50 if quick else 400, rng) for _ in range(8 if quick else 25)]
    timed = built(1000, rng)
    batches = {name: FEW if name in SINGLE else len(timed.wrenches) for name in METHODS}
    calls = {
        name: partial(prepare(timed.semi_axes), timed.wrenches[: batches[name]])
        for name, prepare in METHODS.items()
    }
    tell("contact: time")
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that the simpler methods overflow or stall is the point
        taken = timed_in_turns(calls, 5 if quick else 15)
        rows = []
        for name, prepare in METHODS.items():
            tell(f"contact: error of {name}")
            errors = np.concatenate([_errors(prepare, case) for case in cases])
            rows.append(_row(name, taken[name] / batches[name], errors))
    return Study(
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


def _errors(prepare: Callable[[FloatArray], Solve], case: Case) -> FloatArray:
    found = prepare(case.semi_axes)(case.wrenches)
    away = np.linalg.norm(found - case.centroids, axis=1)
    return np.asarray(away / np.linalg.norm(case.centroids, axis=1))
