"""Hard contacts by category, and the error of a method on them against the reference in 180 digits.

The contacts and the reference are those of the tests (`tests/reference`). Only wrenches that have a contact are
used: what palpate says about the others is the tests' business, the other methods say nothing about them.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from mpmath import mp

from contact.closed_forms import Rows
from contact.methods import Method
from reference import quadric
from reference.cases import sample
from reference.compare import Case

FAILED = 1e-6
"""An error beyond this, relative to the length of the centroid, counts as failed: 10 nm on a 10 mm fingertip."""


@dataclass(frozen=True, slots=True)
class Category:
    """One kind of hardness.

    Attributes:
        name: For the table and the picture.
        about: What is in it.
        makers: Names of generators of `tests/reference/cases.py`, in equal shares.
        wanted: Which of their cases belong here.
    """

    name: str
    about: str
    makers: tuple[str, ...]
    wanted: Callable[[Case], bool] = lambda _case: True


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A case and its true centroid (mpf)."""

    case: Case
    centroid: quadric.Vector


@dataclass(frozen=True, slots=True)
class Errors:
    """Relative errors of the centroid on one category.

    Attributes:
        median: Over all cases, those without a number counting as infinitely wrong.
        largest: Of the cases that gave a number; NaN if none did.
        no_number: Share of cases that gave none.
        failed: Share of cases that gave none or one wrong by more than `FAILED`.
    """

    median: float
    largest: float
    no_number: float
    failed: float


def axis_misses(case: Case) -> bool:
    """Return whether the wrench axis passes outside the surface, so that only spin explains the wrench."""
    return quadric.solve(case.semi_axes, case.wrench, model="hard").status == quadric.NO_CONTACT


def spin_is_tiny(case: Case) -> bool:
    """Return whether the moment along the force is at most a hundredth of |f| times the smallest semi-axis."""
    f, m = np.array(case.wrench[:3]), np.array(case.wrench[3:])
    return bool(abs(f @ m) <= 1e-2 * (f @ f) * min(case.semi_axes))


CATEGORIES = (
    Category("sphere", "ordinary contacts", ("sphere",)),
    Category("ellipsoid", "axes 0.1 to 10", ("ellipsoid", "any_wrench")),
    Category("slender", "axes 1e-3 to 1e6", ("slender", "slender_wrench")),
    Category("tiny spin", "down to 1e-30 of f R", ("spin_range", "spin_exact_hit"), spin_is_tiny),
    Category("zero spin", "exactly, or but for rounding", ("zero_spin", "awkward_hit")),
    Category("grazing", "axis almost tangent", ("grazing", "grazing_sphere", "grazing_exact")),
    Category("extreme scale", "1e-200 to 1e200 N", ("scale", "scale_edges")),
    Category("axis misses", "spin 1e-300 to 1", ("spin_exact_miss", "any_wrench"), axis_misses),
    Category("tangential", "slope 1 to 1e8", ("tangential",)),
)


def known_cases(category: Category, count: int) -> Iterator[Known]:
    """Yield about `count` cases that have a contact, and where it is; the makers take turns."""
    each = -(-count // len(category.makers))
    found = [_solved(category, name, each) for name in category.makers]
    for row in zip(*found, strict=True):
        yield from row


def _solved(category: Category, name: str, count: int) -> list[Known]:
    solved: list[Known] = []
    for case in sample(name, 10 * count):
        if len(solved) == count:
            break
        if not category.wanted(case):
            continue
        truth = case.wanted()
        if truth.centroid is not None:
            solved.append(Known(case, truth.centroid))
    assert len(solved) == count, f"{name}: only {len(solved)} of {count} cases belong to {category.name}"
    return solved


def errors(method: Method, known: list[Known]) -> Errors:
    """Return the errors of a method on the cases of one category."""
    found = np.array([error(method, each) for each in known[: method.most_cases]])
    number = np.isfinite(found)
    return Errors(
        median=float(np.median(np.where(number, found, np.inf))),
        largest=float(found[number].max()) if number.any() else float("nan"),
        no_number=float(np.mean(~number)),
        failed=float(np.mean(~(found <= FAILED))),
    )


def error(method: Method, known: Known) -> float:
    """Return |c - true c| / |true c| for one case; NaN where the method gave no number."""
    with np.errstate(all="ignore"):  # that the simpler methods overflow is the point
        wrench = np.array(known.case.wrench, dtype=method.dtype).reshape(1, 6)
        c: Rows = method.prepare(np.array(known.case.semi_axes))(wrench)[0]
    if not np.isfinite(c).all():
        return float("nan")
    with mp.workprec(quadric.PRECISION):
        return float(quadric.distance(list(c), known.centroid) / quadric.norm(quadric.digits(known.centroid)))
